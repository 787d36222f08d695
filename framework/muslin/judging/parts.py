"""What is known of one task, in parts: what an assignment's `judge/` and `practice/` are written with."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np

from muslin.tasks.comparing import FORMULA, TOLERANCE, Limits

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
    spared : float
        Share of the cases that need not be as right as a formula's, because a library's function may be on the way.
    """

    words: str
    scheme: str
    line: Callable[[Any], Line]
    spared: float = 0.0


@dataclass(frozen=True)
class Way:
    """How a function in plain Python went in one case, as far as it asked functions that it was given.

    Attributes
    ----------
    given : dict
        Its arguments by name.
    asked : sequence of (name, arguments, answer, line)
        What it asked which function, in order, and in which line of the student's file.
    end : object
        What it returned; None if it came to no end.
    broken : bool
        Whether that is because it raised an exception.
    """

    given: Mapping[str, Any]
    asked: Sequence[tuple[str, tuple[Any, ...], Any, int]]
    end: Any
    broken: bool = False


@dataclass(frozen=True)
class Seen:
    """Something that is wrong with the way a function went.

    Attributes
    ----------
    cause : str
        Stable key.
    line : int
        Where it shows; 0 if in no line in particular.
    words, advice : str
        What was seen, as half a sentence, and one next step.
    why : str
        What may explain it: told only where it is seen in every wrong case.
    """

    cause: str
    line: int
    words: str
    advice: str
    why: str = ""


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
    watched : callable
        `Way` -> what is wrong with it, each `Seen`, the first to say first.
    loss : callable
        Inputs (b, ...) -> how many times rounding grows in a right formula, however it is arranged, at least 1, (b,).
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
    watched: Callable[[Way], Iterator[Seen]] | None = None
    loss: Terms | None = None

    def limits(self, inputs: Given) -> Limits:
        """How far off a right answer to these inputs may be.

        A derivative is held to what rounding makes of a formula, where somebody has written how much that is.
        """
        if self.loss is None:
            return Limits()
        with np.errstate(all="ignore"):
            of_formula = FORMULA * np.asarray(self.loss(inputs), dtype=np.float64)
        if self.derivative is None:
            return Limits(np.maximum(of_formula, TOLERANCE))
        return Limits(of_formula, self.derivative.spared)


#: What a part of a judge is called in a module: `<part>_<task>`.
PARTS = tuple(entry.name for entry in fields(Judge))
