"""The record of a grading: one value that every report is a view of.

`Record.as_json` gives plain data in the shape of `schemas/record.json`. Two gradings of the same submission
with the same seed differ in `timing` and in nothing else.
"""

from __future__ import annotations

import functools
import hashlib
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

SCHEMA = "muslin/record/v1"

#: The layers of a task's checks, in order: a layer earns its credit only if all before it have passed.
LAYERS = ("form", "public", "hidden", "properties")

PASSED, FAILED, SKIPPED, NOT_IMPLEMENTED, ERROR = (
    "passed",
    "failed",
    "skipped",
    "not implemented",
    "error",
)


@dataclass(frozen=True)
class Check:
    """One check of a task or of the simulation.

    `message` may hold the submission's own text: views escape it. The fields from `case` on are filled for
    public checks only; the check of the hidden cases says one of four words.

    Attributes
    ----------
    name : str
        What is checked, in a few words: "public cases", "partition of unity".
    layer : str
        One of `LAYERS`, or "simulation".
    status : str
        "passed", "failed" or "skipped".
    message : str
        For people; the first line says it all.
    case : int, optional
        Number of the worst public case.
    error : float, optional
        Its relative error.
    cause : str
        Key of the mistake the diagnosis recognised, such as "negated"; empty if none.
    diagnosis, advice : str
        That mistake in words, and one next step.
    """

    name: str
    layer: str
    status: str
    message: str
    case: int | None = None
    error: float | None = None
    cause: str = ""
    diagnosis: str = ""
    advice: str = ""


@dataclass(frozen=True)
class TaskResult:
    """What came of one task.

    Attributes
    ----------
    name, title, file, section : str
        From the task table; `section` is the handout's ("S7").
    status : str
        "passed", "failed" (wrong), "not implemented", or "error" (it cannot be run: missing, does not
        compile, crashes, takes too long).
    score, max_score : float
    checks : tuple of Check
        In the order of `LAYERS`.
    output : str
        What the submission printed during the public checks, capped; raw.
    """

    name: str
    title: str
    file: str
    section: str
    status: str
    score: float
    max_score: float
    checks: tuple[Check, ...]
    output: str = ""

    @property
    def message(self) -> str:
        """What a person should read first: that of the first check that failed, or of the last."""
        return next((c for c in self.checks if c.status == FAILED), self.checks[-1]).message


@dataclass(frozen=True)
class Simulation:
    """The submission's functions together, on a small cloth, beside the reference.

    It earns no points of its own: a mistake is charged where it is made. It comes before the hidden cases: functions
    take part that are right on the public ones and have their properties.

    Attributes
    ----------
    status : str
        "passed", "failed" or "skipped".
    message : str
    checks : tuple of Check
        Layer "simulation".
    uses, stand_ins : tuple of str
        Tasks whose functions took part; tasks the framework's own element stood in for.
    scene : str
        Name of the scene.
    energies, reference_energies : tuple of rows (time, kinetic, elastic, gravity)
        Per step [s, J, J, J].
    momenta, reference_momenta : tuple of rows (px, py, pz, lx, ly, lz)
        At the same times, the angular one about the centre of mass [N s, N m s].
    triangles : tuple of (int, int, int)
    positions, reference_positions : tuple of (x, y, z)
        The cloth at the end [m]; empty where there was no run.
    """

    status: str
    message: str
    checks: tuple[Check, ...] = ()
    uses: tuple[str, ...] = ()
    stand_ins: tuple[str, ...] = ()
    scene: str = ""
    energies: tuple[tuple[float, ...], ...] = ()
    reference_energies: tuple[tuple[float, ...], ...] = ()
    momenta: tuple[tuple[float, ...], ...] = ()
    reference_momenta: tuple[tuple[float, ...], ...] = ()
    triangles: tuple[tuple[int, ...], ...] = ()
    positions: tuple[tuple[float, ...], ...] = ()
    reference_positions: tuple[tuple[float, ...], ...] = ()


@dataclass(frozen=True)
class Answer:
    """A written question as a person marked it, its points on top of the tasks'."""

    name: str
    title: str
    section: str
    score: float
    max_score: float
    comment: str = ""


