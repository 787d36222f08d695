"""Cloth: a triangle mesh that stores elastic energy and has mass, as functions of its vertex positions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin import runtime
from muslin.errors import MuslinError
from muslin.mesh import Mesh, area_and_normal, principal_stretches
from muslin.mesh import load as load_mesh
from muslin.stand_ins import checked, needs
from muslin.tasks import Functions

if TYPE_CHECKING:
    import scipy.sparse as sp

    from muslin.elements.layout import Layout
    from muslin.elements.pattern import Assembly, Impulse

ENERGIES = ("linearised", "area", "volumetric")
HESSIANS = ("closed", "lecture")


class Cloth:
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
    functions : Functions, optional
        A folder's functions, from `muslin.load`: the lecture's 3x3 element. Without them the framework's own
        3x2 element.
    energy : {"linearised", "area", "volumetric"}
        Energy of the stretches; only the linearised one uses the student's strain energy.
    hessian : {"closed", "lecture"}
        Which of the two roads to the Hessian the student's functions take.
    stand_ins : names of tasks
        Whose functions must not be called: the framework's own code computes every part of the cloth that needs
        one of them (see `muslin.stand_ins.NEEDS`).

    Attributes
    ----------
    mass : scipy.sparse.csr_matrix, (3n, 3n)
        Consistent mass matrix [kg].

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
        functions: Functions | None = None,
        energy: str = "linearised",
        hessian: str = "closed",
        stand_ins: Iterable[str] = (),
    ):
        _check_parameters(mu, lam, rho, h, energy, hessian)
        runtime.start()
        from muslin.elements.native import NativeElement
        from muslin.elements.pattern import Pattern
        from muslin.elements.student import StudentElement

        if isinstance(mesh, (str, Path)):
            mesh = load_mesh(mesh)
        self.mesh = mesh if isinstance(mesh, Mesh) else Mesh.from_arrays(*mesh)
        self.X = np.ascontiguousarray(self.mesh.vertices, dtype=np.float64)
        self.triangles = np.ascontiguousarray(self.mesh.triangles, dtype=np.int32)
        self.area, self.normal = area_and_normal(self.X, self.triangles)
        self.mu, self.lam, self.rho, self.h = float(mu), float(lam), float(rho), float(h)
        self.functions = functions
        self.pattern = Pattern(self.triangles, len(self.X))
        self.energy_name, self.road, self.stand_ins = energy, hessian, checked(stand_ins, functions)
        rest = (self.X, self.triangles, self.area, self.normal, self.mu, self.lam, self.h, energy)
        parts = ("energy", "gradient", "hessian")
        own = [part for part in parts if self.by_student(part)]
        student = StudentElement(functions, own, *rest, hessian) if functions is not None and own else None
        native = NativeElement(*rest) if len(own) < len(parts) else None
        #: which element computes each part
        self.elements: dict[str, Any] = {part: student if part in own else native for part in parts}
        self._distinct = [element for element in (student, native) if element is not None]
        self.mass_factor = self.pattern.blocks(self._mass_factor())
        self.mass_data = np.zeros(self.pattern.nnz)
        layout = self.pattern.layout
        for a in range(3):
            self.mass_data[layout.start + a * (layout.stride + 1)] = self.mass_factor
        self.mass = self.pattern.matrix(self.mass_data)
        self._sum: Any = None
        self._moving: Any = None

    def by_student(self, part: str) -> Functions | None:
        """The functions that compute a part (a key of `muslin.stand_ins.NEEDS`), or None if native code does."""
        wanted = needs(part, self.energy_name, self.road)
        return None if self.stand_ins.intersection(wanted) else self.functions

    def tasks_behind(self, *parts: str) -> frozenset[str]:
        """Tasks whose functions compute these parts."""
        return frozenset(
            name
            for part in parts
            if self.by_student(part) is not None
            for name in needs(part, self.energy_name, self.road)
        )

    @property
    def uses(self) -> frozenset[str]:
        """Tasks whose functions energy, gradient, Hessian, mass and kinetic energy of this cloth really call."""
        return self.tasks_behind("energy", "gradient", "hessian", "mass", "kinetic energy")

    def _mass_factor(self) -> np.ndarray:
        """Factor of the identity for each pair of corners of each triangle, (9 m,) [kg]."""
        m = len(self.triangles)
        i, j = np.divmod(np.tile(np.arange(9), m), 3)
        area = np.repeat(self.area, 9)
        if functions := self.by_student("mass"):
            from muslin.batch import evaluate

            return evaluate(functions.mass_block, i=i, j=j, area=area, rho=self.rho, h=self.h)
        return self.rho * self.h * area * np.where(i == j, 2.0, 1.0) / 12

    def assembly(self, layout: Layout, data: np.ndarray | None = None) -> Assembly:
        """What writes M + scale d2V/dx2 to a layout of blocks; `prepare` the Hessian before calling it."""
        from muslin.elements.pattern import Assembly

        return Assembly(self.pattern, layout, self.mass_factor, self.elements["hessian"].rows, data)

    def impulse(self) -> Impulse:
        """What computes M v + dt (force - gradient); `prepare` the gradient before calling it."""
        from muslin.elements.pattern import Impulse

        return Impulse(self.pattern, self.mass_factor, self.elements["gradient"].gradient_rows)

    # One position at a time: what several of these need is computed once ---------------------------------

    def update(self, x: np.ndarray) -> None:
        """Take new positions; `energy_here`, `gradient_here` and `stiffness_here` then refer to them.

        Parameters
        ----------
        x : (n, 3) array
            World positions [m].

        Raises
        ------
        MuslinError
            If the shape is wrong.
        """
        x = (
            np.ascontiguousarray(x, dtype=np.float64).reshape(-1, 3)
            if np.size(x) == self.X.size
            else np.asarray(x)
        )
        if x.shape != self.X.shape:
            raise MuslinError(f"Positions have shape {x.shape}; this cloth needs {self.X.shape}.")
        runtime.start()  # should somebody else have restarted Taichi
        for element in self._distinct:
            element.update(x)

    def prepare(self, *parts: str, project: bool = True) -> None:
        """Compute parts ("energy", "gradient", "hessian") at the positions taken, in as few launches as can be.

        Only a matter of speed: the functions below compute what they need, each for itself.
        """
        for element in self._distinct:
            if own := [part for part in parts if self.elements[part] is element]:
                element.compute(*own, project=project)

    def energy_here(self) -> float:
        """Elastic energy [J]."""
        return float(self.elements["energy"].energies().sum())

    def gradient_here(self) -> np.ndarray:
        """Gradient of the elastic energy, (n, 3) [N]; minus this is the force."""
        return self.pattern.vector(self.elements["gradient"].gradients())

    def stiffness_here(self, project: bool = True) -> np.ndarray:
        """Data array (nnz,) of the energy's Hessian on `pattern` [N/m]."""
        from muslin.elements.pattern import Assembly

        self.prepare("hessian", project=project)
        if self._sum is None:
            massless = np.zeros_like(self.mass_factor)
            self._sum = Assembly(self.pattern, self.pattern.layout, massless, self.elements["hessian"].rows)
        return self._sum(1.0).copy()

    # At given positions -------------------------------------------------------------------------------------

    def energy(self, x: np.ndarray) -> float:
        """Elastic energy V [J] at positions x (n, 3)."""
        self.update(x)
        return self.energy_here()

    def gradient(self, x: np.ndarray) -> np.ndarray:
        """dV/dx, (n, 3) [N], at positions x (n, 3)."""
        self.update(x)
        return self.gradient_here()

    def hessian(self, x: np.ndarray, project: bool = False) -> sp.csr_matrix:
        """d2V/dx2, scipy CSR (3n, 3n) [N/m], at positions x (n, 3).

        With `project` each triangle's Hessian is made positive semi-definite by clamping its known modes.
        """
        self.update(x)
        return self.pattern.matrix(self.stiffness_here(project))

    def kinetic_energy(self, v: np.ndarray) -> float:
        """1/2 qdot^T M qdot [J] for velocities v (n, 3)."""
        if self._moving is None:
            self._moving = self._moving_energies()
        return float(self._moving(v).sum())

    def _moving_energies(self) -> Callable[[np.ndarray], np.ndarray]:
        """What splits the kinetic energy: by the student's function among triangles, else among vertices."""
        from muslin.elements import pattern, student

        if functions := self.by_student("kinetic energy"):
            rest = (self.triangles, self.area, self.rho, self.h)
            return student.KineticEnergy(functions.kinetic_energy, len(self.X), *rest)
        return pattern.KineticEnergy(self.pattern, self.mass_factor)

    def stretches(self, x: np.ndarray) -> np.ndarray:
        """Principal stretches of every triangle, (m, 2), larger first, at positions x (n, 3)."""
        return principal_stretches(self.X, x, self.triangles)


def _check_parameters(mu: float, lam: float, rho: float, h: float, energy: str, hessian: str) -> None:
    for name, value in {"mu": mu, "rho": rho, "h": h}.items():
        if not (np.isfinite(value) and value > 0):
            raise MuslinError(f"{name} = {value} must be positive.")
    if not (np.isfinite(lam) and lam > -mu):
        raise MuslinError(
            f"lam = {lam} must be a number above -mu = {-mu}.", "Otherwise the cloth is unstable at rest."
        )
    for what, chosen, known in (("energy", energy, ENERGIES), ("hessian", hessian, HESSIANS)):
        if chosen not in known:
            raise MuslinError(f"There is no {what} {chosen!r}.", f"There is: {', '.join(known)}.")
