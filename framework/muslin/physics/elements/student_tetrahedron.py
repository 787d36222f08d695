"""The assignment's tetrahedron: the student's functions, from the deformation gradient to nodal forces and stiffness.

One kernel calls all the functions a part of the solid needs. The Hessian is made positive semi-definite where it is
9x9, before it becomes stiffness: its twists, flips and stretches are known from F alone, so that no matrix larger
than 3x3 is decomposed, and what was positive already stays what the student's function returned.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np

from muslin.base.launch import Launch, is_small
from muslin.physics.elements.calling import CallingElement
from muslin.physics.elements.element import PARTS, apart
from muslin.physics.elements.student_tetrahedron_kernels import CALLED, SINGLE, fused
from muslin.physics.elements.tetrahedron import RestSolid, require_upright
from muslin.tasks import Functions
from muslin.tasks.batch import evaluate, kept


class StudentTetrahedron(CallingElement):
    """Energy, gradient and Hessian of every tetrahedron, by the functions of a folder.

    Parameters
    ----------
    functions : Functions
        What `muslin.load` returned.
    needs : mapping
        See `CallingElement`.
    rest : RestSolid
    C, D : float
        [Pa]
    """

    kernels, cell = SINGLE, "tetrahedron"

    def __init__(
        self, functions: Functions, needs: Mapping[str, tuple[str, ...]], rest: RestSolid, C: float, D: float
    ):
        f = SimpleNamespace(**{function.task.name: function for function in functions})  # type: ignore[attr-defined]
        super().__init__(f, needs, rest.X, rest.cells, (16 * len(rest.cells), 3, 3))
        self.C, self.D, self.volume = float(C), float(D), np.ascontiguousarray(rest.volume)
        X, corners = apart(rest.X, rest.cells)
        self.dphi = evaluate(f.dphi_dX, **{f"X{k}": X[corners[:, k]] for k in range(4)})

    def _fused(self, able: int) -> Launch:
        functions = tuple(getattr(self.f, name) for name in CALLED)
        serial = is_small(len(self.cells), 2000)
        key = ("tetrahedron", able, serial, functions)
        kernel = kept(self.f.deformation_gradient, key, lambda: fused(self.f, able, serial))
        at_rest = (self.dphi, self.volume, self.C, self.D)
        out = (self.energies, self.gradients, self.hessians)
        return Launch(kernel, self._orders, *self.at, *at_rest, *out)

    def _explain(self, parts: int) -> None:
        m, constants = len(self.cells), (self.C, self.D)
        if parts == PARTS["energy"] and np.isfinite(self.x).all() and self._inverted():
            return  # the energy is infinite, and the kernel has said so
        require_upright(self.x, self.cells)
        F = np.empty((m, 3, 3))
        self._single("deformation_gradient", *self.at, self.dphi, F)
        if parts & PARTS["energy"]:
            self._single("psi", F, *constants, np.empty(m))
        if parts & PARTS["gradient"]:
            P = np.empty((m, 3, 3))
            self._single("dpsi_dF", F, *constants, P)
            self._single("nodal_force", P, self.dphi, self.volume, np.empty((4 * m, 3)))
        if parts & PARTS["hessian"]:
            H = np.empty((m, 9, 9))
            self._single("d2psi_dF2", F, *constants, H)
            self._single("stiffness_block", H, self.dphi, self.volume, np.empty((16 * m, 3, 3)))

    def _inverted(self) -> bool:
        a, b, c = (self.x[self.cells[:, k]] - self.x[self.cells[:, 0]] for k in (1, 2, 3))
        return bool((np.einsum("ij,ij->i", np.cross(a, b), c) <= 0).any())
