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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from muslin.reference import natural_scale

Rng = np.random.Generator
Arrays = dict[str, np.ndarray]
Given = Mapping[str, np.ndarray]
Outputs = tuple[np.ndarray, ...]
Inputs = Callable[[Rng], Arrays]
Change = Callable[[Rng, Arrays], Arrays]
Judge = Callable[[Given, Outputs], np.ndarray]


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
    judge: Judge
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


def judge(prop: Property, inputs: Given, outputs: Outputs) -> float:
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
    return float(errors(prop, inputs, outputs).max(initial=0.0))


def errors(prop: Property, inputs: Given, outputs: Outputs) -> np.ndarray:
    """Relative error of each sample of a property, or of each group of samples, (k,); infinite if not finite.

    Parameters
    ----------
    prop, inputs, outputs
        As `judge` takes them.
    """
    finite = [np.isfinite(output.reshape(len(output), -1)).all(axis=1) for output in outputs]
    if not np.all(finite):
        return np.where(np.all(finite, axis=0), 0.0, np.inf)
    with np.errstate(all="ignore"):
        found = prop.judge(inputs, outputs)
    return np.where(np.isfinite(found), found, np.inf)


def batch(drawn: Sequence[Given]) -> Arrays:
    """Several draws as one batch, so that a function is launched once."""
    return {name: np.concatenate([inputs[name] for inputs in drawn]) for name in drawn[0]}


def apart(results: Outputs, drawn: Sequence[Given]) -> list[Outputs]:
    """Results of a batch, draw by draw again."""
    ends = np.cumsum([len(next(iter(inputs.values()))) for inputs in drawn])
    return [tuple(r[a:b] for r in results) for a, b in zip([0, *ends[:-1]], ends, strict=True)]


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


#: What inputs are turned by, spun about, scaled by, deformed by: the same always, so that the judge knows.
Q = _rotation(np.array([2.0, 1.0, -3.0, 5.0]))
OMEGA = np.array([0.5, -1.25, 0.75])
FACTOR = 1.75
STRAIN = np.array([[1.25, 0.5, -0.75], [-0.25, 0.875, 0.375], [0.625, -1.0, 1.5]])

#: Pairs of principal directions reversed together: still rotations, still the same F.
REVERSED = np.array([[-1.0, -1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0]])


# --- runs: the same function on inputs that belong together ------------------------------------------------


def _runs(*runs: Given) -> Arrays:
    """Several runs one after another, in one batch."""
    return {name: np.concatenate([run[name] for run in runs]) for name in runs[0]}


def _split(array: np.ndarray, runs: int) -> np.ndarray:
    """The batch of several runs apart again, (runs, b, ...)."""
    return array.reshape(runs, -1, *array.shape[1:])


def _run(inputs: Given, k: int, runs: int) -> Arrays:
    """Inputs of run k."""
    return {name: _split(array, runs)[k] for name, array in inputs.items()}


def _again(base: Inputs, *changes: Change) -> Inputs:
    """Inputs, and runs with some arguments changed."""

    def inputs(rng: Rng) -> Arrays:
        a = base(rng)
        return _runs(a, *({**a, **change(rng, a)} for change in changes))

    return inputs


def _summed(base: Inputs, *names: str) -> Inputs:
    """Three runs that differ in some arguments; those of the third are the sums of the others'."""

    def inputs(rng: Rng) -> Arrays:
        a, b = base(rng), base(rng)
        return _runs(
            a,
            {**a, **{name: b[name] for name in names}},
            {**a, **{name: a[name] + b[name] for name in names}},
        )

    return inputs


def _times(*names: str, factor: float = FACTOR) -> Change:
    """Change: some arguments times a factor."""
    return lambda rng, a: {name: factor * a[name] for name in names}


# --- judges ------------------------------------------------------------------------------------------------


def _size(array: Any) -> np.ndarray:
    """Euclidean norm of each sample, (b,)."""
    flat = np.asarray(array, dtype=np.float64).reshape(len(array), -1)
    return np.sqrt(np.sum(flat * flat, axis=1))


def _error(difference: np.ndarray, scale: Any) -> np.ndarray:
    """Size of a difference relative to a scale (one number, or one per sample)."""
    size = _size(difference)
    return np.where(size > 0, size / np.where(scale > 0, scale, np.finfo(float).tiny), 0.0)


def _follows(task: str, expected: Callable[..., np.ndarray], runs: int = 2) -> Judge:
    """The last run gives what the results of the earlier ones say it must."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        *given, last = _split(out[0], runs)
        right = expected(*given)
        scale = sum(natural_scale(task, right, _run(a, k, runs)) for k in range(runs))
        return _error(last - right, scale)

    return error


def _vanishes(
    task: str,
    rest: Callable[..., np.ndarray],
    scale: Callable[[Given], Any] = lambda a: 1.0,
) -> Judge:
    """`rest(inputs, *outputs)` is zero, measured against the natural scale of the result times `scale`."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        return _error(rest(a, *out), natural_scale(task, out[0], a) * scale(a))

    return error


