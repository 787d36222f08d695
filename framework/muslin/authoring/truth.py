"""What the right answers are, independently of any solution: from the energy and the definitions alone.

Everything here is computed with mpmath to about 110 digits, of which at least 45 survive. Derivatives are
central differences with a step of 1e-30: the truncation error is then about 1e-60 of the result and rounding
costs 1e-50, so nothing is ever differentiated by hand. A vector is a list and a matrix a list of rows.

mpmath is part of the extra `test`; students' machines never need it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from muslin.errors import MuslinError

#: Decimal digits carried.
DIGITS = 110

#: Results below this are rounding of an exact zero; nothing Muslin measures is so small.
NOTHING = 1e-45

Vector = list[Any]
Matrix = list[list[Any]]


@functools.cache
def precise() -> Any:
    """Our own mpmath context with `DIGITS` digits; the user's global one is left alone.

    Raises
    ------
    MuslinError
        If mpmath is not installed.
    """
    try:
        import mpmath
    except ImportError:
        raise MuslinError(
            "The truth behind reference data is computed with mpmath, which is not installed.",
            "Install it with: pip install mpmath",
        ) from None
    context = mpmath.mp.clone()
    context.dps = DIGITS
    return context


# --- small linear algebra on lists -------------------------------------------------------------------------


def exact(values: Any) -> Any:
    """Numbers, arrays or nested lists of them, taken over without rounding (as lists of mpf)."""
    if isinstance(values, (np.ndarray, np.generic)):
        values = values.tolist()
    if isinstance(values, (list, tuple)):
        return [exact(value) for value in values]
    return precise().mpf(values)


def rounded(values: Any) -> np.ndarray:
    """Nearest float64 of each number; noise around an exact zero becomes that zero."""
    array = np.array(values, dtype=object)
    flat = [float(value) if abs(value) > NOTHING else 0.0 for value in array.ravel()]
    return np.array(flat, dtype=np.float64).reshape(array.shape)


def add(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return [p + q for p, q in zip(a, b, strict=True)]


def sub(a: Vector, b: Vector) -> Vector:
    """Difference of two vectors."""
    return [p - q for p, q in zip(a, b, strict=True)]


def times(c: Any, a: Vector) -> Vector:
    """Vector times a number."""
    return [c * p for p in a]


def dot(a: Vector, b: Vector) -> Any:
    """Scalar product."""
    return sum((p * q for p, q in zip(a, b, strict=True)), start=precise().zero)


def cross(a: Vector, b: Vector) -> Vector:
    """Vector product."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def norm(a: Vector) -> Any:
    """Euclidean length."""
    return precise().sqrt(dot(a, a))


def transpose(A: Matrix) -> Matrix:
    """Rows become columns."""
    return [list(column) for column in zip(*A, strict=True)]


def matmul(A: Matrix, B: Matrix) -> Matrix:
    """Product of two matrices."""
    columns = transpose(B)
    return [[dot(row, column) for column in columns] for row in A]


def apply(A: Matrix, a: Vector) -> Vector:
    """Matrix times a vector."""
    return [dot(row, a) for row in A]


def diagonal(a: Vector) -> Matrix:
    """Diagonal matrix."""
    zero = precise().zero
    return [[value if k == m else zero for m in range(len(a))] for k, value in enumerate(a)]


def unit_normal(x0: Vector, x1: Vector, x2: Vector) -> Vector:
    """Normal of length one of a triangle, counterclockwise side."""
    m = cross(sub(x1, x0), sub(x2, x0))
    return times(1 / norm(m), m)


def rotation(U: Matrix) -> Matrix:
    """Orthogonal matrix nearest to one that is so up to rounding: Newton's method for the polar factor."""
    half = precise().mpf(0.5)
    for _ in range(4):
        a, b, c = U
        cofactors = [cross(b, c), cross(c, a), cross(a, b)]
        det = dot(a, cofactors[0])
        U = [
            [half * (p + q / det) for p, q in zip(*rows, strict=True)]
            for rows in zip(U, cofactors, strict=True)
        ]
    return U


# --- differentiation ---------------------------------------------------------------------------------------


