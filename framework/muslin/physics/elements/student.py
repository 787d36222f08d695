"""The lecture's element: the student's functions on the 3x3 deformation gradient, F N = n.

One kernel calls all the functions a part of the cloth needs (`fused`). Where something goes wrong in it, each
function is called once more in a kernel of its own (`singly`), which names the function, the line or the triangle.
The lecture's road to the Hessian goes by those single kernels too.
"""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np

from muslin.base import runtime
from muslin.base.errors import MuslinError, SimulationError
from muslin.base.launch import Launch, is_small
from muslin.physics.elements import lecture, modes
from muslin.physics.elements.calling import CallingElement
from muslin.physics.elements.element import PARTS, Membrane, Rest, apart
from muslin.physics.elements.fused import fused
from muslin.physics.elements.singly import KERNELS
from muslin.physics.energies import ENERGIES, FLIPS
from muslin.tasks import Functions
from muslin.tasks.batch import evaluate


class StudentElement(CallingElement):
    """Energy, gradient and Hessian of every triangle, by the functions of a folder.

    Parameters
    ----------
    functions : Functions
        What `muslin.load` returned.
    needs : mapping
        See `CallingElement`.
    rest : Rest
    membrane : Membrane
    road : {"closed", "lecture"}
        To the Hessian: `eigensystem`, or `d2psi_dFij` and `dn_dx`.
    """

    kernels, cell = KERNELS, "triangle"

    def __init__(
        self,
        functions: Functions,
        needs: Mapping[str, tuple[str, ...]],
        rest: Rest,
        membrane: Membrane,
        road: str,
    ):
        m = len(rest.triangles)
        self.rest, self.membrane, self.road = rest, membrane, road
        self._state: dict[str, np.ndarray] = {}
        f = _with_energy(functions, membrane.energy)
        hessians = (m, modes.LENGTH) if road == "closed" else (9 * m, 3, 3)
        super().__init__(f, needs, rest.X, rest.triangles, hessians)
        X, corners = apart(rest.X, rest.triangles)
        self.dphi = evaluate(f.dphi_dX, **{f"X{k}": X[corners[:, k]] for k in range(3)})

    def _can(self, part: str, names: tuple[str, ...]) -> bool:
        return not (part == "hessian" and self.road == "lecture") and super()._can(part, names)

    def update(self, x: np.ndarray) -> None:
        """Take new positions (n, 3)."""
        super().update(x)
        self._state.clear()

    def _run(self, parts: int, project: bool) -> None:
        if self.road == "lecture" and parts & PARTS["hessian"]:
            self._lecture(project)
            parts &= ~PARTS["hessian"]
        if parts:
            super()._run(parts, project)

    def _fused(self, able: int) -> Launch:
        rest, made_of = self.rest, self.membrane
        kernel = fused(self.f, able, is_small(len(self.cells), 100))
        modes_here = self.hessians if self.road == "closed" else np.zeros((0, modes.LENGTH))
        at_rest = (self.dphi, rest.normal, rest.area, made_of.mu, made_of.lam, made_of.h)
        out = (self.energies, self.gradients, modes_here)
        return Launch(kernel, self._orders, *self.at, *at_rest, *out)

    # One function at a time -----------------------------------------------------------------------------------

    def _require_triangles(self) -> None:
        """Refuse positions no deformation gradient exists for, before a student's function is blamed for it."""
        x = self.x
        if not np.isfinite(x).all():
            raise SimulationError("A position is not a number.", "Reduce dt, or check force and Hessian.")
        a, b, c = (x[self.cells[:, k]] for k in range(3))
        flat = np.flatnonzero((np.cross(b - a, c - a) ** 2).sum(axis=1) == 0)
        if len(flat):
            corners = ", ".join(map(str, self.cells[flat[0]]))
            raise SimulationError(
                f"Triangle {flat[0]} (vertices {corners}) has collapsed and has no normal.",
                "Reduce dt, or look at how the scene starts.",
            )

    def _decomposed(self) -> SimpleNamespace:
        """F, U, s, V and dpsi_ds of every triangle here."""
        if not self._state:
            m = len(self.cells)
            self._require_triangles()
            F, U, V, s, p = *(np.empty((m, 3, 3)) for _ in range(3)), np.empty((m, 3)), np.empty((m, 3))
            self._single("deformation_gradient", *self.at, self.dphi, self.rest.normal, F)
            runtime.call(lecture.svd, F, self.rest.normal, U, s, V)
            self._state = {"F": F, "U": U, "V": V, "s": s, "p": p}
        return SimpleNamespace(**self._state)

    def _explain(self, parts: int) -> None:
        """Call the functions behind these parts one by one, until one fails: its name is in the exception."""
        self._state.clear()
        at = self._decomposed()
        m = len(self.cells)
        if parts & PARTS["energy"]:
            self._single("psi", at.s, self.membrane.mu, self.membrane.lam, np.empty(m))
        if parts & (PARTS["gradient"] | PARTS["hessian"]):
            self._single("dpsi_ds", at.s, self.membrane.mu, self.membrane.lam, at.p)
        if parts & PARTS["gradient"]:
            P = np.empty((m, 3, 3))
            self._single("dpsi_dF", at.U, at.p, at.V, P)
            self._single("nodal_force", P, self.dphi, self.rest.area, self.membrane.h, np.empty((3 * m, 3)))
        if parts & PARTS["hessian"]:
            H = np.empty((m, 3, 3))
            self._single("d2psi_ds2", at.s, self.membrane.mu, self.membrane.lam, H)
            self._single("eigensystem", at.s, at.p, H, np.empty((m, 4)))

    # The lecture's road -----------------------------------------------------------------------------------------

    def _lecture(self, project: bool) -> None:
        """Hessian of each triangle's energy on the lecture's road: `hessians`, corner by corner [N/m]."""
        at = self._decomposed()
        m = len(self.cells)
        s, p, H = np.empty_like(at.s), np.empty_like(at.s), np.empty_like(at.F)
        columns, dn, out = np.empty((9 * m, 3, 3)), np.empty((3 * m, 3, 3)), self.hessians
        # U, V and the stretches split apart belong to one nearby matrix; forces use the true ones
        runtime.call(lecture.split, at.s, s)
        self._single("dpsi_ds", s, self.membrane.mu, self.membrane.lam, p)
        self._single("d2psi_ds2", s, self.membrane.mu, self.membrane.lam, H)
        self._single("d2psi_dFij", at.U, s, at.V, p, H, columns)
        self._single("dn_dx", *self.at, dn)
        runtime.call(
            lecture.chain_rule, columns, dn, self.dphi, self.rest.normal, self.rest.area, self.membrane.h, out
        )
        if project:
            modes_at = (at.U, at.V, self.dphi, self.rest.area, self.membrane.h, out)
            runtime.call(lecture.clamp_known_modes, *apart(self.rest.X, self.cells), *modes_at)


def _with_energy(functions: Functions, energy: str) -> SimpleNamespace:
    """Functions by name, those of the stretches exchanged for the framework's own where they write another energy."""
    f = SimpleNamespace(**{function.task.name: function for function in functions})  # type: ignore[attr-defined]
    f.flip = None
    written = functions.assignment.energy or "linearised"
    if energy != written:
        if energy not in ENERGIES:
            known = ", ".join([written, *ENERGIES])
            raise MuslinError(f"With these functions there is no energy {energy!r}.", f"There is: {known}.")
        f.psi, f.dpsi_ds, f.d2psi_ds2 = ENERGIES[energy]
        f.flip = FLIPS.get(energy)
    return f
