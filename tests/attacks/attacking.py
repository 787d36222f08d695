"""What every attack is held against: shared/attacks.md's pass rule, end to end through `muslin.grade`.

An attack is a submission: files by name, written in its test. `attack` grades it and holds the record against
that of the same code without the hostility. The rule, for every attack:

- the score is not above the honest one,
- the record and every report of it are valid and list each expected task once,
- no hidden number appears in anything a student can read,
- no process, file, socket or descriptor is left behind,
- the tasks of other files fare as before.

What an attack does to the machine if the defence fails must be harmless too: it writes files with its own token,
sends signal 0, and its bombs are bounded.

`MUSLIN_ATTACKS_LEVEL=process pytest tests/attacks` runs all of them at another level than the best one.
"""

from __future__ import annotations

import functools
import json
import os
import re
import secrets
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import checks, fork_server, sandbox, simulating, views
from muslin.grading.record import Record
from muslin.judging import reference

LEVEL = os.environ.get("MUSLIN_ATTACKS_LEVEL", "auto")
SEED = "attacks"
SOLUTION = paths.solution("cloth")
TASKS = tasks.assignment("cloth").tasks
FILES = tasks.assignment("cloth").files

#: The file most attacks are written into, its tasks, and an honest file beside it.
TARGET, SPOILED, BYSTANDER = "collision.py", ("sphere_contact", "filter_velocity"), "kinetic_energy.py"


def honest(file: str = TARGET, assignment: str = "cloth") -> str:
    """The solution's text of a file."""
    return (paths.solution(assignment) / file).read_text(encoding="utf-8")


def public_sizes(assignment: str = "cloth") -> list[int]:
    """How many public cases tasks have; another number of samples is a later stage."""
    return sorted(
        {len(reference.cases(assignment, name)[1][0]) for name in tasks.assignment(assignment).tasks}
    )


def first_hidden(task: str, assignment: str = "cloth") -> float:
    """The first number of a task's hidden cases, by which an attack knows them."""
    return float(next(iter(_stage(tasks.assignment(assignment), task, SEED).inputs.values())).flat[0])


Files = Mapping[str, "str | bytes"]


def write(folder: Path, files: Files) -> Path:
    """A submission folder with these files."""
    folder.mkdir(parents=True)
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        data = content.encode("utf-8") if isinstance(content, str) else content
        (folder / name).write_bytes(data)
    return folder


@pytest.fixture(scope="session")
def _session_folder():
    # not pytest's own temporary folder, which is closed to the users that workers become
    with tempfile.TemporaryDirectory(prefix="muslin-attacks-") as folder:
        os.chmod(folder, 0o711)
        yield Path(folder)