def _moved(x: Vector, *moves: tuple[int, Any]) -> Vector:
    x = list(x)
    for k, step in moves:
        x[k] += step
    return x


def derivative(f: Callable[[Vector], Any], x: Vector, k: int) -> Any:
    """Derivative of a number or a vector f(x) in component k of x."""
    step = precise().mpf("1e-30")
    plus, minus = f(_moved(x, (k, step))), f(_moved(x, (k, -step)))
    if isinstance(plus, list):
        return [(p - m) / (2 * step) for p, m in zip(plus, minus, strict=True)]
    return (plus - minus) / (2 * step)


def gradient(f: Callable[[Vector], Any], x: Vector) -> Vector:
    """Derivatives of a number f(x) in all components of x."""
    return [derivative(f, x, k) for k in range(len(x))]


def second(f: Callable[[Vector], Any], x: Vector, k: int, m: int) -> Any:
    """Second derivative of a number f(x) in the components k and m."""
    step = precise().mpf("1e-30")
    if k == m:
        return (f(_moved(x, (k, step))) - 2 * f(x) + f(_moved(x, (k, -step)))) / step**2
    corners = ((a, b, f(_moved(x, (k, a * step), (m, b * step)))) for a in (1, -1) for b in (1, -1))
    return sum(a * b * value for a, b, value in corners) / (4 * step**2)


def hessian(f: Callable[[Vector], Any], x: Vector) -> Matrix:
    """Second derivatives of a number f(x)."""
    H = [[precise().zero] * len(x) for _ in x]
    for k in range(len(x)):
        for m in range(k, len(x)):
            H[k][m] = H[m][k] = second(f, x, k, m)
    return H


# --- the energies ------------------------------------------------------------------------------------------


def linearised(s: Sequence[Any], mu: Any, lam: Any) -> Any:
    """Density mu * sum over i < 2 of (s_i - 1)^2 + lam/2 (s_0 + s_1 - 2)^2."""
    a, b = s[0] - 1, s[1] - 1
    return mu * (a**2 + b**2) + lam / 2 * (s[0] + s[1] - 2) ** 2


def area(s: Sequence[Any], mu: Any, lam: Any) -> Any:
    """Density mu * sum over i < 2 of (s_i - 1)^2 + lam/2 (s_0 s_1 - 1)^2."""
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] * s[1] - 1) ** 2


#: Energies of two stretches. On a triangle, whose third stretch is 1, the volumetric energy is the area one.
ENERGIES: Mapping[str, Callable[[Sequence[Any], Any, Any], Any]] = {
    "linearised": linearised,
    "area": area,
    "volumetric": area,
}


def stretches(F: Matrix, near: Sequence[Any]) -> Vector:
    """Singular values of a 3x3 matrix, each followed by continuity from a nearby value.

    Newton's method on the characteristic polynomial of F^T F, from the square of each value in `near`. They
    must be simple: the normal's stretch cannot be told from an in-plane one that is equal to it.
    """
    C = matmul(transpose(F), F)
    I1 = C[0][0] + C[1][1] + C[2][2]
    I2 = dot(C[0], C[0]) + dot(C[1], C[1]) + dot(C[2], C[2])
    I2 = (I1 * I1 - I2) / 2
    I3 = dot(C[0], cross(C[1], C[2]))
    found = []
    for start in near:
        t = precise().mpf(start) ** 2
        for _ in range(60):
            change = (((t - I1) * t + I2) * t - I3) / ((3 * t - 2 * I1) * t + I2)
            t -= change
            if abs(change) < precise().mpf("1e-70") * abs(t):
                break
        found.append(precise().sqrt(t))
    return found


def psi_of_F(F: Matrix, s: Sequence[Any], mu: Any, lam: Any, energy: str = "linearised") -> Any:
    """Energy density of a 3x3 deformation gradient near one with the stretches s, the normal's last.

    The two in-plane stretches are followed by continuity, and so is, by their complement, the normal's.
    """
    return ENERGIES[energy](stretches(F, s[:2]), mu, lam)