def _sweep(
    slope: np.ndarray, f: Callable[[float], np.ndarray], scale: Any, steps: tuple[float, ...]
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


def _points(inputs: Given, letter: str) -> np.ndarray:
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


def _undeformed(rng: Rng) -> Arrays:
    return _corners("X", _triangles(rng))


def _deformed(rng: Rng) -> Arrays:
    return _corners("x", _triangles(rng))


def _point(rng: Rng) -> Arrays:
    """Points in and around triangles, above and below their plane."""
    X = _triangles(rng)
    above = _between(rng, -0.5, 0.5, len(X)) * _longest(X)
    return {"X": _apply(_T(X), _weights(rng, len(X))) + above[:, None] * _normal(X), **_corners("X", X)}


def _raised(rng: Rng, a: Arrays) -> Arrays:
    """Change: the point moves along the normal."""
    X = _points(a, "X")
    return {"X": a["X"] + (_between(rng, 0.2, 1, len(X)) * _longest(X))[:, None] * _normal(X)}


def _turned(*names: str) -> Change:
    """Change: some vectors turned by Q."""
    return lambda rng, a: {name: _apply(Q, a[name]) for name in names}


def _moved(*names: str) -> Change:
    """Change: points moved by a few sizes of their triangle (the last three names)."""

    def change(rng: Rng, a: Arrays) -> Arrays:
        size = _longest(np.stack([a[name] for name in names[-3:]], axis=1))
        t = 2 * size[:, None] * _vectors(rng, len(size))
        return {name: a[name] + t for name in names}

    return change


def _rigidly(*names: str) -> Change:
    """Change: points turned and moved together."""
    return lambda rng, a: _moved(*names)(rng, _turned(*names)(rng, a))


def _renumbered(*names: str) -> Change:
    """Change: vertex 1 is called 0, 2 is called 1, 0 is called 2."""
    return lambda rng, a: {name: a[other] for name, other in zip(names, names[1:] + names[:1], strict=True)}


def _phi_at_vertices(rng: Rng) -> Arrays:
    a = _undeformed(rng)
    return _runs(*({"X": a[f"X{i}"], **a} for i in range(3)))


def _nearest(a: Given, phi: np.ndarray) -> np.ndarray:
    """Sum of phi_i X_i, less the nearest point of the plane, seen from X0."""
    X, d = _points(a, "X"), a["X"] - a["X0"]
    N = _normal(X)
    return _apply(_T(X - X[:, :1]), phi) - (d - _dot(N, d)[:, None] * N)


_PHI = (
    Property(
        "partition of unity",
        "The three shape functions must sum to one at every point.",
        _point,
        _vanishes("phi", lambda a, phi: phi.sum(axis=1) - 1),
    ),
    Property(
        "Kronecker delta at the vertices",
        "At a vertex its own shape function must be one and the other two zero.",
        _phi_at_vertices,
        _vanishes("phi", lambda a, phi: phi - np.repeat(I, len(LIES), axis=0)),
    ),
    Property(
        "linear functions are reproduced",
        "The vertices, weighted with the shape functions, must give the point's nearest point in the plane.",
        _point,
        _vanishes("phi", _nearest, lambda a: _longest(_points(a, "X"))),
    ),
    Property(
        "blind to an offset along the normal",
        "Moving the point along the normal of the triangle must not change its shape functions.",
        _again(_point, _raised),
        _follows("phi", lambda phi: phi),
    ),
    Property(
        "rigid motion changes nothing",
        "Turning and moving the point together with its triangle must not change its shape functions.",
        _again(_point, _rigidly("X", "X0", "X1", "X2")),
        _follows("phi", lambda phi: phi),
    ),
    Property(
        "no vertex is special",
        "Renumbering the vertices must renumber the shape functions in the same way.",
        _again(_point, _renumbered("X0", "X1", "X2")),
        _follows("phi", lambda phi: np.roll(phi, -1, axis=1)),
    ),
)


def _linear_exact(a: Given, G: np.ndarray) -> np.ndarray:
    """Sum of X_i grad_i^T, less I - N N^T; X_i seen from their middle."""
    X = _points(a, "X")
    N = _normal(X)
    return _mul(_T(X - X.mean(axis=1, keepdims=True)), G) - (I - _outer(N, N))


_DPHI_DX = (
    Property(
        "rows sum to zero",
        "The shape functions sum to one everywhere, so their gradients, the rows, must sum to zero.",
        _undeformed,
        _vanishes("dphi_dX", lambda a, G: G.sum(axis=1)),
    ),
    Property(
        "rows lie in the plane",
        "Every row must be orthogonal to the normal N of the triangle.",
        _undeformed,
        _vanishes("dphi_dX", lambda a, G: _apply(G, _normal(_points(a, "X")))),
    ),
    Property(
        "exact on linear functions",
        "The sum of X_i times row i must be I - N N^T: a linear function has its own gradient.",
        _undeformed,
        _vanishes("dphi_dX", _linear_exact, lambda a: _longest(_points(a, "X"))),
    ),
    Property(
        "shrinks as the triangle grows",
        "A triangle larger by a factor must have gradients smaller by that factor.",
        _again(_undeformed, _times("X0", "X1", "X2")),
        _follows("dphi_dX", lambda G: G / FACTOR),
    ),
    Property(
        "turns with the triangle",
        "Turning the triangle must turn every row with it.",
        _again(_undeformed, _turned("X0", "X1", "X2")),
        _follows("dphi_dX", lambda G: _mul(G, Q.T)),
    ),
    Property(
        "translation changes nothing",
        "Moving the triangle must not change the gradients.",
        _again(_undeformed, _moved("X0", "X1", "X2")),
        _follows("dphi_dX", lambda G: G),
    ),
)


def _weighted(rng: Rng) -> Arrays:
    return {"phi": _weights(rng, len(LIES)), **_deformed(rng)}


def _weighted_vertices(rng: Rng) -> Arrays:
    x = _deformed(rng)
    return _runs(*({"phi": np.tile(I[i], (len(LIES), 1)), **x} for i in range(3)))


_INTERPOLATE = (
    Property(
        "vertices",
        "Where one shape function is one and the others are zero, the point must be that vertex.",
        _weighted_vertices,
        _vanishes("interpolate", lambda a, x: x - _apply(_T(_points(a, "x")), a["phi"])),
    ),
    Property(
        "linear in the vertices",
        "x(X) = N(X) q is linear in q: the sum of two sets of vertices must give the sum of the points.",
        _summed(_weighted, "x0", "x1", "x2"),
        _follows("interpolate", lambda x, y: x + y, runs=3),
    ),
    Property(
        "straight lines stay straight",
        "Halfway between two points the shape functions are halfway, and so must be the interpolated point.",
        _again(
            _weighted,
            lambda rng, a: {"phi": np.roll(a["phi"], 1, axis=1)},
            lambda rng, a: {"phi": (a["phi"] + np.roll(a["phi"], 1, axis=1)) / 2},
        ),
        _follows("interpolate", lambda x, y: (x + y) / 2, runs=3),
    ),
    Property(
        "follows affine maps",
        "Stretching, shearing and moving all three vertices must do the same to the point.",
        _again(
            _weighted,
            lambda rng, a: {name: _apply(STRAIN, a[name]) + OMEGA for name in ("x0", "x1", "x2")},
        ),
        _follows("interpolate", lambda x: _apply(STRAIN, x) + OMEGA),
    ),
)


# --- S3: deformation gradient ------------------------------------------------------------------------------


def _carried(rng: Rng) -> Arrays:
    """Deformed triangles, with the shape gradients and normals of undeformed ones."""
    X = _triangles(rng)
    return {**_deformed(rng), "dphi_dX": _gradients(X), "N": _normal(X)}


def _mapped(A: np.ndarray) -> Inputs:
    """Triangles deformed by x = A X + t."""

    def inputs(rng: Rng) -> Arrays:
        X = _triangles(rng)
        x = _moved("x0", "x1", "x2")(rng, _corners("x", _apply(A, X)))
        return {**x, "dphi_dX": _gradients(X), "N": _normal(X)}

    return inputs


def _plane(a: Given, F: np.ndarray) -> np.ndarray:
    """F on the undeformed plane."""
    return F - _outer(_apply(F, a["N"]), a["N"])


_DEFORMATION_GRADIENT = (
    Property(
        "rigid motion gives its rotation",
        "A triangle that is only turned and moved must have that rotation as its F.",
        _mapped(Q),
        _vanishes("deformation_gradient", lambda a, F: F - Q),
    ),
    Property(
        "an affine map is its own gradient",
        "Under x = A X + t, F must do to every vector in the plane of the triangle what A does.",
        _mapped(STRAIN),
        _vanishes("deformation_gradient", lambda a, F: _plane(a, F - STRAIN)),
    ),
    Property(
        "the normal goes to the normal",
        "F N must be the unit normal n of the deformed triangle.",
        _carried,
        _vanishes("deformation_gradient", lambda a, F: _apply(F, a["N"]) - _normal(_points(a, "x"))),
    ),
    Property(
        "rotation equivariance",
        "Turning the deformed triangle, x -> Q x, must turn its deformation gradient: F -> Q F.",
        _again(_carried, _turned("x0", "x1", "x2")),
        _follows("deformation_gradient", lambda F: _mul(Q, F)),
    ),
    Property(
        "translation changes nothing",
        "Moving the deformed triangle must not change F.",
        _again(_carried, _moved("x0", "x1", "x2")),
        _follows("deformation_gradient", lambda F: F),
    ),
)


def _each_vertex(*changes: Change) -> Inputs:
    """Deformed triangles with i = 0, 1 and 2 one after another; and the same again, changed."""

    def inputs(rng: Rng) -> Arrays:
        x = _deformed(rng)
        return _runs(*({**x, "i": np.full(len(LIES), i, dtype=np.int32)} for i in range(3)))

    return _again(inputs, *changes)


def _all_vertices(
    rest: Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray],
    scale: Callable[[np.ndarray], Any] = lambda x: 1.0,
) -> Judge:
    """`rest(x, n, dn)` of the three derivatives together, dn (3, b, 3, 3), is zero."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        x, dn = _points(_run(a, 0, 3), "x"), _split(out[0], 3)
        x = x - x.mean(axis=1, keepdims=True)
        return _error(rest(x, _normal(x), dn), sum(_size(one) for one in dn) * scale(x))

    return error


def _normal_sweep(a: Given, out: Outputs) -> np.ndarray:
    """Columns of dn/dx_i against differences of n; steps are shares of the triangle's height."""
    x = _points(a, "x") - a["x0"][:, None]
    height = _height(x)[:, None]
    chosen = (a["i"][:, None] == np.arange(3))[..., None]
    return np.max(
        [
            _sweep(
                out[0][..., k] * height,
                lambda t, k=k: _normal(x + t * height[:, None] * chosen * I[k]),  # type: ignore[misc]
                1.0,
                (2.0**-3, 2.0**-5, 2.0**-7, 2.0**-9),
            )
            for k in range(3)
        ],
        axis=0,
    )


