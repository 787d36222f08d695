"""Cloth: a triangle mesh that stores elastic energy and has mass, as functions of its vertex positions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from muslin.base import handed, runtime
from muslin.base.errors import MuslinError
from muslin.physics.bending import Hinges, require_model
from muslin.physics.body import OTHERS, PARTS, Body
from muslin.physics.invariants import weights
from muslin.physics.roles import Roles, checked
from muslin.tasks import Functions, taken
from muslin.tasks.wiring import as_called

if TYPE_CHECKING:
    from muslin.mesh import Mesh
    from muslin.physics.elements.element import Element, Membrane, Rest

ENERGIES = ("linearised", "area", "volumetric", "green", "green-area", "neo-hookean")
HESSIANS = ("closed", "lecture")

#: Tasks behind each part of a cloth: part -> names. `hessian` is the closed road.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "energy": ("dphi_dX", "deformation_gradient", "psi"),
        "gradient": ("dphi_dX", "deformation_gradient", "dpsi_ds", "dpsi_dF", "nodal_force"),
        "hessian": ("dphi_dX", "deformation_gradient", "dpsi_ds", "d2psi_ds2", "eigensystem"),
        "lecture's hessian": (
            "dphi_dX", "deformation_gradient", "dpsi_ds", "d2psi_ds2", "d2psi_dFij", "dn_dx",
        ),
        "mass": ("mass_block",),
        "kinetic energy": ("kinetic_energy",),
    }
)  # fmt: skip

#: Tasks that only the energy of their assignment asks a student for.
STRAIN_ENERGY = ("psi", "dpsi_ds", "d2psi_ds2")


def needed(
    energy: str = "linearised", hessian: str = "closed", written: str = "linearised"
) -> dict[str, tuple[str, ...]]:
    """Tasks behind each part of a cloth with this energy, on this road to the Hessian; students write `written`."""
    chosen = {part: NEEDS[part] for part in (*PARTS, *OTHERS)}
    if hessian == "lecture":
        chosen["hessian"] = NEEDS["lecture's hessian"]
    left = () if energy == written else STRAIN_ENERGY
    return {part: tuple(name for name in names if name not in left) for part, names in chosen.items()}


class Cloth(Body):
    """Elastic sheet on a triangle mesh.

    Parameters
    ----------
    mesh : Mesh, (vertices, triangles) or path
        Undeformed cloth.
    mu, lam : float
        Lamé parameters [Pa] (times `h` they are the membrane's, [N/m]).
    rho : float
        Density [kg/m^3].
    h : float
        Thickness [m].
    functions : Functions or path, optional
        A folder's functions, from `muslin.load`, or the folder: the lecture's 3x3 element. Without them the
        framework's own 3x2 element.
    energy : {"linearised", "area", "volumetric", "green", "green-area", "neo-hookean"}
        Energy of the stretches, or one of your own (see `muslin.physics.invariants`). The default is the one that the
        functions' assignment asks for, which alone uses the student's strain energy; without functions the linearised.
    hessian : {"closed", "lecture"}
        Which of the two roads to the Hessian the student's functions take.
    stand_ins : names of tasks
        Whose functions must not be called: the framework's own code computes every part of the cloth that needs
        one of them (see `NEEDS`).
    bending : {"off", "quadratic", "shells"}
        Model of bending (see `muslin.physics.bending`). The quadratic one takes every sheet for flat at rest; shells
        keep the angles of the undeformed mesh.
    bending_stiffness : float
        Flexural rigidity [N m].
    exact_bending : bool
        Whether the matrix of a step is to be exact (see `muslin.physics.elements.bending.Bending`).
    lasting : bool
        Whether the mesh stays for long: if not, the weights of its hinges are found in a quicker way.

    Raises
    ------
    MuslinError
        For a parameter without physical sense, or a mesh that cannot be cloth.
    """

    def __init__(
        self,
        mesh: Mesh | tuple[np.ndarray, np.ndarray] | Path | str,
        *,
        mu: float,
        lam: float,
        rho: float = 1.0,
        h: float = 1.0,
        functions: Functions | Path | str | None = None,
        energy: str = "",
        hessian: str = "closed",
        stand_ins: Iterable[str] = (),
        bending: str = "off",
        bending_stiffness: float = 0.0,
        exact_bending: bool = True,
        lasting: bool = True,
    ):
        functions = None if (given := taken(functions)) is None else as_called(given)
        written = (functions.assignment.energy if functions is not None else "") or ENERGIES[0]
        energy = energy or written
        _check_parameters(mu, lam, rho, h, energy, hessian)
        require_model(bending, bending_stiffness)
        runtime.start()
        from muslin import mesh as meshes
        from muslin.physics.elements.bending import Bending
        from muslin.physics.elements.element import Membrane, Rest
        from muslin.physics.elements.layout import Incidence

        self.mesh = meshes.taken(mesh, meshes.Mesh)
        X = np.ascontiguousarray(self.mesh.vertices, dtype=np.float64)
        self.triangles = np.ascontiguousarray(self.mesh.triangles, dtype=np.int32)
        self.area, self.normal = self.mesh.area_and_normal
        self.mu, self.lam, self.rho, self.h = float(mu), float(lam), float(rho), float(h)
        self.road = hessian
        self.roles, self.needs = (
            Roles(functions, checked(stand_ins, functions)),
            needed(energy, hessian, written),
        )
        _require_tasks(functions, self.needs)
        rest = Rest(X, self.triangles, self.area, self.normal)
        elements = self._elements(rest, Membrane(self.mu, self.lam, self.h, energy))
        hinges, incidence = None, Incidence.of(self.triangles, len(X))
        if bending != "off" and bending_stiffness > 0:
            at = Hinges.of(X, self.triangles, not lasting, incidence)
            hinges = Bending(X, at, bending, bending_stiffness, exact_bending) if len(at.cells) else None
        super().__init__(
            X, self.triangles, elements, self._masses(), self.mesh, self.roles, self.needs,
            self.mu * self.h, hinges, incidence,
        )  # fmt: skip

    def _elements(self, rest: Rest, membrane: Membrane) -> dict[str, Element]:
        """Which element computes each part: the lecture's around a folder's functions, or our own."""
        from muslin.physics.elements.native import NativeElement
        from muslin.physics.elements.student import StudentElement

        found: dict[str, Element] = {}
        own = {part: self.needs[part] for part in PARTS if self.by_student(part) is not None}
        if own and self.functions is not None:
            found |= dict.fromkeys(own, StudentElement(self.functions, own, rest, membrane, self.road))
        if left := [part for part in PARTS if part not in own]:
            found |= dict.fromkeys(left, NativeElement(rest, membrane))
        return found

    def _masses(self) -> np.ndarray:
        """Factor of the identity for each pair of corners of each triangle, (9 m,) [kg]."""
        m = len(self.triangles)
        if functions := self.by_student("mass"):
            from muslin.tasks.batch import evaluate

            i, j = np.divmod(np.tile(np.arange(9), m), 3)
            area = np.repeat(self.area, 9)
            return evaluate(functions.mass_block, i=i, j=j, area=area, rho=self.rho, h=self.h)
        once = self.rho * self.h * self.area
        factor = np.empty((m, 9))
        factor[:], factor[:, ::4] = (once / 12)[:, None], (once * 2 / 12)[:, None]
        return factor.ravel()

    def _moving_energies(self) -> Callable[[np.ndarray], np.ndarray]:
        """What splits the kinetic energy: by the student's function among triangles, else among vertices."""
        if functions := self.by_student("kinetic energy"):
            from muslin.physics.elements.fused import kinetic_energy
            from muslin.physics.elements.kinetic import KineticEnergy

            rest = (self.triangles, self.area, self.rho, self.h)
            return KineticEnergy(functions.kinetic_energy, kinetic_energy, 20, len(self.X), *rest)
        return super()._moving_energies()

    def limiter(
        self, limit: float, pinned: np.ndarray
    ) -> Callable[[np.ndarray, np.ndarray, float], np.ndarray]:
        """What keeps triangles from being stretched beyond a limit, where they can be."""
        from muslin.physics.elements.limit import StretchLimit

        weights = self.mass.sum(axis=1).A1[::3]
        return StretchLimit(self.X, self.triangles, self.normal, weights, pinned, limit)

    word = "cloth"

    def stretches(self, x: np.ndarray) -> np.ndarray:
        """Principal stretches of every triangle, (m, 2), larger first, at positions x (n, 3)."""
        from muslin.mesh import principal_stretches

        return principal_stretches(self.X, self.at_vertices(x, "Positions"), self.triangles)


def _require_tasks(functions: Functions | None, needs: Mapping[str, tuple[str, ...]]) -> None:
    """Refuse a folder of another assignment."""
    there = {} if functions is None else functions.assignment.tasks
    wanted = () if functions is None else [name for names in needs.values() for name in names]
    if functions is not None and (absent := [name for name in wanted if name not in there]):
        raise MuslinError(
            f"The assignment {functions.assignment.name!r} has no task {absent[0]!r}, which a cloth calls.",
            "Give the functions of the cloth assignment, or none.",
        )


def _check_parameters(mu: float, lam: float, rho: float, h: float, energy: str, hessian: str) -> None:
    for name, value in {"mu": mu, "rho": rho, "h": h}.items():
        handed.positive(name, value)
    if not handed.number("lam", lam) > -mu:
        raise MuslinError(
            f"lam = {lam} must be a number above -mu = {-mu}.", "Otherwise the cloth is unstable at rest."
        )
    for what, chosen, known in (("energy", energy, ENERGIES), ("hessian", hessian, HESSIANS)):
        if chosen not in known and not (what == "energy" and weights(chosen)):
            raise MuslinError(f"There is no {what} {chosen!r}.", f"There is: {', '.join(known)}.")
