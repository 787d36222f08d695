"""Whose code computes a part of a simulation: a folder's functions, or the framework's own.

A part is computed by a folder's functions only if all the tasks behind it may be called. If one of them is stood
in for (not written yet, or known to be wrong), the framework's own code computes that part: never a mixture
that would blame one function for another's mistake. Which tasks are behind a part is said where they are called.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from muslin.base.errors import MuslinError
from muslin.tasks import Functions, assignment, failure_of


@dataclass(frozen=True)
class Roles:
    """The functions of a folder, and the tasks among them that must not be called.

    Parameters
    ----------
    functions : Functions, optional
        None: native code computes everything.
    stand_ins : set of str
        Names of tasks; see `checked`.
    """

    functions: Functions | None = None
    stand_ins: frozenset[str] = frozenset()

    def calling(self, names: Iterable[str]) -> Functions | None:
        """The functions, if the folder has all of these tasks and they may be called; else None."""
        if self.functions is None or not self.stand_ins.isdisjoint(names):
            return None
        return self.functions if all(name in self.functions.assignment.tasks for name in names) else None

    def called(self, names: Iterable[str]) -> frozenset[str]:
        """These tasks, if their functions are called; else none."""
        return frozenset() if self.calling(names) is None else frozenset(names)


def unusable(functions: Functions) -> tuple[str, ...]:
    """Names of the tasks whose functions cannot be called: still the stub, missing, or in a broken file."""
    return tuple(name for name in functions.assignment.tasks if failure_of(functions[name]) is not None)


def checked(stand_ins: Iterable[str], functions: Functions | None) -> frozenset[str]:
    """Names of tasks that are stood in for, as a set.

    Raises
    ------
    MuslinError
        If the assignment has no task of one of these names.
    """
    chosen = frozenset([stand_ins] if isinstance(stand_ins, str) else stand_ins)
    if not chosen:
        return chosen
    known = list((functions.assignment if functions is not None else assignment()).tasks)
    if unknown := sorted(map(str, chosen - set(known))):
        raise MuslinError(
            f"There is no task {unknown[0]!r} that could be stood in for.", f"There is: {', '.join(known)}."
        )
    return chosen
