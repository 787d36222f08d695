"""What answers are measured against where the function that says so is not: as data, beside the public cases.

A task may say how large the terms of its answers are (`terms_<task>`). Where that stands in a file that students do not
get, its values of the public cases ship with these: so whoever compares with the public cases measures alike.
"""

from __future__ import annotations

import functools
import zipfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging.knowledge import secret
from muslin.judging.parts import Terms
from muslin.tasks import Task

#: Name of the array beside a task's cases; no argument can be called so.
TERMS = "terms-of-the-answer"

#: How near inputs must be to those of a public case to be taken for it, relative.
_SAME = 1e-12


def terms(assignment: str, task: Task) -> Terms | None:
    """Size of the terms of a task's answers to its public cases, zero for other inputs; None if none is recorded."""
    path = paths.reference(assignment) / f"{task.name}.npz"
    try:
        recorded = _recorded(path, path.stat().st_mtime_ns)
    except OSError:
        return None
    if recorded is None:
        return None
    names = [value.name for value in task.inputs]

    def measured(inputs: Mapping[str, np.ndarray]) -> Any:
        from muslin.judging import reference

        try:
            known = _rows(reference.cases(assignment, task.name)[0], names)
        except MuslinError:
            return 0.0
        asked = _rows(inputs, names)
        same = np.all(np.isclose(asked[:, None], known[None], rtol=_SAME, atol=0.0), axis=2)
        return np.where(same.any(axis=1), recorded[same.argmax(axis=1)], 0.0)

    return measured


def lacking(assignment: str, names: Iterable[str]) -> list[str]:
    """Tasks whose terms students have neither as a function nor as data: their right answers could be wrong there."""
    asked = [name for name in names if secret(assignment, f"terms_{name}")]
    files = {name: paths.reference(assignment) / f"{name}.npz" for name in asked}
    there = {name: path for name, path in files.items() if path.is_file()}
    return [name for name, path in there.items() if _recorded(path, path.stat().st_mtime_ns) is None]


def _rows(inputs: Mapping[str, np.ndarray], names: list[str]) -> np.ndarray:
    """All numbers of each case, (b, n)."""
    columns = [np.asarray(inputs[name], dtype=np.float64) for name in names]
    return np.concatenate([column.reshape(len(column), -1) for column in columns], axis=1)


@functools.lru_cache(maxsize=64)
def _recorded(path: Path, time: int) -> np.ndarray | None:
    try:
        with np.load(path, allow_pickle=False) as data:
            return np.asarray(data[TERMS], dtype=np.float64) if TERMS in data.files else None
    except (OSError, ValueError, zipfile.BadZipFile):  # said where the cases are read
        return None
