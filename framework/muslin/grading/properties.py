"""Properties of the task functions themselves: what must hold for every input, whatever the right answer is.

The parent draws inputs (`draw`), the child evaluates the student's function on them, the parent judges the
outputs (`judge`). Nothing here needs Taichi or an expected value. Most properties are *relations between
runs*: the function is evaluated on inputs, and again on the same inputs turned, moved, scaled or exchanged;
the runs lie one after another in one batch.

An error is measured against the size of the terms an answer is a sum of, so rounding stays near 1e-13 on
every input drawn here, however a right answer is written; a mistake makes 1e-3 and more.

Inputs are drawn with `Generator.random` of a PCG64 and worked out with `+ - * /` and `sqrt` alone: every
machine draws the same bytes.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

Rng = np.random.Generator
Arrays = dict[str, np.ndarray]


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
    inputs: Callable[[Rng], Arrays]
    judge: Callable[[Mapping[str, np.ndarray], tuple[np.ndarray, ...]], np.ndarray]
    tolerance: float = 1e-9
    cause: str = ""


def draw(assignment: str, task: str, seed: str) -> tuple[tuple[Property, Arrays], ...]:
    """Properties of a task, each with inputs drawn from a stream of its own.

    Parameters
    ----------
    assignment, task : str
        Which task; one without properties gives an empty tuple.
    seed : str
        What the streams are drawn from: the same seed gives the same bytes.

    Returns
    -------
    tuple of (Property, dict of ndarray (b, ...))
    """
    drawn = []
    for prop in PROPERTIES.get(assignment, {}).get(task, ()):
        digest = hashlib.sha256(f"{seed}/{assignment}/{task}/{prop.name}".encode()).digest()
        rng = np.random.Generator(np.random.PCG64(int.from_bytes(digest, "little")))
        inputs = {
            name: np.ascontiguousarray(array, dtype=np.int32 if array.dtype.kind == "i" else np.float64)
            for name, array in prop.inputs(rng).items()
        }
        drawn.append((prop, inputs))
    return tuple(drawn)


def judge(prop: Property, inputs: Mapping[str, np.ndarray], outputs: tuple[np.ndarray, ...]) -> float:
    """Worst relative error of a property; infinite where anything is not finite.

    Parameters
    ----------
    prop : Property
    inputs : dict of ndarray, (b, ...)
        As drawn.
    outputs : tuple of ndarray, (b, ...)
        What the function made of them, of the shapes the task table says.

    Returns
    -------
    float
        The property holds if it is at most `prop.tolerance`.
    """
    if not all(np.isfinite(output).all() for output in outputs):
        return np.inf
    with np.errstate(all="ignore"):
        errors = prop.judge(inputs, outputs)
    return float(errors.max(initial=0.0)) if np.isfinite(errors).all() else np.inf


# --- vectors and matrices, (..., 3) and (..., 3, 3), without BLAS ------------------------------------------

I = np.eye(3)  # noqa: E741


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    (a0, a1, a2), (b0, b1, b2) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def _length(v: np.ndarray) -> np.ndarray:
    return np.sqrt(_dot(v, v))


def _unit(v: np.ndarray) -> np.ndarray:
    return v / _length(v)[..., None]


def _mul(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A B."""
    return A[..., :, :1] * B[..., :1, :] + A[..., :, 1:2] * B[..., 1:2, :] + A[..., :, 2:] * B[..., 2:, :]


