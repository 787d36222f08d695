"""Scenes of solids: what they have beside those of cloth."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from muslin.base.errors import MuslinError
from muslin.mesh import Mesh, TetMesh, ball, block, load_tets
from muslin.mesh.creature import creature, creature_skin
from muslin.physics.body import Body
from muslin.physics.solid import ENERGIES, Solid, constants
from muslin.simulation.model import Spring
from muslin.simulation.scenes.scene import Scene, Vec
from muslin.tasks import Functions


@dataclass(frozen=True)
class SolidScene(Scene):
    """A solid, what holds it, what pulls at it, what it meets, and how time passes."""

    mesh: str = "bar"
    resolution: int = 5
    length: float = 1.0
    thickness: float = 0.25
    E: float | None = 5e4
    nu: float | None = 0.4
    rho: float = 1000.0
    plane: str = "strain"
    course_parameters: bool = False
    integrator: str = "backward-euler"
    contact: str = "solve"
    dt: float = 1 / 120
    frame_every: int = 2
    drag_until: float | None = None
    drag_point: str = "none"

    ENERGIES: ClassVar[tuple[str, ...]] = ENERGIES
    MESH: ClassVar[type[Mesh] | type[TetMesh]] = TetMesh
    WORD: ClassVar[str] = "solid"
    FOREIGN: ClassVar[frozenset[str]] = frozenset(
        {
            *(
                "diagonals",
                "plane",
                "swap_lame",
                "h",
                "bending",
                "bending_stiffness",
                "stretch_limit",
                "tilt",
                "sag",
            ),
            *("self_collision", "self_gap", "adaptive", "levels", "budget", "adapt_every", "look_ahead"),
            *("refine_angle", "refine_stretch", "flip_angle"),
        }
    )

    def load_mesh(self) -> Any:
        """The undeformed solid."""
        return self.scaled(self._unscaled())

    def _unscaled(self) -> TetMesh:
        n = self.resolution
        if Path(self.mesh).is_file():
            return load_tets(self.mesh)
        if self.mesh == "bar":
            along = max(2, round((n - 1) * self.length / self.thickness) + 1)
            return block(along, n, n, self.length, self.thickness, self.thickness, "bar")
        if self.mesh == "ball":
            return ball(n, 0.5)
        if self.mesh == "creature":
            return creature().scaled(self.size / creature().extent)
        return load_tets(self.mesh)  # says what is wrong with it

    def skin(self, mesh: TetMesh) -> Mesh | None:
        """The creature's smooth surface, where the mesh is the creature."""
        return creature_skin().scaled(mesh.scale) if mesh.name == "creature" else None

    def body(
        self, mesh: Any, functions: Functions | None, energy: str, hessian: str, stand_ins: Iterable[str]
    ) -> Body:
        """The solid; it has one road to the Hessian."""
        if hessian != "closed":
            raise MuslinError(f"A solid has no hessian {hessian!r}.", "Leave it out.")
        C, D = constants(*self.lame, self.course_parameters)
        return Solid(mesh, C=C, D=D, rho=self.rho, functions=functions, energy=energy, stand_ins=stand_ins)

    @property
    def pulled(self) -> bool:
        """Whether the mouse pulls at all."""
        return self.drag_point != "none" or super().pulled

    def spring(self, mesh: Any, time: float) -> Spring | None:
        """The mouse, until it lets go."""
        if self.drag_until is not None and time >= self.drag_until:
            return None
        if self.drag_point == "none":
            return super().spring(mesh, time)
        try:
            point = [float(word) for word in self.drag_point.replace(",", " ").split()]
            vertex = int(((mesh.vertices - point) ** 2).sum(axis=1).argmin())
        except ValueError:
            raise MuslinError(
                f"drag_point = {self.drag_point!r} is not a point.", "For example: 0,1,0"
            ) from None
        return Spring(vertex, self.drag_to, self.drag_stiffness)


#: Where a scene's view looks from.
FRONT: Vec = (0.45, 0.2, 1.0)
