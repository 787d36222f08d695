"""What the parameters of scenes mean: the one table of it, in the order of `docs/scenes.md` and `muslin scenes NAME`.

Each parameter of a scene stands here once, with its unit and what it is. What it is by default says its field.
"""

from __future__ import annotations

import dataclasses
from importlib import import_module
from typing import Any, NamedTuple

from muslin.simulation.scenes import SCENES, SOLIDS, Scene, get


class Meaning(NamedTuple):
    """Of one parameter: what it is, and its unit ("" for none)."""

    text: str
    unit: str = ""


M = Meaning

#: Group -> parameter -> meaning.
MEANINGS: dict[str, dict[str, Meaning]] = {
    "The mesh": {
        "mesh": M("`grid`, a mesh that Muslin ships, or a file; of solids `bar`, `ball`, `creature`, or a file"),
        "scale": M("what the mesh's coordinates are multiplied with; `fit`: as large as the scene is made for"),
        "resolution": M("vertices along each side of a `grid`; of solids, across a `bar` or a `ball`"),
        "diagonals": M("of a `grid`: `uniform`, `alternating` (an adaptive cloth has these) or `zigzag`"),
        "length": M("of a `bar`, along x; solids only", "m"),
        "thickness": M("of a `bar`, along y and z; solids only", "m"),
        "cloths": M("which fall: `both`, `curled` or `rest`; `freefall` only"),
    },
    "The material": {
        "E": M("Young's modulus; it and `nu`, or `mu` and `lam`", "Pa"),
        "nu": M("Poisson's ratio, in (-1, 1/2)"),
        "mu": M("Lamé's parameter: the shear modulus", "Pa"),
        "lam": M("Lamé's other parameter", "Pa"),
        "plane": M("what `E` and `nu` of a sheet mean: plane `stress`, `strain`, or the `course`'s formula"),
        "swap_lame": M("pass lam for mu and mu for lam, as the course's starter code did"),
        "course_parameters": M("D = lam/2, as the course has it, instead of lam/2 + mu/3; solids only"),
        "rho": M("density", "kg/m³"),
        "h": M("thickness of a cloth", "m"),
        "damping": M("Rayleigh's β: the force -β K v, with the stiffness K", "s"),
        "bending": M("model of bending: `off`, `quadratic` or `shells`"),
        "bending_stiffness": M("flexural rigidity", "N m"),
        "stretch_limit": M("largest principal stretch a step of a cloth may end with, above 1; 0: any"),
    },
    "What acts on it": {
        "gravity": M("acceleration", "m/s²"),
        "wind": M("velocity of the air; it acts where `drag` is not 0", "m/s"),
        "drag": M("of the air: its density times the drag coefficient", "kg/m³"),
        "pinned": M(
            "vertices held: `none`, `highest-row`, `corners`, `collar`, numbers (`0,19`), or sides (`left:0.01`)"
        ),
        "drag_vertex": M("the vertex that a spring pulls at, by its number from 0; -1: none"),
        "drag_point": M("instead of a number: the vertex nearest to this undeformed point, `0,1,0`; solids only", "m"),
        "drag_to": M("where the spring pulls it to", "m"),
        "drag_stiffness": M("of the spring", "N/m"),
        "drag_until": M("when it lets go; none: never; solids only", "s"),
    },
    "How it starts": {
        "start_at": M("where the middle of a cloth that starts lying is, or by how much `drop` is moved", "m"),
        "tilt": M("of a cloth that starts lying, about the x axis", "degrees"),
        "sag": M("how far corners hang below the middle of `drape`'s sheet", "m"),
        "stretch": M("factors on the starting positions along x, y and z, about their middle"),
        "start_velocity": M("of all vertices that are not pinned; in Python one for each, too", "m/s"),
        "turns": M("by which the bar of `twist` starts wound up"),
        "spread": M("half angle of the cone the cape starts on; `cape` only", "rad"),
    },
    "What it meets": {
        "sphere": M("whether there is a sphere"),
        "sphere_center": M("where it is at the start", "m"),
        "sphere_radius": M("its radius", "m"),
        "sphere_velocity": M("its velocity, which is constant", "m/s"),
        "ground": M("height of the ground in pictures; none: there is none", "m"),
        "floor": M("whether the ground is solid"),
        "contact": M("`filter` the velocities after solving (the lecture's), or `solve` with contacts in the system"),
        "friction": M("Coulomb's coefficient: with colliders (`contact=solve`), and of the cloth with itself"),
        "self_collision": M("of a cloth with itself: `off`, `fast` or `exact`"),
        "self_gap": M("the distance below which a cloth is kept apart from itself", "m"),
        "walk_speed": M("of the figure; `cape` only", "m/s"),
        "turn_rate": M("amplitude of its turning; `cape` only", "rad/s"),
        "turn_period": M("of its turning; `cape` only", "s"),
        "stride": M("swing of its legs; `cape` only", "rad"),
    },
    "Time and the solver": {
        "dt": M("time step", "s"),
        "steps": M("how many (`--steps`, `steps=`)"),
        "frame_every": M("steps from one written frame to the next"),
        "integrator": M(
            "`linearly-implicit`, `backward-euler`, `midpoint`, `bdf2` or `symplectic-euler`"
        ),
        "solver": M("of linear systems: `auto`, `cholmod`, `multifrontal`, `superlu` or `cg`"),
        "project": M("whether each cell's Hessian is made positive semi-definite"),
        "tolerance": M("of Newton's method and of `cg`, relative; where contacts are solved `cg` has 1e-12 at most"),
    },
    "An adaptive mesh": {
        "adaptive": M("whether a cloth's mesh is refined and coarsened while it moves"),
        "levels": M("of refinement: each has three times the triangles"),
        "budget": M("vertices at most"),
        "adapt_every": M("steps from one look at the mesh to the next"),
        "look_ahead": M("it is refined for where it is, and where it would be after this time", "s"),
        "refine_angle": M("between neighbouring triangles, from which they are refined", "degrees"),
        "refine_stretch": M("difference of neighbours' principal stretches, likewise; 0: any"),
        "flip_angle": M("of folds, from which no edge along them is exchanged", "degrees"),
    },
    "Pictures": {
        "fps": M("of the film", "1/s"),
        "view": M("direction from the body to the camera"),
        "still": M("time of the still; none: the scene's end", "s"),
        "camera": M("`fit` the whole motion, or `follow` the body"),
    },
}  # fmt: skip