_DN_DX = (
    Property(
        "tangent to n",
        "n keeps its length, so no vertex can change it along itself: n^T dn/dx_i must be zero.",
        _each_vertex(),
        _vanishes("dn_dx", lambda a, dn: _apply(_T(dn), _normal(_points(a, "x")))),
    ),
    Property(
        "motions in the plane leave n alone",
        "Moving a vertex along an edge does not turn the triangle: dn/dx_i times an edge must be zero.",
        _each_vertex(),
        _vanishes(
            "dn_dx",
            lambda a, dn: _mul(dn, _T(_points(a, "x") - _points(a, "x")[:, [1, 2, 0]])),
            lambda a: _longest(_points(a, "x")),
        ),
    ),
    Property(
        "translation leaves n alone",
        "Moving all three vertices together does not turn the triangle: dn/dx_0 + dn/dx_1 + dn/dx_2 must be zero.",
        _each_vertex(),
        _all_vertices(lambda x, n, dn: dn.sum(axis=0)),
    ),
    Property(
        "rotation turns n with the triangle",
        "When the triangle spins with angular velocity w, n must change by w x n.",
        _each_vertex(),
        _all_vertices(
            lambda x, n, dn: (
                sum(_apply(dn[i], _cross(OMEGA[None], x[:, i])) for i in range(3)) - _cross(OMEGA[None], n)
            ),
            _longest,
        ),
    ),
    Property(
        "rotation equivariance",
        "Turning the triangle by Q must turn the derivative: dn/dx_i -> Q dn/dx_i Q^T.",
        _each_vertex(_turned("x0", "x1", "x2")),
        _follows("dn_dx", lambda dn: _mul(_mul(Q, dn), Q.T)),
    ),
    Property(
        "finite differences of the normal",
        "Moving vertex i by ever smaller steps, the change of n per step must approach dn/dx_i.",
        _each_vertex(),
        _normal_sweep,
    ),
)


# --- S4: kinetic energy and mass ---------------------------------------------------------------------------

#: All nine blocks, row by row.
BLOCKS = np.array([(i, j) for i in range(3) for j in range(3)], dtype=np.int32)


def _blocks(rng: Rng) -> Arrays:
    """The nine blocks of two triangles, block by block."""
    sheet = _sheet(rng, 2)
    return _runs(*({**sheet, "i": np.full(2, i, np.int32), "j": np.full(2, j, np.int32)} for i, j in BLOCKS))


