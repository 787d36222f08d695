"""Mistakes known from students, task by task: what each makes of the right answer, and what to say of it.

A mistake is a small function of the inputs and the right answer (or of the right answer to other inputs), so
that no formula of a solution is written down here. `muslin.grading.diagnosis` tries them against what came. To
teach the grader a mistake, add a line to `KNOWN`; to say a general one better for one task, a line to `SAID`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np


class Case:
    """What a mistake is made of: the right answer, the truth for other inputs, and the arguments as attributes."""

    def __init__(self, right: np.ndarray, truth: Callable[..., np.ndarray], inputs: Mapping[str, np.ndarray]):
        self.right = right
        self.truth = truth
        self.__dict__.update(inputs)

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


@dataclass(frozen=True)
class Mistake:
    """One mistake: its words, and what it makes of the right answer (one array, or several to try)."""

    cause: str
    mistake: str
    advice: str
    makes: Callable[[Case], Any]
    result: int = 0


def transposed(matrix: np.ndarray) -> np.ndarray:
    """Each matrix transposed."""
    return np.swapaxes(matrix, 1, 2)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Each vector (or each row) made of length one."""
    return vectors / np.sqrt(np.sum(vectors**2, axis=-1, keepdims=True))


def norm(array: np.ndarray) -> np.ndarray:
    """Euclidean norm of each sample, (b,)."""
    return np.sqrt(np.sum(np.reshape(array, (len(array), -1)) ** 2, axis=1))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot product of each pair of vectors, as a column (b, 1)."""
    return np.sum(a * b, axis=1, keepdims=True)


def _outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return a[:, :, None] * b[:, None, :]


def _diag(p: np.ndarray) -> np.ndarray:
    return p[:, :, None] * np.eye(p.shape[1])


def _long(array: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """A number per case, (b,), ready to be multiplied with vectors or matrices."""
    return array.reshape(-1, *[1] * (vectors.ndim - 1))


def _edges(a: Case) -> tuple[np.ndarray, np.ndarray]:
    return a.X1 - a.X0, a.X2 - a.X0


def _completed(first: np.ndarray, second: np.ndarray, total: Any) -> np.ndarray:
    """Entries or rows 1 and 2, and a zeroth that makes the sum right."""
    return np.stack([total - first - second, first, second], axis=1)


def _replaced(array: np.ndarray, component: int, values: np.ndarray) -> np.ndarray:
    array = array.copy()
    array[:, component] = values
    return array


def _unsigned_areas(a: Case) -> np.ndarray:
    corners = (a.X0, a.X1, a.X2)
    shares = [norm(np.cross(corners[k - 2] - a.X, corners[k - 1] - a.X)) for k in range(3)]
    return np.stack(shares, axis=1) / norm(np.cross(*_edges(a)))[:, None]


def _phi_unit_edges(a: Case) -> np.ndarray:
    e, f = _edges(a)
    return _completed(norm(e) * a.right[:, 1], norm(f) * a.right[:, 2], 1)


def _phi_apart(a: Case) -> tuple[np.ndarray, ...]:
    d, (e, f) = a.X - a.X0, _edges(a)
    along = [(_dot(d, e)[:, 0] / norm(e) ** p, _dot(d, f)[:, 0] / norm(f) ** p) for p in (2, 1, 0)]
    return tuple(_completed(first, second, 1) for first, second in along)


def _gradients_apart(a: Case) -> tuple[np.ndarray, ...]:
    e, f = _edges(a)
    along = [(e / norm(e)[:, None] ** p, f / norm(f)[:, None] ** p) for p in (2, 1, 0)]
    return tuple(_completed(first, second, 0) for first, second in along)


def _opposite_edges(a: Case) -> np.ndarray:
    return (
        np.stack([a.X2 - a.X1, a.X0 - a.X2, a.X1 - a.X0], axis=1) / norm(np.cross(*_edges(a)))[:, None, None]
    )


def _gradients_unit_edges(a: Case) -> np.ndarray:
    e, f = _edges(a)
    return _completed(norm(e)[:, None] * a.right[:, 1], norm(f)[:, None] * a.right[:, 2], 0)


def _heights(a: Case) -> np.ndarray:
    """Gradients as long as the heights, not one over them."""
    return a.right / np.sum(a.right**2, axis=2, keepdims=True)


def _normal_part(a: Case) -> tuple[np.ndarray, np.ndarray]:
    """F without what carries N to n, and that part."""
    flat = a.truth(N=np.zeros_like(a.N))
    return flat, a.right - flat


def _m(a: Case) -> np.ndarray:
    """The deformed triangle's normal, twice as long as its area."""
    return np.cross(a.x1 - a.x0, a.x2 - a.x0)


