"""Solid: a tetrahedral mesh that stores elastic energy and has mass, as functions of its vertex positions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from muslin.base import handed, runtime
from muslin.base.errors import MuslinError, choices
from muslin.physics.body import PARTS, Body
from muslin.physics.roles import Roles, checked
from muslin.tasks import Functions, taken

if TYPE_CHECKING:
    from muslin.mesh import TetMesh
    from muslin.physics.elements.element import Element
    from muslin.physics.elements.tetrahedron import RestSolid

#: The energy of the assignment, and the framework's own.
ENERGIES = ("neo-hookean", "corotated", "st-venant-kirchhoff", "stable-neo-hookean")

#: Tasks behind each part of a solid: part -> names.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "energy": ("dphi_dX", "deformation_gradient", "psi"),
        "gradient": ("dphi_dX", "deformation_gradient", "dpsi_dF", "nodal_force"),
        "hessian": ("dphi_dX", "deformation_gradient", "d2psi_dF2", "stiffness_block"),
        "mass": ("mass_block",),
        "kinetic energy": ("kinetic_energy",),
    }
)

#: Parts that are the framework's own unless the energy is the assignment's.
STRAIN_ENERGY = PARTS


def constants(mu: float, lam: float, course_parameters: bool = False) -> tuple[float, float]:
    """C and D of the Neo-Hookean energy [Pa] from Lamé parameters.

    C = mu/2, and D = lam/2 + mu/3: half the bulk modulus, so that small strains have the E and nu that were asked for.
    The course takes D = lam/2 (`course_parameters`); then the bulk modulus is lam instead of lam + 2/3 mu.
    """
    return mu / 2, lam / 2 + (0.0 if course_parameters else mu / 3)


def needed(energy: str = ENERGIES[0]) -> dict[str, tuple[str, ...]]:
    """Tasks behind each part of a solid with this energy."""
    own = () if energy == ENERGIES[0] else STRAIN_ENERGY
    return {part: names for part, names in NEEDS.items() if part not in own}


class Solid(Body):
    """Elastic solid on a tetrahedral mesh.

    Parameters
    ----------
    mesh : TetMesh, (vertices, tetrahedra) or path
        Undeformed solid.
    C, D : float
        Stiffness against a change of shape and of volume [Pa]: half the shear modulus and half the bulk modulus.
        The other energies take mu = 2 C and lam = 2 D - 4/3 C, which are the same for small strains.
    rho : float
        Density [kg/m^3].
    functions : Functions or path, optional
        A folder's functions, from `muslin.load`, or the folder. Without them the framework's own element.
    energy : {"neo-hookean", "corotated", "st-venant-kirchhoff", "stable-neo-hookean"}
        Strain energy; only the first one uses a student's. It is infinite where a tetrahedron is inverted.
    stand_ins : names of tasks
        Whose functions must not be called: the framework's own code computes every part of the solid that needs
        one of them (see `NEEDS`).

    Raises
    ------
    MuslinError
        For a parameter without physical sense, or a mesh that cannot be a solid.
    """

    def __init__(
        self,
        mesh: TetMesh | tuple[np.ndarray, np.ndarray] | Path | str,
        *,
        C: float,
        D: float,
        rho: float = 1.0,
        functions: Functions | Path | str | None = None,
        energy: str = ENERGIES[0],
        stand_ins: Iterable[str] = (),
    ):
        functions = taken(functions)
        _check_parameters(C, D, rho, energy)
        runtime.start()
        from muslin import mesh as meshes
        from muslin.mesh.surface import frozen
        from muslin.physics.elements.tetrahedron import RestSolid

        self.solid = meshes.taken(mesh, meshes.TetMesh)
        X = np.ascontiguousarray(self.solid.vertices, dtype=np.float64)
        cells = np.ascontiguousarray(self.solid.cells, dtype=np.int32)
        self.C, self.D, self.rho, self.energy_name = float(C), float(D), float(rho), energy
        self.volume = np.ascontiguousarray(self.solid.volumes)
        self.roles, self.needs = Roles(functions, checked(stand_ins, functions)), needed(energy)
        _require_tasks(functions)
        elements = self._elements(RestSolid(X, cells, self.volume))
        mass = self._masses(len(cells))
        surface = frozen(X, self.solid.surface, self.solid.name, self.solid.notices, self.solid.numbers)
        stiffness = 2 * self.C * self.solid.extent
        super().__init__(X, cells, elements, mass, surface, self.roles, self.needs, stiffness)

    @property
    def undeformed(self) -> TetMesh:
        """The mesh it was made of."""
        return self.solid

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé parameters (mu, lam) of small strains [Pa]."""
        return 2 * self.C, 2 * self.D - 4 / 3 * self.C

    def _elements(self, rest: RestSolid) -> dict[str, Element]:
        """Which element computes each part: one around a folder's functions, or our own."""
        from muslin.physics.elements.student_tetrahedron import StudentTetrahedron
        from muslin.physics.elements.tetrahedron import NativeTetrahedron

        found: dict[str, Element] = {}
        own = {part: self.needs[part] for part in PARTS if self.by_student(part) is not None}
        if own and self.functions is not None:
            found |= dict.fromkeys(own, StudentTetrahedron(self.functions, own, rest, self.C, self.D))
        if left := [part for part in PARTS if part not in own]:
            constants = (self.C, self.D) if self.energy_name == ENERGIES[0] else self.lame
            found |= dict.fromkeys(left, NativeTetrahedron(rest, self.energy_name, *constants))
        return found

    def _masses(self, m: int) -> np.ndarray:
        """Factor of the identity for each pair of corners of each tetrahedron, (16 m,) [kg]."""
        i, j = np.divmod(np.tile(np.arange(16), m), 4)
        volume = np.repeat(self.volume, 16)
        if functions := self.by_student("mass"):
            from muslin.tasks.batch import evaluate

            return evaluate(functions.mass_block, i=i, j=j, volume=volume, rho=self.rho)
        return self.rho * volume * np.where(i == j, 2.0, 1.0) / 20

    def _moving_energies(self) -> Callable[[np.ndarray], np.ndarray]:
        """What splits the kinetic energy: by the student's function among tetrahedra, else among vertices."""
        if functions := self.by_student("kinetic energy"):
            from muslin.physics.elements.kinetic import KineticEnergy
            from muslin.physics.elements.student_tetrahedron_kernels import kinetic_energy

            rest = (self.cells, self.volume, self.rho)
            return KineticEnergy(functions.kinetic_energy, kinetic_energy, 25, len(self.X), *rest)
        return super()._moving_energies()

    def von_mises(self, x: np.ndarray) -> np.ndarray:
        """How hard each tetrahedron is stressed beside its pressure, (m,) [Pa]: sqrt(3/2) |dev sigma|."""
        from muslin.mesh.tets import deformation_gradients

        self.update(x)
        self.prepare("gradient")
        forces = self.elements["gradient"].gradients.reshape(-1, 4, 3)[:, 1:]
        rest = self.X[self.cells[:, 1:]] - self.X[self.cells[:, :1]]
        # gradient i is V P g_i, and the edges are the inverse of the g_i
        P = np.einsum("mia,mib->mab", forces, rest) / self.volume[:, None, None]
        F = deformation_gradients(self.X, self.at_vertices(x, "Positions"), self.cells)
        sigma = P @ np.swapaxes(F, 1, 2) / np.linalg.det(F)[:, None, None]
        deviator = sigma - np.trace(sigma, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
        return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=(1, 2))))

    word = "solid"
    exact_near_rest = True


def _require_tasks(functions: Functions | None) -> None:
    """Refuse a folder of another assignment."""
    there = {} if functions is None else functions.assignment.tasks
    wanted = () if functions is None else [name for names in NEEDS.values() for name in names]
    if functions is not None and (absent := [name for name in wanted if name not in there]):
        raise MuslinError(
            f"The assignment {functions.assignment.name!r} has no task {absent[0]!r}, which a solid calls.",
            "Give the functions of the solids assignment, or none.",
        )


def _check_parameters(C: float, D: float, rho: float, energy: str) -> None:
    for name, value in {"C": C, "D": D, "rho": rho}.items():
        handed.positive(name, value)
    if energy not in ENERGIES:
        raise MuslinError(f"A solid has no energy {energy!r}.", choices(energy, ENERGIES))