def _block_matrix(rest: Callable[[np.ndarray], np.ndarray]) -> Judge:
    """`rest` of the matrices of all nine blocks, (b, 3, 3), in parts of rho h a, is zero."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        blocks = (out[0] / (a["rho"] * a["h"] * a["area"])).reshape(3, 3, -1)
        m = np.moveaxis(blocks, -1, 0)
        return _error(rest(m), 1 + _size(m))

    return error


_MASS_BLOCK = (
    Property(
        "all nine blocks weigh the triangle",
        "The shape functions sum to one, so all nine blocks together must be rho h area.",
        _blocks,
        _block_matrix(lambda m: m.sum(axis=(1, 2)) - 1),
    ),
    Property(
        "symmetric",
        "Block (i, j) must be block (j, i).",
        _blocks,
        _block_matrix(lambda m: m - _T(m)),
    ),
    Property(
        "no vertex is special",
        "The three blocks on the diagonal must be alike, and so must the six off it.",
        _blocks,
        _block_matrix(lambda m: m - np.roll(m, 1, axis=(1, 2))),
    ),
    Property(
        "diagonal twice the rest",
        "The integral of phi_i phi_i over a triangle must be twice that of phi_i phi_j.",
        _blocks,
        _block_matrix(lambda m: m[:, [0, 1, 2], [0, 1, 2]] - 2 * m[:, [0, 1, 2], [1, 2, 0]]),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must weigh twice as much.",
            _again(_blocks, _times(name)),
            _follows("mass_block", lambda m: FACTOR * m),
        )
        for name in ("area", "rho", "h")
    ),
)


def _moving(rng: Rng, count: int = 8) -> Arrays:
    return {**{f"v{i}": _vectors(rng, count, 5) for i in range(3)}, **_sheet(rng, count)}


def _together(rng: Rng) -> Arrays:
    a = _moving(rng)
    return {**a, "v1": a["v0"], "v2": a["v0"]}


def _alone(i: int) -> Change:
    """Change: only vertex i moves."""
    return lambda rng, a: {f"v{k}": a[f"v{k}"] * float(k == i) for k in range(3)}


_KINETIC_ENERGY = (
    Property(
        "uniform velocity",
        "When all three vertices move with v, the energy must be rho h area |v|^2 / 2.",
        _together,
        _vanishes(
            "kinetic_energy", lambda a, T: T - a["rho"] * a["h"] * a["area"] * _dot(a["v0"], a["v0"]) / 2
        ),
    ),
    *(
        Property(
            f"vertex {i} alone",
            f"Vertex {i} moving alone must have a sixth of the energy of all three moving like it.",
            _again(_together, _alone(i)),
            _follows("kinetic_energy", lambda T: T / 6),
        )
        for i in range(3)
    ),
    Property(
        "never negative",
        "Kinetic energy is never negative.",
        lambda rng: _moving(rng, 24),
        _vanishes("kinetic_energy", lambda a, T: np.minimum(T, 0)),
    ),
    Property(
        "quadratic in the velocities",
        "All velocities times a factor, of either sign, must give the energy times its square.",
        _again(_moving, _times("v0", "v1", "v2", factor=-FACTOR)),
        _follows("kinetic_energy", lambda T: FACTOR**2 * T),
    ),
    Property(
        "no vertex is special",
        "Renumbering the vertices must not change the energy.",
        _again(_moving, _renumbered("v0", "v1", "v2")),
        _follows("kinetic_energy", lambda T: T),
    ),
    Property(
        "rotation changes nothing",
        "Turning all three velocities must not change the energy.",
        _again(_moving, _turned("v0", "v1", "v2")),
        _follows("kinetic_energy", lambda T: T),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must give twice the energy.",
            _again(_moving, _times(name)),
            _follows("kinetic_energy", lambda T: FACTOR * T),
        )
        for name in ("area", "rho", "h")
    ),
)


# --- S5: principal stretches -------------------------------------------------------------------------------


def _cloth_gradients(rng: Rng) -> Arrays:
    """F of stretched cloth, and any other."""
    stretched = _mul(_mul(_rotations(rng, 8), _diag(_stretches(rng, 8))), _T(_rotations(rng, 8)))
    return {"F": np.concatenate([stretched, 2 * _matrices(rng, 4)])}


def _rotation_only(rng: Rng) -> Arrays:
    return {"F": np.concatenate([_rotations(rng, 4), I[None]])}


_RIGHT_CAUCHY_GREEN = (
    Property(
        "symmetric",
        "|dx|^2 = dX^T C dX: C must be symmetric.",
        _cloth_gradients,
        _vanishes("right_cauchy_green", lambda a, C: C - _T(C)),
    ),
    Property(
        "a rotation strains nothing",
        "If F is a rotation, C must be the identity.",
        _rotation_only,
        _vanishes("right_cauchy_green", lambda a, C: C - I),
    ),
    Property(
        "blind to a rotation after the deformation",
        "Turning the deformed cloth, F -> R F, must not change C.",
        _again(_cloth_gradients, lambda rng, a: {"F": _mul(Q, a["F"])}),
        _follows("right_cauchy_green", lambda C: C),
    ),
    Property(
        "turns with the undeformed cloth",
        "Turning the undeformed cloth, F -> F R^T, must turn C: C -> R C R^T.",
        _again(_cloth_gradients, lambda rng, a: {"F": _mul(a["F"], Q.T)}),
        _follows("right_cauchy_green", lambda C: _mul(_mul(Q, C), Q.T)),
    ),
    Property(
        "trace",
        "The trace of C must be the sum of the squares of all entries of F.",
        _cloth_gradients,
        _vanishes("right_cauchy_green", lambda a, C: np.trace(C, axis1=1, axis2=2) - _size(a["F"]) ** 2),
    ),
    Property(
        "determinant",
        "The determinant of C must be the square of that of F.",
        _cloth_gradients,
        _vanishes(
            "right_cauchy_green", lambda a, C: _det(C) - _det(a["F"]) ** 2, lambda a: 1 + _size(a["F"]) ** 4
        ),
    ),
)


# --- S6: strain energy -------------------------------------------------------------------------------------

AT_REST = np.ones(3)


def _energy(s: np.ndarray, mu: np.ndarray, lam: np.ndarray) -> np.ndarray:
    """psi, as its docstring has it in the student's file: what a Taylor sweep takes differences of."""
    return mu * ((s[:, 0] - 1) ** 2 + (s[:, 1] - 1) ** 2) + lam / 2 * (s[:, 0] + s[:, 1] - 2) ** 2


def _exchanged(rng: Rng, a: Arrays) -> Arrays:
    """Change: s_0 and s_1 trade places."""
    return {"s": a["s"][:, [1, 0, 2]]}


def _other_normal(rng: Rng, a: Arrays) -> Arrays:
    """Change: another third stretch."""
    return {"s": a["s"] * np.array([1, 1, 0]) + _between(rng, 0.4, 1.8, len(a["s"]), 1) * np.array([0, 0, 1])}


def _slightly_strained(rng: Rng) -> Arrays:
    return {**_material(rng, 8), "s": AT_REST + _between(rng, -0.3, 0.3, 8, 3) * np.array([1, 1, 0])}


def _strained(factor: float) -> Change:
    """Change: the strain s - 1 times a factor."""
    return lambda rng, a: {"s": AT_REST + factor * (a["s"] - AT_REST)}


def _other_stretches(rng: Rng, a: Arrays) -> Arrays:
    return {"s": _stretches(rng, len(a["s"]))}


def _relaxed(rng: Rng) -> Arrays:
    return {**_material(rng, 8), "s": np.ones((8, 3))}


def _strip(rng: Rng) -> Arrays:
    """One stretch away from 1, now the first, now the second."""
    away = np.where(np.arange(8)[:, None] % 2 == 0, I[0], I[1])
    return {**_material(rng, 8), "s": AT_REST + _between(rng, -0.8, 1.5, 8, 1) * away}


def _balanced(rng: Rng) -> Arrays:
    """One stretch as far above 1 as the other is below."""
    d = _between(rng, 0.1, 0.8, 8, 1) * np.array([1, -1, 0])
    return {**_material(rng, 8), "s": AT_REST + d}


def _materials_add(task: str) -> Property:
    return Property(
        "linear in mu and lam",
        "Two materials together, mu and lam added, must give the sum of both.",
        _summed(_state, "mu", "lam"),
        _follows(task, lambda one, other: one + other, runs=3),
    )


def _third_stretch(task: str) -> Property:
    return Property(
        "the normal's stretch does not count",
        "Only the two stretches in the plane store energy: the third, s_2, must not matter.",
        _again(_state, _other_normal),
        _follows(task, lambda result: result),
        cause="third stretch",
    )


_PSI = (
    Property(
        "no energy at rest",
        "At s = (1, 1, 1) the energy must be zero.",
        _relaxed,
        _vanishes("psi", lambda a, psi: psi),
    ),
    Property(
        "never negative",
        "Deforming the cloth in any way costs energy: psi must never be negative.",
        lambda rng: _state(rng, 24),
        _vanishes("psi", lambda a, psi: np.minimum(psi, 0)),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must not change the energy.",
        _again(_state, _exchanged),
        _follows("psi", lambda psi: psi),
    ),
    _third_stretch("psi"),
    _materials_add("psi"),
    Property(
        "quadratic in the strain",
        "Three times the strain s - 1, of either sign, must cost nine times the energy.",
        _again(_slightly_strained, _strained(-3.0)),
        _follows("psi", lambda psi: 9 * psi),
    ),
    Property(
        "one stretch alone",
        "Stretching in one direction only, s = (1 + d, 1), must cost (mu + lam/2) d^2.",
        _strip,
        _vanishes("psi", lambda a, psi: psi - (a["mu"] + a["lam"] / 2) * _dot(a["s"] - 1, a["s"] - 1)),
    ),
    Property(
        "lam feels only the change of area",
        "Where s_0 + s_1 = 2 the area does not change (to first order), and lam must not matter.",
        _again(_balanced, _times("lam")),
        _follows("psi", lambda psi: psi),
    ),
)


