"""collision: what must hold for every input, and what lies on the way."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Arrays, Given, Inputs, Outputs, Property, Rng, Tested
from muslin.judging.relations import (
    FACTOR,
    Q,
    again,
    between,
    binades,
    directions,
    follows,
    in_turn,
    norms,
    relative,
    rotations,
    run_of,
    split_runs,
    times,
    turned,
    vanishes,
    vectors,
)
from muslin.judging.vectors import I, apply, cross, dot, unit
from muslin.tasks.comparing import size_of


def terms_filter_velocity(a: Given) -> Any:
    """Size of the terms that filter_velocity is a sum of, (b,)."""
    return size_of(a["v"])


def _ball(rng: Rng, count: int = 12) -> Arrays:
    """Points in and around spheres, none near the surface."""
    c, r = vectors(rng, count, 3), binades(rng, -5, 3, count)
    inside = np.arange(count) % 2 == 0
    share = np.where(inside, between(rng, 0.2, 0.95, count), between(rng, 1.05, 3, count))
    return {"x": c + (share * r)[:, None] * directions(rng, count), "c": c, "r": r}


def _ball_and_centre(rng: Rng) -> Arrays:
    a = _ball(rng)
    return in_turn(a, {**run_of(a, 0, 6), "x": a["c"][:2], "c": a["c"][:2]})


def _carried_along(rng: Rng, a: Arrays) -> Arrays:
    """Change: vertex and centre move together."""
    t = vectors(rng, len(a["r"]), 4)
    return {"x": a["x"] + t, "c": a["c"] + t}


def _skin(rng: Rng) -> Arrays:
    """Points one part in a million inside, and outside."""
    c, r, d = vectors(rng, 8, 3), binades(rng, -5, 3, 8), directions(rng, 8)
    return in_turn(*({"x": c + (r * share)[:, None] * d, "c": c, "r": r} for share in (1 - 1e-6, 1 + 1e-6)))


def _same_contact(turn: np.ndarray) -> Tested:
    """The second run gives the same hit, and the normal turned."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        (hit, hit_again), (n, n_again) = split_runs(out[0], 2), split_runs(out[1], 2)
        return np.maximum(np.abs(1.0 * hit_again - hit), relative(n_again - apply(turn, n), 1 + norms(n)))

    return error


properties_sphere_contact = (
    Property(
        "unit normal",
        "The contact normal must have length one, at the centre as well.",
        _ball_and_centre,
        lambda a, out: np.abs(norms(out[1]) - 1),
    ),
    Property(
        "the normal points away from the centre",
        "The contact normal must point from the centre of the sphere to the vertex.",
        _ball,
        lambda a, out: relative(unit(a["x"] - a["c"]) * norms(out[1])[:, None] - out[1], norms(out[1])),
    ),
    Property(
        "the hit ends at the surface",
        "A millionth of the radius inside is a hit, a millionth outside is not.",
        _skin,
        lambda a, out: np.abs(out[0] - np.repeat([1.0, 0.0], len(out[0]) // 2)),
    ),
    Property(
        "rotation equivariance",
        "Turning vertex and centre about the origin must turn the normal, and not change the hit.",
        again(_ball, turned("x", "c")),
        _same_contact(Q),
    ),
    Property(
        "translation changes nothing",
        "Moving vertex and centre together must change neither the hit nor the normal.",
        again(_ball, _carried_along),
        _same_contact(I),
    ),
    Property(
        "size changes nothing",
        "Vertex, centre and radius times a factor are the same picture: the same hit, the same normal.",
        again(_ball, times("x", "c", "r")),
        _same_contact(I),
    ),
)


def _bouncing(low: float, high: float) -> Inputs:
    """Velocities whose part along n, for each metre per second along the surface, is between low and high."""

    def inputs(rng: Rng) -> Arrays:
        R, speed = rotations(rng, 8), binades(rng, -4, 6, 8)[:, None]
        n, along = R[:, :, 0], R[:, :, 1]
        return {"v": speed * (along + between(rng, low, high, 8, 1) * n), "n": n}

    return inputs


_any_way, _into, _away, _filtered = (
    _bouncing(low, high) for low, high in ((-2, 2), (-3, -0.1), (0.1, 3), (0, 0))
)


_any_way, _into, _away, _filtered = (
    _bouncing(low, high) for low, high in ((-2, 2), (-3, -0.1), (0.1, 3), (0, 0))
)


_any_way, _into, _away, _filtered = (
    _bouncing(low, high) for low, high in ((-2, 2), (-3, -0.1), (0.1, 3), (0, 0))
)


_any_way, _into, _away, _filtered = (
    _bouncing(low, high) for low, high in ((-2, 2), (-3, -0.1), (0.1, 3), (0, 0))
)


def _sliding(rng: Rng) -> Arrays:
    """Exactly along the surface: n is an axis, of either sign, and v has no part along it."""
    n = np.concatenate([I, -I])
    return {"v": vectors(rng, 6, 5) * (1 - np.abs(n)), "n": n}


#: Velocities come back as they were, but for those who take them apart and put them together again.
UNTOUCHED = 1e-14


properties_filter_velocity = (
    Property(
        "velocities away from the obstacle stay",
        "A vertex that moves away keeps its velocity.",
        _away,
        vanishes(terms_filter_velocity, lambda a, v: v - a["v"]),
        tolerance=UNTOUCHED,
    ),
    Property(
        "velocities along the obstacle stay",
        "A vertex that slides along the surface, n^T v = 0, keeps its velocity.",
        _sliding,
        vanishes(terms_filter_velocity, lambda a, v: v - a["v"]),
        tolerance=UNTOUCHED,
    ),
    Property(
        "filtering twice is filtering once",
        "What has been filtered already must come back as it is.",
        _filtered,
        vanishes(terms_filter_velocity, lambda a, v: v - a["v"]),
    ),
    Property(
        "nothing goes in",
        "After the filter no velocity may point into the obstacle: n^T v must not be negative.",
        _any_way,
        vanishes(terms_filter_velocity, lambda a, v: np.minimum(dot(a["n"], v), 0)),
    ),
    Property(
        "nothing bounces",
        "A vertex that went into the obstacle must neither go on nor come back: n^T v must be zero.",
        _into,
        vanishes(terms_filter_velocity, lambda a, v: dot(a["n"], v)),
    ),
    Property(
        "only the part along n changes",
        "The filter may take away something along n and nothing else: what it takes must be parallel to n.",
        _any_way,
        vanishes(terms_filter_velocity, lambda a, v: cross(a["v"] - v, a["n"])),
    ),
    Property(
        "never gains energy",
        "The filtered velocity must not be longer than it was.",
        _any_way,
        vanishes(terms_filter_velocity, lambda a, v: np.maximum(norms(v) - norms(a["v"]), 0)),
    ),
    Property(
        "twice as fast",
        "A velocity times a positive factor must come out times that factor.",
        again(_any_way, times("v")),
        follows(terms_filter_velocity, lambda v: FACTOR * v),
    ),
    Property(
        "rotation equivariance",
        "Turning velocity and normal must turn the result.",
        again(_any_way, turned("v", "n")),
        follows(terms_filter_velocity, lambda v: apply(Q, v)),
    ),
)


def steps_sphere_contact(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"x - c": a["x"] - a["c"], "|x - c|": np.linalg.norm(a["x"] - a["c"])}


def steps_filter_velocity(a: Given) -> dict[str, Any]:
    """What lies on the way."""
    return {"d = n^T v": a["n"] @ a["v"]}
