"""What a scene is: plain parameters anyone may override, and the few functions that make it particular."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from muslin import mesh as meshes
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.mesh import Mesh, TetMesh
from muslin.physics.body import Body
from muslin.physics.cloth import ENERGIES
from muslin.physics.colliders import Collider, Plane, Sphere
from muslin.physics.material import lame
from muslin.simulation.model import Spring
from muslin.simulation.scenes.pins import PINS, SIDES, near_sides
from muslin.simulation.scenes.values import _number
from muslin.tasks import Functions

#: Flexural rigidity of a cotton cloth of 0.2 kg/m^2 [N m]: its bending length (Peirce 1930), 2 cm, cubed, times its
#: weight, 2 N/m^2.
COTTON = 1.6e-5

EARTH = (0.0, -9.81, 0.0)
Vec = tuple[float, float, float]


def as_it_is(scene: Scene, mesh: Mesh) -> np.ndarray:
    """Start in the undeformed shape."""
    return mesh.vertices.copy()


def lying(scene: Scene, mesh: Mesh) -> np.ndarray:
    """Start undeformed, turned to lie horizontally but for `scene.tilt`, its middle at `scene.start_at`."""
    area, normal = meshes.area_and_normal(mesh.vertices, mesh.triangles)
    n = area @ normal
    if np.linalg.norm(n) < 1e-9 * area.sum():
        raise MuslinError(
            f"The mesh {mesh.name!r} is closed: there is no way to lay it flat.", "Use an open one."
        )
    n /= np.linalg.norm(n)
    side = np.cross(n, (0.0, 0.0, 1.0)) if abs(n[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    side /= np.linalg.norm(side)
    turn = np.stack([side, n, np.cross(side, n)])
    flat = mesh.vertices @ turn.T
    middle = (flat.min(axis=0) + flat.max(axis=0)) / 2
    c, s = np.cos(np.radians(scene.tilt)), np.sin(np.radians(scene.tilt))
    tilted = (flat - middle) @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T
    return tilted + np.asarray(scene.start_at)


def sphere_and_floor(scene: Scene, time: float) -> tuple[Collider, ...]:
    """The scene's floor, and its sphere moving with `sphere_velocity`, where they are switched on.

    The sphere comes last: where cloth is caught between the two, it has the last word.
    """
    there: list[Collider] = []
    if scene.floor and scene.ground is not None:
        there.append(Plane((0.0, scene.ground, 0.0), (0.0, 1.0, 0.0)))
    if scene.sphere:
        center = np.asarray(scene.sphere_center) + time * np.asarray(scene.sphere_velocity)
        there.append(Sphere(tuple(center.tolist()), scene.sphere_radius, scene.sphere_velocity))
    return tuple(there)


@dataclass(frozen=True)
class Scene:
    """A cloth, what holds it, what pulls at it, what it meets, and how time passes.

    Everything but the functions at the end can be overridden by name (`--set key=value`); what each means, and its
    unit, is in the table `muslin.simulation.scenes.meanings`, which `muslin scenes NAME` and docs/scenes.md show.
    """

    name: str
    title: str
    mesh: str = "grid"
    scale: str = "1"
    resolution: int = 64
    diagonals: str = "uniform"
    pinned: str = "none"
    E: float | None = None
    nu: float | None = None
    mu: float | None = None
    lam: float | None = None
    plane: str = "stress"
    swap_lame: bool = False
    rho: float = 1.0
    h: float = 1.0
    damping: float = 0.0
    gravity: Vec = EARTH
    dt: float = 1 / 240
    steps: int = 480
    frame_every: int = 4
    fps: int = 60
    integrator: str = "linearly-implicit"
    solver: str = "auto"
    contact: str = "filter"
    bending: str = "off"
    bending_stiffness: float = COTTON
    self_collision: str = "off"
    self_gap: float = 1e-3
    adaptive: bool = False
    levels: int = 2
    budget: int = 20000
    adapt_every: int = 6
    look_ahead: float = 0.04
    refine_angle: float = 12.0
    refine_stretch: float = 0.1
    flip_angle: float = 30.0
    friction: float = 0.0
    stretch_limit: float = 0.0
    project: bool = True
    tolerance: float = 1e-8
    sphere: bool = False
    sphere_center: Vec = (0.0, 0.0, 0.0)
    sphere_radius: float = 0.3
    sphere_velocity: Vec = (0.0, 0.0, 0.0)
    wind: Vec = (0.0, 0.0, 0.0)
    drag: float = 0.0
    start_at: Vec = (0.0, 0.0, 0.0)
    tilt: float = 0.0
    sag: float = 0.0
    start_velocity: Vec = (0.0, 0.0, 0.0)
    stretch: Vec = (1.0, 1.0, 1.0)
    drag_vertex: int = -1
    drag_to: Vec = (0.0, 0.0, 0.0)
    drag_stiffness: float = 1e3
    view: Vec = (0.4, 0.35, 1.0)
    still: float | None = None
    camera: str = "fit"
    ground: float | None = None
    floor: bool = False
    size: float = 1.0  # longest side of the cloth the scene is made for [m]
    start: Callable[[Any, Any], np.ndarray] = as_it_is
    colliders: Callable[[Any, float], tuple[Collider, ...]] = sphere_and_floor
    carried: Callable[[Any, np.ndarray, float], np.ndarray] | None = (
        None  # where pinned vertices are at a time
    )

    #: The energies a body of the scene may have; the first is the default.
    ENERGIES: ClassVar[tuple[str, ...]] = ENERGIES

    #: What it is made of.
    MESH: ClassVar[type[Mesh] | type[TetMesh]] = Mesh

    #: Parameters that do nothing for what it is made of.
    FOREIGN: ClassVar[frozenset[str]] = frozenset()

    #: What messages call what is simulated.
    WORD: ClassVar[str] = "cloth"

    def body(
        self, mesh: Any, functions: Functions | None, energy: str, hessian: str, stand_ins: Iterable[str]
    ) -> Body:
        """What is simulated, on its undeformed mesh; see `muslin.simulation.simulating.simulate`."""
        from muslin.physics.cloth import Cloth

        mu, lam = self.lame
        return Cloth(
            mesh, mu=mu, lam=lam, rho=self.rho, h=self.h, functions=functions, energy=energy,
            hessian=hessian, stand_ins=stand_ins, bending=self.bending, bending_stiffness=self.bending_stiffness,
            exact_bending=self.integrator.replace("_", "-") != "linearly-implicit", lasting=not self.adaptive,
        )  # fmt: skip

    def skin(self, mesh: Any) -> Mesh | None:
        """A finer mesh that the scene carries along and shows, undeformed like its own mesh; None: there is none."""
        return None

    @property
    def pulled(self) -> bool:
        """Whether the mouse pulls at all."""
        return self.drag_vertex >= 0

    @property
    def energy_names(self) -> dict[str, str]:
        """Kinds of energy that are shown of a run, in words -> column of its log."""
        outer = "gravity and pull" if self.pulled else "gravity"
        return {"kinetic": "kinetic", "elastic": "elastic", outer: "gravity", "total": "total"}

    def energies_told(self, row: Any) -> str:
        """A row of a run's log [J] in words, the total left out."""
        return ", ".join(
            f"{name} {row[kind] + 0.0:.4g}" for name, kind in self.energy_names.items() if kind != "total"
        )

    def spring(self, mesh: Any, time: float) -> Spring | None:
        """The mouse at a time: what pulls at one vertex."""
        if self.drag_vertex < 0:
            return None
        return Spring(int(mesh.find(self.drag_vertex)[0]), self.drag_to, self.drag_stiffness)

    @property
    def lame(self) -> tuple[float, float]:
        """Lamé parameters (mu, lam) [Pa], from whichever pair was given."""
        if self.mu is not None and self.lam is not None:
            return (self.lam, self.mu) if self.swap_lame else (self.mu, self.lam)
        if self.E is None or self.nu is None:
            raise MuslinError(f"The scene {self.name!r} needs E and nu, or mu and lam.")
        return lame(self.E, self.nu, self.swap_lame, self.plane)

    def parameters(self) -> dict[str, Any]:
        """All that can be overridden, by name."""
        return {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name not in _FIXED}

    def load_mesh(self) -> Mesh:
        """The undeformed cloth."""
        if self.mesh == "grid":
            n = self.resolution
            return self.scaled(meshes.grid(n, n, diagonals=self.diagonals, name=f"grid {n}x{n}"))
        shipped = paths.meshes() / f"{self.mesh}.obj"
        file = shipped if shipped.is_file() and not Path(self.mesh).exists() else self.mesh
        return self.scaled(meshes.load(file))

    def scaled(self, mesh: Any) -> Any:
        """A mesh at the scene's `scale`."""
        return mesh.scaled(self.factor(mesh))

    def factor(self, mesh: Mesh | TetMesh) -> float:
        """What `scale` multiplies a mesh's coordinates with."""
        return self.size / mesh.extent if self.scale == "fit" else _number(self.scale)

    def pinned_vertices(self, mesh: Mesh | TetMesh) -> np.ndarray:
        """Numbers of the vertices that are pinned.

        Raises
        ------
        MuslinError
            If `pinned` is neither a known rule nor a list of vertex numbers.
        """
        X = mesh.vertices
        if self.pinned in PINS:
            pinned = PINS[self.pinned](X, mesh.extent)
        elif any(side in self.pinned for side in SIDES):
            pinned = near_sides(self.pinned, X, mesh.extent)
        else:
            try:
                numbers = [int(word) for word in str(self.pinned).replace(",", " ").split()]
                if not numbers:
                    raise ValueError
            except ValueError:
                raise MuslinError(
                    f"pinned = {self.pinned!r} is not understood.",
                    f"Write one of {', '.join(PINS)}, vertex numbers such as 0,19, or lowest:0.1 for all within "
                    f"0.1 of the lowest (also {', '.join([*SIDES][1:])}).",
                ) from None
            pinned = np.unique(mesh.find(np.array(numbers, dtype=np.int64)))
        if len(pinned) == len(X):
            flat = self.pinned in PINS and np.ptp(X[:, 1]) <= 1e-6 * mesh.extent
            why = " (it is flat: y is the same everywhere)" if flat else ""
            raise MuslinError(
                f"pinned = {self.pinned!r} holds all {len(X)} vertices of {mesh.name!r}{why}, "
                "so that nothing can move.",
                f"Hold fewer: --set pinned=corners, or vertex numbers such as {_two_ends(mesh)}."
                + (" Or turn the mesh so that y points up." if why else ""),
            )
        return pinned

    def remarks(self, mesh: Mesh | TetMesh, pinned: np.ndarray) -> tuple[str, ...]:
        """What a person should know of a mesh in this scene before it is simulated.

        What was left out or changed when it was read, and a size, pins or a budget that do not fit the scene.

        Parameters
        ----------
        mesh : Mesh
            As the scene takes it, scaled.
        pinned : (k,) int
            The vertices that are pinned.
        """
        said = list(mesh.notices)
        if not self.size / FAR_OFF < mesh.extent < self.size * FAR_OFF:
            meets = f", and the sphere's radius is {self.sphere_radius:g} m" if self.sphere else ""
            said.append(
                f"The {self.WORD} {mesh.name!r} is {mesh.extent:.3g} m across; the scene {self.name!r} is made for "
                f"one of {self.size:.3g} m{meets}. If the mesh is not in metres, scale it: --scale 0.001 from "
                "millimetres, --scale 0.01 from centimetres, or --scale fit."
            )
        if self.pinned == "corners" and len(pinned) < 2:
            where = ", ".join(str(n) for n in mesh.called(pinned))
            said.append(
                f"pinned = 'corners' holds {len(pinned)} vertex of {mesh.name!r} (number {where}), not two: "
                f"no other is as high. To hold others: {_two_ends(mesh)}, by their numbers from 0."
            )
        if self.adaptive and (count := len(mesh.vertices)) >= self.budget:
            said.append(
                f"The {self.WORD} {mesh.name!r} has {count} vertices to begin with, and budget = {self.budget} allows "
                "no more: nothing is refined. Set a larger budget, or begin with fewer."
            )
        return tuple(said)


def _two_ends(mesh: Mesh | TetMesh) -> str:
    """A setting that pins the two vertices farthest apart in x."""
    x = mesh.vertices[:, 0]
    ends = mesh.called(np.array([np.argmin(x), np.argmax(x)]))
    return f"--set pinned={','.join(map(str, ends))}"


#: How many times larger or smaller than a scene's own a cloth may be before that is remarked upon.
FAR_OFF = 10.0
_FIXED = {"name", "title", "size", "start", "colliders", "carried"}