def in_plane_stretches(a: Vector, b: Vector) -> Vector:
    """Principal stretches, the larger first, of the 3x2 matrix [a b]; their sum and product are smooth."""
    product = norm(cross(a, b))
    squares = dot(a, a) + dot(b, b)
    total = precise().sqrt(squares + 2 * product)
    difference = squares - 2 * product
    gap = precise().sqrt(difference) if difference > 0 else precise().zero
    return [(total + gap) / 2, (total - gap) / 2]


def potential_energy(
    X: Sequence[Vector], x: Sequence[Vector], mu: Any, lam: Any, h: Any, energy: str = "linearised"
) -> Any:
    """V(q) = h a psi of one triangle.

    The undeformed triangle is laid flat: edge one along the first axis. The deformed edges are then combined
    to what the two axes have become, and their principal stretches taken.

    Parameters
    ----------
    X, x : three points
        Undeformed and deformed vertices [m].
    mu, lam, h
        Lamé parameters [Pa] and thickness [m].
    energy : str
        A key of `ENERGIES`.
    """
    E1, E2 = sub(X[1], X[0]), sub(X[2], X[0])
    length = norm(E1)
    along, height = dot(E1, E2) / length, norm(cross(E1, E2)) / length
    e1, e2 = sub(x[1], x[0]), sub(x[2], x[0])
    a = times(1 / length, e1)
    b = times(1 / height, sub(e2, times(along, a)))
    return h * length * height / 2 * ENERGIES[energy](in_plane_stretches(a, b), mu, lam)


# --- the truth, task by task -------------------------------------------------------------------------------


def _phi(X: Vector, X0: Vector, X1: Vector, X2: Vector) -> Vector:
    """The nearest point of the plane parts the triangle in three: phi_i is the share opposite vertex i."""
    m = cross(sub(X1, X0), sub(X2, X0))
    P = sub(X, times(dot(m, sub(X, X0)) / dot(m, m), m))
    parts = (cross(sub(b, P), sub(c, P)) for b, c in ((X1, X2), (X2, X0), (X0, X1)))
    return [dot(m, part) / dot(m, m) for part in parts]


def _dphi_dX(X0: Vector, X1: Vector, X2: Vector) -> Matrix:
    """`_phi`, differentiated in X."""
    return transpose([derivative(lambda X: _phi(X, X0, X1, X2), X0, k) for k in range(3)])


