"""The energies of two stretches, and what follows from them for one triangle, in exact numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from muslin.judging.exact import Matrix, Vector, cross, dot, matmul, norm, precise, sub, times, transpose


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
