"""Errors that speak to people.

Everything Muslin refuses is a `MuslinError`: one paragraph that says what is wrong, where, and what to do
next. The command line prints it without a traceback and exits non-zero.
"""

from __future__ import annotations


class MuslinError(Exception):
    """Something a person can mend.

    Parameters
    ----------
    message : str
        What is wrong and where, in one or two sentences.
    hint : str, optional
        What to do next.
    """

    def __init__(self, message: str, hint: str = ""):
        super().__init__(f"{message} {hint}".strip())
        self.message = message
        self.hint = hint


class MeshError(MuslinError):
    """A mesh that cannot be loaded or cannot be cloth."""


class NotImplementedYet(MuslinError):
    """A student function that is still the stub."""


class StudentCodeError(MuslinError):
    """A student's file that cannot be imported, compiled or called as the handout asks."""


class SimulationError(MuslinError):
    """A simulation that cannot start or has blown up."""
