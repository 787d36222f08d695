"""What mistakes known from students make of the public cases: data, made beforehand, with no formula in them.

`muslin.authoring.mistakes` makes them, from what the assignment's `judge/` knows; the diagnosis holds what came against
them. Beside each mistake stand its words; conditions tell right and wrong cases apart.
"""

from __future__ import annotations

import functools
import hashlib
import zipfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import reference

#: Kinds of mistakes: known from students, or the right answer to changed inputs.
MISTAKE, CHANGE = "mistake", "change"


@dataclass(frozen=True)
class Entry:
    """One mistake in one result.

    Attributes
    ----------
    kind : str
        `MISTAKE` or `CHANGE`.
    cause : str
        Stable key.
    head, of : str
        Of a changed input: which words of the diagnosis it is told in, and what is changed.
    mistake, advice : str
        Of a known mistake: its words.
    made : ndarray, (cases, ...)
        What it makes of the public cases.
    """

    kind: str
    cause: str
    head: str
    of: str
    mistake: str
    advice: str
    made: np.ndarray


@dataclass(frozen=True)
class Known:
    """What is known of the mistakes of one task.

    Attributes
    ----------
    entries : tuple of tuple of Entry
        For each result, in order.
    said : dict
        Cause -> (mistake, advice): general mistakes in this task's own words.
    conditions : tuple of (str, ndarray of bool (cases,))
        By which right and wrong cases may be told apart.
    """

    entries: tuple[tuple[Entry, ...], ...] = ()
    said: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    conditions: tuple[tuple[str, np.ndarray], ...] = ()

    def of(self, result: int, kind: str) -> Iterator[Entry]:
        """The mistakes of a kind in a result, the plainest first."""
        if result < len(self.entries):
            yield from (entry for entry in self.entries[result] if entry.kind == kind)

    def at(self, cases: np.ndarray) -> Known:
        """The same in some of the cases."""
        return replace(
            self,
            entries=tuple(tuple(replace(e, made=e.made[cases]) for e in entries) for entries in self.entries),
            conditions=tuple((words, holds[cases]) for words, holds in self.conditions),
        )


def fingerprint(assignment: str, task: str) -> str:
    """What tells the public cases of a task from all others."""
    inputs, expected = reference.cases(assignment, task)
    digest = hashlib.sha256()
    for array in (*inputs.values(), *expected):
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def save(assignment: str, task: str, known: Known) -> None:
    """Write what is known; the same is the same bytes."""
    arrays: dict[str, np.ndarray] = {"cases": np.array([fingerprint(assignment, task)])}
    for k, entries in enumerate(known.entries):
        if entries:
            words = [(e.kind, e.cause, e.head, e.of, e.mistake, e.advice) for e in entries]
            arrays[f"words_{k}"] = np.array(words)
            with np.errstate(over="ignore"):
                arrays[f"made_{k}"] = np.stack([e.made for e in entries]).astype(np.float32)
    arrays["said"] = np.array([(cause, *words) for cause, words in known.said.items()] or [("", "", "")])
    if known.conditions:
        arrays["conditions"] = np.array([words for words, _ in known.conditions])
        arrays["holds"] = np.stack([holds for _, holds in known.conditions])
    path = paths.known(assignment) / f"{task}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy", (2000, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(entry, "w") as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


def current(assignment: str, task: str) -> bool:
    """Whether there are data of a task's mistakes, made of its public cases as they are."""
    try:
        with np.load(paths.known(assignment) / f"{task}.npz", allow_pickle=False) as data:
            return str(data["cases"][0]) == fingerprint(assignment, task)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile, MuslinError):
        return False


def _entry(words: np.ndarray, made: np.ndarray) -> Entry:
    kind, cause, head, of, mistake, advice = map(str, words)
    return Entry(kind, cause, head, of, mistake, advice, made)


@functools.lru_cache(maxsize=64)
def load(assignment: str, task: str, results: int) -> Known:
    """What is known of a task's mistakes; nothing if no data were made of its public cases."""
    if not current(assignment, task):  # the diagnosis does without
        return Known()
    try:
        with np.load(paths.known(assignment) / f"{task}.npz", allow_pickle=False) as data:
            entries = []
            for k in range(results):
                words, made = (data.get(f"{name}_{k}", ()) for name in ("words", "made"))
                pairs = zip(words, np.asarray(made, dtype=np.float64), strict=True)
                entries.append(tuple(_entry(words, array) for words, array in pairs))
            said = {
                str(cause): (str(mistake), str(advice)) for cause, mistake, advice in data["said"] if cause
            }
            holds = zip(data.get("conditions", ()), data.get("holds", ()), strict=True)
            return Known(tuple(entries), said, tuple((str(words), mask) for words, mask in holds))
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        return Known()