@dataclass(frozen=True)
class Safety:
    """How the submission was kept apart.

    `defences` says of each defence by name whether this system could give it; `notes` are sentences about
    those it could not.
    """

    level: str
    asked: str
    defences: Mapping[str, bool]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Submission:
    """What was handed in: a name for people, the sha256 of the task files, what was found on unpacking."""

    name: str
    sha256: str
    files: Mapping[str, str]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Record:
    """Everything a grading found out.

    Attributes
    ----------
    assignment : dict
        name, title, version.
    submission : Submission
    environment : dict
        Versions and the pinned mode: muslin, taichi, numpy, python, platform, precision, threads, fast_math.
    safety : Safety
    seed : str
        What the hidden cases were drawn from, or the digest of a seed that was given.
    hidden : dict
        cases: how many per task were drawn; instructor: how many per task came from the instructor's folder.
    tasks : tuple of TaskResult
        Every task of the table, once, in its order.
    simulation : Simulation
    timing : dict
        seconds: from the start until the hidden cases went out; tasks: by name, of the stages before. The only part
        that differs between two runs.
    written : tuple of Answer
        Written questions that a person has marked; a grading itself marks none.
    """

    assignment: Mapping[str, str]
    submission: Submission
    environment: Mapping[str, Any]
    safety: Safety
    seed: str
    hidden: Mapping[str, int]
    tasks: tuple[TaskResult, ...]
    simulation: Simulation
    timing: Mapping[str, Any] = field(default_factory=dict)
    written: tuple[Answer, ...] = ()

    @property
    def score(self) -> float:
        """Points earned."""
        return round(sum(task.score for task in self.tasks) + sum(answer.score for answer in self.written), 2)

    @property
    def max_score(self) -> float:
        """Points there are."""
        return round(sum(task.max_score for task in self.tasks), 2)

    def __getitem__(self, task: str) -> TaskResult:
        for result in self.tasks:
            if result.name == task:
                return result
        raise KeyError(task)

    def __iter__(self) -> Iterator[TaskResult]:
        return iter(self.tasks)

    def as_json(self, timing: bool = True) -> dict[str, Any]:
        """Plain data, in the shape of the schema; without `timing`, the same for every run."""
        data = {"schema": SCHEMA, "score": self.score, "max_score": self.max_score, **asdict(self)}
        if not timing:
            del data["timing"]
        if not self.written:
            del data["written"]
        return _plain(data)


def from_json(data: Mapping[str, Any]) -> Record:
    """The record again, from what `Record.as_json` gave.

    Raises
    ------
    ValueError
        If it is not such a record.
    """
    if data.get("schema") != SCHEMA:
        raise ValueError(f"not a {SCHEMA}")

    def check(entry: Mapping[str, Any]) -> Check:
        return Check(**entry)

    simulation = {key: _tuples(value) for key, value in data["simulation"].items()}
    return Record(
        assignment=data["assignment"],
        submission=Submission(**{k: _tuples(v) for k, v in data["submission"].items()}),
        environment=data["environment"],
        safety=Safety(**{k: _tuples(v) for k, v in data["safety"].items()}),
        seed=data["seed"],
        hidden=data["hidden"],
        tasks=tuple(
            TaskResult(**{**task, "checks": tuple(check(c) for c in task["checks"])})
            for task in data["tasks"]
        ),
        simulation=Simulation(
            **{**simulation, "checks": tuple(check(c) for c in data["simulation"]["checks"])}
        ),
        timing=data.get("timing", {}),
        written=tuple(Answer(**answer) for answer in data.get("written", ())),
    )


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    return [_plain(entry) for entry in value] if isinstance(value, (tuple, list)) else value


def _tuples(value: Any) -> Any:
    return tuple(_tuples(entry) for entry in value) if isinstance(value, list) else value


@functools.lru_cache(maxsize=16)
def digest(seed: str) -> str:
    """By which it is seen that two gradings had the same seed; slow, so that trying words takes long."""
    return "digest:" + hashlib.pbkdf2_hmac("sha256", seed.encode(), b"muslin seed", 200_000).hex()[:16]
