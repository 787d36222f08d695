"""A class of 200, graded through the command line: killed twice on the way, then once more on a Dask cluster.

    python tests/benchmarks/class_of_200.py [--students 200] [--keep DIR]

Submissions are right, wrong, hostile and broken, and of each it is known what every task must get. It fails if a
verdict is wrong, if anything is lost or graded twice, or if the cluster's grades.csv differs in a byte. In the end
it says how many submissions a minute one core grades.
"""

from __future__ import annotations

import argparse
import csv
import importlib.util
import itertools
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
import zipfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "misconceptions"))
import suite  # type: ignore[import-not-found]  # noqa: E402

from muslin import tasks  # noqa: E402
from muslin.base import paths  # noqa: E402

TABLE = tasks.assignment("cloth")
MOST = {name: task.points for name, task in TABLE.tasks.items()}


@dataclass
class Made:
    """A submission: its files, how it is packed, and what it must get (`points`; None if it cannot be graded)."""

    kind: str
    files: dict[str, str]
    lost: set[str] = field(default_factory=set)
    pack: str = "folder"
    gradable: bool = True

    @property
    def points(self) -> dict[str, int] | None:
        if not self.gradable:
            return None
        return {name: 0 if name in self.lost else most for name, most in MOST.items()}


def source(folder: Path) -> dict[str, str]:
    return {file: (folder / file).read_text(encoding="utf-8") for file in TABLE.files}


SOLUTION, STUBS = source(paths.solution("cloth")), source(paths.assignment("cloth"))
VARIANTS = suite.variants()


def with_variants(chosen: Sequence[suite.Variant]) -> dict[str, str]:
    files = dict(SOLUTION)
    for variant in chosen:
        file = TABLE.tasks[variant.task].file
        files[file] = suite.replaced(files[file], variant.task, variant.code)
    return files


def right(draw: random.Random) -> Made:
    """The solution with a few functions written in other right ways."""
    names = draw.sample(list(MOST), draw.randrange(5))
    others = [draw.choice([v for v in VARIANTS if v.task == n and v.verdict == "right"]) for n in names]
    return Made("right", with_variants(others))


def wrong(draw: random.Random) -> Made:
    """One to four known mistakes."""
    names = draw.sample(list(MOST), draw.randrange(1, 5))
    mistakes = [draw.choice([v for v in VARIANTS if v.task == n and v.verdict == "wrong"]) for n in names]
    return Made("wrong", with_variants(mistakes), set(names))


#: Attacks: task, body of its function, what is added to its file.
ATTACKS = {
    "endless loop": (
        "right_cauchy_green",
        "    k = 0\n    while F[0, 0] < 1e300:\n        k += 1\n    return F * k\n",
        "",
    ),
    "exit": (
        "sphere_contact",
        "    ti.static(leave())\n    return 1, x\n",
        "def leave():\n    import os\n\n    os._exit(0)\n",
    ),
    "segfault": (
        "nodal_force",
        "    ti.static(fall())\n    return P @ grad_phi\n",
        "def fall():\n    import ctypes\n\n    ctypes.string_at(0)\n    return True\n",
    ),
    "flood": (
        "filter_velocity",
        "    ti.static(flood())\n    return v\n",
        "def flood():\n    import os\n\n    for _ in range(2000):\n        os.write(1, b'A' * 5000)\n    return True\n",
    ),
    "forged result": (
        "psi",
        "    ti.static(forge())\n    return 0.0 * mu\n",
        'def forge():\n    for n in range(1, 10):\n        print(\'{"score": 100, "tests": []}\')\n    return True\n',
    ),
    "kills its parent": (
        "kinetic_energy",
        "    ti.static(kill())\n    return 0.0 * area\n",
        "def kill():\n    import os\n    import signal\n\n    try:\n        os.kill(os.getppid(), signal.SIGKILL)\n"
        "    except OSError:\n        pass\n    return True\n",
    ),
}


def attack(name: str) -> Callable[[random.Random], Made]:
    def made(draw: random.Random) -> Made:
        task, body, added = ATTACKS[name]
        arguments = ", ".join(value.name for value in TABLE.tasks[task].arguments)
        file = TABLE.tasks[task].file
        code = f"@ti.func\ndef {task}({arguments}):\n{body}"
        text = suite.replaced(SOLUTION[file], task, code) + (f"\n\n{added}" if added else "")
        return Made(f"hostile: {name}", SOLUTION | {file: text}, {task})

    return made


