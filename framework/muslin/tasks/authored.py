"""The one home for running an author's function: what goes wrong in one is told as its author's, with file and line.

An assignment's own files say how cases are drawn, what is true, what mistakes make of it, and build the functions that
tasks take. They are run while data are made, while a submission is graded and on students' machines. A slip in one is
neither an error of Muslin nor of a student.
"""

from __future__ import annotations

import functools
import inspect
import traceback
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.base.errors import MuslinError, said

#: What is raised where numbers are to blame: there may be no right answer to some inputs.
NUMERIC = (ArithmeticError, ValueError, IndexError)


#: Where a guarded function keeps the file that says it.
_FILE = "said_in"


class AuthorError(MuslinError):
    """A slip in an assignment's own files.

    Parameters
    ----------
    where : str
        The file, with the line if it is known.
    what : str
        What is wrong: without a full stop.
    do : str
        What to do, in a sentence.
    raised : Exception, optional
        What one of their functions raised.
    """

    def __init__(
        self, where: str, what: str, do: str = "Correct it there.", raised: BaseException | None = None
    ):
        super().__init__(f"{where}: {what}.", do)
        self.where, self.what, self.do, self.raised = where, what, do, raised

    @property
    def numeric(self) -> bool:
        """Whether numbers made it fail."""
        return isinstance(self.raised, NUMERIC)


def place(function: Any, file: str = "") -> str:
    """Where a function is written, for people: its file and line; the `file` alone where Muslin made it."""
    file = file or getattr(function, _FILE, "")
    code = getattr(inspect.unwrap(function), "__code__", None) if callable(function) else None
    if code is None or (file and Path(code.co_filename).parent != Path(file).parent):
        return paths.shown(file)
    return f"{paths.shown(code.co_filename)}, line {code.co_firstlineno}"


def guarded(function: Callable[..., Any], words: str, file: str, do: str = "Correct it there.") -> Any:
    """A function of an author's whose failures are told as theirs; a `MuslinError` passes through.

    Parameters
    ----------
    function : callable
    words : str
        What it is, for people: "truth_phi", "the property 'symmetric' of phi".
    file : str
        Which file says so.
    do : str
        What to do about a failure.
    """

    @functools.wraps(function)
    def guard(*given: Any, **named: Any) -> Any:
        try:
            found = function(*given, **named)
            return iter(list(found)) if isinstance(found, Iterator) else found
        except MuslinError:
            raise
        except Exception as error:
            raise _told(error, function, (given, named), words, file, do) from None

    setattr(guard, _FILE, file)
    return guard


def _told(
    error: Exception, function: Any, called: tuple[tuple[Any, ...], Mapping[str, Any]],
    words: str, file: str, do: str,
) -> AuthorError:  # fmt: skip
    """What went wrong in an author's function, for people."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).parent == Path(file).parent]
    given, named = called
    if isinstance(error, TypeError) and not own and not _fits(function, given, named):
        takes = ", ".join(inspect.signature(function).parameters)
        asked = ", ".join(named) if named else _counted(len(given), "argument")
        do = f"Name its arguments as the manifest does: ({asked})." if named else do
        return AuthorError(place(function, file), f"{words} takes ({takes}), and is given {asked}", do)
    where = f"{paths.shown(own[-1].filename)}, line {own[-1].lineno}" if own else place(function, file)
    return AuthorError(where, f"{words} raises {said(error).rstrip('.')}", do, error)


def _fits(function: Any, given: tuple[Any, ...], named: Mapping[str, Any]) -> bool:
    """Whether a function can be called so."""
    try:
        inspect.signature(function).bind(*given, **named)
    except TypeError:
        return False
    except ValueError:  # a builtin says nothing of what it takes
        return True
    return True


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'' if count == 1 else 's'}"


def imported(error: BaseException, path: Path, do: str = "Correct it there.") -> AuthorError:
    """What keeps an author's file from being imported."""
    if isinstance(error, SyntaxError) and error.filename:
        where = f"{paths.shown(error.filename)}, line {error.lineno}"
        return AuthorError(where, f"this is not Python: {error.msg}", do)
    frames = traceback.extract_tb(error.__traceback__)
    own = [frame for frame in frames if Path(frame.filename).parent == path.parent]  # not importlib's
    line = f", line {own[-1].lineno}" if own else ""
    where = f"{paths.shown(own[-1].filename if own else path)}{line}"
    return AuthorError(where, f"it cannot be read: {said(error).rstrip('.')}", do)
