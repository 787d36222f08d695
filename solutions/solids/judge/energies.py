"""The Neo-Hookean energy of a deformation gradient, in exact numbers: all that is true of it follows from here."""

from __future__ import annotations

from typing import Any

from muslin.judging.exact import Matrix, Vector, cross, dot, precise


def neo_hookean(entries: Vector, C: Any, D: Any) -> Any:
    """C (J^(-2/3) tr(F^T F) - 3) + D (J - 1)^2 of the nine entries of F, row by row.

    Raises
    ------
    ValueError
        Where J is not positive: there the energy is infinite, and no task asks for it.
    """
    rows: Matrix = [entries[:3], entries[3:6], entries[6:]]
    J = dot(rows[0], cross(rows[1], rows[2]))
    if not J > 0:
        raise ValueError("The tetrahedron is turned inside out: its energy is infinite.")
    return C * (dot(entries, entries) / precise().cbrt(J) ** 2 - 3) + D * (J - 1) ** 2