def bomb(draw: random.Random) -> Made:
    """A zip whose one file unpacks to 60 MB."""
    text = SOLUTION["stress.py"] + "#" * 60_000_000
    return Made("hostile: zip bomb", SOLUTION | {"stress.py": text}, of("stress.py"), "zip")


def link(draw: random.Random) -> Made:
    """A task file that is a link to a file of the grader's machine."""
    return Made("hostile: link", dict(SOLUTION), of("collision.py"), "link")


def climbing(draw: random.Random) -> Made:
    """A zip with entries that climb out of it; what else is in it is right."""
    files = SOLUTION | {"../../../../tmp/muslin-climbed.py": "print('out')\n"}
    return Made("hostile: climbing zip", files, set(), "zip")


def missing(draw: random.Random) -> Made:
    gone = draw.choice(TABLE.files)
    return Made("broken: missing", {f: t for f, t in SOLUTION.items() if f != gone}, of(gone))


def syntax(draw: random.Random) -> Made:
    file = draw.choice(TABLE.files)
    return Made("broken: syntax", SOLUTION | {file: SOLUTION[file] + "\ndef (:\n"}, of(file))


def unfinished(draw: random.Random) -> Made:
    """Some files still the stubs."""
    done = draw.sample(list(TABLE.files), draw.randrange(len(TABLE.files)))
    files = {f: SOLUTION[f] if f in done else STUBS[f] for f in TABLE.files}
    return Made("broken: unfinished", files, {n for n, t in TABLE.tasks.items() if t.file not in done})


def damaged(draw: random.Random) -> Made:
    """A zip that was cut short."""
    return Made("broken: damaged zip", dict(SOLUTION), set(), "cut", gradable=False)


def of(file: str) -> set[str]:
    return {name for name, task in TABLE.tasks.items() if task.file == file}


#: Of every twenty: 7 right, 6 wrong, 3 hostile in turn, 4 broken in turn.
HOSTILE = [*map(attack, ATTACKS), bomb, link, climbing]
BROKEN = [missing, syntax, unfinished, unfinished, unfinished, damaged]


def kinds(count: int) -> Iterator[Callable[[random.Random], Made]]:
    hostile, broken = itertools.cycle(HOSTILE), itertools.cycle(BROKEN)
    plan = "RWRWHRBWRBHWRWRBHWRB"
    for letter in itertools.islice(itertools.cycle(plan), count):
        yield {"R": right, "W": wrong}.get(letter) or next(hostile if letter == "H" else broken)


def generate(
    folder: Path, making: Iterator[Callable[[random.Random], Made]], seed: int = 7
) -> dict[str, Made]:
    """Write submissions, as folders, zips and tars in turn; returns them by the student's name."""
    made = {}
    for number, make in enumerate(making, 1):
        draw = random.Random(f"{seed}/{number}")
        submission = make(draw)
        name = f"{number:03} {draw.choice(GIVEN)} {draw.choice(FAMILY)}"
        files = {file: f"{text}\n# {name}\n" for file, text in submission.files.items()}
        pack = submission.pack
        if pack == "folder":
            pack = ("folder", "zip", "tar")[number % 3]
        PACKS[pack](folder, name, files)
        made[name] = submission
    return made


GIVEN = ("Ada", "Emmy", "Zoë", "José", "李", "<b>Ann", "Björn", "Noor")
FAMILY = ("Lovelace", "Noether", "O'Hara", "van der Berg", "=1+1", "Ng", "Šimić", "🧵")


def _folder(root: Path, name: str, files: dict[str, str]) -> None:
    for file, text in files.items():
        path = root / name / "cloth" / file
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def _link(root: Path, name: str, files: dict[str, str]) -> None:
    _folder(root, name, files)
    target = root / name / "cloth" / "collision.py"
    target.unlink()
    target.symlink_to(paths.solution("cloth") / "collision.py")