def _carried(change: Callable[[Case, np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """F with what carries N to n changed."""

    def makes(a: Case) -> np.ndarray:
        flat, part = _normal_part(a)
        return flat + change(a, part)

    return makes


def _vertices_as_rows(a: Case) -> np.ndarray:
    _, part = _normal_part(a)
    return np.stack([a.x0, a.x1, a.x2], axis=1) @ a.dphi_dX + part


def _dm(a: Case) -> np.ndarray:
    """How the triangle's long normal changes with vertex i: it is linear in it, so differences are exact."""
    x = [a.x0 - a.x0, a.x1 - a.x0, a.x2 - a.x0]

    def m(k: int, step: int) -> np.ndarray:
        y = [p + np.where(a.i == v, step, 0)[:, None] * np.eye(3)[k] for v, p in enumerate(x)]
        return np.cross(y[1] - y[0], y[2] - y[0])

    return np.stack([(m(k, 1) - m(k, -1)) / 2 for k in range(3)], axis=2)


def _turned(project: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """The normal's derivative, projected in another way: project(dm, n n^T) / |m|."""

    def makes(a: Case) -> np.ndarray:
        n = unit(_m(a))
        return project(_dm(a), _outer(n, n)) / norm(_m(a))[:, None, None]

    return makes


def _mass(a: Case) -> np.ndarray:
    return a.area * a.rho * a.h


def _squares(a: Case) -> np.ndarray:
    """What the three vertices would have if they moved one at a time."""
    still = np.zeros_like(a.v0)
    alone = ({"v1": still, "v2": still}, {"v0": still, "v2": still}, {"v0": still, "v1": still})
    return sum(a.truth(**others) for others in alone)  # type: ignore[return-value]


def _mixed(count: float, times: float = 1) -> Callable[[Case], np.ndarray]:
    return lambda a: times * _squares(a) + count * (a.right - _squares(a))


def _without_pair(a: Case) -> tuple[np.ndarray, ...]:
    still = np.zeros_like(a.v0)
    two, one, other = {"v0": still}, {"v0": still, "v1": still}, {"v0": still, "v2": still}
    pairs = []
    for k in range(3):
        named = [
            {f"v{(int(name[1]) + k) % 3}": v for name, v in still_ones.items()}
            for still_ones in (two, one, other)
        ]
        pairs.append(a.truth(**named[0]) - a.truth(**named[1]) - a.truth(**named[2]))
    return tuple(a.right - pair for pair in pairs)


def _principal_root(a: Case) -> np.ndarray:
    squares, V = np.linalg.eigh(a.right)
    return V @ _diag(np.sqrt(squares)) @ transposed(V)


def _apart(a: Case) -> np.ndarray:
    """The lam term of each stretch alone: then lam only adds to mu."""
    return a.truth(mu=a.mu + a.lam / 2, lam=np.zeros_like(a.lam))


def _without_lam(a: Case) -> np.ndarray:
    return a.truth(lam=np.zeros_like(a.lam))


def _psi_third(a: Case) -> tuple[np.ndarray, ...]:
    t, plane = a.s[:, 2] - 1, a.s[:, 0] + a.s[:, 1] - 2
    more = a.lam / 2 * (2 * plane * t + t * t)
    return a.right + a.mu * t**2, a.right + more, a.right + a.mu * t**2 + more


def _dpsi_third(a: Case) -> tuple[np.ndarray, ...]:
    t = (a.s[:, 2] - 1)[:, None]
    total = np.sum(a.s, axis=1, keepdims=True) - 3
    third, mu, lam = np.array([0.0, 0.0, 1.0]), a.mu[:, None], a.lam[:, None]
    alone = a.right + 2 * mu * t * third
    return (
        alone,
        alone + lam * (t * (1 - third) + total * third),
        a.right + lam * total * third,
        alone + lam * t * third,
    )


def _area_psi(a: Case, power: int = 2) -> np.ndarray:
    return _without_lam(a) + a.lam / 2 * (a.s[:, 0] * a.s[:, 1] - 1) ** power


def _area_gradient(a: Case) -> np.ndarray:
    change = a.lam * (a.s[:, 0] * a.s[:, 1] - 1)
    return _without_lam(a) + change[:, None] * a.s[:, [1, 0, 2]] * np.array([1.0, 1.0, 0.0])


def _area_hessian(a: Case) -> np.ndarray:
    s0, s1, _ = a.s.T
    block = np.zeros((len(s0), 3, 3))
    block[:, 0, 0], block[:, 1, 1] = s1**2, s0**2
    block[:, 0, 1] = block[:, 1, 0] = 2 * s0 * s1 - 1
    return _without_lam(a) + a.lam[:, None, None] * block


def _third_row(a: Case) -> tuple[np.ndarray, ...]:
    corner = np.diag([0.0, 0.0, 1.0])
    border = 1 - np.diag([1.0, 1.0, 0.0]) - np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 0]])
    mu, lam = a.mu[:, None, None], a.lam[:, None, None]
    alone = a.right + 2 * mu * corner
    return alone, alone + lam * border, alone + lam * corner, a.right + corner


def _times_s(a: Case) -> tuple[np.ndarray, ...]:
    S = _diag(a.s)
    return S @ a.right, a.right @ S, S @ a.right @ S, a.right * S, a.right + a.right * (S - np.eye(3))


def _entrywise_chain(a: Case) -> tuple[np.ndarray, ...]:
    rest = a.truth(ds=np.zeros_like(a.ds))
    middles = (a.d2psi_ds2 * a.ds[:, None, :], a.d2psi_ds2 * a.ds[:, :, None])
    return tuple(rest + a.U @ middle @ transposed(a.V) for middle in middles)


def _without_limit(a: Case) -> tuple[np.ndarray, ...]:
    met = a.s[:, 0] == a.s[:, 1]
    return tuple(_replaced(a.right, 0, np.where(met, value, a.right[:, 0])) for value in (np.nan, 0.0))


def _flip_limit(combine: Callable[[np.ndarray], np.ndarray]) -> Callable[[Case], np.ndarray]:
    """Another limit where the stretches meet."""

    def makes(a: Case) -> np.ndarray:
        met = a.s[:, 0] == a.s[:, 1]
        return _replaced(a.right, 0, np.where(met, combine(a.d2psi_ds2), a.right[:, 0]))

    return makes


def _limit_always(a: Case) -> tuple[np.ndarray, ...]:
    H = a.d2psi_ds2
    limits = ((H[:, 0, 0] + H[:, 1, 1]) / 2 - H[:, 0, 1], H[:, 0, 0] - H[:, 0, 1], H[:, 1, 1] - H[:, 0, 1])
    return tuple(_replaced(a.right, 0, limit) for limit in limits)


def _outs(values: Callable[[Case, int], np.ndarray]) -> Callable[[Case], np.ndarray]:
    def makes(a: Case) -> np.ndarray:
        return _replaced(_replaced(a.right, 2, values(a, 0)), 3, values(a, 1))

    return makes


def _distance(a: Case) -> np.ndarray:
    return norm(a.x - a.c)


def _projected_always(a: Case) -> np.ndarray:
    return np.where(_dot(a.v, a.n) < 0, a.right, -a.truth(v=-a.v))


def _along_v(a: Case) -> tuple[np.ndarray, ...]:
    d = np.minimum(_dot(a.v, a.n), 0)
    speed = norm(a.v)[:, None]
    unit = np.where(speed > 0, a.v / np.where(speed > 0, speed, 1), 0)
    return a.v - d * a.v, a.v + d * a.v, a.v - d * unit, a.v + d * unit


_LEAD = "Write the derivation down once more; the handout takes it in small steps."

#: Mistakes of single tasks, the likelier first.
KNOWN: Mapping[str, tuple[Mistake, ...]] = {
    "phi": (
        Mistake(
            "missing:X0",
            "X0 is not subtracted from X: your phi is right only if vertex 0 is the origin.",
            "A triangle that is moved must keep its barycentric coordinates. Measure from a vertex.",
            lambda a: a.truth(X=a.X + a.X0),
        ),
        Mistake(
            "unsigned areas",
            "Your phi are shares of area without a sign: outside the triangle none of them is negative.",
            "Give each area a sign, positive if it turns the same way round as the triangle.",
            _unsigned_areas,
        ),
        Mistake(
            "edges apart",
            "The edges are treated one at a time, as if they were perpendicular.",
            "Two unknowns need both equations at once: a 2x2 system.",
            _phi_apart,
        ),
        Mistake(
            "unit edges",
            "Your phi count metres along the edges: the edges have been made of length one.",
            "phi_1 must be 1 at vertex 1, however long the edge is.",
            _phi_unit_edges,
        ),
    ),
    "dphi_dX": (
        Mistake(
            "edges apart",
            "The edges are treated one at a time, as if they were perpendicular.",
            "Each gradient must be perpendicular to the edge opposite its vertex. Is yours?",
            _gradients_apart,
        ),
        Mistake(
            "unit edges",
            "The edges have been made of length one, so your gradients do not know the size of the triangle.",
            "Doubling the triangle must halve the gradients.",
            _gradients_unit_edges,
        ),
        Mistake(
            "not turned",
            "Row i points along the edge opposite vertex i, not across it.",
            "A gradient points where phi_i grows: from the opposite edge towards the vertex.",
            _opposite_edges,
        ),
        Mistake(
            "heights",
            "Your gradients point the right way, but are as long as the heights of the triangle.",
            "phi_i grows by one over the whole height: how much per metre?",
            _heights,
        ),
    ),
    "interpolate": (
        Mistake(
            "average",
            "Your point is the centre of the triangle, whatever phi is.",
            "Weight each vertex with its own shape function.",
            lambda a: (a.x0 + a.x1 + a.x2) / 3,
        ),
        Mistake(
            "missing:phi",
            "Your point is the sum of the vertices, without the shape functions.",
            "Weight each vertex with its own shape function.",
            lambda a: a.x0 + a.x1 + a.x2,
        ),
        Mistake(
            "entry by entry",
            "Component k of your point comes from one vertex, or is weighted by phi_k.",
            "A shape function multiplies a whole vertex, all three components of it.",
            lambda a: (
                np.stack([a.phi[:, k] * (a.x0, a.x1, a.x2)[k][:, k] for k in range(3)], axis=1),
                a.phi * (a.x0 + a.x1 + a.x2),
            ),
        ),
        Mistake(
            "transposed vertices",
            "The vertices stand in the rows of your matrix, where they should be columns.",
            "phi_0 must multiply vertex 0: look what it multiplies in your product.",
            lambda a: np.stack([_dot(x, a.phi)[:, 0] for x in (a.x0, a.x1, a.x2)], axis=1),
        ),
    ),
    "deformation_gradient": (
        Mistake(
            "normal not normalised",
            "The deformed normal has not been made of length one.",
            "A normal has length one, whatever the size of the triangle: then F N = n keeps the thickness.",
            lambda a: (
                _carried(lambda a, part: part * norm(_m(a))[:, None, None])(a),
                _carried(lambda a, part: part * norm(_m(a))[:, None, None] / 2)(a),
            ),
        ),
        Mistake(
            "outer product transposed",
            "The outer product of the normals is the wrong way round.",
            "The matrix must send N to n. Multiply yours by N and see what comes out.",
            _carried(lambda a, part: transposed(part)),
        ),
        Mistake(
            "undeformed normal",
            "The undeformed normal stands where the deformed one should.",
            "A cloth that turns takes its normal along: compute n from the deformed vertices.",
            _carried(lambda a, part: _outer(a.N, a.N)),
        ),
        Mistake(
            "deformed normal twice",
            "The deformed normal stands where the undeformed one should, too.",
            "F starts from the undeformed cloth: which normal does it multiply?",
            _carried(lambda a, part: _outer(unit(_m(a)), unit(_m(a)))),
        ),
        Mistake(
            "missing vertex",
            "One of the three vertices has been left out.",
            "A cloth that is moved as a whole keeps its F: with a vertex left out it does not.",
            lambda a: tuple(a.right - _outer(x, a.dphi_dX[:, k]) for k, x in enumerate((a.x0, a.x1, a.x2))),
        ),
        Mistake(
            "vertices as rows",
            "The vertices stand in the rows of your matrix, where they should be columns.",
            "Each term is a vertex (column) times the gradient of its shape function (row).",
            _vertices_as_rows,
        ),
    ),
    "dn_dx": (
        Mistake(
            "not projected",
            "Your derivative has a part along n: the change of length has not been taken away.",
            "A unit vector keeps its length, so n^T dn must be zero. Check yours.",
            _turned(lambda dm, nn: dm),
        ),
        Mistake(
            "not divided",
            "You project, but do not divide by the length of the unnormalised normal.",
            "Check the unit: the result is in 1/m.",
            lambda a: a.right * norm(_m(a))[:, None, None],
        ),
        Mistake(
            "not normalised",
            "This is the derivative of the unnormalised normal.",
            "Differentiate m/|m|: both the direction and the length of m depend on the vertex.",
            _dm,
        ),
        Mistake(
            "divided twice",
            "You divide by the length of the unnormalised normal once too often.",
            "Check the unit: the result is in 1/m.",
            lambda a: a.right / norm(_m(a))[:, None, None],
        ),
        Mistake(
            "projected wrongly",
            "The projection keeps the part along n, or adds it once more.",
            "n^T dn must be zero: which part of the change has to go?",
            lambda a: (
                _turned(lambda dm, nn: nn @ dm)(a),
                _turned(lambda dm, nn: dm + nn @ dm)(a),
            ),
        ),
        Mistake(
            "only in a plane",
            "The normal in your projection is fixed: it fits triangles in a coordinate plane only.",
            "Take the triangle's own normal.",
            lambda a: tuple(
                (np.eye(3) - np.outer(z, z)) @ _dm(a) / norm(_m(a))[:, None, None] for z in np.eye(3)[::-1]
            ),
        ),
        Mistake(
            "wrong edge",
            "This belongs to another vertex, walked the other way round.",
            "Which edge lies opposite vertex i? Walk the triangle always in the same sense.",
            lambda a: (-a.truth(i=(a.i + 1) % 3), -a.truth(i=(a.i + 2) % 3)),
        ),
    ),
    "mass_block": (
        Mistake(
            "lumped",
            "This is the lumped mass: a third of the triangle at each vertex, nothing between them.",
            "The consistent mass couples the vertices: integrate phi_i phi_j for i != j, too.",
            lambda a: np.where(a.i == a.j, _mass(a) / 3, 0),
        ),
        Mistake(
            "one point",
            "The product of the shape functions is taken at the centre of the triangle only.",
            "The integrand is quadratic: one sample at the centre is not exact.",
            lambda a: _mass(a) / 9,
        ),
        Mistake(
            "exchanged",
            "The fractions for i = j and for i != j are exchanged.",
            "A shape function overlaps most with itself: which of the two must be larger?",
            lambda a: a.truth(j=np.where(a.i == a.j, (a.i + 1) % 3, a.i)),
        ),
        Mistake(
            "linear",
            "The integral of one shape function stands in place of that of a product of two.",
            "Two shape functions meet under the integral, also for i = j.",
            lambda a: _mass(a) / 3,
        ),
    ),
    "kinetic_energy": (
        Mistake(
            "lumped",
            "This is the energy of lumped masses: a third of the triangle at each vertex.",
            "Between the vertices the velocity is interpolated, so they are coupled: v_i . v_j for i != j, too.",
            _mixed(0, 2),
        ),
        Mistake(
            "missing coupling",
            "Only the terms v_i . v_i are there: the coupling between the vertices is missing.",
            "The double sum has nine terms. Which ones are left out?",
            _mixed(0),
        ),
        Mistake(
            "mixed terms once",
            "Each mixed term is counted once: v_0 . v_1, but not v_1 . v_0.",
            "The double sum has nine terms, and the mixed ones come in pairs.",
            _mixed(0.5),
        ),
        Mistake(
            "mixed terms doubled",
            "The mixed terms count twice as much as they should.",
            "Write the nine terms out: how often does each mixed pair come, and with which fraction?",
            _mixed(2),
        ),
        Mistake(
            "missing pair",
            "One pair of vertices is not coupled.",
            "The double sum has nine terms: three squares and three pairs, each of them twice.",
            _without_pair,
        ),
        Mistake(
            "one point",
            "The velocity is taken at the centre of the triangle only.",
            "The energy is quadratic in the velocity: one sample at the centre is not exact.",
            lambda a: _mass(a) / 2 * norm((a.v0 + a.v1 + a.v2) / 3) ** 2,
        ),
        Mistake(
            "sum of velocities",
            "The velocities are added first, and their sum squared.",
            "Then i = j and i != j count alike. In the mass matrix they do not.",
            lambda a: tuple(_mass(a) / k * norm(a.v0 + a.v1 + a.v2) ** 2 for k in (12, 24, 6, 2)),
        ),
    ),
    "right_cauchy_green": (
        Mistake(
            "strain",
            "This is a strain: the identity has been subtracted.",
            "C itself is asked: for a rotation it is the identity, not zero.",
            lambda a: (
                (a.right - np.eye(3)) / 2,
                a.right - np.eye(3),
                a.F @ transposed(a.F) - np.eye(3),
                (a.F @ transposed(a.F) - np.eye(3)) / 2,
            ),
        ),
        Mistake(
            "entry by entry",
            "The matrices are multiplied entry by entry.",
            "In Taichi * is entry by entry. The matrix product has another sign.",
            lambda a: (a.F * a.F, transposed(a.F) * a.F),
        ),
        Mistake(
            "F F",
            "F is multiplied with itself, and nothing is transposed.",
            "Put dx = F dX into dx^T dx: what happens to the first factor?",
            lambda a: a.F @ a.F,
        ),
        Mistake(
            "stretch",
            "This is the root of C: its eigenvalues are the stretches, not their squares.",
            "C holds the squares. Do not take the root.",
            _principal_root,
        ),
        Mistake(
            "small strain",
            "This is the symmetric part of F (or what remains without the identity), right for tiny changes only.",
            "Lengths are squared: C is a product, not a sum.",
            lambda a: (
                (a.F + transposed(a.F)) / 2,
                (a.F + transposed(a.F)) / 2 - np.eye(3),
                a.F + transposed(a.F) - np.eye(3),
                a.F + transposed(a.F),
            ),
        ),
    ),
    "psi": (
        Mistake(
            "third stretch",
            "The sum runs over three stretches.",
            "Only the two stretches in the plane store energy; do not count on the third being 1.",
            _psi_third,
        ),
        Mistake(
            "missing stretch",
            "Only one of the two stretches is in the mu term.",
            "mu resists each of the two stretches in the plane.",
            lambda a: tuple(a.right - a.mu * (a.s[:, k] - 1) ** 2 for k in (1, 0)),
        ),
        Mistake(
            "area energy",
            "This is the area energy, with the product of the stretches.",
            "The task asks for the linearised one: what is the product, to first order around (1, 1)?",
            lambda a: (_area_psi(a), _area_psi(a, 1)),
        ),
        Mistake(
            "each stretch alone",
            "The lam term squares the change of each stretch alone.",
            "Add the changes of both stretches first, then square.",
            lambda a: (_apart(a), a.truth(mu=a.mu + a.lam, lam=0 * a.lam)),
        ),
        Mistake(
            "missing square",
            "The square of the lam term is missing.",
            "Without a square, compressing the cloth would win energy without end.",
            lambda a: _without_lam(a) + a.lam / 2 * (a.s[:, 0] + a.s[:, 1] - 2),
        ),
        Mistake(
            "rest at one",
            "The lam term does not vanish at rest.",
            "At s_0 = s_1 = 1 nothing is stored: what must be subtracted from the sum of the stretches?",
            lambda a: tuple(
                _without_lam(a) + a.lam / 2 * (a.s[:, 0] + a.s[:, 1] - k) ** 2 for k in (1, 0, 3)
            ),
        ),
    ),
    "dpsi_ds": (
        Mistake(
            "third stretch",
            "The third stretch takes part.",
            "psi does not contain s_2: what is its derivative by it?",
            _dpsi_third,
        ),
        Mistake(
            "each stretch alone",
            "The lam term of each component holds its own stretch only.",
            "Differentiate the square of a sum: the whole sum stays inside.",
            lambda a: _apart(a),
        ),
        Mistake(
            "area energy",
            "This is the gradient of the area energy, the handout's example.",
            "Differentiate the linearised energy in the same way. It is easier.",
            _area_gradient,
        ),
        Mistake(
            "stretches",
            "These are the stretches themselves, not the derivative of psi.",
            "Differentiate psi by s_0 with s_1 fixed.",
            lambda a: (a.s, a.s * np.array([1.0, 1.0, 0.0]), a.s - 1),
        ),
        Mistake(
            "rest at one",
            "The lam term does not vanish at rest.",
            "At s_0 = s_1 = 1 there is no stress: what must be subtracted from the sum of the stretches?",
            lambda a: tuple(
                a.right + k * a.lam[:, None] * np.array([1.0, 1.0, 0.0]) for k in (1.0, 2.0, -1.0)
            ),
        ),
    ),
    "d2psi_ds2": (
        Mistake(
            "third row and column",
            "There is something in the third row and column.",
            "psi does not contain s_2: what are its second derivatives by it?",
            _third_row,
        ),
        Mistake(
            "multiplied by s",
            "The Hessian has been multiplied by the stretches.",
            "psi is quadratic in s: its second derivative does not contain s any more.",
            _times_s,
        ),
        Mistake(
            "area energy",
            "This is the Hessian of the area energy, the handout's example.",
            "Differentiate the linearised energy in the same way: the result is constant.",
            _area_hessian,
        ),
    ),
    "dpsi_dF": (
        Mistake(
            "transposed:V",
            "V stands where its transpose is asked.",
            "Compare with F = U diag(s) V^T.",
            lambda a: a.U @ _diag(a.dpsi_ds) @ a.V,
        ),
        Mistake(
            "transposed:U",
            "U is transposed.",
            "Compare with F = U diag(s) V^T.",
            lambda a: transposed(a.V @ _diag(a.dpsi_ds) @ a.U),
        ),
        Mistake(
            "transposed:U,V",
            "Both rotations are transposed.",
            "The principal directions are the columns of U and V, not the rows.",
            lambda a: transposed(a.U) @ _diag(a.dpsi_ds) @ a.V,
        ),
        Mistake(
            "missing:V",
            "V is missing.",
            "The result belongs to F, not to the principal directions: turn it back on both sides.",
            lambda a: a.U @ _diag(a.dpsi_ds),
        ),
        Mistake(
            "missing:U",
            "U is missing.",
            "The result belongs to F, not to the principal directions: turn it back on both sides.",
            lambda a: transposed(a.V @ _diag(a.dpsi_ds)),
        ),
        Mistake(
            "permuted:dpsi_ds",
            "The components of dpsi_ds meet the wrong principal directions.",
            "Component i belongs to column i of U and of V.",
            lambda a: a.U @ _diag(a.dpsi_ds[:, [1, 0, 2]]) @ transposed(a.V),
        ),
        Mistake(
            "diagonal outside",
            "The diagonal matrix stands outside of the product of the two rotations.",
            "The stress in the principal directions is diagonal: U and V turn it from both sides.",
            lambda a: (_diag(a.dpsi_ds) @ a.U @ transposed(a.V), a.U @ transposed(a.V) @ _diag(a.dpsi_ds)),
        ),
        Mistake(
            "entry by entry",
            "The matrices are multiplied entry by entry.",
            "In Taichi * is entry by entry. The matrix product has another sign.",
            lambda a: (a.U * _diag(a.dpsi_ds) * transposed(a.V), a.U * _diag(a.dpsi_ds) @ transposed(a.V)),
        ),
    ),
    "nodal_force": (
        Mistake(
            "entry by entry",
            "P and the gradient are multiplied entry by entry somewhere.",
            "The force is a matrix times a vector.",
            lambda a: -_long(a.area * a.h, a.right) * np.einsum("bii->bi", a.P) * a.grad_phi,
        ),
    ),
    "d2psi_dFij": (
        Mistake(
            "missing:dU,dV",
            "Only the middle term is there: the principal directions never turn.",
            "Three factors depend on F_ij: the product rule has three terms.",
            lambda a: a.truth(dU=0 * a.dU, dV=0 * a.dV),
        ),
        Mistake(
            "one product",
            "All three factors are differentiated at once, in one product.",
            "The product rule differentiates one factor at a time, and adds.",
            lambda a: a.dU @ _diag(np.einsum("bij,bj->bi", a.d2psi_ds2, a.ds)) @ transposed(a.dV),
        ),
        Mistake(
            "entry by entry",
            "The Hessian of psi and ds are multiplied entry by entry.",
            "How psi_s changes is a vector: a matrix times a vector. Its diagonal matrix stands in the middle.",
            _entrywise_chain,
        ),
    ),
    "eigensystem": (
        Mistake(
            "3x3 mode",
            "out_i is divided by s_i - 1: that is the mode of the 3x3 matrix, singular at rest.",
            "The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.",
            _outs(lambda a, i: a.dpsi_ds[:, i] / (a.s[:, i] - 1)),
        ),
        Mistake(
            "missing limit",
            "Flip has no limit: where the stretches meet it is zero divided by zero.",
            "Where the gap is tiny, take the limit of the quotient in place of the quotient.",
            _without_limit,
        ),
        Mistake(
            "out not divided",
            "out_0 and out_1 are stresses: they have not been divided by a stretch.",
            "How far does the normal lean when the tangent is lifted? The stretch decides it.",
            _outs(lambda a, i: a.dpsi_ds[:, i]),
        ),
        Mistake(
            "other stretch",
            "out_i is divided by the wrong stretch.",
            "out_i belongs to the axis i: stress and stretch along the same axis.",
            _outs(lambda a, i: a.dpsi_ds[:, i] / a.s[:, 1 - i]),
        ),
        Mistake(
            "wrong limit",
            "The limit of flip, where the stretches meet, is not the right combination of second derivatives.",
            "Step apart by a small gap, one stretch up, the other down: what does that do to the two stresses?",
            lambda a: (
                _flip_limit(lambda H: H[:, 0, 0] + H[:, 0, 1])(a),
                _flip_limit(lambda H: H[:, 0, 0])(a),
                _flip_limit(lambda H: H[:, 0, 1])(a),
                _flip_limit(lambda H: H[:, 0, 1] - H[:, 0, 0])(a),
                _flip_limit(lambda H: (H[:, 0, 0] - H[:, 0, 1]) / 2)(a),
                _flip_limit(lambda H: H[:, 0, 0] + H[:, 1, 1] - H[:, 0, 1])(a),
            ),
        ),
        Mistake(
            "limit always",
            "The limit of flip is taken everywhere, or where the gap is large.",
            "The limit holds where the stretches meet; elsewhere the quotient does. It depends on the energy.",
            _limit_always,
        ),
        Mistake(
            "difference in twist",
            "Twist has the difference of the stresses above, where flip has it.",
            "Plus over plus, minus over minus.",
            lambda a: _replaced(a.right, 1, (a.dpsi_ds[:, 0] - a.dpsi_ds[:, 1]) / (a.s[:, 0] + a.s[:, 1])),
        ),
        Mistake(
            "difference below twist",
            "Twist is divided by the difference of the stretches.",
            "Plus over plus, minus over minus.",
            lambda a: _replaced(a.right, 1, (a.dpsi_ds[:, 0] + a.dpsi_ds[:, 1]) / (a.s[:, 0] - a.s[:, 1])),
        ),
    ),
    "sphere_contact": (
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
            lambda a: norm(a.x) < a.r,
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
                np.where(_distance(a)[:, None] > 0, (a.x - a.c) / a.r[:, None], there)
                for there in (0.0, a.right)
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
    ),
    "filter_velocity": (
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
            lambda a: np.where(_dot(a.v, a.n) < 0, a.v, -a.truth(v=-a.v)),
        ),
        Mistake(
            "absolute",
            "The amount is taken without its sign, so the velocity is changed where it should be kept.",
            "Only a negative n^T v is a problem, and its sign matters in the formula.",
            lambda a: (
                a.v - np.abs(_dot(a.v, a.n)) * a.n,
                a.v + np.abs(_dot(a.v, a.n)) * a.n,
                np.where(_dot(a.v, a.n) < 0, a.v - np.abs(_dot(a.v, a.n)) * a.n, a.v),
            ),
        ),
        Mistake(
            "stopped",
            "A velocity that goes in is set to zero: the vertex sticks.",
            "Take away the part along n only; what slides along the surface stays.",
            lambda a: np.where(_dot(a.v, a.n) < 0, 0.0, a.v),
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
                np.where(_dot(a.v, a.n) < 0, a.v - a.right, a.v),
                a.v - _projected_always(a),
            ),
        ),
        Mistake(
            "whole speed",
            "The whole speed is taken away along the normal, not the part of it that goes in.",
            "How fast does the vertex move along n? That is less than its speed.",
            lambda a: np.where(_dot(a.v, a.n) < 0, a.v + norm(a.v)[:, None] * a.n, a.v),
        ),
        Mistake(
            "missing:n",
            "The number n^T v is taken away from every component, without the direction n.",
            "The part of v along n is a vector: a number times n.",
            lambda a: a.v - np.minimum(_dot(a.v, a.n), 0),
        ),
    ),
}