def of(scene: Scene) -> dict[str, list[tuple[str, Any, Meaning]]]:
    """Parameters of a scene by group: name, value, meaning; those the table does not know come last, without one."""
    left = {name: value for name, value in scene.parameters().items() if name not in scene.FOREIGN}
    found = {
        group: [(name, left.pop(name), meaning) for name, meaning in rows.items() if name in left]
        for group, rows in MEANINGS.items()
    }
    found["Its own"] = [(name, value, Meaning("")) for name, value in left.items()]
    return {group: rows for group, rows in found.items() if rows}


def plain(value: Any) -> str:
    """A value as `--set` takes it."""
    if value is None:
        return "none"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float) and 0 < value < 1 and len(repr(value)) > 8 and (1 / value).is_integer():
        return f"1/{round(1 / value)}"
    if isinstance(value, tuple):
        return ",".join(f"{v:g}" for v in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def lines(scene: Scene) -> list[str]:
    """A scene's parameters, as `muslin scenes NAME` prints them."""
    said = [f"{scene.name}: {scene.title}"]
    for group, rows in of(scene).items():
        said += ["", group]
        for name, value, meaning in rows:
            unit = f" [{meaning.unit}]" if meaning.unit else ""
            said.append(f"  {f'{name}={plain(value)}':32} {meaning.text.replace('`', '')}{unit}".rstrip())
    return said


def tables() -> str:
    """The tables of `docs/scenes.md`: what each parameter means, and what each scene has otherwise."""
    default = {f.name: f.default for f in dataclasses.fields(Scene)}
    scenes = [get(name) for name in SCENES]
    for scene in scenes:  # what only some scenes have
        default = {f.name: f.default for f in dataclasses.fields(scene)} | default
    text = []
    for group, rows in MEANINGS.items():
        text += [f"### {group}", "", "| parameter | meaning | unit | default |", "|---|---|---|---|"]
        text += [f"| `{name}` | {m.text} | {m.unit} | {_cell(default[name])} |" for name, m in rows.items()]
        text.append("")
    text += ["### What scenes have otherwise", "", "Solids begin with"]
    base = import_module("muslin.simulation.scenes.solid").SolidScene
    solid = {f.name: f.default for f in dataclasses.fields(base)}
    text[-1] += f" {_differing(solid, default)}.\n"
    text += ["| scene | what | it has |", "|---|---|---|"]
    for scene in scenes:
        against = solid if scene.name in SOLIDS else default
        text.append(f"| `{scene.name}` | {scene.title} | {_differing(scene.parameters(), against)} |")
    return "\n".join(text) + "\n"


def _cell(value: Any) -> str:
    return f"`{plain(value)}`"


def _differing(values: dict[str, Any], default: dict[str, Any]) -> str:
    known = {name for rows in MEANINGS.values() for name in rows}
    return ", ".join(
        f"`{name}={plain(value)}`"
        for name, value in values.items()
        if name in known and value != default.get(name)
    )