def _apply(A: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A v."""
    return A[..., 0] * v[..., :1] + A[..., 1] * v[..., 1:2] + A[..., 2] * v[..., 2:]


def _T(A: np.ndarray) -> np.ndarray:
    return np.swapaxes(A, -1, -2)


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[..., :, None] * b[..., None, :]


def _diag(v: np.ndarray) -> np.ndarray:
    return v[..., None] * I


def _det(A: np.ndarray) -> np.ndarray:
    return _dot(A[..., 0], _cross(A[..., 1], A[..., 2]))


def _rotation(q: np.ndarray) -> np.ndarray:
    """Rotation of a quaternion (w, x, y, z) of any length, (..., 4) -> (..., 3, 3)."""
    q = q / np.sqrt(_dot(q, q) + q[..., 3] * q[..., 3])[..., None]
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


#: What inputs are turned by, spun about, scaled by: known to the judge, like in no way any input.
Q = _rotation(np.array([2.0, 1.0, -3.0, 5.0]))
OMEGA = np.array([0.5, -1.25, 0.75])
FACTOR = 1.75

#: Pairs of principal directions reversed together: still rotations, still the same F.
REVERSED = (np.array([-1.0, -1.0, 1.0]), np.array([1.0, -1.0, -1.0]), np.array([-1.0, 1.0, -1.0]))


# --- runs and errors ---------------------------------------------------------------------------------------


def _runs(*runs: Mapping[str, np.ndarray]) -> Arrays:
    """Several runs one after another, in one batch."""
    return {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}


def _split(array: np.ndarray, runs: int) -> np.ndarray:
    """The batch of several runs apart again, (runs, b, ...)."""
    return array.reshape(runs, -1, *array.shape[1:])


def _first(inputs: Mapping[str, np.ndarray], runs: int) -> Arrays:
    """Inputs of the first of several runs."""
    return {name: _split(array, runs)[0] for name, array in inputs.items()}


def _scaled(inputs: Mapping[str, np.ndarray], *names: str, factor: float = FACTOR) -> Arrays:
    """The same inputs, some of them times a factor."""
    return {name: factor * array if name in names else array for name, array in inputs.items()}


def _size(array: Any) -> np.ndarray:
    """Euclidean norm of each sample, (b,)."""
    flat = np.asarray(array, dtype=np.float64).reshape(len(array), -1)
    return np.sqrt(np.sum(flat * flat, axis=1))


def _error(difference: np.ndarray, *scales: Any) -> np.ndarray:
    """Size of a difference relative to the sum of the scales (each one number, or one per sample)."""
    size, scale = _size(difference), sum(scales)
    return np.where(size > 0, size / np.where(scale > 0, scale, np.finfo(float).tiny), 0.0)


def _sweep(
    slope: np.ndarray, f: Callable[[float], np.ndarray], scale: np.ndarray, steps: tuple[float, ...]
) -> np.ndarray:
    """Error of a derivative: the least along a Taylor sweep, step by step down to the rounding floor.

    Differences are central, of sixth order. A wrong slope is wrong at every step.
    """
    errors = []
    for h in steps:
        d1, d2, d3 = (f(k * h) - f(-k * h) for k in (1, 2, 3))
        errors.append(_error(slope - (45 * d1 - 9 * d2 + d3) / (60 * h), scale))
    return np.min(errors, axis=0)


# --- draws -------------------------------------------------------------------------------------------------


def _between(rng: Rng, low: float, high: float, *shape: int) -> np.ndarray:
    return low + (high - low) * rng.random(shape)


def _binades(rng: Rng, low: int, high: int, count: int) -> np.ndarray:
    """Numbers between 2^low and 2^high, spread over the powers of two."""
    exponent = np.floor(_between(rng, low, high, count)).astype(np.int32)
    return np.ldexp(1 + rng.random(count), exponent)


def _integers(rng: Rng, low: int, high: int, count: int) -> np.ndarray:
    """Whole numbers from low to high - 1, as float64."""
    return np.floor(_between(rng, low, high, count))


def _vectors(rng: Rng, count: int, size: float = 1.0) -> np.ndarray:
    return _between(rng, -size, size, count, 3)


def _matrices(rng: Rng, count: int) -> np.ndarray:
    return _between(rng, -1, 1, count, 3, 3)


def _rotations(rng: Rng, count: int) -> np.ndarray:
    return _rotation(_between(rng, -1, 1, count, 4))


def _directions(rng: Rng, count: int) -> np.ndarray:
    return _rotations(rng, count)[:, :, 0]


#: How a triangle lies: how many times thinner than well-shaped, size [m], distance from the origin [m].
#: Generic, far away, small as in a cloth, thin, large, at the origin, thin and small, generic again.
LIES = np.array(
    [
        (1, 1, 1),
        (1, 1, 100),
        (1, 0.03, 1),
        (8, 1, 0.5),
        (1, 20, 10),
        (1, 1, 0),
        (5, 0.05, 2),
        (2, 0.5, 1),
    ]
)


def _triangles(rng: Rng) -> np.ndarray:
    """One triangle of each of the `LIES`: vertices (b, 3, 3)."""
    count = len(LIES)
    thin, size, distance = LIES.T[:, :, None]
    y = np.array([[-0.5, -0.3], [0.5, -0.3], [0.0, 0.55]]) + _between(rng, -0.15, 0.15, count, 3, 2)
    along = _between(rng, -1, 1, count, 2)
    c, s = (along / np.sqrt(along[:, :1] * along[:, :1] + along[:, 1:] * along[:, 1:])).T[:, :, None]
    flat = [c * y[..., 0] - s * y[..., 1], (s * y[..., 0] + c * y[..., 1]) / thin, 0 * y[..., 0]]
    placed = size[..., None] * _apply(_rotations(rng, count)[:, None], np.stack(flat, axis=-1))
    return placed + (distance * _vectors(rng, count))[:, None, :]


def _corners(letter: str, points: np.ndarray) -> Arrays:
    """Vertices (b, 3, 3) as arguments: x0, x1, x2."""
    return {f"{letter}{i}": points[:, i] for i in range(3)}


def _points(inputs: Mapping[str, np.ndarray], letter: str) -> np.ndarray:
    """Arguments x0, x1, x2 as vertices (b, 3, 3)."""
    return np.stack([inputs[f"{letter}{i}"] for i in range(3)], axis=1)


def _normal(x: np.ndarray) -> np.ndarray:
    return _unit(_cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]))


def _longest(x: np.ndarray) -> np.ndarray:
    """Longest edge, (b,)."""
    return np.max([_length(x[:, i] - x[:, i - 1]) for i in range(3)], axis=0)


def _height(x: np.ndarray) -> np.ndarray:
    """Smallest height, (b,)."""
    return _length(_cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0])) / _longest(x)


def _far(x: np.ndarray) -> np.ndarray:
    """Distance of the farthest vertex from the origin, (b,)."""
    return _length(x).max(axis=1)


def _moved(rng: Rng, x: np.ndarray) -> np.ndarray:
    """A translation of a few sizes for each triangle, (b, 1, 3)."""
    return (2 * _longest(x)[:, None] * _vectors(rng, len(x)))[:, None, :]


def _weights(rng: Rng, count: int) -> np.ndarray:
    """Shape functions in and around a triangle, whose sum is exactly one."""
    phi12 = np.floor(_between(rng, -0.5, 1.0, count, 2) * 2.0**40) / 2.0**40
    return np.stack([1 - phi12[:, 0] - phi12[:, 1], phi12[:, 0], phi12[:, 1]], axis=1)


def _gradients(X: np.ndarray) -> np.ndarray:
    """Rows that sum to zero, dual to the edges: what the simulator would hand on as dphi_dX, (b, 3, 3)."""
    N, e1, e2 = _normal(X), X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
    g1, g2 = _cross(e2, N), _cross(N, e1)
    g1, g2 = g1 / _dot(g1, e1)[:, None], g2 / _dot(g2, e2)[:, None]
    return np.stack([-g1 - g2, g1, g2], axis=1)


def _material(rng: Rng, count: int) -> Arrays:
    """Lamé parameters, never near each other, so that swapping them shows."""
    mu = _binades(rng, 7, 16, count)
    softer = np.arange(count) % 2 == 0
    ratio = np.where(softer, _between(rng, 0.1, 0.7, count), _between(rng, 1.5, 8, count))
    return {"mu": mu, "lam": ratio * mu}


def _stretches(rng: Rng, count: int) -> np.ndarray:
    """Stretched, compressed or both, now and then alike; the normal's is 1, (b, 3)."""
    s = np.where(
        rng.random((count, 2)) < 0.5, _between(rng, 0.2, 0.95, count, 2), _between(rng, 1.05, 2.5, count, 2)
    )
    s[::4, 1] = s[::4, 0]
    return np.concatenate([s, np.ones((count, 1))], axis=1)


def _state(rng: Rng, count: int = 8) -> Arrays:
    return {"s": _stretches(rng, count), **_material(rng, count)}


def _sheet(rng: Rng, count: int) -> Arrays:
    """Area, density, thickness."""
    ranges = {"area": (-13, 0), "rho": (0, 10), "h": (-13, 0)}
    return {name: _binades(rng, *span, count) for name, span in ranges.items()}


def _stress(rng: Rng, count: int = 8) -> Arrays:
    """Arguments of dpsi_dF: two rotations, and a gradient with nothing in the third place."""
    p = _vectors(rng, count) * _binades(rng, 7, 16, count)[:, None] * np.array([1, 1, 0])
    return {"U": _rotations(rng, count), "dpsi_ds": p, "V": _rotations(rng, count)}


# --- S1, S2: shape functions -------------------------------------------------------------------------------


def _point_and_triangle(rng: Rng, offset: bool = True) -> Arrays:
    """Points in and around triangles, and above or below their plane."""
    X = _triangles(rng)
    phi, above = _weights(rng, len(X)), _between(rng, -0.5, 0.5, len(X)) * _longest(X) * offset
    return {"X": _apply(_T(X), phi) + above[:, None] * _normal(X), **_corners("X", X)}


def _phi_offset(rng: Rng) -> Arrays:
    a = _point_and_triangle(rng, offset=False)
    X = _points(a, "X")
    above = _longest(X) * _between(rng, 0.2, 1, len(X)) * np.where(np.arange(len(X)) % 3 == 0, -1, 1)
    return _runs(a, {**a, "X": a["X"] + above[:, None] * _normal(X)})


def _phi_rigid(rng: Rng) -> Arrays:
    a = _point_and_triangle(rng)
    t = _moved(rng, _points(a, "X"))[:, 0]
    return _runs(a, {name: _apply(Q, array) + t for name, array in a.items()})


def _phi_cycled(rng: Rng) -> Arrays:
    a = _point_and_triangle(rng)
    return _runs(a, {"X": a["X"], "X0": a["X1"], "X1": a["X2"], "X2": a["X0"]})


def _phi_linear(a: Mapping[str, np.ndarray], out: tuple[np.ndarray, ...]) -> np.ndarray:
    X, phi, N = _points(a, "X"), out[0], _normal(_points(a, "X"))
    d, e = a["X"] - X[:, 0], X - X[:, :1]
    nearest = d - _dot(N, d)[:, None] * N
    return _error(_apply(_T(e), phi) - nearest, _longest(X) * (1 + _size(phi)), _length(d))


def _phi_same(a: Mapping[str, np.ndarray], out: tuple[np.ndarray, ...]) -> np.ndarray:
    first, second = _split(out[0], 2)
    return _error(second - first, 1 + _size(first))


_PHI = (
    Property(
        "partition of unity",
        "The three shape functions must sum to one at every point.",
        _point_and_triangle,
        lambda a, out: _error(out[0].sum(axis=1) - 1, 1 + _size(out[0])),
    ),
    Property(
        "Kronecker delta at the vertices",
        "At a vertex its own shape function must be one and the other two zero.",
        lambda rng: (
            lambda X: _runs(*({"X": X[f"X{i}"], **X} for i in range(3)))
        )(_corners("X", _triangles(rng))),
        lambda a, out: _error((_split(out[0], 3) - I[:, None, :]).reshape(-1, 3), 1),
    ),
    Property(
        "linear functions are reproduced",
        "The vertices, weighted with the shape functions, must give back the point (its nearest in the plane).",
        _point_and_triangle,
        _phi_linear,
    ),
    Property(
        "blind to an offset along the normal",
        "Moving the point along the triangle's normal must not change its shape functions.",
        _phi_offset,
        _phi_same,
    ),
    Property(
        "rigid motion changes nothing",
        "Turning and moving the point together with its triangle must not change its shape functions.",
        _phi_rigid,
        _phi_same,
    ),
    Property(
        "no vertex is special",
        "Renumbering the vertices must renumber the shape functions in the same way.",
        _phi_cycled,
        lambda a, out: _phi_same(a, (np.concatenate([out[0][: len(LIES)], np.roll(out[0][len(LIES) :], 1, 1)]),)),
    ),
)


def _gradients_after(change: Callable[[Rng, np.ndarray], np.ndarray]) -> Callable[[Rng], Arrays]:
    """Triangles as they are, and changed."""

    def inputs(rng: Rng) -> Arrays:
        X = _triangles(rng)
        return _runs(_corners("X", X), _corners("X", change(rng, X)))

    return inputs


def _gradients_become(
    expected: Callable[[np.ndarray], np.ndarray],
) -> Callable[[Mapping[str, np.ndarray], tuple[np.ndarray, ...]], np.ndarray]:
    """The second run is what the first should have become."""

    def error(a: Mapping[str, np.ndarray], out: tuple[np.ndarray, ...]) -> np.ndarray:
        first, second = _split(out[0], 2)
        return _error(second - expected(first), _size(first), 1 / _height(_points(_first(a, 2), "X")))

    return error


def _dphi_linear(a: Mapping[str, np.ndarray], out: tuple[np.ndarray, ...]) -> np.ndarray:
    X, G = _points(a, "X"), out[0]
    N = _normal(X)
    return _error(_mul(_T(X), G) - (I - _outer(N, N)), 1 + _far(X) * (_size(G) + 1 / _height(X)))


_DPHI_DX = (
    Property(
        "rows sum to zero",
        "The shape functions sum to one everywhere, so their gradients, the rows, must sum to zero.",
        lambda rng: _corners("X", _triangles(rng)),
        lambda a, out: _error(out[0].sum(axis=1), 1 / _height(_points(a, "X")), _size(out[0])),
    ),
    Property(
        "rows lie in the plane",
        "Every row must be orthogonal to the normal N of the triangle.",
        lambda rng: _corners("X", _triangles(rng)),
        lambda a, out: _error(
            _apply(out[0], _normal(_points(a, "X"))), 1 / _height(_points(a, "X")), _size(out[0])
        ),
    ),
    Property(
        "exact on linear functions",
        "The sum of X_i times row i must be I - N N^T: a function that is linear has its own gradient.",
        lambda rng: _corners("X", _triangles(rng)),
        _dphi_linear,
    ),
    Property(
        "shrinks as the triangle grows",
        "A triangle larger by a factor must have gradients smaller by that factor.",
        _gradients_after(lambda rng, X: FACTOR * X),
        _gradients_become(lambda G: G / FACTOR),
    ),
    Property(
        "turns with the triangle",
        "Turning the triangle must turn every row with it.",
        _gradients_after(lambda rng, X: _apply(Q, X)),
        _gradients_become(lambda G: _mul(G, Q.T)),
    ),
    Property(
        "translation changes nothing",
        "Moving the triangle must not change the gradients.",
        _gradients_after(lambda rng, X: X + _moved(rng, X)),
        _gradients_become(lambda G: G),
    ),
)


def _weighted(rng: Rng) -> Arrays:
    x = _triangles(rng)
    return {"phi": _weights(rng, len(x)), **_corners("x", x)}


def _interpolate_sum(rng: Rng) -> Arrays:
    a, b = _weighted(rng), _corners("x", _triangles(rng))
    return _runs(a, {**a, **b}, {**a, **{name: a[name] + FACTOR * b[name] for name in b}})


#: An affine map.
STRAIN = np.array([[1.25, 0.5, -0.75], [-0.25, 0.875, 0.375], [0.625, -1.0, 1.5]])


def _interpolate_affine(rng: Rng) -> Arrays:
    a = _weighted(rng)
    t = _vectors(rng, len(LIES), 2)
    return _runs(
        a,
        {"phi": a["phi"], **{f"x{i}": _apply(STRAIN, a[f"x{i}"]) for i in range(3)}},
        {"phi": a["phi"], **{f"x{i}": a[f"x{i}"] + t for i in range(3)}},
    )


def _interpolate_affine_error(a: Mapping[str, np.ndarray], out: tuple[np.ndarray, ...]) -> np.ndarray:
    x, mapped, moved = _split(out[0], 3)
    t = _split(a["x0"], 3)[2] - _split(a["x0"], 3)[0]
    scale = (_far(_points(_first(a, 3), "x")) + _length(t)) * (1 + _size(_split(a["phi"], 3)[0]))
    return np.maximum(_error(mapped - _apply(STRAIN, x), 3 * scale), _error(moved - x - t, scale))


_INTERPOLATE = (
    Property(
        "vertices",
        "Where one shape function is one and the others are zero, the point must be that vertex.",
        lambda rng: (
            lambda x: _runs(*({"phi": np.tile(I[i], (len(LIES), 1)), **x} for i in range(3)))
        )(_corners("x", _triangles(rng))),
        lambda a, out: _error(
            _split(out[0], 3).swapaxes(0, 1) - _points(_first(a, 3), "x"), 3 * _far(_points(_first(a, 3), "x"))
        ),
    ),
    Property(
        "linear in the vertices",
        "x(X) = N(X) q is linear in q: the sum of two sets of vertices must give the sum of the points.",
        _interpolate_sum,
        lambda a, out: (
            lambda x, y, both: _error(
                both - x - FACTOR * y, _far(_points(a, "x")).max() * _size(_split(a["phi"], 3)[0]) * 0, 
                (_split(_far(_points(a, "x")), 3)[0] + FACTOR * _split(_far(_points(a, "x")), 3)[1])
                * (1 + _size(_split(a["phi"], 3)[0])),
            )
        )(*_split(out[0], 3)),
    ),
    Property(
        "follows affine maps",
        "Mapping or moving all three vertices must map or move the point in the same way.",
        _interpolate_affine,
        _interpolate_affine_error,
    ),
)
