"""What is said where a task's function calls that of another task."""

from __future__ import annotations

from collections.abc import Sequence

from muslin.base import paths
from muslin.base.errors import StudentCodeError


class Borrowed(StudentCodeError):
    """A task's function calls `other`, the function of another task; where, says `placed`."""

    def __init__(self, other: str) -> None:
        super().__init__(f"It calls {other}, the function of another task.")
        self.other = other

    def placed(self, task: str, file: str, calls: Sequence[tuple[str, int]]) -> StudentCodeError:
        """The same, with its place.

        Parameters
        ----------
        task : str
            Whose function it is.
        file : str
            As its code says it.
        calls : sequence of (name, line)
            Functions of the file on the way from the task's to the other's, innermost last.
        """
        where, by = paths.shown(file.split(" (version ")[0]), task
        if calls:
            where, by = f"{where}, line {calls[-1][1]}", calls[-1][0]
        through = "" if by == task else f", which {task} uses,"
        return StudentCodeError(
            f"{where}: {by}{through} calls {self.other}, the function of another task.",
            "Each task is written alone: put in what its own arguments give, or a helper of your own.",
        )
