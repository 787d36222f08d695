"""All that is known of one task, found by assignment and name.

What students must not read (how cases are drawn, what is true, what mistakes make of it) lies in the assignment's
folder `judge/`; what they may read (what must hold for every input, what lies on the way, which derivative can be
checked) in `practice/`, which their installation carries. In both, and in an instructor's one file `reference.py`, a
name says what it is: `draw_x`, `truth_x`, `terms_x`, `properties_x`, and so on, for a task `x`.
"""

from __future__ import annotations

import functools
import importlib
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from muslin.base import paths
from muslin.tasks.authored import AuthorError, guarded, imported
from muslin.tasks.comparing import FORMULA, TOLERANCE

Rng = np.random.Generator
Arrays = dict[str, np.ndarray]
Given = Mapping[str, np.ndarray]
Outputs = tuple[np.ndarray, ...]
Inputs = Callable[[Rng], Arrays]
Change = Callable[[Rng, Arrays], Arrays]
Tested = Callable[[Given, Outputs], np.ndarray]
Terms = Callable[[Given], Any]


@dataclass(frozen=True)
class Property:
    """One thing that must hold for a task function.

    Attributes
    ----------
    name : str
        In a few words: "partition of unity".
    statement : str
        One sentence for the student.
    inputs : callable
        Generator -> argument name -> (b, ...) float64 or int32 samples.
    judge : callable
        (inputs, outputs) -> relative error of each sample, or of each group of samples, (k,).
    tolerance : float
        Largest error of a right answer.
    cause : str
        Key of the mistake, where breaking this property means one in particular.
    """

    name: str
    statement: str
    inputs: Inputs
    judge: Tested
    tolerance: float = 1e-9
    cause: str = ""


class Case:
    """What a mistake is made of: the right answer, the truth for other inputs, and the arguments as attributes."""

    def __init__(self, right: np.ndarray, truth: Callable[..., np.ndarray], inputs: Given):
        self.right = right
        self.truth = truth
        self.__dict__.update(inputs)

    def __getattr__(self, name: str) -> Any:
        there = [known for known in self.__dict__ if not known.startswith("_")]
        raise AttributeError(f"there is no argument {name!r}, but {', '.join(there)}")


@dataclass(frozen=True)
class Mistake:
    """One mistake known from students.

    Attributes
    ----------
    cause : str
        Stable key.
    mistake, advice : str
        The mistake in words, and one next step.
    makes : callable
        What it makes of the right answer, or of the right answer to other inputs: one array, or several to try.
    result : int
        Of which result of the task.
    """

    cause: str
    mistake: str
    advice: str
    makes: Callable[[Case], Any]
    result: int = 0


@dataclass(frozen=True)
class Line:
    """A function along a line, for several cases at once.

    Attributes
    ----------
    at : callable
        Numbers t (c, k) -> values (c, k, ...).
    yours, right : ndarray (c, ...)
        Its derivative at t = 0, by the student's function and by Muslin.
    """

    at: Callable[[np.ndarray], np.ndarray]
    yours: np.ndarray
    right: np.ndarray


@dataclass(frozen=True)
class Derivative:
    """A derivative that can be checked against differences.

    Attributes
    ----------
    words : str
        What is differentiated; "{psi} psi" becomes "your psi" or "Muslin's psi".
    scheme : str
        "central" or "forward".
    line : callable
        From the inputs and functions of `muslin.student.gradcheck.Inputs`.
    """

    words: str
    scheme: str
    line: Callable[[Any], Line]


#: Gives the results of a task's function: (task, inputs by name) -> results in order.
Ask = Callable[[str, Given], Outputs]


@dataclass(frozen=True)
class Law:
    """What several functions must obey together.

    An assignment's `judge/` lists its `laws`, and may say on what they are asked: `specimen(ask)`.

    Attributes
    ----------
    name : str
        In a few words.
    needs : tuple of str
        The tasks whose functions it asks.
    error : callable
        The specimen, or without one the function that asks -> (relative error, how large it may be).
    """

    name: str
    needs: tuple[str, ...]
    error: Callable[[Any], tuple[float, float]]


@dataclass(frozen=True)
class Judge:
    """All that is known of one task; what nobody has written is left out.

    Attributes
    ----------
    draw : callable
        (Draw, k) -> inputs of case k by name, in exact numbers.
    truth : callable
        Inputs by name, in exact numbers -> the right answer, or a tuple of them.
    terms : callable
        Inputs (b, ...) -> size of the terms the answer is a sum of, (b,).
    properties : tuple of Property
    mistakes : tuple of Mistake
    said : dict
        Cause -> (mistake, advice): general mistakes in this task's own words.
    conditions : callable
        Inputs (b, ...) -> pairs of words and cases (b,), by which right and wrong ones may be told apart.
    steps : callable
        Inputs of a case -> what lies on the way to the result, by the handout's symbols.
    derivative : Derivative
    """

    draw: Callable[..., dict[str, Any]] | None = None
    truth: Callable[..., Any] | None = None
    terms: Terms | None = None
    properties: tuple[Property, ...] = ()
    mistakes: tuple[Mistake, ...] = ()
    said: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    conditions: Callable[[Given], Iterator[tuple[str, Any]]] | None = None
    steps: Callable[[Given], dict[str, Any]] | None = None
    derivative: Derivative | None = None

    @property
    def tolerance(self) -> float:
        """Largest relative error of a right answer."""
        return TOLERANCE if self.derivative is None else FORMULA