def _interpolate(phi: Vector, x0: Vector, x1: Vector, x2: Vector) -> Vector:
    """N(X) q with the 3x9 matrix written out."""
    shape_matrix = [[phi[m // 3] if m % 3 == k else precise().zero for m in range(9)] for k in range(3)]
    return apply(shape_matrix, [*x0, *x1, *x2])


def _deformation_gradient(x0: Vector, x1: Vector, x2: Vector, dphi_dX: Matrix, N: Vector) -> Matrix:
    """The map X -> sum of phi_i(X) x_i + (offset of X along N) n, differentiated in X."""
    n = unit_normal(x0, x1, x2)

    def x(X: Vector) -> Vector:
        point = times(dot(N, X), n)
        for g, vertex in zip(dphi_dX, (x0, x1, x2), strict=True):
            point = add(point, times(dot(g, X), vertex))
        return point

    return transpose([derivative(x, exact([0, 0, 0]), k) for k in range(3)])


def _dn_dx(x0: Vector, x1: Vector, x2: Vector, i: Any) -> Matrix:
    """The unit normal, differentiated in the position of vertex i."""

    def n(x: Vector) -> Vector:
        return unit_normal(x[:3], x[3:6], x[6:])

    return transpose([derivative(n, [*x0, *x1, *x2], 3 * int(i) + k) for k in range(3)])


def _over_triangle(f: Callable[[Vector], Any], area: Any) -> Any:
    """Integral over a triangle of a polynomial f(phi) of degree 2.

    phi = (1-u, u(1-v), uv) maps the unit square to the triangle, with dA = 2 area u du dv: an iterated
    integral of degree 3 in u and 2 in v, for which Simpson's rule is exact.
    """
    half, sixth = precise().mpf(1) / 2, precise().mpf(1) / 6
    simpson = ((precise().mpf(0), sixth), (half, 4 * sixth), (precise().mpf(1), sixth))
    samples = (wu * wv * u * f([1 - u, u * (1 - v), u * v]) for u, wu in simpson for v, wv in simpson)
    return 2 * area * sum(samples)


def _mass_block(i: Any, j: Any, area: Any, rho: Any, h: Any) -> Any:
    """Thickness times the integral of rho phi_i phi_j."""
    return h * _over_triangle(lambda phi: rho * phi[int(i)] * phi[int(j)], area)


def _kinetic_energy(v0: Vector, v1: Vector, v2: Vector, area: Any, rho: Any, h: Any) -> Any:
    """Thickness times the integral of rho |v(X)|^2 / 2."""

    def density(phi: Vector) -> Any:
        v = _interpolate(phi, v0, v1, v2)
        return rho * dot(v, v) / 2

    return h * _over_triangle(density, area)


def _right_cauchy_green(F: Matrix) -> Matrix:
    """Half the second derivatives of |F dX|^2 in dX."""

    def squared_length(dX: Vector) -> Any:
        dx = apply(F, dX)
        return dot(dx, dx)

    return [[value / 2 for value in row] for row in hessian(squared_length, exact([0, 0, 0]))]


def _psi(s: Vector, mu: Any, lam: Any) -> Any:
    """The energy itself: `linearised`, of the two in-plane stretches."""
    return linearised(s, mu, lam)


def _dpsi_ds(s: Vector, mu: Any, lam: Any) -> Vector:
    """`linearised`, differentiated in all three stretches."""
    return gradient(lambda t: linearised(t, mu, lam), s)


def _d2psi_ds2(s: Vector, mu: Any, lam: Any) -> Matrix:
    """`linearised`, differentiated twice in all three stretches."""
    return hessian(lambda t: linearised(t, mu, lam), s)


def _dpsi_dF(U: Matrix, dpsi_ds: Vector, V: Matrix) -> Matrix:
    """An energy of the stretches of F, differentiated in the nine entries of F.

    P depends on the energy only through its gradient in the stretches, and not on the stretches: so the
    energy sum of dpsi_ds[k] s_k(F) is taken, at F = U diag(3, 2, 1) V^T, where the stretches are far apart.
    """
    s = [3, 2, 1]
    F = matmul(matmul(rotation(U), diagonal(exact(s))), transpose(rotation(V)))

    def psi(entries: Vector) -> Any:
        return dot(dpsi_ds, stretches([entries[:3], entries[3:6], entries[6:]], s))

    P = gradient(psi, [entry for row in F for entry in row])
    return [P[:3], P[3:6], P[6:]]


def _nodal_force(P: Matrix, grad_phi: Vector, area: Any, h: Any) -> Vector:
    """Minus the derivative of h a psi in the vertex x: psi changes by P : F, and F by x grad_phi^T."""

    def work(x: Vector) -> Any:
        F = [times(component, grad_phi) for component in x]
        return h * area * sum(dot(p, f) for p, f in zip(P, F, strict=True))

    return [-component for component in gradient(work, exact([0, 0, 0]))]


def _d2psi_dFij(
    U: Matrix, V: Matrix, dpsi_ds: Vector, d2psi_ds2: Matrix, dU: Matrix, ds: Vector, dV: Matrix
) -> Matrix:
    """(U + t dU) diag(dpsi_ds + t d2psi_ds2 ds) (V + t dV)^T, differentiated in t."""

    def along(A: Matrix, dA: Matrix, t: Any) -> Matrix:
        return [add(row, times(t, change)) for row, change in zip(A, dA, strict=True)]

    def stress(at: Vector) -> Vector:
        (t,) = at
        p = add(dpsi_ds, times(t, apply(d2psi_ds2, ds)))
        P = matmul(matmul(along(U, dU, t), diagonal(p)), transpose(along(V, dV, t)))
        return [entry for row in P for entry in row]

    entries = derivative(stress, exact([0]), 0)
    return [entries[:3], entries[3:6], entries[6:]]


def _eigensystem(s: Vector, dpsi_ds: Vector, d2psi_ds2: Matrix) -> Vector:
    """Second derivatives of psi(F) along the four modes, at the 3x2 matrix F with s on its diagonal.

    psi is the quadratic with this gradient and Hessian at s. At s_0 = s_1 it must be symmetric in the two, as
    every energy of the stretches is; elsewhere the stretches are followed in their order. F is moved along
    flip [[0,1],[1,0],[0,0]]/sqrt 2, twist [[0,-1],[1,0],[0,0]]/sqrt 2, and out_i, entry i of the third row.
    """
    one, zero = precise().one, precise().zero
    r = 1 / precise().sqrt(2)
    modes = (
        ([zero, r, zero], [r, zero, zero]),
        ([zero, r, zero], [-r, zero, zero]),
        ([zero, zero, one], [zero, zero, zero]),
        ([zero, zero, zero], [zero, zero, one]),
    )

    def psi(a: Vector, b: Vector) -> Any:
        ds = sub(in_plane_stretches(a, b), s[:2])
        H = [row[:2] for row in d2psi_ds2[:2]]
        return dot(dpsi_ds[:2], ds) + dot(ds, apply(H, ds)) / 2

    def along(mode: tuple[Vector, Vector], at: Vector) -> Any:
        a, b = add([s[0], zero, zero], times(at[0], mode[0])), add([zero, s[1], zero], times(at[0], mode[1]))
        return psi(a, b)

    return [second(functools.partial(along, mode), [zero], 0, 0) for mode in modes]


def _sphere_contact(x: Vector, c: Vector, r: Any) -> tuple[int, Vector]:
    """Distance below the radius; the normal is the direction from the centre, up at the centre itself."""
    d = sub(x, c)
    distance = norm(d)
    return int(distance < r), times(1 / distance, d) if distance > 0 else exact([0, 1, 0])


def _filter_velocity(v: Vector, n: Vector) -> Vector:
    """The velocity, or where it enters the obstacle the same without its part along n."""
    d = dot(n, v)
    return sub(v, times(d, n)) if d < 0 else v


#: One function per task of the cloth assignment; arguments by the names of the task table.
TRUTH: Mapping[str, Callable[..., Any]] = {
    "phi": _phi,
    "dphi_dX": _dphi_dX,
    "interpolate": _interpolate,
    "deformation_gradient": _deformation_gradient,
    "dn_dx": _dn_dx,
    "mass_block": _mass_block,
    "kinetic_energy": _kinetic_energy,
    "right_cauchy_green": _right_cauchy_green,
    "psi": _psi,
    "dpsi_ds": _dpsi_ds,
    "d2psi_ds2": _d2psi_ds2,
    "dpsi_dF": _dpsi_dF,
    "nodal_force": _nodal_force,
    "d2psi_dFij": _d2psi_dFij,
    "eigensystem": _eigensystem,
    "sphere_contact": _sphere_contact,
    "filter_velocity": _filter_velocity,
}


def truth(
    task: str, inputs: Mapping[str, np.ndarray], function: Callable[..., Any] | None = None
) -> tuple[np.ndarray, ...]:
    """The right answers of a task for a batch of inputs, rounded to float64.

    Parameters
    ----------
    task : str
        A key of `TRUTH`.
    inputs : dict of ndarray, (b, ...)
        The task's arguments by name.
    function : callable, optional
        What is true, on exact numbers; default that of `TRUTH`.

    Returns
    -------
    tuple of ndarray, (b, ...)
        One array per result of the task; an integer result as int32.

    Raises
    ------
    MuslinError
        If there is no truth for this task, or mpmath is not installed.
    """
    function = function or TRUTH.get(task)
    if function is None:
        raise MuslinError(f"There is no truth for a task {task!r}.", f"There is: {', '.join(TRUTH)}.")
    columns = []
    for sample in range(len(next(iter(inputs.values())))):
        found = function(**{name: exact(array[sample]) for name, array in inputs.items()})
        columns.append(found if isinstance(found, tuple) else (found,))
    return tuple(
        np.array(column, dtype=np.int32) if isinstance(column[0], int) else rounded(list(column))
        for column in zip(*columns, strict=True)
    )