#: A cause in the words of one task: (mistake, advice); empty where those of `WORDS` say it best.
SAID: Mapping[str, Mapping[str, tuple[str, str]]] = {
    "phi": {
        "permuted:1,2,0": (
            "The components are in another order: phi_0 comes last in yours.",
            "The first component belongs to vertex 0: at X0 it is 1.",
        ),
        "absolute": (
            "Your phi are never negative, also outside the triangle.",
            "Give each area a sign, positive if it turns the same way round as the triangle.",
        ),
        "component 0": ("", "The three shape functions sum to one, everywhere."),
        "component 0: zeros": ("", "The three shape functions sum to one, everywhere."),
    },
    "dphi_dX": {
        **{
            cause: (
                "A singular matrix has been inverted: your gradients are huge, or not finite, nearly everywhere.",
                "Which of the two products of D and its transpose is 2x2, and which is 3x3 and singular?",
            )
            for cause in ("singular", "nan")
        },
        "scaled:2": ("", "The cross product of two edges is as long as twice the area."),
        "scaled:1/2": ("", "The cross product of two edges is as long as twice the area."),
        "transposed": (
            "Rows and columns are exchanged: your columns are the gradients.",
            "Row i of the result is the gradient of phi_i.",
        ),
        "row 0: zeros": (
            "Row 0 is zero: the gradient of phi_0 has been forgotten.",
            "The shape functions sum to one everywhere. What do their gradients sum to?",
        ),
        "row 0: negated": (
            "Row 0 has the opposite sign.",
            "The shape functions sum to one everywhere. What do their gradients sum to?",
        ),
        "row 0": (
            "Row 0 is wrong: the three rows do not sum to zero.",
            "The shape functions sum to one everywhere. What do their gradients sum to?",
        ),
        "rows normalised": (
            "",
            "phi_i grows from 0 to 1 over one height of the triangle. How much is that per metre?",
        ),
    },
    "interpolate": {
        "lacks:x0": (
            "The edges are weighted, and vertex 0 is not added.",
            "Either weight the three vertices, or begin at vertex 0.",
        ),
    },
    "deformation_gradient": {
        "missing:N": (
            "The normal is missing: your F flattens everything along N.",
            "Multiply your F by N: it must give the deformed normal, not zero.",
        ),
        "negated:N": (
            "The deformed normal points to the other side.",
            "Look at the order of the edges in the cross product: an undeformed triangle must give the identity.",
        ),
        "transposed": (
            "This is F transposed.",
            "dx = F dX: the vertices are columns, the gradients of the shape functions rows.",
        ),
        "transposed:dphi_dX": (
            "The gradients of the shape functions are used as columns.",
            "Row i of dphi_dX is the gradient of phi_i: which product takes column x_i times that row?",
        ),
    },
    "dn_dx": {
        "scaled:2": ("", "The cross product of two edges is as long as twice the area."),
        "scaled:1/2": ("", "The cross product of two edges is as long as twice the area."),
        "negated": (
            "Your derivative has the opposite sign: the edge, or its cross-product matrix, is turned round.",
            "Lift one vertex: the normal leans away from it.",
        ),
        "transposed": (
            "Rows and columns are exchanged.",
            "Column k says how n changes when component k of x_i grows.",
        ),
        "negated and transposed": (
            "This is minus the transpose: so it comes out if the projection stands on the wrong side of the product.",
            "It acts on a change of the normal, after that change has been computed.",
        ),
        "shifted:i": (
            "The edges are in the wrong order: this is the derivative by another vertex.",
            "The edge that counts lies opposite vertex i.",
        ),
    },
    "mass_block": {
        "scaled:3": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
        "where i != j: scaled:2": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
        "where i = j: scaled:2": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
        "where i = j: scaled:1/2": ("", "All nine blocks together weigh as much as the triangle. Do yours?"),
        "scaled:2": ("", "Is the area doubled? `area` is that of the triangle, not of the parallelogram."),
        "scaled:1/2": ("", "The 1/2 of the kinetic energy does not belong into the mass."),
        "where i != j: zeros": (
            "The blocks off the diagonal are zero: the vertices are not coupled.",
            "Integrate phi_i phi_j for i != j, too: all nine blocks weigh as much as the triangle.",
        ),
    },
    "kinetic_energy": {
        "scaled:2": ("", "Where is the 1/2 in front of qdot^T M qdot?"),
        "scaled:1/2": ("", "The 1/2 in front of qdot^T M qdot is there once, not twice."),
    },
    "right_cauchy_green": {
        "transposed:F": (
            "This is the left Cauchy-Green tensor: the factors are in the other order.",
            "Turn the cloth after deforming it, F -> R F: your result must not change.",
        ),
    },
    "psi": {
        "swapped:mu,lam": (
            "mu and lam are exchanged.",
            "mu weighs the stretches one by one, lam their common change.",
        ),
        "doubled:lam": (
            "The lam term is twice too large.",
            "Look at the number in front of lam in the formula.",
        ),
        "halved:mu": (
            "The mu term is half of the right one.",
            "Look at the number in front of mu in the formula.",
        ),
        "squared:s": (
            "The stretches are squared before one is subtracted.",
            "The energy counts s - 1. With squares it is another material.",
        ),
        "missing:lam": ("The lam term is missing.", "The second term resists a change of area."),
        "missing:mu": ("The mu term is missing.", "The first term resists each stretch."),
    },
    "dpsi_ds": {
        "component 0": ("", "The term with lam depends on both stretches: it is in both components."),
        "component 1": ("", "The term with lam depends on both stretches: it is in both components."),
        "swapped:mu,lam": (
            "mu and lam are exchanged.",
            "mu weighs the stretches one by one, lam their common change.",
        ),
        "halved:mu": ("The 2 in the mu term is missing.", "Differentiate the square once more."),
        "halved:lam": (
            "The lam term is half of the right one.",
            "The square brings a factor of two: what becomes of lam/2?",
        ),
        "negated": (
            "This is minus the gradient.",
            "The gradient of psi points uphill; the sign of a force comes later.",
        ),
        "missing:lam": (
            "The lam term is missing.",
            "The square of the sum depends on both stretches: differentiate it, too.",
        ),
    },
    "d2psi_ds2": {
        "diagonal": ("", "psi depends on s_0 through both of its terms: differentiate both twice."),
        "off the diagonal": ("", "Differentiate the first component of the gradient by the other stretch."),
        "off the diagonal: negated": (
            "",
            "Pull one stretch up: does the stress along the other rise or fall?",
        ),
        "off the diagonal: scaled:2": (
            "",
            "Differentiate the first component of the gradient by the other stretch.",
        ),
        "upper triangle only": ("", "It does not matter which stretch comes first: the matrix is symmetric."),
        "lower triangle only": ("", "It does not matter which stretch comes first: the matrix is symmetric."),
        "swapped:mu,lam": (
            "mu and lam are exchanged.",
            "mu weighs the stretches one by one, lam their common change.",
        ),
        "diagonal only": (
            "The matrix is diagonal: the coupling of the stretches is missing.",
            "Differentiate the first component of the gradient by the other stretch.",
        ),
        "halved:mu": (
            "The 2 at mu is missing.",
            "Differentiate the gradient: which factor does mu carry there?",
        ),
        "missing:lam": ("The lam term is missing.", "lam comes in on the diagonal and off it."),
    },
    "dpsi_dF": {
        "transposed": (
            "This is P transposed: U and V have changed places.",
            "P belongs to F: U turns in the deformed cloth and stands on the same side as in F.",
        ),
    },
    "nodal_force": {
        "scaled:1/3": ("", "Nothing is shared out among the vertices: each has a gradient of its own."),
        "scaled:1/2": ("", "`area` is that of the triangle, and psi has its halves inside already."),
        "scaled:2": ("", "`area` is that of the triangle, not of the parallelogram."),
        "negated": (
            "This is the gradient of the energy: the force has the opposite sign.",
            "The gradient points uphill, a force pulls downhill.",
        ),
        "missing:area": (
            "The area is missing.",
            "psi is energy per volume: how large is the volume of a triangle of cloth?",
        ),
        "missing:h": (
            "The thickness is missing.",
            "psi is energy per volume: how large is the volume of a triangle of cloth?",
        ),
        "missing:area,h": (
            "Area and thickness are missing.",
            "psi is energy per volume: how large is the volume of a triangle of cloth?",
        ),
        "transposed:P": ("P is transposed.", "P : (w g^T) = w^T P g. Which index of P meets the gradient?"),
        "missing:|grad_phi|": (
            "The gradient has been made of length one.",
            "The length of the gradient knows the size of the triangle: use it as it comes.",
        ),
    },
    "d2psi_dFij": {
        "missing:dU": (
            "The term with dU is missing.",
            "Three factors depend on F_ij: the product rule has three terms.",
        ),
        "missing:dV": (
            "The term with dV is missing.",
            "Three factors depend on F_ij: the product rule has three terms.",
        ),
        "missing:ds": (
            "The middle term is missing.",
            "Three factors depend on F_ij: the product rule has three terms.",
        ),
        "transposed:dV": (
            "dV is not transposed.",
            "The last factor of the stress is V transposed: so is its derivative.",
        ),
        "transposed:V": (
            "V is not transposed.",
            "The last factor of the stress is V transposed, in every term.",
        ),
        "missing:d2psi_ds2": (
            "ds stands in the middle as it is, without the Hessian of psi.",
            "How does psi_s change when s changes by ds? That is the chain rule.",
        ),
        "diagonal:d2psi_ds2": (
            "Only the diagonal of the Hessian of psi is used.",
            "A change of one stretch changes both stresses: multiply with the whole matrix.",
        ),
    },
    "eigensystem": {
        "digits": (
            "Your values are nearly right everywhere: as if a small number had been added to what you divide by.",
            "Divide by the larger of the two, the denominator and 1e-6: where nothing collapses, nothing changes.",
        ),
        "permuted:1,0,2,3": (
            "Flip and twist are exchanged.",
            "Minus over minus is flip, plus over plus is twist; flip comes first.",
        ),
        "permuted:0,1,3,2": ("out_0 and out_1 are exchanged.", "out_i belongs to stretch i."),
        "clamped": (
            "Negative eigenvalues are replaced by zero.",
            "The projection is done later, and not by you: return the true eigenvalues.",
        ),
        "where s_0 = s_1: nan": (
            "Where the stretches meet, your result is zero divided by zero.",
            "Where the gap is tiny, take the limit of the quotient in place of the quotient.",
        ),
    },
    "sphere_contact": {
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
    },
    "filter_velocity": {
        "echo:v": (
            "The velocity comes back as it is.",
            "Where it goes into the obstacle, something must be taken away.",
        ),
        "negated:n": (
            "The normal is used as if it pointed into the obstacle.",
            "n points out of the obstacle: which sign of n^T v means going in?",
        ),
    },
}