def _gradient_sweep(a: Given, out: Outputs) -> np.ndarray:
    """Components of dpsi/ds against differences of psi."""
    s, mu, lam = a["s"], a["mu"], a["lam"]
    errors = [
        _sweep(
            out[0][:, k],
            lambda t, k=k: _energy(s + t * I[k], mu, lam),  # type: ignore[misc]
            (2 * mu + lam) * (1 + _size(s)),
            (2.0**-1, 2.0**-3, 2.0**-5, 2.0**-7),
        )
        for k in range(3)
    ]
    return np.max(errors, axis=0)


_DPSI_DS = (
    Property(
        "no stress at rest",
        "At s = (1, 1, 1) the energy is least, so its gradient must be zero.",
        _relaxed,
        _vanishes("dpsi_ds", lambda a, p: p),
    ),
    Property(
        "third entry zero",
        "psi does not depend on s_2, so the third entry must be zero.",
        _state,
        _vanishes("dpsi_ds", lambda a, p: p[:, 2]),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must exchange the first two entries.",
        _again(_state, _exchanged),
        _follows("dpsi_ds", lambda p: p[:, [1, 0, 2]]),
    ),
    _third_stretch("dpsi_ds"),
    _materials_add("dpsi_ds"),
    Property(
        "linear in the strain",
        "Minus three times the strain s - 1 must give minus three times the gradient.",
        _again(_slightly_strained, _strained(-3.0)),
        _follows("dpsi_ds", lambda p: -3 * p),
    ),
    Property(
        "Taylor sweep of psi",
        "Changing one stretch by ever smaller steps, the change of psi per step must approach your gradient.",
        _state,
        _gradient_sweep,
    ),
)


def _hessian_sweep(a: Given, out: Outputs) -> np.ndarray:
    """Entries of d2psi/ds2 against differences of differences of psi."""
    s, mu, lam = a["s"], a["mu"], a["lam"]

    def slope(j: int, t: float, k: int) -> np.ndarray:
        return (_energy(s + t * I[k] + I[j], mu, lam) - _energy(s + t * I[k] - I[j], mu, lam)) / 2

    errors = [
        _sweep(
            out[0][:, j, k],
            lambda t, j=j, k=k: slope(j, t, k),  # type: ignore[misc]
            (2 * mu + lam) * (1 + _size(s)),
            (2.0**-1, 2.0**-3, 2.0**-5),
        )
        for j in range(3)
        for k in range(3)
    ]
    return np.max(errors, axis=0)


def _negative_part(a: Given, H: np.ndarray) -> np.ndarray:
    """Smallest eigenvalue of the in-plane block, where it is negative."""
    a00, a11, a01 = H[:, 0, 0], H[:, 1, 1], (H[:, 0, 1] + H[:, 1, 0]) / 2
    return np.minimum((a00 + a11) / 2 - np.hypot((a00 - a11) / 2, a01), 0)


_D2PSI_DS2 = (
    Property(
        "symmetric",
        "Second derivatives do not care about their order: the matrix must be symmetric.",
        _state,
        _vanishes("d2psi_ds2", lambda a, H: H - _T(H)),
    ),
    Property(
        "third row and column zero",
        "psi does not depend on s_2, so the third row and column must be zero.",
        _state,
        _vanishes("d2psi_ds2", lambda a, H: np.concatenate([H[:, 2], H[:, :, 2]], axis=1)),
    ),
    Property(
        "the same everywhere",
        "psi is quadratic, so its Hessian must not depend on the stretches.",
        _again(_state, _other_stretches),
        _follows("d2psi_ds2", lambda H: H),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must exchange the first two rows and columns.",
        _again(_state, _exchanged),
        _follows("d2psi_ds2", lambda H: H[:, [1, 0, 2]][:, :, [1, 0, 2]]),
    ),
    _materials_add("d2psi_ds2"),
    Property(
        "positive semi-definite",
        "At rest psi is least: with mu > 0 and lam >= 0 no eigenvalue may be negative.",
        _state,
        _vanishes("d2psi_ds2", _negative_part),
    ),
    Property(
        "Taylor sweep of psi",
        "Differences of the gradient over ever smaller steps must approach your second derivatives.",
        _state,
        _hessian_sweep,
    ),
)


# --- S7: stress and forces ---------------------------------------------------------------------------------


def _reversed(*names: str) -> Change:
    """Change: two principal directions reversed, the same in every matrix."""

    def change(rng: Rng, a: Arrays) -> Arrays:
        signs = REVERSED[np.arange(len(a[names[0]])) % len(REVERSED)]
        return {name: a[name] * signs[:, None, :] for name in names}

    return change


def _left(*names: str) -> Change:
    """Change: matrices turned, A -> Q A."""
    return lambda rng, a: {name: _mul(Q, a[name]) for name in names}


def _rotated_back(a: Given, P: np.ndarray) -> np.ndarray:
    return _mul(_mul(_T(a["U"]), P), a["V"]) - _diag(a["dpsi_ds"])


_DPSI_DF = (
    Property(
        "linear in dpsi_ds",
        "The sum of two gradients in the stretches must give the sum of the stresses.",
        _summed(_stress, "dpsi_ds"),
        _follows("dpsi_dF", lambda one, other: one + other, runs=3),
    ),
    Property(
        "principal directions",
        "Seen along the principal directions, U^T P V, the stress must be diagonal and hold dpsi_ds.",
        _stress,
        _vanishes("dpsi_dF", _rotated_back),
    ),
    Property(
        "turns with the deformed cloth",
        "Turning the deformed cloth, U -> R U, must turn the stress: P -> R P.",
        _again(_stress, _left("U")),
        _follows("dpsi_dF", lambda P: _mul(Q, P)),
    ),
    Property(
        "turns with the undeformed cloth",
        "Turning the undeformed cloth, V -> R V, must turn the stress: P -> P R^T.",
        _again(_stress, _left("V")),
        _follows("dpsi_dF", lambda P: _mul(P, Q.T)),
    ),
    Property(
        "signs of the principal directions",
        "Reversing the same two columns of U and V is the same F: the stress must not change.",
        _again(_stress, _reversed("U", "V")),
        _follows("dpsi_dF", lambda P: P),
    ),
)


def _pulled(rng: Rng) -> Arrays:
    """One vertex of triangles under stress."""
    G = _gradients(_triangles(rng))
    sheet = _sheet(rng, len(G))
    return {"P": _P(rng), "grad_phi": G[:, 1], "area": sheet["area"], "h": sheet["h"]}


def _P(rng: Rng, count: int = len(LIES)) -> np.ndarray:
    return _matrices(rng, count) * _binades(rng, 7, 16, count)[:, None, None]


