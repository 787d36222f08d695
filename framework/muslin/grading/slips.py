"""What one slip in a right formula makes of the public cases: data, made beforehand, with no formula in them.

Of each slip one number per case and result is kept, a fixed combination of the entries of the answer (`print_of`),
and its words. `muslin.authoring.mutations` makes them; the diagnosis compares what came with them (`Slips.like`).
"""

from __future__ import annotations

import functools
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base import paths

#: How closely a slip must be met, relative to the size of its print.
MET = 1e-6

#: Prints that differ by less are one slip.
SAME = 1e-7


def print_of(answers: np.ndarray) -> np.ndarray:
    """One number for each answer, (b, ...) -> (b,): its entries, each times a weight of its own."""
    flat = np.asarray(answers, dtype=np.float64).reshape(len(answers), -1)
    weights = 1 + np.sqrt(np.arange(2, 2 + flat.shape[1])) % 1
    with np.errstate(all="ignore"):
        return np.sum(flat * weights, axis=1)


@dataclass(frozen=True)
class Slips:
    """The slips of one task.

    Attributes
    ----------
    words : ndarray of str, (n, 3)
        Cause, mistake and advice of each.
    prints : ndarray, (n, results, cases)
        What each makes of the public cases; NaN where it makes nothing finite.
    places : ndarray of str, (k,)
        Quantities on the way to the result, in words.
    marks : ndarray, (k, cases)
        The print of each.
    """

    words: np.ndarray
    prints: np.ndarray
    places: np.ndarray = field(default_factory=lambda: np.array([], dtype=str))
    marks: np.ndarray = field(default_factory=lambda: np.zeros((0, 0), dtype=np.float32))

    def place(self, values: np.ndarray, cases: Any = slice(None)) -> str:
        """What a quantity is called, by its values (b, ...), in all cases or some; empty if it is not known."""
        if not len(self.places) or self.marks.shape[1:] != np.shape(values)[:1]:
            return ""
        mark = print_of(values)[cases]
        if not len(mark) or not np.isfinite(mark).all():
            return ""
        off = np.abs(self.marks[:, cases] - mark) <= MET * np.abs(mark).max()
        met = np.flatnonzero(off.all(axis=1))
        return str(self.places[met[0]]) if len(met) else ""

    @classmethod
    def of(cls, found: Sequence[tuple[tuple[str, str, str], list[np.ndarray]]]) -> Slips:
        """Slips, each kept only if it comes to something finite that none before it has come to."""
        words, prints, seen = [], [], set()
        for said, made in found:
            rows = np.stack(made)
            with np.errstate(all="ignore"):
                rows = np.where(np.abs(rows) < np.finfo(np.float32).max, rows, np.nan)
                key = np.array([f"{number:.5e}" for number in rows.ravel()]).tobytes()
            if key not in seen and np.isfinite(rows).any():
                seen.add(key)
                words.append(said)
                prints.append(rows)
        return cls(np.array(words), np.array(prints, dtype=np.float32))

    def at(self, cases: np.ndarray) -> Slips:
        """The same slips in some of the cases."""
        return replace(self, prints=self.prints[:, :, cases], marks=self.marks[:, cases])

    def save(self, path: Path) -> Path:
        """Write to a file; the same slips are the same bytes."""
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            words, places = (
                np.frombuffer(
                    "\n".join(texts.ravel().tolist()).encode(), np.uint8
                )  # far smaller than an array of str
                for texts in (self.words, self.places)
            )
            arrays = {"words": words, "prints": self.prints, "places": places, "marks": self.marks}
            for name, array in arrays.items():
                info = zipfile.ZipInfo(f"{name}.npy", (2000, 1, 1, 0, 0, 0))
                info.compress_type = zipfile.ZIP_DEFLATED
                with archive.open(info, "w") as file:
                    np.lib.format.write_array(file, array, allow_pickle=False)
        return path

    def like(
        self, result: int, got: np.ndarray, size: np.ndarray, wrong: np.ndarray
    ) -> Iterator[tuple[str, str, str]]:
        """Words of the slips that come to what came, the plainest first.

        Parameters
        ----------
        result : int
            Which result of the task.
        got : ndarray, (b, ...)
            What came.
        size : ndarray, (b,)
            Natural scale of each case: what is far larger is taken as not finite.
        wrong : ndarray of bool, (b,)
            Which cases are wrong: nearly all of those that can be compared must be met.
        """
        came, made = print_of(got), self.prints[:, result].astype(np.float64)
        with np.errstate(all="ignore"):
            known = (np.abs(made) < 1e6 * size) & (np.abs(came) < 1e6 * size)
            met = known & (np.abs(made - came) <= MET * np.abs(made) + 1e-9 * size)
        asked = known & wrong
        good = met.sum(axis=1) >= 0.9 * np.maximum(known.sum(axis=1), 0.5 * len(came))
        good &= (met & wrong).sum(axis=1) >= np.maximum(0.9 * asked.sum(axis=1), 1)
        for k in np.flatnonzero(good):
            cause, mistake, advice = (str(text) for text in self.words[k])
            yield cause, mistake, advice


@functools.cache
def load(assignment: str, task: str) -> Slips | None:
    """The slips of a task; None if none were made."""
    try:
        with np.load(paths.slips(assignment) / f"{task}.npz", allow_pickle=False) as data:
            words, places = (data[name].tobytes().decode().split("\n") for name in ("words", "places"))
            named = np.array([place for place in places if place], dtype=str)
            marks = data["marks"].reshape(
                len(named), data["prints"].shape[2]
            )  # none of roads without comments
            return Slips(np.array(words).reshape(-1, 3), data["prints"], named, marks)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):  # the diagnosis does without
        return None
