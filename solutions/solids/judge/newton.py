"""Newton's method: how the objectives are drawn, where they are least, and what students get wrong."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from muslin.base import paths
from muslin.judging import Case, Given, Mistake
from muslin.judging.draws import Draw, float64
from muslin.judging.exact import Matrix, Vector, add, precise
from muslin.tasks.plain import builder

#: Where the terms of each kind begin, in y: quadratic, flat far away, infinite from -1 on, hardly lower.
BEGINS: tuple[Callable[[Draw], Any], ...] = (
    lambda draw: draw.between(-3, 3),
    lambda draw: draw.choice((-1, 1)) * draw.between(1.5, 4),
    lambda draw: draw.choice((draw.between(-0.95, -0.2), draw.between(1.5, 6))),
    lambda draw: draw.choice((-1, 1)) * draw.between(0.9, 1.1),
)


def truth_newtons_method(
    x: Vector, tolerance: Any, most_steps: Any, A: Matrix, m: Vector, w: Vector, kind: Any
) -> Vector:
    """Every term is least, and zero, where y = A (x - m) is zero, and A is invertible: so it is m."""
    return list(m)


def draw_newtons_method(draw: Draw, k: int) -> dict[str, Any]:
    """Objectives of the four kinds in turn; at times from the minimum itself on, or where a gradient has one entry."""
    kind, zero = k % 4, precise().zero
    A = [[zero] * 4 for _ in range(4)]
    for i in range(4):
        A[i][i] = draw.choice((-1, 1)) * draw.between(0.7, 1.4)
        for j in range(i):
            A[i][j] = draw.between(-0.5, 0.5)
    A, m = float64(A), float64([draw.between(-2, 2) for _ in range(4)])
    y = [BEGINS[kind](draw) for _ in range(4)]
    w = [10 ** draw.between(-1, 1) for _ in range(4)]
    if (
        k % 12 == 8
    ):  # of a quadratic, w y is the slope in y: who looks at one entry of the gradient stops here
        slopes = _slopes(A, 3 if k % 24 == 8 else 0, y[0])
        y = [slope / weight for slope, weight in zip(slopes, w, strict=True)]
    way: list[Any] = []
    for i in range(4):  # A way = y, row by row
        way.append((y[i] - sum((A[i][j] * way[j] for j in range(i)), start=zero)) / A[i][i])
    x = list(m) if k % 12 == 4 else add(m, way)
    return {
        "x": x,
        "tolerance": precise().mpf(1e-10) * min(w),
        "most_steps": 30,
        "A": A,
        "m": m,
        "w": w,
        "kind": kind,
    }


def _slopes(A: Matrix, entry: int, value: Any) -> list[Any]:
    """What makes A^T slopes, the gradient, vanish but for one entry: A^T is upper triangular, from the last row up."""
    slopes = [precise().zero] * 4
    for j in reversed(range(4)):
        known = sum((A[i][j] * slopes[i] for i in range(j + 1, 4)), start=precise().zero)
        slopes[j] = ((value if j == entry else 0) - known) / A[j][j]
    return slopes


@functools.cache
def _builder() -> Any:
    from muslin import tasks

    table = tasks.assignment("solids")
    return builder(table.tasks["newtons_method"], table, paths.source("solids"))


def _marched(march: Callable[..., np.ndarray]) -> Callable[[Case], np.ndarray]:
    """Where another method ends, case by case."""

    def makes(a: Case) -> np.ndarray:
        ends = []
        for k in range(len(a.x)):
            given = _builder()(A=a.A[k], m=a.m[k], w=a.w[k], kind=int(a.kind[k]))
            with np.errstate(all="ignore"):
                ends.append(march(np.array(a.x[k]), int(a.most_steps[k]), float(a.tolerance[k]), **given))
        return np.array(ends)

    return makes


def march(
    x: np.ndarray, steps: int, tolerance: float, objective: Any, gradient: Any, hessian: Any, solve: Any,
    sign: float = 1.0, enough: float | None = 1e-4, first: float = 1.0, keep: bool = False,
    most: int | None = None, fixed: bool = False, downhill: bool = False, halve: float = 0.5,
    shortest: float = 1e-10, refuses: bool = True, held: bool = False, finite: bool = False,
    length: Callable[[np.ndarray], float] = np.linalg.norm,
) -> np.ndarray:  # fmt: skip
    """Newton's method, or one that is nearly that."""
    step, H0, g0 = first, hessian(x), gradient(x)
    for _ in range(steps if most is None else min(most, steps)):
        g = g0 if held else gradient(x)
        if length(g) <= tolerance:
            break
        d = sign * (-g if downhill else solve(H0 if fixed else hessian(x), -g))
        here, slope = objective(x), g @ d
        step = step if keep else first
        while enough is not None and step > shortest:
            there = objective(x + step * d)
            low_enough = there <= here + enough * step * slope or (not refuses and not there > here)
            if there != np.inf if finite else low_enough:
                break
            step *= halve
        x = x + step * d
    return x