def _zip(root: Path, name: str, files: dict[str, str]) -> None:
    with zipfile.ZipFile(root / f"{name}.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for file, text in files.items():
            archive.writestr(zipfile.ZipInfo(file), text, zipfile.ZIP_DEFLATED)


def _cut(root: Path, name: str, files: dict[str, str]) -> None:
    _zip(root, name, files)
    whole = (root / f"{name}.zip").read_bytes()
    (root / f"{name}.zip").write_bytes(whole[: len(whole) // 2])


def _tar(root: Path, name: str, files: dict[str, str]) -> None:
    with tempfile.TemporaryDirectory() as scratch:
        _folder(Path(scratch), "x", files)
        with tarfile.open(root / f"{name}.tar.gz", "w:gz") as archive:
            archive.add(Path(scratch) / "x" / "cloth", "cloth")


PACKS = {"folder": _folder, "link": _link, "zip": _zip, "cut": _cut, "tar": _tar}


# Grading and what must hold --------------------------------------------------------------------------------


def command(submissions: Path, report: Path, *more: str) -> list[str]:
    grade = ["-m", "muslin.cli", "class", "grade", str(submissions), "--out", str(report)]
    return [sys.executable, *grade, *more]


def journal(report: Path) -> list[dict]:
    path = report / "journal.jsonl"
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def killed_after(count: int, command: Sequence[str], report: Path, limit: float = 3600) -> None:
    """Run a command and kill it, as the power does, when `count` results are in the journal."""
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    until = time.monotonic() + limit
    while len(journal(report)) < count and process.poll() is None and time.monotonic() < until:
        time.sleep(0.05)
    assert process.poll() is None, "it ended before it could be killed"
    process.send_signal(signal.SIGKILL)
    process.wait()


def check(report: Path, made: dict[str, Made]) -> None:
    """No wrong verdict, nothing lost, nothing repeated."""
    with open(report / "grades.csv", encoding="utf-8", newline="") as stream:
        rows = {row["student"].removeprefix("'"): row for row in csv.DictReader(stream)}
    assert rows.keys() == made.keys(), rows.keys() ^ made.keys()
    mistaken = []
    for name, submission in made.items():
        given = {task: rows[name][task] for task in MOST}
        points = submission.points
        due = {task: "" if points is None else str(points[task]) for task in MOST}
        total = "" if points is None else str(sum(points.values()))
        if given != due or rows[name]["score"] != total:
            differing = {task: (given[task], due[task]) for task in MOST if given[task] != due[task]}
            mistaken.append(f"{name} ({submission.kind}): {differing}")
    assert not mistaken, "\n".join(mistaken)
    keys = [entry["key"] for entry in journal(report)]
    assert len(keys) == len(set(keys)), "graded more than once"
    due = sum(submission.gradable for submission in made.values())
    assert len(keys) == due, f"{len(keys)} gradings of {due} submissions"


@contextmanager
def cluster() -> Iterator[str]:
    """A Dask scheduler and two worker processes; its address."""
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0
    ) as local:
        yield local.scheduler_address


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--students", type=int, default=200)
    parser.add_argument("--keep", type=Path, help="folder for submissions and reports, kept")
    parser.add_argument("--deadline", default="20")
    options = parser.parse_args()
    if importlib.util.find_spec("distributed") is None:
        sys.exit('The second half needs Dask. Install it with: pip install -e ".[class]"')
    home = options.keep or Path(tempfile.mkdtemp(prefix="class-"))
    submissions = home / "submissions"
    submissions.mkdir(parents=True)
    made = generate(submissions, kinds(options.students))
    os.environ["XDG_CACHE_HOME"] = str(home / "cache")  # nothing compiled beforehand
    here, there = home / "report", home / "report-dask"
    run = command(submissions, here, "--deadline", options.deadline)
    began = time.monotonic()
    for part in (3, 3 / 2):
        killed_after(int(options.students / part), run, here)
        print(f"killed after {len(journal(here))} of {len(made)}", flush=True)
    subprocess.run(run, check=True)
    wall = time.monotonic() - began
    check(here, made)
    entries = journal(here)
    cpu = sum(entry["cpu"] for entry in entries) / len(entries)
    print(f"{len(made)} graded here, none wrong, lost or repeated, in {wall / 60:.1f} min")
    print(f"{60 / cpu:.1f} submissions per minute and core: {cpu:.2f} s of processor time each", flush=True)
    with cluster() as address:
        subprocess.run(
            command(submissions, there, "--deadline", options.deadline, "--scheduler", address), check=True
        )
    check(there, made)
    assert (here / "grades.csv").read_bytes() == (there / "grades.csv").read_bytes()
    print("grades.csv of the cluster is the same to the last byte")
    if not options.keep:
        shutil.rmtree(home)


if __name__ == "__main__":
    main()