#: What a part of a judge is called in a module: `<part>_<task>`.
PARTS = tuple(entry.name for entry in fields(Judge))


def judge(assignment: str, task: str) -> Judge:
    """All that is known here of a task; on a student's machine that is what `practice/` and the public data say.

    Its functions are the author's, `guarded`: what goes wrong in one is told as theirs.

    Raises
    ------
    AuthorError
        If a file of the assignment cannot be run.
    """
    from muslin import tasks
    from muslin.judging import measured
    from muslin.judging.wired import wired

    found = _judge(modules(assignment), task)
    if not any(place(assignment).is_dir() for place in (paths.assignment, paths.source)):
        return found
    entry = tasks.assignment(assignment).tasks.get(task)
    if entry is None:
        return found
    found = wired(found, entry)
    return found if found.terms is not None else replace(found, terms=measured.terms(assignment, entry))


@functools.lru_cache(maxsize=256)
def _judge(files: tuple[ModuleType, ...], task: str) -> Judge:
    found = {}
    for part in PARTS:
        file, value = _said(files, f"{part}_{task}")
        if value is not None:
            found[part] = _guarded(part, task, value, file)
    return Judge(**found)


def _guarded(part: str, task: str, value: Any, file: str) -> Any:
    """A part of a judge whose functions tell what goes wrong in them."""
    words = f"{part}_{task}"
    try:
        if part == "properties":
            return tuple(
                replace(
                    prop,
                    inputs=guarded(prop.inputs, f"the property {prop.name!r} of {task}", file),
                    judge=guarded(prop.judge, f"the property {prop.name!r} of {task}", file),
                )
                for prop in value
            )
        if part == "mistakes":
            return tuple(
                replace(
                    mistake, makes=guarded(mistake.makes, f"the mistake {mistake.cause!r} of {task}", file)
                )
                for mistake in value
            )
        if part == "said":
            return {cause: (mistake, advice) for cause, (mistake, advice) in value.items()}
        if part == "derivative":
            return replace(value, line=guarded(value.line, words, file))
    except (TypeError, ValueError, AttributeError):
        raise AuthorError(paths.shown(file), f"{words} is not {FORMS[part]}") from None
    if not callable(value):
        raise AuthorError(paths.shown(file), f"{words} is not a function")
    return guarded(value, words, file)


#: What the parts of a judge are that are no functions.
FORMS = {
    "properties": "a tuple of Property (one alone needs a comma after it)",
    "mistakes": "a tuple of Mistake (one alone needs a comma after it)",
    "said": "a table: cause -> (mistake, advice)",
    "derivative": "a Derivative",
}


def known(assignment: str, name: str) -> Any:
    """What an assignment's own files call by a name; None if none does.

    Raises
    ------
    AuthorError
        If one of the files cannot be run.
    """
    return _said(modules(assignment), name)[1]


def secret(assignment: str, name: str) -> bool:
    """Whether an assignment says something by a name, and where students do not get it."""
    file, found = _said(modules(assignment), name)
    return found is not None and file not in {
        str(path) for part, path in paths.knowledge(assignment) if part == "practice"
    }


def _said(files: tuple[ModuleType, ...], name: str) -> tuple[str, Any]:
    """The file that says something last, and what it says; nothing if none does."""
    for file in reversed(files):
        if (found := getattr(file, name, None)) is not None:
            return str(file.__file__), found
    return "", None


def modules(assignment: str) -> tuple[ModuleType, ...]:
    """The modules of an assignment's `practice/`, `judge/` and `reference.py`, as far as they are here.

    Raises
    ------
    AuthorError
        If one cannot be run.
    """
    sources = paths.knowledge(assignment)
    with _importing:  # the grader asks from several threads
        return _modules(
            paths.bare(assignment), tuple((part, path, path.stat().st_mtime_ns) for part, path in sources)
        )


_importing = threading.RLock()


@functools.lru_cache(maxsize=16)
def _modules(assignment: str, sources: tuple[tuple[str, Path, int], ...]) -> tuple[ModuleType, ...]:
    """Import files; those of one part as the package it is, so that they may import each other."""
    packages = {part: f"muslin_{part}_{assignment.replace('-', '_')}" for part, _, _ in sources}
    folders = {part: path.parent for part, path, _ in sources}
    for part, package in packages.items():
        for old in [key for key in sys.modules if key.partition(".")[0] == package]:
            del sys.modules[old]
        sys.modules[package] = ModuleType(package)
        sys.modules[package].__path__ = [str(folders[part])]
    return tuple(_imported(f"{packages[part]}.{path.stem}", path) for part, path, _ in sources)


def _imported(name: str, path: Path) -> ModuleType:
    try:
        return importlib.import_module(name)
    except Exception as error:
        raise imported(error, path) from None
