"""The reference data that ship with Muslin, and how answers are compared with them: no mpmath, no solution needed."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.tasks import wiring
from muslin.tasks.comparing import (
    TOLERANCE,
    Verdict,
    compare,
    form,
    largest_of,
    natural_scale,
    shown,
    size_of,
)

__all__ = [
    "TOLERANCE",
    "Verdict",
    "cases",
    "compare",
    "form",
    "largest_of",
    "natural_scale",
    "shown",
    "size_of",
]


def cases(
    assignment_name: str, task: str, folder: Path | None = None
) -> tuple[dict[str, np.ndarray], tuple[np.ndarray, ...]]:
    """Reference cases of a task.

    Parameters
    ----------
    assignment_name, task : str
        Which task.
    folder : Path, optional
        Where the data are; default the public ones.

    Returns
    -------
    inputs : dict of ndarray, (b, ...)
        The arguments by name.
    expected : tuple of ndarray, (b, ...)
        The results in order.

    Raises
    ------
    MuslinError
        If there are no such data, or the file is damaged.
    """
    entry = tasks.assignment(assignment_name).tasks.get(task)
    if entry is None:
        raise MuslinError(f"The assignment {assignment_name!r} has no task {task!r}.")
    path = (folder or paths.reference(assignment_name)) / f"{task}.npz"
    try:
        with np.load(path, allow_pickle=False) as data:
            inputs = {value.name: data[value.name] for value in entry.inputs}
            expected = tuple(data[f"expected_{value.name}"] for value in entry.results)
    except FileNotFoundError:
        raise MuslinError(
            f"There are no reference data for {task}: {paths.shown(path)} is missing."
        ) from None
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        hint = "Restore it, or install Muslin again."
        raise MuslinError(f"{paths.shown(path)} is damaged ({error}).", hint) from None
    if paths.bare(assignment_name) == assignment_name:
        return inputs, expected
    everybodys = tasks.assignment(paths.bare(assignment_name)).tasks[task]
    own = wiring.to_own(entry, wiring.to_called(everybodys, inputs))
    return own, wiring.results_own(entry, wiring.results_called(everybodys, expected))
