"""The acceptance line: no expected value of a hidden case is in a worker's memory, or in a file it can see.

The submission is wrong, so that it does not compute the answers itself. Right after a worker has answered a
private stage, the memory of that worker and of its nursery is searched for the bytes of every expected number;
that the hidden inputs are found there shows that the search works.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from attacking import LEVEL, SEED, TASKS, _list, _stage, honest, write

from muslin import tasks
from muslin.grading import sandbox
from muslin.judging import reference

#: Right on the public cases, whose answers it knows, and wrong on others in a way that keeps the right answer out of
#: memory: a constant, and the inputs are used.
WRONG = """
from muslin.tasks import batch
import numpy as np
PUBLIC
def wrong(function, **arrays):
    from muslin.tasks import form
    n = len(next(iter(arrays.values())))
    answers = [np.frombuffer(bytes.fromhex(a), t).reshape(s) for a, t, s in known[function.task.name]]
    if len(answers[0]) == n:
        return tuple(answers)
    kept.append(arrays)
    shapes = [form(value.kind) for value in function.task.results]
    return tuple(np.full((n, *s), 3, np.int32 if i else np.float64) for s, i in shapes)
kept = []
batch.evaluate = wrong
"""


def knowing_the_public_cases(file: str) -> str:
    """`WRONG`, for the tasks of a file."""
    known = {
        name: [(a.tobytes().hex(), a.dtype.str, a.shape) for a in reference.cases("cloth", name)[1]]
        for name, task in TASKS.items()
        if task.file == file
    }
    return WRONG.replace("PUBLIC", f"known = {known!r}") + honest(file)


def memory(pid: int) -> Iterator[np.ndarray]:
    """All memory of a process that is not a library's own file, in pieces, as the bits of aligned doubles."""
    with open(f"/proc/{pid}/mem", "rb") as stream:
        for line in Path(f"/proc/{pid}/maps").read_text().splitlines():
            first, last, rights = re.match(r"(\w+)-(\w+) (\S+)", line).groups()
            place, end = int(first, 16), int(last, 16)
            if "r" not in rights or "[v" in line or (line.split()[4] != "0" and "w" not in rights):
                continue
            while place < end:
                try:
                    stream.seek(place)
                    data = stream.read(min(end - place, 1 << 24))
                except OSError:
                    break
                if not data:
                    break
                yield np.frombuffer(data[: len(data) // 8 * 8], dtype=np.uint64)
                place += len(data)


def found_in(pid: int, wanted: np.ndarray) -> set[int]:
    """Which of the wanted doubles, as bits, are in a process's memory."""
    low = np.zeros(1 << 16, bool)
    low[wanted & np.uint64(0xFFFF)] = True
    found = set()
    for held in memory(pid):
        likely = held[low[held.astype(np.uint16)]]
        found.update(np.intersect1d(likely, wanted).tolist())
    return found


def uncommon(arrays) -> np.ndarray:
    """Bits of the doubles with full mantissas: no integers, no short fractions."""
    values = np.concatenate([a.ravel() for a in arrays if a.dtype.kind == "f"])
    bits = np.unique(values.view(np.uint64))
    return bits[(bits & np.uint64(0xFFFFFF)) != 0]


def descendants(token: str) -> list[int]:
    found = []
    for entry in filter(str.isdigit, _list("/proc")):
        try:
            if token.encode() in Path(f"/proc/{entry}/environ").read_bytes():
                found.append(int(entry))
        except OSError:
            pass
    return found


def test_memory_holds_the_inputs_and_no_answer(attack, tmp_path, monkeypatch):
    if not Path("/proc/self/mem").exists():
        pytest.skip("no /proc/PID/mem on this system")
    stages = {name: _stage(tasks.assignment("cloth"), name, SEED) for name in TASKS}
    inputs = uncommon([a for s in stages.values() for a in s.inputs.values()])
    public = [a for name in TASKS for a in _public(name)]
    expected = np.setdiff1d(uncommon([a for s in stages.values() for a in s.expected]), inputs)
    expected = np.setdiff1d(expected, uncommon(public))
    assert len(expected) > 1000
    both, answers = np.concatenate([inputs, expected]), set(expected.tolist())
    seen, searched = set(), 0
    ask = sandbox.Worker.ask

    def watched(self, request, arrays, *rest):
        nonlocal searched
        answer = ask(self, request, arrays, *rest)
        name = request.get("task")
        if name in stages and len(next(iter(arrays.values()))) == len(
            next(iter(stages[name].inputs.values()))
        ):
            for pid in descendants(attack.token):
                try:
                    found = found_in(pid, both)
                except PermissionError:
                    pytest.skip("the memory of workers may not be read here")
                assert not found.intersection(answers), "an expected value is in a worker's memory"
                seen.update(found)
                searched += 1
        return answer

    monkeypatch.setattr(sandbox.Worker, "ask", watched)
    chosen = {"stress.py": knowing_the_public_cases("stress.py")}
    record = attack.grade(write(tmp_path / "wrong", chosen), level=LEVEL, fresh=True)
    assert record.score == 0
    assert searched >= 4  # worker and nursery, for both functions
    assert len(seen) > 100, "the search finds nothing at all"


def _public(name):
    inputs, expected = reference.cases("cloth", name)
    return [*inputs.values(), *expected]


GREP = """
import os, re
answers = [bytes.fromhex(text) for text in ANSWERS]
pattern = re.compile(b"|".join(map(re.escape, answers)))
control, found, files = re.compile(re.escape(bytes.fromhex(CONTROL))), [], 0
open("control", "wb").write(b"...." + bytes.fromhex(CONTROL))
for root in (".", os.path.dirname(os.path.dirname(os.path.abspath(muslin.__file__))), "/work", "/home", "/root",
             "/autograder", "/mnt", "/opt", "/tmp", "/srv", "/var", "/run", "/etc", os.path.expanduser("~")):
    for folder, folders, names in os.walk(root):
        folders[:] = [f for f in folders if f not in ("site-packages", "dist-packages", "lib-dynload", "proc")]
        if os.path.basename(folder) in ("solutions", "reference"):
            if names: found.append(folder)
        for name in names:
            path = os.path.join(folder, name)
            try:
                data = open(path, "rb").read(1 << 24)
            except OSError:
                continue
            files += 1
            if control.search(data) and name == "control":
                print("CONTROL FOUND")
            if pattern.search(data):
                found.append(path)
print("FILES", files, "FOUND", found[:20])
"""


def test_no_file_in_sight_holds_an_answer(attack):
    stages = [_stage(tasks.assignment("cloth"), name, SEED) for name in TASKS]
    answers = uncommon([a for s in stages for a in s.expected])
    chosen = np.random.default_rng(0).choice(answers, 40, replace=False)
    texts = [int(bits).to_bytes(8, "little").hex() for bits in chosen]
    hostile = GREP.replace("ANSWERS", repr(texts)).replace("CONTROL)", f"{'c0ffee1234567890'!r})")
    record = attack({"collision.py": "import muslin\n" + hostile + honest()}, deadline=60)
    assert record.safety.defences["solution and hidden data out of sight"]
    told = record["sphere_contact"].output
    assert "CONTROL FOUND" in told
    assert "FOUND []" in told
