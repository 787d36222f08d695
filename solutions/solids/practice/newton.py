"""newton: what must hold for every objective, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Arrays, Given, Property, Rng
from muslin.judging.relations import FACTOR, again, between, follows, vanishes
from muslin.tasks.comparing import size_of

#: Objectives of each property: two of each kind.
KINDS = np.array([0, 1, 2, 3, 0, 1, 2, 3], dtype=np.int32)


def terms_newtons_method(a: Given) -> Any:
    """Size of the terms that x is a sum of, (b,)."""
    return size_of(a["x"]) + size_of(a["m"])


def _begun(rng: Rng) -> Arrays:
    """Objectives, and where to begin: A is lower triangular, so that x can be had from y = A (x - m) row by row."""
    count = len(KINDS)
    A = np.zeros((count, 4, 4))
    for i in range(4):
        A[:, i, i] = between(rng, 0.8, 1.3, count)
        for j in range(i):
            A[:, i, j] = between(rng, -0.5, 0.5, count)
    kind, m = KINDS[:, None], between(rng, -2, 2, count, 4)
    side = np.where(rng.random((count, 4)) < 0.5, -1.0, 1.0)
    wide, near = between(rng, 1.5, 4, count, 4), between(rng, 0.9, 1.1, count, 4)
    y = np.where(kind == 2, wide, np.where(kind == 3, side * near, side * wide))
    way = _way(A, y)
    w = between(rng, 0.3, 3, count, 4)
    return {
        "x": m + way,
        "tolerance": 1e-10 * w.min(axis=1),
        "most_steps": np.full(count, 30, np.int32),
        "A": A,
        "m": m,
        "w": w,
        "kind": KINDS.copy(),
    }


def _way(A: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The x - m with A (x - m) = y, row by row."""
    way = np.zeros_like(y)
    for i in range(4):
        rest = sum((A[:, i, j] * way[:, j] for j in range(i)), start=np.zeros(len(y)))
        way[:, i] = (y[:, i] - rest) / A[:, i, i]
    return way


def _there_already(rng: Rng) -> Arrays:
    a = _begun(rng)
    return {**a, "x": a["m"].copy()}


def _no_steps(rng: Rng) -> Arrays:
    a = _begun(rng)
    return {**a, "most_steps": np.zeros(len(KINDS), np.int32)}


def _one_step(rng: Rng) -> Arrays:
    """Quadratics, of which one step of Newton's is all it takes."""
    a = _begun(rng)
    return {**a, "kind": np.zeros_like(a["kind"]), "most_steps": np.ones(len(KINDS), np.int32)}


def _few_steps(rng: Rng) -> Arrays:
    """One, two or three steps on the way to a minimum that takes more, from where every whole step is good enough.

    The terms are y - log(1 + y): Newton's step leads from y to -y^2, and from a y < 0 it lowers the objective by more
    than half of what the slope promises, so that no line search refuses it.
    """
    a = _begun(rng)
    count = len(KINDS)
    y = between(rng, -0.35, -0.25, count, 4)
    steps = np.array([1, 2, 3, 1, 2, 3, 1, 2], np.int32)
    return {**a, "x": a["m"] + _way(a["A"], y), "kind": np.full(count, 2, np.int32), "most_steps": steps}


#: Steps after which the gradient is short enough, and how many times as long it may be.
AFTER = np.array([0, 1, 2, 0, 1, 2, 0, 1])
LONGER = np.array([4, 2.5, 4])[AFTER]


def _short_on_the_way(rng: Rng) -> Arrays:
    """As `_few_steps`, with a tolerance that holds after none, one or two steps, whichever length one measures."""
    a = _few_steps(rng)
    y = _led(_slope(a, a["x"]), AFTER)
    slopes = a["w"] * y / (1 + y)
    gradient = np.sum(a["A"] * slopes[:, :, None], axis=1)
    tolerance = LONGER * np.sqrt(np.sum(gradient * gradient, axis=1))
    return {**a, "tolerance": tolerance, "most_steps": np.full(len(KINDS), 30, np.int32)}


def _led(y: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Where whole steps lead in `_few_steps`: each from y to -y^2."""
    for k in range(int(steps.max())):
        y = np.where((k < steps)[:, None], -y * y, y)
    return y


def _weighed(rng: Rng, a: Arrays) -> Arrays:
    """Change: the objective, and what counts as zero, times a factor."""
    return {"w": FACTOR * a["w"], "tolerance": FACTOR * a["tolerance"]}


def _elsewhere(rng: Rng, a: Arrays) -> Arrays:
    """Change: a start nearer to the minimum."""
    return {"x": a["m"] + 0.875 * (a["x"] - a["m"])}


def _slope(a: Given, x: np.ndarray) -> np.ndarray:
    """How far y = A (x - m) is from zero."""
    return np.sum(a["A"] * (x - a["m"])[:, None, :], axis=2)


def _from_where_steps_lead(a: Given, x: np.ndarray) -> np.ndarray:
    """How far y is from where so many steps lead as are allowed."""
    return _slope(a, x) - _led(_slope(a, a["x"]), a["most_steps"])


def _from_where_it_is_short(a: Given, x: np.ndarray) -> np.ndarray:
    """How far y is from where the gradient is short enough."""
    return _slope(a, x) - _led(_slope(a, a["x"]), AFTER)


properties_newtons_method = (
    Property(
        "least where every term is",
        "Every term of the objective is least where y = A (x - m) is zero: there x must end.",
        _begun,
        vanishes(terms_newtons_method, _slope),
    ),
    Property(
        "what is least stays",
        "Begun at the minimum, x must stay where it is.",
        _there_already,
        vanishes(terms_newtons_method, lambda a, x: x - a["m"]),
    ),
    Property(
        "no steps, no way",
        "With no steps allowed, x must come back as it began.",
        _no_steps,
        vanishes(terms_newtons_method, lambda a, x: x - a["x"]),
    ),
    Property(
        "one step is one step",
        "With one step allowed, a quadratic objective must be least at x: Newton's step leads there.",
        _one_step,
        vanishes(terms_newtons_method, lambda a, x: x - a["m"]),
    ),
    Property(
        "no more steps than allowed",
        "With most_steps = 1, 2 or 3, x must be where that many steps of Newton's lead, and no further.",
        _few_steps,
        vanishes(terms_newtons_method, _from_where_steps_lead),
    ),
    Property(
        "no step where the gradient is short",
        "Where the gradient is at most tolerance long, x must stay: no step is taken any more, and none too few.",
        _short_on_the_way,
        vanishes(terms_newtons_method, _from_where_it_is_short),
    ),
    Property(
        "moves with the objective",
        "Moving the objective and the start together must move the minimum with them.",
        again(_begun, lambda rng, a: {"x": a["x"] + 1.5, "m": a["m"] + 1.5}),
        follows(terms_newtons_method, lambda x: x + 1.5),
    ),
    Property(
        "blind to units",
        "The objective and the tolerance times a factor have the same minimum.",
        again(_begun, _weighed),
        follows(terms_newtons_method, lambda x: x),
    ),
    Property(
        "every start leads there",
        "From another start the same minimum must be found.",
        again(_begun, _elsewhere),
        follows(terms_newtons_method, lambda x: x),
    ),
)


def steps_newtons_method(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    terms = ("quadratic", "flat far away", "infinite from y = -1 on", "as high on the other side")
    return {"y = A (x - m)": a["A"] @ (a["x"] - a["m"]), f"kind ({terms[int(a['kind'])]})": int(a["kind"])}
