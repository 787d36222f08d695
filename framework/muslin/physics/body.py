"""A body: a mesh of triangles or tetrahedra that stores elastic energy and has mass, as functions of its positions."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.base import handed, runtime
from muslin.base.errors import MuslinError
from muslin.physics.roles import Roles
from muslin.tasks import Functions

if TYPE_CHECKING:
    import scipy.sparse as sp

    from muslin.mesh import Mesh, TetMesh
    from muslin.physics.elements.bending import Bending
    from muslin.physics.elements.element import Element
    from muslin.physics.elements.layout import Incidence, Layout
    from muslin.physics.elements.pattern import Assembly

#: What the elements of a body compute.
PARTS = ("energy", "gradient", "hessian")

#: What is computed once, when a body is made, or of velocities.
OTHERS = ("mass", "kinetic energy")


class Body:
    """Cells with elements, and what comes of all of them together.

    Parameters
    ----------
    X : (n, 3)
        Undeformed positions [m].
    cells : (m, k) int32
        Vertices of triangles (k = 3) or tetrahedra (k = 4).
    elements : mapping
        Which `Element` computes each of `PARTS`; one may compute several.
    mass : (k k m,) array
        Factor of the identity for each pair of corners of each cell [kg].
    mesh : Mesh
        What touches, feels the wind and is seen: the body's vertices, and triangles that face outwards.
    roles : Roles, optional
        Whose code computes what.
    needs : mapping, optional
        Tasks behind each of `PARTS` and `OTHERS`: part -> names.
    stiffness : float
        How hard the body is to stretch [N/m], for a hand that pulls at it.
    bending : Bending, optional
        Hinges, whose energy is part of the body's.
    incidence : Incidence, optional
        Of the cells, if that is known.

    Attributes
    ----------
    surface : (t, 3) int32
        The triangles of `mesh`.
    pattern : Pattern
        Which vertices act on each other.
    """

    def __init__(
        self,
        X: np.ndarray,
        cells: np.ndarray,
        elements: Mapping[str, Element],
        mass: np.ndarray,
        mesh: Mesh,
        roles: Roles | None = None,
        needs: Mapping[str, tuple[str, ...]] = MappingProxyType({}),
        stiffness: float = 0.0,
        bending: Bending | None = None,
        incidence: Incidence | None = None,
    ):
        from muslin.physics.elements.pattern import Gather, Pattern

        self.X, self.cells, self.stiffness = X, cells, stiffness
        self.mesh, self.surface = mesh, np.ascontiguousarray(mesh.triangles, dtype=np.int32)
        self.roles, self.needs = roles or Roles(), needs
        self.elements = dict(elements)
        self._distinct = list(dict.fromkeys(elements.values()))
        self.bending = bending
        self.pattern = Pattern(cells, len(X), bending.widened if bending else None, incidence)
        sheet = np.array_equal(self.surface, cells)
        self._skin: Gather = self.pattern if sheet else Gather(self.surface, len(X))
        self.mass_factor = self.pattern.blocks(mass)
        self._sum: Any = None
        self._sizes: Any = None
        self._factors: np.ndarray | None = None
        self._moving: Any = None

    @functools.cached_property
    def mass_data(self) -> np.ndarray:
        """Data array (nnz,) of the mass matrix on `pattern` [kg]."""
        data, layout = np.zeros(self.pattern.nnz), self.pattern.layout
        for a in range(3):
            data[layout.start + a * (layout.stride + 1)] = self.mass_factor
        return data

    @functools.cached_property
    def mass(self) -> sp.csr_matrix:
        """Consistent mass matrix, (3n, 3n) [kg]."""
        return self.pattern.matrix(self.mass_data)

    @functools.cached_property
    def scalar_mass(self) -> sp.csr_matrix:
        """The same, of one coordinate: (n, n) [kg]."""
        import scipy.sparse as sp

        n = len(self.X)
        return sp.csr_matrix((self.mass_factor, self.pattern.col, self.pattern.ptr), shape=(n, n))

    @property
    def undeformed(self) -> Mesh | TetMesh:
        """The mesh it was made of, which may carry a finer one."""
        return self.mesh

    # Whose code it is ---------------------------------------------------------------------------------------

    @property
    def functions(self) -> Functions | None:
        """The folder's functions that were given."""
        return self.roles.functions

    @property
    def stand_ins(self) -> frozenset[str]:
        """Tasks whose functions must not be called."""
        return self.roles.stand_ins

    def by_student(self, part: str) -> Functions | None:
        """The functions that compute a part (of `PARTS` and `OTHERS`), or None if native code does."""
        names = self.needs.get(part)
        return self.roles.calling(names) if names else None

    @property
    def uses(self) -> frozenset[str]:
        """Tasks whose functions energy, gradient, Hessian, mass and kinetic energy of this body really call."""
        return frozenset().union(*(self.roles.called(names) for names in self.needs.values()))

    # What steps are made of ---------------------------------------------------------------------------------

    def assembly(self, layout: Layout, data: np.ndarray | None = None, lasting: bool = True) -> Assembly:
        """What writes M + scale d2V/dx2 to a layout of blocks; `prepare` the Hessian before calling it.

        `lasting`: whether it will be called often.
        """
        return self._assembly(layout, self.mass_factor, data, lasting)

    def _assembly(
        self, layout: Layout, mass: np.ndarray, data: np.ndarray | None = None, lasting: bool = True
    ) -> Assembly:
        from muslin.physics.elements.pattern import Assembly

        hessians, hinges = self.elements["hessian"].hessians, self.bending
        if hinges is None:
            return Assembly(self.pattern, layout, mass, hessians, data, lasting=lasting)
        if self._factors is None:
            self._factors = hinges.factors(self.pattern)
        constant = self._factors
        more = None if constant is not None else (hinges.element.cells, hinges.element.hessians)
        return Assembly(self.pattern, layout, mass, hessians, data, constant, more, lasting)

    def impulse(self, damping: float = 0.0) -> Callable[[np.ndarray, np.ndarray, float], np.ndarray]:
        """What computes M v + dt (force - gradient) of (v, force, dt); `prepare` the gradient before calling it.

        It is the right-hand side of a linearly implicit step with the matrix `assembly` writes, and where that is not
        quite the exact one (see `Bending`), this is allowed for; of stiffness-proportional `damping` [s], too.
        """
        from muslin.physics.elements.pattern import Impulse

        impulse = Impulse(self.pattern, self.mass_factor, self.elements["gradient"].gradients)
        hinges = self.bending
        if hinges is None:
            return impulse

        def bent(v: np.ndarray, force: np.ndarray, dt: float) -> np.ndarray:
            force, beyond = force - hinges.gradient(), hinges.beyond(v)
            return impulse(v, force if beyond is None else force + (dt + damping) * beyond, dt)

        return bent

    def limiter(
        self, limit: float, pinned: np.ndarray
    ) -> Callable[[np.ndarray, np.ndarray, float], np.ndarray]:
        """What keeps triangles from being stretched beyond a limit (see `muslin.physics.elements.limit`).

        Raises
        ------
        MuslinError
            If the body has no such thing.
        """
        raise MuslinError("A stretch limit is for cloth; this body has none.", "Leave stretch_limit at 0.")

    def on_surface(self, forces: np.ndarray) -> np.ndarray:
        """Sum forces (3 t, 3) on the corners of the surface's triangles into (n, 3)."""
        self._forces[...] = forces
        return self._skin.vector(self._forces)

    @property
    def of_surface(self) -> np.ndarray:
        """Whether vertices are in a triangle of the surface, (n,)."""
        return np.diff(self._skin.vertex_ptr) > 0

    @functools.cached_property
    def _forces(self) -> np.ndarray:
        """Where forces are put that are summed, one array for all of them."""
        return np.empty((self.surface.size, 3))

    # One position at a time: what several of these need is computed once ------------------------------------

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
        x = self.at_vertices(x, "Positions")
        runtime.start()  # should somebody else have restarted the engine
        for element in self._distinct:
            element.update(x)
        if self.bending:
            self.bending.element.update(x)

    def at_vertices(self, values: Any, what: str) -> np.ndarray:
        """One row for each vertex, (n, 3), of an array of this shape or flat.

        Raises
        ------
        MuslinError
            If it is none of real numbers, or of another shape.
        """
        array = handed.real(what, values)
        if array.size != self.X.size:
            raise MuslinError(f"{what} have shape {array.shape}; this {self.word} needs {self.X.shape}.")
        return np.ascontiguousarray(array, dtype=np.float64).reshape(-1, 3)

    #: Whether Newton's method may take its Hessian as it is, near the end of a step.
    exact_near_rest = False

    #: What messages call it.
    word = "body"

    def prepare(self, *parts: str, project: bool = True) -> None:
        """Compute parts ("energy", "gradient", "hessian") at the positions taken, in as few launches as can be.

        Only a matter of speed: the functions below compute what they need, each for itself.
        """
        for element in self._distinct:
            if own := [part for part in parts if self.elements[part] is element]:
                element.compute(*own, project=project)
        if self.bending:
            self.bending.element.compute(*parts, project=project)

    def energy_here(self) -> float:
        """Elastic energy [J]."""
        self.prepare("energy")
        energy = float(self.elements["energy"].energies.sum())
        return energy + self.bending.energy() if self.bending else energy

    def gradient_here(self) -> np.ndarray:
        """Gradient of the elastic energy, (n, 3) [N]; minus this is the force."""
        self.prepare("gradient")
        gradient = self.pattern.vector(self.elements["gradient"].gradients)
        return gradient + self.bending.gradient() if self.bending else gradient

    def stiffness_here(self, project: bool = True) -> np.ndarray:
        """Data array (nnz,) of the energy's Hessian on `pattern` [N/m], as `assembly` has it."""
        return self._stiffness(project).copy()

    def _stiffness(self, project: bool) -> np.ndarray:
        """The same, written over by the next call."""
        self.prepare("hessian", project=project)
        if self._sum is None:
            self._sum = self._assembly(self.pattern.layout, np.zeros_like(self.mass_factor))
        return np.asarray(self._sum(1.0))

    def summands_here(
        self, x: np.ndarray, project: bool = True, more: tuple[int, float] | None = None
    ) -> np.ndarray:
        """|K| |x|, (3n,) [N]: the size of what is summed into the forces; `more`: a vertex, and its K's own [N/m]."""
        K = self._stiffness(project)
        if more:
            K[self.pattern.diagonal[more[0]]] += more[1]
        if self._sizes is None:
            self._sizes = self.pattern.matrix(np.empty_like(K))
        np.abs(K, out=self._sizes.data)
        return np.asarray(self._sizes @ np.abs(x).ravel())

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

        With `project` the Hessian of each cell is made positive semi-definite.
        """
        self.update(x)
        matrix = self.pattern.matrix(self.stiffness_here(project))
        excess = self.bending.excess() if self.bending else None
        return matrix if excess is None else matrix - excess

    def kinetic_energy(self, v: np.ndarray) -> float:
        """1/2 qdot^T M qdot [J] for velocities v (n, 3)."""
        v = self.at_vertices(v, "Velocities")
        if self._moving is None:
            self._moving = self._moving_energies()
        return float(self._moving(v).sum())

    def momenta(self, x: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Linear momentum (3,) [kg m/s], and angular momentum about the centre of mass (3,) [kg m^2/s].

        Of positions and velocities (n, 3), with the consistent mass matrix.
        """
        x, v = self.at_vertices(x, "Positions"), self.at_vertices(v, "Velocities")
        carried = self.scalar_mass @ v
        weights = np.asarray(self.scalar_mass.sum(axis=1)).ravel()
        middle = weights @ x / weights.sum()
        return carried.sum(axis=0), np.cross(x - middle, carried).sum(axis=0)

    def _moving_energies(self) -> Callable[[np.ndarray], np.ndarray]:
        """What splits the kinetic energy: here among vertices."""
        from muslin.physics.elements.pattern import KineticEnergy

        return KineticEnergy(self.pattern, self.mass_factor)