@pytest.fixture(autouse=True)
def _apart(monkeypatch, _session_folder, request):
    """A cache and a temporary folder of our own; hidden cases drawn once; no simulation unless asked for."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(_session_folder / "cache"))
    (_session_folder / "tmp").mkdir(exist_ok=True)
    os.chmod(_session_folder / "tmp", 0o711)
    monkeypatch.setattr(tempfile, "tempdir", str(_session_folder / "tmp"))
    monkeypatch.setattr(checks, "hidden", _stage)
    if "with_simulation" not in request.keywords:
        monkeypatch.setattr(simulating, "reference", lambda assignment: None)


def _stage(table, task, seed, folder=None):
    return _cached_stage(table.name, task, seed, folder)


@functools.cache
def _cached_stage(name, task, seed, folder):
    return _drawn(tasks.assignment(name), task, seed, folder)


_drawn = checks.hidden


@functools.cache
def available(level: str) -> bool:
    """Whether this system gives a safety level."""
    try:
        with sandbox.Sandbox(level):
            return True
    except MuslinError:
        return False


@pytest.fixture(params=sandbox.LEVELS)
def level(request):
    """Every safety level; skipped where the system does not give it."""
    if not available(request.param):
        pytest.skip(f"no safety level {request.param!r} here")
    return request.param


def needs(record: Record, defence: str) -> None:
    """Skip, visibly, what this system cannot defend against."""
    if not record.safety.defences[defence]:
        pytest.skip(f"this system does not give: {defence} (level {record.safety.level})")


class Attack:
    """Grades hostile submissions and holds them against the rule."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, honest_records: dict):
        self._folder, self._honest = folder, honest_records
        self.token = secrets.token_hex(8)
        marked = {**fork_server.ENVIRONMENT, "MUSLIN_ATTACK": self.token}
        monkeypatch.setattr(fork_server, "ENVIRONMENT", marked)

    def __call__(
        self,
        files: Files,
        *,
        instead_of: Files | None = None,
        spoils: tuple[str, ...] = SPOILED,
        level: str = LEVEL,
        deadline: float = 20.0,
        pack: Callable[[Path], Path] | None = None,
        check_leaks: bool = True,
        assignment: str = "cloth",
    ) -> Record:
        """Grade `files` beside an honest file; all of the rule is asserted.

        Parameters
        ----------
        files : dict
            The hostile files.
        instead_of : dict, optional
            The same code without hostility; default the solution's files of the same names.
        spoils : tuple of str
            Tasks the attack may harm: those of its own files.
        level, deadline
            As for `muslin.grade`.
        pack : callable, optional
            Makes an archive of the folder.
        assignment : str
            Which the files are of.
        """
        beside = {} if BYSTANDER in files else {BYSTANDER: honest(BYSTANDER, assignment)}
        if instead_of is None:
            given = [name for name in files if (paths.solution(assignment) / name).is_file()]
            instead_of = {name: honest(name, assignment) for name in given}
        folder = write(self._folder / f"attack-{secrets.token_hex(4)}", {**beside, **files})
        before = self._traces()
        record = self.grade(
            pack(folder) if pack else folder, level=level, deadline=deadline, assignment=assignment
        )
        after = self._traces()
        assert after == before, f"something is left behind: {before} {after}"
        expected = self._of_honest({**beside, **instead_of}, level, assignment)
        assert record.score <= expected.score
        valid(record)
        unaffected(record, expected, spoils)
        if check_leaks:
            no_hidden_number(record)
        return record

    def grade(self, submission: Path, **options) -> Record:
        """Grade, with the cases all attacks share."""
        options.setdefault("level", LEVEL)
        return muslin.grade(submission, seed=SEED, safety=options.pop("level"), **options)

    def _of_honest(self, files: Files, level: str, assignment: str) -> Record:
        key = (level, assignment, *sorted(files.items()), simulating.reference.__name__)
        if key not in self._honest:
            folder = write(self._folder / f"honest-{secrets.token_hex(4)}", files)
            self._honest[key] = self.grade(folder, level=level, assignment=assignment)
        return self._honest[key]

    def _traces(self) -> dict[str, object]:
        """All that an attack could leave on this machine."""
        shared = ("/tmp", "/var/tmp", "/dev/shm", "/dev/mqueue", "/run", str(Path.home()), os.getcwd(), "/")
        return {
            "processes": processes(self.token),
            "temporary": sorted(os.listdir(tempfile.gettempdir())),
            "files": [f"{d}/{n}" for d in shared if os.path.isdir(d) for n in _list(d) if self.token in n],
            "descriptors": len(_list("/proc/self/fd")),
            "sockets": _count("/proc/net/unix", self.token),
            "mounts": mounts(tempfile.gettempdir()),
            "system v": system_v(self.token),
        }


def _list(folder: str) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:
        return []


def _count(path: str, text: str) -> int:
    try:
        return Path(path).read_text(errors="replace").count(text)
    except OSError:
        return 0


def processes(token: str) -> list[int]:
    """Processes descended from a fork server of the test with this token, and dead ones nobody waited for."""
    found = []
    for entry in filter(str.isdigit, _list("/proc")):
        try:
            state, parent = (
                Path(f"/proc/{entry}/stat").read_text(errors="replace").rpartition(")")[2].split()[:2]
            )
            ours = token.encode() in Path(f"/proc/{entry}/environ").read_bytes()
        except (OSError, ValueError):
            continue
        if ours or (state, parent) == ("Z", str(os.getpid())):
            found.append(int(entry))
    return found


