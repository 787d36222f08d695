"""Collision: how the cases are drawn, what is true, and what students get wrong."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Case, Mistake
from muslin.judging.arrays import dot_column, lengths
from muslin.judging.draws import Draw, float64
from muslin.judging.exact import Vector, add, cross, dot, exact, norm, precise, sub, times


def truth_sphere_contact(x: Vector, c: Vector, r: Any) -> tuple[int, Vector]:
    """Distance below the radius; the normal is the direction from the centre, up at the centre itself."""
    d = sub(x, c)
    distance = norm(d)
    return int(distance < r), times(1 / distance, d) if distance > 0 else exact([0, 1, 0])


def truth_filter_velocity(v: Vector, n: Vector) -> Vector:
    """The velocity, or where it enters the obstacle the same without its part along n."""
    d = dot(n, v)
    return sub(v, times(d, n)) if d < 0 else v


def draw_sphere_contact(draw: Draw, k: int) -> dict[str, Any]:
    """Just inside, just outside, deep inside, far away, at the very centre, exactly on the surface (no hit)."""
    if k % 10 == 8:  # (3, 4, 0) has length 5: all of it exact, however it is computed
        unit = 2.0 ** draw.randint(-4, 2)
        c = [unit * draw.randint(-9, 9) for _ in range(3)]
        turned = draw.sample([3 * unit, 4 * unit, 0.0], 3)
        return {"x": [a + b for a, b in zip(c, turned, strict=True)], "c": c, "r": 5 * unit}
    c, r = float64(draw.vector(3)), draw.decades(-2, 1)
    share = (draw.between(0.6, 0.95), draw.between(1.05, 1.5), draw.between(0.01, 0.5), draw.between(2, 9))[
        k % 4
    ]
    x = c if k % 10 == 9 else add(c, times(share * r, draw.direction()))
    return {"x": x, "c": c, "r": r}


def draw_filter_velocity(draw: Draw, k: int) -> dict[str, Any]:
    """Into the obstacle, away from it, exactly along it, straight into it, straight away, at rest."""
    n = float64(draw.direction())
    along = cross(n, draw.direction())
    into = draw.between(0.1, 3)
    v = add(along, times((-into, into)[k % 2], n))
    if k % 6 == 2:
        axis, sign = k // 6 % 3, (1, -1)[k // 6 % 2]
        n = exact([sign if m == axis else 0 for m in range(3)])
        v = [precise().zero if m == axis else entry for m, entry in enumerate(draw.vector(3))]
    elif k % 6 in (3, 4):
        v = times((-into, into)[k % 6 - 3], n)
    elif k == 5:
        v = exact([0, 0, 0])
    return {"v": v, "n": n}


def _distance(a: Case) -> np.ndarray:
    return lengths(a.x - a.c)


def _projected_always(a: Case) -> np.ndarray:
    return np.where(dot_column(a.v, a.n) < 0, a.right, -a.truth(v=-a.v))


def _along_v(a: Case) -> tuple[np.ndarray, ...]:
    d = np.minimum(dot_column(a.v, a.n), 0)
    speed = lengths(a.v)[:, None]
    unit = np.where(speed > 0, a.v / np.where(speed > 0, speed, 1), 0)
    return a.v - d * a.v, a.v + d * a.v, a.v - d * unit, a.v + d * unit


mistakes_sphere_contact = (
    Mistake(
        "squared distance",
        "The squared distance is compared with r.",
        "Metres squared against metres: for r = 1 it works. Compare like with like.",
        lambda a: _distance(a) ** 2 < a.r,
    ),
    Mistake(
        "surface counts",
        "A point exactly on the surface counts as a hit.",
        "A hit is strictly inside: look at < and <=.",
        lambda a: _distance(a) <= a.r,
    ),
    Mistake(
        "inverted",
        "Outside counts as a hit, and inside as none.",
        "Inside means nearer to the centre than r.",
        lambda a: (_distance(a) >= a.r, _distance(a) > a.r),
    ),
    Mistake(
        "missing:c",
        "The distance is measured from the origin, not from the centre c.",
        "Where is x, seen from the centre of the sphere?",
        lambda a: lengths(a.x) < a.r,
    ),
    Mistake(
        "scaled by distance",
        "The normal is as long as the distance from the centre.",
        "A normal has length one: how do you make a vector of length one?",
        lambda a: (a.x - a.c, np.where(_distance(a)[:, None] > 0, a.x - a.c, a.right)),
        result=1,
    ),
    Mistake(
        "divided by the radius",
        "The normal is divided by the radius: it has length one on the surface only.",
        "Inside the sphere the vertex is nearer than r. Divide by its own distance.",
        lambda a: tuple(
            np.where(_distance(a)[:, None] > 0, (a.x - a.c) / a.r[:, None], there) for there in (0.0, a.right)
        ),
        result=1,
    ),
    Mistake(
        "divided by the squared distance",
        "The normal is divided by the squared distance.",
        "A vector divided by its length has length one. Is yours divided by its length?",
        lambda a: np.where(_distance(a)[:, None] > 0, a.right / _distance(a)[:, None], a.right),
        result=1,
    ),
    Mistake(
        "no normal without a hit",
        "Your normal is set only where there is a hit.",
        "The normal is asked for whether or not there is a hit.",
        lambda a: tuple(
            np.where((_distance(a) < a.r)[:, None], a.right, there)
            for there in (0.0, np.eye(3)[1], a.x - a.c)
        ),
        result=1,
    ),
)


said_sphere_contact = {
    "negated": (
        "The normal points into the sphere.",
        "The way out leads from the centre to the vertex: which minus which?",
    ),
    "missing:c": (
        "The normal points away from the origin, not from the centre c.",
        "Where is x, seen from the centre of the sphere?",
    ),
    "where x = c: nan": (
        "At the centre of the sphere your normal is zero divided by zero.",
        "Every way out is equally good there: the docstring says which one to take.",
    ),
    "where x = c": (
        "At the centre of the sphere your normal is not the one agreed on.",
        "The docstring says which way is out there.",
    ),
    "where x = c: zeros": (
        "At the centre of the sphere your normal is zero.",
        "The docstring says which way is out there.",
    ),
}


mistakes_filter_velocity = (
    Mistake(
        "always",
        "The filter is applied always, also to a velocity that leaves the obstacle.",
        "A vertex that moves away keeps its velocity: look at the sign of n^T v first.",
        _projected_always,
    ),
    Mistake(
        "reflected",
        "The velocity is reflected: the cloth bounces.",
        "Take the part that goes in away once, not twice.",
        lambda a: (2 * a.right - a.v, 2 * _projected_always(a) - a.v),
    ),
    Mistake(
        "wrong sign",
        "The part that goes in is added, not taken away: the vertex goes in twice as fast.",
        "Afterwards n^T v must be zero. Try it with one number.",
        lambda a: (2 * a.v - a.right, 2 * a.v - _projected_always(a)),
    ),
    Mistake(
        "reversed",
        "The filter acts on velocities that leave, and lets those pass that go in.",
        "n points out of the obstacle: which sign of n^T v means going in?",
        lambda a: np.where(dot_column(a.v, a.n) < 0, a.v, -a.truth(v=-a.v)),
    ),
    Mistake(
        "absolute",
        "The amount is taken without its sign, so the velocity is changed where it should be kept.",
        "Only a negative n^T v is a problem, and its sign matters in the formula.",
        lambda a: (
            a.v - np.abs(dot_column(a.v, a.n)) * a.n,
            a.v + np.abs(dot_column(a.v, a.n)) * a.n,
            np.where(dot_column(a.v, a.n) < 0, a.v - np.abs(dot_column(a.v, a.n)) * a.n, a.v),
        ),
    ),
    Mistake(
        "stopped",
        "A velocity that goes in is set to zero: the vertex sticks.",
        "Take away the part along n only; what slides along the surface stays.",
        lambda a: np.where(dot_column(a.v, a.n) < 0, 0.0, a.v),
    ),
    Mistake(
        "along the velocity",
        "The velocity is made smaller along itself, not along the normal.",
        "Take away the part along n only; what slides along the surface stays.",
        _along_v,
    ),
    Mistake(
        "the part that goes in",
        "You return the part along the normal, not what is left without it.",
        "Split v into two parts. Which one may the vertex keep?",
        lambda a: (
            a.v - a.right,
            np.where(dot_column(a.v, a.n) < 0, a.v - a.right, a.v),
            a.v - _projected_always(a),
        ),
    ),
    Mistake(
        "whole speed",
        "The whole speed is taken away along the normal, not the part of it that goes in.",
        "How fast does the vertex move along n? That is less than its speed.",
        lambda a: np.where(dot_column(a.v, a.n) < 0, a.v + lengths(a.v)[:, None] * a.n, a.v),
    ),
    Mistake(
        "missing:n",
        "The number n^T v is taken away from every component, without the direction n.",
        "The part of v along n is a vector: a number times n.",
        lambda a: a.v - np.minimum(dot_column(a.v, a.n), 0),
    ),
)


said_filter_velocity = {
    "echo:v": (
        "The velocity comes back as it is.",
        "Where it goes into the obstacle, something must be taken away.",
    ),
    "negated:n": (
        "The normal is used as if it pointed into the obstacle.",
        "n points out of the obstacle: which sign of n^T v means going in?",
    ),
}
