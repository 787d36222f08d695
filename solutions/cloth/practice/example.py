"""One triangle from its vertices to the force and the modes: what `muslin explain` follows."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import Any

import numpy as np

#: The tasks on the way, in the order of the handout.
example_tasks = (
    "dphi_dX", "deformation_gradient", "right_cauchy_green", "psi", "dpsi_ds", "d2psi_ds2", "dpsi_dF",
    "nodal_force", "eigensystem",
)  # fmt: skip


def example(cases: Callable[[str], dict[str, np.ndarray]], case: int) -> Generator[Any, Any, None]:
    """The whole way of one triangle; see `muslin.student.explaining.example`."""
    from muslin import given
    from muslin.tasks.batch import evaluate

    a, b = cases("deformation_gradient"), cases("psi")
    case = min(case, len(a["N"]) - 1, len(b["mu"]) - 1)
    D = np.linalg.pinv(a["dphi_dX"][case][1:])
    x0, x1, x2, N = (a[key][case] for key in ("x0", "x1", "x2", "N"))
    material = {"mu": b["mu"][case], "lam": b["lam"][case]}
    area = np.linalg.norm(np.cross(D[:, 0], D[:, 1])) / 2
    yield "One whole triangle, from its vertices on.", {"D": D, "N": N}
    dphi_dX = yield "dphi_dX", ("dphi_dX", {"X0": np.zeros(3), "X1": D[:, 0], "X2": D[:, 1]})
    F = yield "F", ("deformation_gradient", {"x0": x0, "x1": x1, "x2": x2, "dphi_dX": dphi_dX, "N": N})
    U, s, V = (part[0] for part in evaluate(given.svd, F=F[None], N=N[None]))
    yield "", {"U (given svd)": U, "s": s, "V": V}
    yield "C", ("right_cauchy_green", {"F": F})
    yield "psi", ("psi", {"s": s, **material})
    p = yield "dpsi_ds", ("dpsi_ds", {"s": s, **material})
    H = yield "d2psi_ds2", ("d2psi_ds2", {"s": s, **material})
    P = yield "P", ("dpsi_dF", {"U": U, "dpsi_ds": p, "V": V})
    yield "f_0", ("nodal_force", {"P": P, "grad_phi": dphi_dX[0], "area": area, "h": 1.0})
    yield "modes", ("eigensystem", {"s": s, "dpsi_ds": p, "d2psi_ds2": H})