def _three_pulled(rng: Rng) -> Arrays:
    """All three vertices, one after another."""
    G, sheet, P = _gradients(_triangles(rng)), _sheet(rng, len(LIES)), _P(rng)
    return _runs(*({"P": P, "grad_phi": G[:, i], "area": sheet["area"], "h": sheet["h"]} for i in range(3)))


def _force_scale(a: Given) -> np.ndarray:
    return a["h"] * a["area"] * _size(a["P"]) * _size(a["grad_phi"])


def _power(a: Given, f: np.ndarray) -> np.ndarray:
    """Power of the force on a vertex that moves with each unit vector, plus the rate of the stored energy."""
    rates = [(a["P"] * _outer(v[None], a["grad_phi"])).sum(axis=(1, 2)) for v in I]
    return f + (a["h"] * a["area"])[:, None] * np.stack(rates, axis=1)


_NODAL_FORCE = (
    Property(
        "forces sum to zero",
        "The gradients of the three shape functions sum to zero, so the three forces must, too.",
        _three_pulled,
        lambda a, out: _error(_split(out[0], 3).sum(axis=0), _split(_force_scale(a), 3).sum(axis=0)),
    ),
    Property(
        "power",
        "When the vertex moves, the force must do the work that the triangle gives up.",
        _pulled,
        _vanishes("nodal_force", _power),
    ),
    Property(
        "turns with the stress",
        "Turning the stress, P -> R P, must turn the force.",
        _again(_pulled, _left("P")),
        _follows("nodal_force", lambda f: _apply(Q, f)),
    ),
    Property(
        "linear in P",
        "The sum of two stresses must pull with the sum of the forces.",
        _summed(_pulled, "P"),
        _follows("nodal_force", lambda one, other: one + other, runs=3),
    ),
    Property(
        "linear in grad_phi",
        "The sum of two gradients must give the sum of the forces.",
        _summed(_pulled, "grad_phi"),
        _follows("nodal_force", lambda one, other: one + other, runs=3),
    ),
    *(
        Property(
            f"linear in {name}",
            f"Twice the {name} must pull twice as hard.",
            _again(_pulled, _times(name)),
            _follows("nodal_force", lambda f: FACTOR * f),
        )
        for name in ("area", "h")
    ),
)


# --- S8: Hessian -------------------------------------------------------------------------------------------


def _rates(rng: Rng) -> Arrays:
    """Arguments of d2psi_dFij: any symmetric in-plane Hessian, any derivatives of U, s and V."""
    a = _stress(rng)
    H = _matrices(rng, 8) * np.outer([1, 1, 0], [1, 1, 0]) * _binades(rng, 7, 16, 8)[:, None, None]
    return {
        **a,
        "d2psi_ds2": H + _T(H),
        "dU": _matrices(rng, 8),
        "ds": _vectors(rng, 8),
        "dV": _matrices(rng, 8),
    }


def _only_stretching(rng: Rng) -> Arrays:
    a = _rates(rng)
    return {**a, "dU": 0 * a["dU"], "dV": 0 * a["dV"]}


def _product_sweep(a: Given, out: Outputs) -> np.ndarray:
    """The result against differences of U diag(p) V^T, each factor moving at its rate."""
    dp = _apply(a["d2psi_ds2"], a["ds"])

    def stress(t: float) -> np.ndarray:
        U, p, V = a["U"] + t * a["dU"], a["dpsi_ds"] + t * dp, a["V"] + t * a["dV"]
        return _mul(_mul(U, _diag(p)), _T(V))

    scale = natural_scale("d2psi_dFij", out[0], a)
    return _sweep(out[0], stress, scale, (2.0**-1, 2.0**-3, 2.0**-5, 2.0**-7))


_D2PSI_DFIJ = (
    Property(
        "linear in dU, ds and dV",
        "The sum of two sets of rates dU, ds, dV must give the sum of the results.",
        _summed(_rates, "dU", "ds", "dV"),
        _follows("d2psi_dFij", lambda one, other: one + other, runs=3),
    ),
    Property(
        "linear in the derivatives of psi",
        "The sum of two energies, dpsi_ds and d2psi_ds2 added, must give the sum of the results.",
        _summed(_rates, "dpsi_ds", "d2psi_ds2"),
        _follows("d2psi_dFij", lambda one, other: one + other, runs=3),
    ),
    Property(
        "stretching alone",
        "Where dU = dV = 0 only the middle factor changes: seen as U^T (..) V it is diagonal, by the chain rule.",
        _only_stretching,
        _vanishes(
            "d2psi_dFij",
            lambda a, dP: _mul(_mul(_T(a["U"]), dP), a["V"]) - _diag(_apply(a["d2psi_ds2"], a["ds"])),
        ),
    ),
    Property(
        "turns with the deformed cloth",
        "Turning the deformed cloth, U -> R U and dU -> R dU, must turn the result in the same way.",
        _again(_rates, _left("U", "dU")),
        _follows("d2psi_dFij", lambda dP: _mul(Q, dP)),
    ),
    Property(
        "turns with the undeformed cloth",
        "Turning the undeformed cloth, V -> R V and dV -> R dV, must turn the result by R^T from the right.",
        _again(_rates, _left("V", "dV")),
        _follows("d2psi_dFij", lambda dP: _mul(dP, Q.T)),
    ),
    Property(
        "signs of the principal directions",
        "Reversing the same two columns of U, V, dU and dV must not change the result.",
        _again(_rates, _reversed("U", "V", "dU", "dV")),
        _follows("d2psi_dFij", lambda dP: dP),
    ),
    Property(
        "Taylor sweep of dpsi_dF",
        "Differences of U diag(dpsi_ds) V^T over ever smaller steps must approach your result.",
        _rates,
        _product_sweep,
    ),
)


# Energies m sum (s_i - 1)^2 + g, where g depends on the sum or on the product of the stretches: k is its first
# derivative there, l its second. The first has the flip 2 m whatever g is, the second 2 m - k.
# Gaps are never between 0 and 2e-3 for the product: there the limit, which a right answer takes, is only near.


def _of_sum(s: np.ndarray, m: np.ndarray, k: np.ndarray, l: np.ndarray) -> Arrays:  # noqa: E741
    s0, s1, zero = s[:, 0], s[:, 1], np.zeros(len(s))
    p = [2 * m * (s0 - 1) + k, 2 * m * (s1 - 1) + k, zero]
    H = [[2 * m + l, l, zero], [l, 2 * m + l, zero], [zero, zero, zero]]
    return {"s": s, "dpsi_ds": np.stack(p, axis=-1), "d2psi_ds2": np.moveaxis(np.array(H), -1, 0)}


def _of_product(s: np.ndarray, m: np.ndarray, k: np.ndarray, l: np.ndarray) -> Arrays:  # noqa: E741
    s0, s1, zero = s[:, 0], s[:, 1], np.zeros(len(s))
    p = [2 * m * (s0 - 1) + k * s1, 2 * m * (s1 - 1) + k * s0, zero]
    coupling = k + l * (s0 * s1)
    H = [[2 * m + l * s1 * s1, coupling, zero], [coupling, 2 * m + l * s0 * s0, zero], [zero, zero, zero]]
    return {"s": s, "dpsi_ds": np.stack(p, axis=-1), "d2psi_ds2": np.moveaxis(np.array(H), -1, 0)}


