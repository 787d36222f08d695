"""The truth for ten thousand triangles: exact derivatives of the energy alone, in 64-bit-mantissa arithmetic.

`muslin.judging.exact` differentiates numerically with 110 digits, some milliseconds a case. Here the energy
is evaluated on jets (value, gradient, Hessian, carried through each operation by the chain rule) of numpy's
longdouble: about 1e-18, vectorised. Nothing below is a formula of a solution; the two truths are tested
against each other in `test_student_functions.py`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

Real = np.longdouble

needs_longdouble = pytest.mark.skipif(
    np.finfo(Real).nmant < 63, reason="numpy's longdouble is no more precise than double on this platform"
)


class Jet:
    """A number that knows its first and second derivatives in n variables; b samples at once.

    value (b,), gradient (b, n), hessian (b, n, n).
    """

    __array_ufunc__ = None  # numpy arrays on the left leave the operation to us

    def __init__(self, value, gradient, hessian):
        self.value, self.gradient, self.hessian = value, gradient, hessian

    def __add__(self, other):
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.gradient, self.hessian)
        return Jet(self.value + other.value, self.gradient + other.gradient, self.hessian + other.hessian)

    def __neg__(self):
        return Jet(-self.value, -self.gradient, -self.hessian)

    def __mul__(self, other):
        if not isinstance(other, Jet):
            c = np.asarray(other, dtype=Real)
            return Jet(self.value * c, self.gradient * c[..., None], self.hessian * c[..., None, None])
        p, q = self.value[:, None], other.value[:, None]
        outer = self.gradient[:, :, None] * other.gradient[:, None, :]
        return Jet(
            self.value * other.value,
            p * other.gradient + q * self.gradient,
            p[:, None] * other.hessian + q[:, None] * self.hessian + outer + outer.transpose(0, 2, 1),
        )

    __radd__, __rmul__ = __add__, __mul__

    def __sub__(self, other):
        return self + (-other)

    def __rsub__(self, other):
        return -self + other

    def chain(self, f, df, d2f):
        """f of this number, given f and its two derivatives there."""
        outer = self.gradient[:, :, None] * self.gradient[:, None, :]
        return Jet(
            f, df[:, None] * self.gradient, df[:, None, None] * self.hessian + d2f[:, None, None] * outer
        )

    def sqrt(self):
        root = np.sqrt(self.value)
        return self.chain(root, 0.5 / root, -0.25 / (root * self.value))

    def __truediv__(self, other):
        v = other.value
        return self * other.chain(1 / v, -1 / v**2, 2 / v**3)


def variables(x):
    """The columns of x (b, n) as n independent variables."""
    b, n = x.shape
    zero, unit = np.zeros((b, n, n), dtype=Real), np.eye(n, dtype=Real)
    return [Jet(x[:, k].astype(Real), np.broadcast_to(unit[k], (b, n)), zero) for k in range(n)]


def dot(a, b):
    return sum((p * q for p, q in zip(a[1:], b[1:], strict=True)), start=a[0] * b[0])


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def energy_of_invariants(squares, product, mu, lam, energy):
    """psi from s0^2 + s1^2 and s0 s1 of the in-plane stretches: smooth also where they are equal."""
    total = (squares + 2 * product).sqrt()
    change = total - 2 if energy == "linearised" else product - 1
    return mu * (squares - 2 * total + 2) + lam / 2 * (change * change)


def energy_of_A(A, mu, lam, energy="linearised"):
    """psi as a jet in the six entries (row by row) of the in-plane 3x2 deformation gradient A, (b, 3, 2)."""
    entries = variables(A.reshape(-1, 6))
    a, b = entries[::2], entries[1::2]
    m = cross(a, b)
    return energy_of_invariants(dot(a, a) + dot(b, b), dot(m, m).sqrt(), mu, lam, energy)


def orthogonal(U):
    """Rotations that are so to double precision, made so to longdouble precision (a Newton step)."""
    U = U.astype(Real)
    return 1.5 * U - 0.5 * (U @ U.transpose(0, 2, 1) @ U)


def energy_of_F(F, U, V, mu, lam, energy="linearised"):
    """psi as a jet in the nine entries of F, (b, 3, 3), that follows the normal's stretch by continuity.

    psi does not change when F is turned, so it is taken of U^T F V with any rotations U, V that nearly
    diagonalise it, the normal last. The square t of the normal's stretch is then the eigenvalue of C = F^T F
    near C_22, the fixed point of t = C_22 + c^T (t I - C')^-1 c with C' and c the other parts of C. It must
    be simple.
    """
    U, V = orthogonal(U), orthogonal(V)
    value = U.transpose(0, 2, 1) @ F.astype(Real) @ V
    gradient = np.einsum("eik,ejm->ekmij", U, V).reshape(-1, 3, 3, 9)
    zero = np.zeros((len(F), 9, 9), dtype=Real)
    G = [[Jet(value[:, k, m], gradient[:, k, m], zero) for m in range(3)] for k in range(3)]
    columns = [[row[m] for row in G] for m in range(3)]
    C = [[dot(columns[k], columns[m]) for m in range(3)] for k in range(3)]
    t = C[2][2]
    for _ in range(4):
        p, q, r = t - C[0][0], t - C[1][1], C[0][1]
        c0, c1 = C[0][2], C[1][2]
        t = C[2][2] + (c0 * c0 * q + 2 * (c0 * c1 * r) + c1 * c1 * p) / (p * q - r * r)
    det = dot(columns[0], cross(columns[1], columns[2]))
    return energy_of_invariants(C[0][0] + C[1][1] + C[2][2] - t, det / t.sqrt(), mu, lam, energy)


@dataclass
class Flat:
    """The undeformed triangle laid flat, in longdouble.

    T (b, 3, 2): two unit tangents; N (b, 3): unit normal; area (b,); dphi (b, 3, 2): gradients of the shape
    functions in the frame T; length (b,): the longest edge.
    """

    T: np.ndarray
    N: np.ndarray
    area: np.ndarray
    dphi: np.ndarray
    length: np.ndarray


def norm(a):
    return np.sqrt(np.sum(a * a, axis=-1))


def flat(X):
    """Lay triangles X (b, 3, 3), one row per vertex, flat: edge one along the first tangent."""
    X = X.astype(Real)
    e1, e2 = X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]
    m = np.cross(e1, e2)
    N = m / norm(m)[:, None]
    t0 = e1 / norm(e1)[:, None]
    t1 = np.cross(N, t0)
    length, along, height = norm(e1), np.sum(t0 * e2, axis=1), norm(m) / norm(e1)
    zero = np.zeros_like(length)
    g1 = np.stack([1 / length, -along / (length * height)], axis=1)
    g2 = np.stack([zero, 1 / height], axis=1)
    longest = np.max([length, norm(e2), norm(e2 - e1)], axis=0)
    return Flat(np.stack([t0, t1], axis=2), N, norm(m) / 2, np.stack([-g1 - g2, g1, g2], axis=1), longest)


def in_plane(X, x):
    """In-plane 3x2 deformation gradient A: what the two tangents have become; and the flat triangle."""
    rest = flat(X)
    x = x.astype(Real)
    edges = x - x[:, :1]  # of the sum over all vertices, vertex 0 drops out
    return np.einsum("eik,eia->eka", edges, rest.dphi), rest


def element(X, x, mu, lam, h, energy="linearised"):
    """V (b,), its gradient (b, 9) and Hessian (b, 9, 9) in q: V = h a psi(A(q)), and A is linear in q."""
    A, rest = in_plane(X, x)
    psi = energy_of_A(A, mu, lam, energy)
    B = np.einsum("kl,eia->ekail", np.eye(3, dtype=Real), rest.dphi).reshape(-1, 6, 9)  # dA/dq
    weight = h * rest.area
    gradient = np.einsum("eA,eAq->eq", psi.gradient, B)
    hessian = np.einsum("eAp,eAq->epq", B, np.einsum("eAB,eBq->eAq", psi.hessian, B))
    return weight * psi.value, weight[:, None] * gradient, weight[:, None, None] * hessian


def clamped_element(X, x, mu, lam, h, energy="linearised"):
    """`element`'s Hessian with psi'' in the 3x2 A replaced by its positive part, (b, 9, 9), in double.

    The negative eigenvalues of the 6x6 psi'' are dropped by an eigen-decomposition, whichever modes they are.
    """
    A, rest = in_plane(X, x)
    curvature = energy_of_A(A, mu, lam, energy).hessian.astype(float)
    values, vectors = np.linalg.eigh(curvature)
    positive = (vectors * np.maximum(values, 0)[:, None, :]) @ vectors.transpose(0, 2, 1)
    B = np.einsum("kl,eia->ekail", np.eye(3), rest.dphi.astype(float)).reshape(-1, 6, 9)
    return (h * rest.area.astype(float))[:, None, None] * (B.transpose(0, 2, 1) @ positive @ B)


def unit_normal(x):
    """The unit normal of triangles x (b, 3, 3) as three jets in the nine coordinates."""
    q = variables(x.reshape(-1, 9))
    edges = [[q[3 * i + k] - q[k] for k in range(3)] for i in (1, 2)]
    m = cross(*edges)
    length = dot(m, m).sqrt()
    return [entry / length for entry in m]


def over_triangle(f, area):
    """Integral over triangles of a polynomial f(phi) of degree 2, by Simpson's rule on the unit square."""
    rule = ((Real(0), Real(1) / 6), (Real(1) / 2, Real(4) / 6), (Real(1), Real(1) / 6))
    return 2 * area * sum(wu * wv * u * f((1 - u, u * (1 - v), u * v)) for u, wu in rule for v, wv in rule)


# --- samples -----------------------------------------------------------------------------------------------


def rotations(rng, b):
    """Random rotations, (b, 3, 3)."""
    Q, R = np.linalg.qr(rng.normal(size=(b, 3, 3)))
    Q = Q * np.sign(np.diagonal(R, axis1=1, axis2=2))[:, None, :]
    return Q * np.linalg.det(Q)[:, None, None]


def turns(rng, b):
    """Random rotations of the plane, (b, 2, 2)."""
    angle = rng.uniform(0, 2 * np.pi, b)
    c, s = np.cos(angle), np.sin(angle)
    return np.stack([np.stack([c, -s], 1), np.stack([s, c], 1)], 1)


def stretch_pairs(rng, b):
    """Stretches 0.05-3, larger first, (b, 2): any; equal; one or both 1; nearly equal; nearly 1; below 1."""
    kinds, k = 8, np.arange(b) % 8
    any_pair, c = rng.uniform(0.05, 3, (b, 2)), rng.uniform(0.05, 3, b)
    tiny = 10 ** rng.uniform(-13, -2, (b, 2)) * rng.choice([-1, 1], (b, 2))
    one = np.ones(b)
    pairs = [
        any_pair,
        np.stack([c, c], 1),
        np.stack([c, one], 1),
        np.stack([one, one], 1),
        np.stack([c, c + tiny[:, 0]], 1),
        np.stack([c, 1 + tiny[:, 0]], 1),
        1 + tiny,
        rng.uniform(0.05, 0.95, (b, 2)),
    ]
    assert len(pairs) == kinds
    return -np.sort(-np.stack(pairs)[k, np.arange(b)], axis=1)


def triangles(rng, b, condition=(0, 1), size=(-1.5, 0.5)):
    """Random triangles X, x (b, 3, 3) within a metre, deformed by `stretch_pairs`; and cond(D), (b,).

    `condition` and `size` are decades: of the ratio of D's singular values, and of the larger one [m]. One in
    sixteen is axis-aligned and has dyadic coordinates and stretches, so that its F has no rounding at all.
    """
    s = stretch_pairs(rng, b)
    cond = 10 ** rng.uniform(*condition, b)
    large = 10 ** rng.uniform(*size, b)
    D = turns(rng, b) * np.stack([large, large / cond], 1)[:, None, :] @ turns(rng, b)
    y = np.concatenate([np.zeros((b, 2, 1)), D], axis=2)  # vertices are columns
    stretched = (turns(rng, b) * s[:, None, :]) @ turns(rng, b) @ y
    rigid = (s == 1).all(axis=1)
    stretched[rigid] = y[rigid]
    placed = []
    for p in (y, stretched):
        flat_points = np.concatenate([p, np.zeros((b, 1, 3))], axis=1)
        placed.append((rotations(rng, b) @ flat_points).transpose(0, 2, 1) + rng.uniform(-1, 1, (b, 1, 3)))
    X, x = placed
    dyadic = np.arange(b) % 16 == 15
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]) / 4
    X[dyadic] = corner
    scale = np.round(rng.uniform(0.1, 3, (b, 2)) * 8) / 8
    scale[::32] = scale[::32, :1]
    scale[15::64] = scale[15::64, :1]
    scale[31::128] = 1
    x[dyadic] = corner * np.concatenate([scale, np.ones((b, 1))], axis=1)[dyadic][:, None, :]
    D = np.stack([X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]], axis=2)
    return X, x, np.linalg.cond(D)


def materials(rng, b):
    """Lamé parameters and thickness, (b,) each."""
    mu = 10 ** rng.uniform(2, 5, b)
    return mu, mu * rng.uniform(0, 8, b), 10 ** rng.uniform(-4, 0, b)