def _ways(*changes: dict[str, Any]) -> Any:
    return lambda a: tuple(_marched(functools.partial(march, **change))(a) for change in changes)


mistakes_newtons_method = (
    Mistake(
        "where it begins",
        "Your x does not move: it comes back as it began.",
        "x + step d is the new x: keep it, and begin the next step there.",
        lambda a: a.x,
    ),
    Mistake(
        "no line search",
        "Newton's whole step is taken always, also where it leads uphill or to where the objective is infinite.",
        "Compare the objective there with the one here; while it has not fallen enough, halve the step.",
        _ways({"enough": None}, {"enough": -1e200}, {"finite": True}),
    ),
    Mistake(
        "any decrease",
        "Any decrease is taken, however small: then one may step to and fro for ever.",
        "Enough is 1e-4 of what the slope promises: objective(x) + 1e-4 step g^T d.",
        _ways({"enough": 0.0}, {"enough": -1e-4}, {"enough": 1e-12}),
    ),
    Mistake(
        "one step",
        "One step is taken, and no more.",
        "The quadratic is only nearly the objective: repeat, from the new x, until the gradient is short.",
        _ways({"most": 1}, {"most": 1, "enough": None}, {"most": 2}),
    ),
    Mistake(
        "uphill",
        "Your direction leads uphill: its sign is wrong.",
        "Where the quadratic is least: H d = -g.",
        _ways(
            {"sign": -1.0},
            {"sign": -1.0, "enough": None},
            {"sign": -1.0, "shortest": 0.0},
            {"sign": -1.0, "shortest": 1e-8},
            {"sign": -1.0, "shortest": 1e-6},
            {"sign": -1.0, "shortest": 1e-12},
        ),
    ),
    Mistake(
        "steepest descent",
        "You go against the gradient: the Hessian is not used.",
        "Newton's direction solves H d = -g: it knows how far it is.",
        _ways({"downhill": True}, {"downhill": True, "enough": None}),
    ),
    Mistake(
        "gradient of the start",
        "The gradient stays the one of the start, and so does the direction.",
        "Each step needs gradient and Hessian at its own x: compute both within the loop.",
        _ways({"fixed": True, "held": True}, {"held": True}, {"fixed": True, "held": True, "enough": None}),
    ),
    Mistake(
        "hessian of the start",
        "The Hessian stays the one of the start.",
        "Each step needs the Hessian at its own x.",
        _ways({"fixed": True}, {"fixed": True, "enough": None}),
    ),
    Mistake(
        "too much asked",
        "Your line search asks for more than a right step gives: it halves for ever.",
        "To the bottom of a quadratic the objective falls by half of what the slope promises: ask for 1e-4 of it.",
        _ways({"enough": 1.0}, {"enough": 1.0, "shortest": 0.0}, {"enough": 0.6}, {"enough": 0.9}),
    ),
    Mistake(
        "one entry of the gradient",
        "You stop when one entry of the gradient is small: the others may be large.",
        "The whole gradient must be short: its length is np.linalg.norm(g).",
        _ways(
            *({"length": lambda g, k=k: abs(g[k])} for k in range(4)),
            {"length": lambda g: abs(g).min()},
            {"length": lambda g: abs(g.sum())},
        ),
    ),
    Mistake(
        "short steps for ever",
        "The step is not set back to one: once short, it stays short.",
        "Every direction deserves to be tried whole: begin each line search with 1.",
        _ways({"keep": True}),
    ),
    Mistake(
        "half a step",
        "Every step is only a part of Newton's: near the minimum the whole one is right.",
        "Try the whole step first.",
        _ways({"enough": None, "first": 0.5}, {"first": 0.5}, {"enough": None, "first": 0.1}, {"first": 0.1}),
    ),
)


said_newtons_method = {
    "echo:x": (
        "Your x does not move: it comes back as it began, or the line search finds nothing good on the way d.",
        "Is the new x kept? And does d lead downhill, g^T d < 0? H d = -g.",
    ),
    "nan": (
        "Your x is not a number: a step has led to where the objective is infinite.",
        "An infinite objective, or none at all, is never enough: halve the step until there is a number.",
    ),
}


def conditions_newtons_method(a: Given) -> Iterator[tuple[str, Any]]:
    """By which cases may be told apart."""
    yield "it begins at the minimum", (a["x"] == a["m"]).all(axis=1)
    yield "the objective is quadratic", a["kind"] == 0
    yield "the objective is flat far away", a["kind"] == 1
    yield "the objective is infinite somewhere", a["kind"] == 2
    yield "the whole step hardly lowers the objective", a["kind"] == 3