#: Gaps s_0 - s_1 for the sum, of either sign, across every threshold; relative ones for the product.
GAPS = (0.0, 2.0**-30, -(2.0**-30), 2.0**-20, -(2.0**-20), 2.0**-10, -(2.0**-10), 2.0**-7, -(2.0**-2))
APART = (0.0, 0.01, -0.01, 0.03, -0.1, 0.3)


def _meeting(rng: Rng) -> Arrays:
    """Stretches that meet; every number is short enough in binary for p_0 - p_1 to be exact."""
    m, k, l = (_integers(rng, *span, 3) for span in ((1, 64), (-400, 400), (0, 200)))  # noqa: E741
    s1 = np.floor(_between(rng, 0.5, 2, 3) * 2.0**20) / 2.0**20
    return _runs(*(_of_sum(np.stack([s1 + gap, s1, np.ones(3)], axis=1), m, k, l) for gap in GAPS))


def _constant_area(rng: Rng) -> Arrays:
    """Stretches that meet while their product, so the area, stays what it is."""
    m, k, l = (_between(rng, *span, 3) for span in ((1, 60), (-40, 40), (0, 50)))  # noqa: E741
    a = np.concatenate(
        [[0.4], _between(rng, 0.4, 1.8, 2)]
    )  # the narrowest gaps always: nobody passes by luck
    runs = []
    for gap in APART:
        s0 = a * (1 + gap)
        s1 = a * a / s0 if gap else a
        runs.append(_of_product(np.stack([s0, s1, np.ones(3)], axis=1), m, k, l))
    return _runs(*runs)


def _equal(rng: Rng) -> Arrays:
    return _run(_constant_area(rng), 0, len(APART))


def _unstressed(rng: Rng) -> Arrays:
    m, l, zero = _between(rng, 1, 60, 4), _between(rng, 0, 50, 4), np.zeros(4)  # noqa: E741
    return _runs(*(energy(np.ones((4, 3)), m, zero, l) for energy in (_of_sum, _of_product)))


#: In-plane stretches of a cloth that collapses, to a line or to a point, or nearly.
COLLAPSED = np.array(
    [
        (0, 0), (0.5, 0), (0, 0.25), (2.0**-24, 0), (2.0**-24, 2.0**-24), (0.75, 2.0**-30),
        (2.0**-8, 0.5), (0.3125, 2.0**-14), (2.0**-18, 2.0**-12),
    ]
)  # fmt: skip

#: What the handout divides by at least.
FLOOR = 1e-6


def _collapsing(rng: Rng) -> Arrays:
    count = len(COLLAPSED)
    m, k, l = (_integers(rng, *span, count) for span in ((1, 64), (-400, 400), (0, 200)))  # noqa: E741
    return _of_sum(np.concatenate([COLLAPSED, np.ones((count, 1))], axis=1), m, k, l)


def _beyond_the_floor(a: Given, out: Outputs) -> np.ndarray:
    """How far twist, out_0 and out_1 exceed what the floor allows, or above it miss the quotient; in parts of that."""
    s, p = a["s"], a["dpsi_ds"]
    s = np.stack([s[:, 0] + s[:, 1], s[:, 0], s[:, 1]], axis=1)
    p = np.stack([p[:, 0] + p[:, 1], p[:, 0], p[:, 1]], axis=1)
    most = np.stack([np.abs(p[:, 1]) + np.abs(p[:, 2]), np.abs(p[:, 1]), np.abs(p[:, 2])], axis=1)
    got = out[0][:, 1:]
    excess = np.maximum(np.abs(got) * FLOOR - most, 0)
    return _error(np.where(s < FLOOR, excess, np.abs(got * s - p)), _size(most))


def _jump(a: Given, out: Outputs) -> np.ndarray:
    """How far flip at each gap is from flip at none."""
    flip = _split(out[0][:, 0], len(APART))
    scale = _split(natural_scale("eigensystem", out[0], a), len(APART))
    return _error(np.moveaxis(flip - flip[0], 0, 1), scale.max(axis=0))


def _outside(a: Given, out: np.ndarray) -> np.ndarray:
    """How far twist lies outside the interval from out_0 to out_1."""
    twist, low, high = out[:, 1], out[:, 2:].min(axis=1), out[:, 2:].max(axis=1)
    return np.maximum(np.maximum(low - twist, twist - high), 0)


_EIGENSYSTEM = (
    Property(
        "flip through equal stretches",
        "For the energy of this assignment flip is 2 mu, however near the two stretches come, equal ones included.",
        _meeting,
        _vanishes(
            "eigensystem", lambda a, out: out[:, 0] - (a["d2psi_ds2"][:, 0, 0] - a["d2psi_ds2"][:, 0, 1])
        ),
    ),
    Property(
        "flip is continuous",
        "Let the stretches of a material that resists changes of area meet: flip must not jump.",
        _constant_area,
        _jump,
    ),
    Property(
        "exchanging s_0 and s_1",
        "Exchanging s_0 and s_1 with their derivatives must exchange out_0 and out_1 and nothing else.",
        _again(
            _constant_area,
            lambda rng, a: {
                "s": a["s"][:, [1, 0, 2]],
                "dpsi_ds": a["dpsi_ds"][:, [1, 0, 2]],
                "d2psi_ds2": a["d2psi_ds2"][:, [1, 0, 2]][:, :, [1, 0, 2]],
            },
        ),
        _follows("eigensystem", lambda out: out[:, [0, 1, 3, 2]]),
    ),
    Property(
        "linear in the derivatives of psi",
        "dpsi_ds and d2psi_ds2 times a factor, of either sign, must give all four values times that factor.",
        _again(_constant_area, _times("dpsi_ds", "d2psi_ds2", factor=-FACTOR)),
        _follows("eigensystem", lambda out: -FACTOR * out),
    ),
    Property(
        "at rest only flip is left",
        "At rest there is no stress: twist, out_0 and out_1 must be zero.",
        _unstressed,
        _vanishes("eigensystem", lambda a, out: out[:, 1:]),
    ),
    Property(
        "at equal stretches three agree",
        "Where s_0 = s_1, twist, out_0 and out_1 must be the same.",
        _equal,
        _vanishes("eigensystem", lambda a, out: out[:, 1:] - out[:, [2, 3, 1]]),
    ),
    Property(
        "twist lies between out_0 and out_1",
        "A sum over a sum lies between the two quotients: twist must lie between out_0 and out_1.",
        _constant_area,
        _vanishes("eigensystem", _outside),
    ),
    Property(
        "stress over stretch",
        "With the same stress, stretches larger by a factor must give twist, out_0 and out_1 smaller by it.",
        _again(_constant_area, _times("s")),
        lambda a, out: _follows("eigensystem", lambda rest: rest / FACTOR)(a, (out[0][:, 1:],)),
    ),
    Property(
        "finite at collapse",
        "Where a stretch is below 1e-6 it must be divided by 1e-6, not by less; above, by the stretch itself.",
        _collapsing,
        _beyond_the_floor,
    ),
)


