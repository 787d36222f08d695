"""One tetrahedron from its vertices to the force and the stiffness: what `muslin explain` follows."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np

#: The tasks on the way, in the order of the handout.
example_tasks = (
    "dphi_dX", "deformation_gradient", "psi", "dpsi_dF", "d2psi_dF2", "nodal_force", "stiffness_block",
)  # fmt: skip


def example(cases: Callable[[str], dict[str, np.ndarray]], case: int) -> Generator[Any, Any, None]:
    """The whole way of one tetrahedron; see `muslin.student.explaining.example`."""
    a, b = cases("deformation_gradient"), cases("psi")
    case = min(case, len(a["x0"]) - 1, len(b["C"]) - 1)
    D = np.linalg.inv(a["dphi_dX"][case][1:])
    x = {f"x{k}": a[f"x{k}"][case] for k in range(4)}
    material = {"C": b["C"][case], "D": b["D"][case]}
    volume = np.linalg.det(D) / 6
    yield "One whole tetrahedron, from its vertices on.", {"edges X_i - X_0": D, "volume": volume}
    X = {"X0": np.zeros(3), **{f"X{k + 1}": D[:, k] for k in range(3)}}
    dphi_dX = yield "dphi_dX", ("dphi_dX", X)
    F = yield "F", ("deformation_gradient", {**x, "dphi_dX": dphi_dX})
    yield "psi", ("psi", {"F": F, **material})
    P = yield "P", ("dpsi_dF", {"F": F, **material})
    H = yield "d2psi_dF2", ("d2psi_dF2", {"F": F, **material})
    yield "f_0", ("nodal_force", {"P": P, "grad_phi": dphi_dX[0], "volume": volume})
    yield (
        "K_01",
        (
            "stiffness_block",
            {"d2psi_dF2": H, "grad_phi_i": dphi_dX[0], "grad_phi_j": dphi_dX[1], "volume": volume},
        ),
    )
