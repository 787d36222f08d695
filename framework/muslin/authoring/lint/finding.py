"""What is looked at, and what is found: one line each."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.tasks import Assignment
from muslin.tasks.authored import AuthorError


@dataclass(frozen=True)
class Finding:
    """Something to fix: `where` (a file, perhaps with line or task), `what`, and what to `do`."""

    where: str
    what: str
    do: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}; {self.do}".replace("\n", " ")


@dataclass(frozen=True)
class Subject:
    """An assignment being looked at."""

    name: str
    table: Assignment
    thorough: bool = False

    @property
    def source(self) -> Path:
        """Its solution folder."""
        return paths.solution(self.name)

    def where(self, file: str, task: str = "") -> str:
        """A file of its solution, perhaps with a task, as findings name it."""
        return f"{paths.shown(self.source / file)}{f', {task}' if task else ''}"


def of_error(where: Path | str, error: MuslinError) -> Finding:
    """An error as a finding: at the place it names itself, or else there."""
    shown = paths.shown(where) if isinstance(where, Path) else where
    if isinstance(error, AuthorError):
        return Finding(error.where, error.what, error.do.rstrip("."))
    what = error.message.rstrip(".")
    if what.startswith(shown):  # its own place, perhaps closer
        shown, _, what = what.partition(": ")
    return Finding(shown, what, (error.hint or "fix it").rstrip("."))