def mounts(folder: str) -> list[str]:
    """What is mounted in a folder of ours; others on this machine grade, too."""
    points = [line.split()[1] for line in Path("/proc/self/mounts").read_text(errors="replace").splitlines()]
    return [point for point in points if f"{point}/".startswith(f"{folder}/")]


def system_v_key(token: str) -> int:
    """The key under which an attack makes segments, semaphores and queues, to know them by."""
    return int(token[:7], 16) + 1


def system_v(token: str) -> list[str]:
    """Segments, semaphores and queues of System V with this token's key."""
    tables = [Path(f"/proc/sysvipc/{kind}") for kind in ("shm", "sem", "msg")]
    rows = [
        (table.name, line)
        for table in tables
        if table.exists()
        for line in table.read_text().splitlines()[1:]
    ]
    return [f"{kind} {line}" for kind, line in rows if int(line.split()[0]) == system_v_key(token)]


@pytest.fixture(scope="session")
def _honest_records():
    return {}


@pytest.fixture
def attack(tmp_path, monkeypatch, _honest_records) -> Attack:
    """Grade a hostile submission, under the rule."""
    return Attack(tmp_path, monkeypatch, _honest_records)


# the rule ---------------------------------------------------------------------------------------------------


def valid(record: Record) -> None:
    """The record and the results files are what their schemas say, with every task once."""
    jsonschema = pytest.importorskip("jsonschema")
    table = tasks.assignment(record.assignment["name"]).tasks
    data = json.loads(views.render(record, "json"))
    jsonschema.validate(data, views.schema("record"))
    assert [task["name"] for task in data["tasks"]] == list(table)
    assert 0 <= data["score"] <= data["max_score"] == sum(task.points for task in table.values())
    assert all(0 <= task["score"] <= table[task["name"]].points for task in data["tasks"])
    results = json.loads(views.render(record, "gradescope"))
    jsonschema.validate(results, views.schema("gradescope"))
    for name, task in table.items():
        named = [test for test in results["tests"] if task.title in test["name"] or name in test["name"]]
        assert named, f"{name} is missing in results.json"


def unaffected(record: Record, expected: Record, spoiled: tuple[str, ...]) -> None:
    """Tasks of other files fare as without the attack."""
    for name in tasks.assignment(record.assignment["name"]).tasks:
        if name not in spoiled:
            assert record[name] == expected[name]


def readable(record: Record) -> str:
    """All that a student can read of a record."""
    return "\n".join(
        views.render(record, name) for name in ("json", "gradescope", "terminal", "junit", "csv")
    )


def hidden_numbers(assignment: str) -> np.ndarray:
    """Inputs and answers of the hidden cases, but no small integers and simple fractions."""
    table = tasks.assignment(assignment)
    stages = [_stage(table, task, SEED) for task in table.tasks]
    arrays = [a for stage in stages for a in (*stage.expected, *stage.inputs.values()) if a.dtype.kind == "f"]
    numbers = np.unique(np.abs(np.concatenate([array.ravel() for array in arrays])))
    return numbers[(numbers * 2**10 % 1 != 0) & (numbers > 0)]


@functools.cache
def _hidden(assignment: str) -> np.ndarray:
    return hidden_numbers(assignment)


def no_hidden_number(record: Record) -> None:
    """No number of ten or more digits in any report is one of the hidden cases."""
    tokens = re.findall(r"\d+\.\d{9,}(?:e[+-]?\d+)?", readable(record))
    hidden = _hidden(record.assignment["name"])
    for token in tokens:
        value = float(token)
        near = hidden[min(np.searchsorted(hidden, value * (1 - 1e-10)), len(hidden) - 1)]
        assert abs(near - value) > 1e-9 * value, f"the hidden number {token} was leaked"