# --- S9: collision -----------------------------------------------------------------------------------------


def _ball(rng: Rng, count: int = 12) -> Arrays:
    """Points in and around spheres, none near the surface."""
    c, r = _vectors(rng, count, 3), _binades(rng, -5, 3, count)
    inside = np.arange(count) % 2 == 0
    share = np.where(inside, _between(rng, 0.2, 0.95, count), _between(rng, 1.05, 3, count))
    return {"x": c + (share * r)[:, None] * _directions(rng, count), "c": c, "r": r}


def _ball_and_centre(rng: Rng) -> Arrays:
    a = _ball(rng)
    return _runs(a, {**_run(a, 0, 6), "x": a["c"][:2], "c": a["c"][:2]})


def _carried_along(rng: Rng, a: Arrays) -> Arrays:
    """Change: vertex and centre move together."""
    t = _vectors(rng, len(a["r"]), 4)
    return {"x": a["x"] + t, "c": a["c"] + t}


def _skin(rng: Rng) -> Arrays:
    """Points one part in a million inside, and outside."""
    c, r, d = _vectors(rng, 8, 3), _binades(rng, -5, 3, 8), _directions(rng, 8)
    return _runs(*({"x": c + (r * share)[:, None] * d, "c": c, "r": r} for share in (1 - 1e-6, 1 + 1e-6)))


def _same_contact(turn: np.ndarray) -> Judge:
    """The second run gives the same hit, and the normal turned."""

    def error(a: Given, out: Outputs) -> np.ndarray:
        (hit, hit_again), (n, n_again) = _split(out[0], 2), _split(out[1], 2)
        return np.maximum(np.abs(1.0 * hit_again - hit), _error(n_again - _apply(turn, n), 1 + _size(n)))

    return error


_SPHERE_CONTACT = (
    Property(
        "unit normal",
        "The contact normal must have length one, at the centre as well.",
        _ball_and_centre,
        lambda a, out: np.abs(_size(out[1]) - 1),
    ),
    Property(
        "the normal points away from the centre",
        "The contact normal must point from the centre of the sphere to the vertex.",
        _ball,
        lambda a, out: _error(_unit(a["x"] - a["c"]) * _size(out[1])[:, None] - out[1], _size(out[1])),
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
        _again(_ball, _turned("x", "c")),
        _same_contact(Q),
    ),
    Property(
        "translation changes nothing",
        "Moving vertex and centre together must change neither the hit nor the normal.",
        _again(_ball, _carried_along),
        _same_contact(I),
    ),
    Property(
        "size changes nothing",
        "Vertex, centre and radius times a factor are the same picture: the same hit, the same normal.",
        _again(_ball, _times("x", "c", "r")),
        _same_contact(I),
    ),
)


def _bouncing(low: float, high: float) -> Inputs:
    """Velocities whose part along n, for each metre per second along the surface, is between low and high."""

    def inputs(rng: Rng) -> Arrays:
        R, speed = _rotations(rng, 8), _binades(rng, -4, 6, 8)[:, None]
        n, along = R[:, :, 0], R[:, :, 1]
        return {"v": speed * (along + _between(rng, low, high, 8, 1) * n), "n": n}

    return inputs


_any_way, _into, _away, _filtered = (
    _bouncing(low, high) for low, high in ((-2, 2), (-3, -0.1), (0.1, 3), (0, 0))
)


def _sliding(rng: Rng) -> Arrays:
    """Exactly along the surface: n is an axis, of either sign, and v has no part along it."""
    n = np.concatenate([I, -I])
    return {"v": _vectors(rng, 6, 5) * (1 - np.abs(n)), "n": n}


#: Velocities come back as they were, but for those who take them apart and put them together again.
UNTOUCHED = 1e-14

_FILTER_VELOCITY = (
    Property(
        "velocities away from the obstacle stay",
        "A vertex that moves away keeps its velocity.",
        _away,
        _vanishes("filter_velocity", lambda a, v: v - a["v"]),
        tolerance=UNTOUCHED,
    ),
    Property(
        "velocities along the obstacle stay",
        "A vertex that slides along the surface, n^T v = 0, keeps its velocity.",
        _sliding,
        _vanishes("filter_velocity", lambda a, v: v - a["v"]),
        tolerance=UNTOUCHED,
    ),
    Property(
        "filtering twice is filtering once",
        "What has been filtered already must come back as it is.",
        _filtered,
        _vanishes("filter_velocity", lambda a, v: v - a["v"]),
    ),
    Property(
        "nothing goes in",
        "After the filter no velocity may point into the obstacle: n^T v must not be negative.",
        _any_way,
        _vanishes("filter_velocity", lambda a, v: np.minimum(_dot(a["n"], v), 0)),
    ),
    Property(
        "nothing bounces",
        "A vertex that went into the obstacle must neither go on nor come back: n^T v must be zero.",
        _into,
        _vanishes("filter_velocity", lambda a, v: _dot(a["n"], v)),
    ),
    Property(
        "only the part along n changes",
        "The filter may take away something along n and nothing else: what it takes must be parallel to n.",
        _any_way,
        _vanishes("filter_velocity", lambda a, v: _cross(a["v"] - v, a["n"])),
    ),
    Property(
        "never gains energy",
        "The filtered velocity must not be longer than it was.",
        _any_way,
        _vanishes("filter_velocity", lambda a, v: np.maximum(_size(v) - _size(a["v"]), 0)),
    ),
    Property(
        "twice as fast",
        "A velocity times a positive factor must come out times that factor.",
        _again(_any_way, _times("v")),
        _follows("filter_velocity", lambda v: FACTOR * v),
    ),
    Property(
        "rotation equivariance",
        "Turning velocity and normal must turn the result.",
        _again(_any_way, _turned("v", "n")),
        _follows("filter_velocity", lambda v: _apply(Q, v)),
    ),
)


#: assignment -> task -> its properties.
PROPERTIES: Mapping[str, Mapping[str, tuple[Property, ...]]] = MappingProxyType(
    {
        "cloth": MappingProxyType(
            {
                "phi": _PHI,
                "dphi_dX": _DPHI_DX,
                "interpolate": _INTERPOLATE,
                "deformation_gradient": _DEFORMATION_GRADIENT,
                "dn_dx": _DN_DX,
                "mass_block": _MASS_BLOCK,
                "kinetic_energy": _KINETIC_ENERGY,
                "right_cauchy_green": _RIGHT_CAUCHY_GREEN,
                "psi": _PSI,
                "dpsi_ds": _DPSI_DS,
                "d2psi_ds2": _D2PSI_DS2,
                "dpsi_dF": _DPSI_DF,
                "nodal_force": _NODAL_FORCE,
                "d2psi_dFij": _D2PSI_DFIJ,
                "eigensystem": _EIGENSYSTEM,
                "sphere_contact": _SPHERE_CONTACT,
                "filter_velocity": _FILTER_VELOCITY,
            }
        )
    }
)
