"""Export: an `Animation` (arrays) becomes files that other programs open.

    frames (n, 3), triangles, times, props -> Animation -> write(animation, path, to) -> files

Knows nothing of simulations. Y is up, lengths are metres, and frames may be read lazily: each writer asks for
each frame once, in order. Strain goes along as a number per vertex in usda, pvd, vtu and ply.

=====  =================================================================  ==============================
to     what is written for the path `drape`                               opens in
=====  =================================================================  ==============================
glb    `drape.glb`: morph targets, at most `max_frames` frames            Blender, browsers, viewers
usda   `drape.usda`: time-sampled points                                  Blender, Houdini, Maya, usdview
pvd    `drape.pvd` and `drape_0000.vtu`, ...: displacement, stretch;       ParaView
       of a solid `drape_solid_0000.vtu`, too: its von Mises stress
vtu    the same as pvd                                                    ParaView
ply    `drape_0000.ply`, ...; props `drape_sphere_0000.ply`               Blender, MeshLab, ParaView
obj    `drape_0000.obj`, ...: cloth and props as objects                  Blender and most others
=====  =================================================================  ==============================

==============  ==========================================================
`animation`     `Animation`, `Prop`; texture coordinates, normals, names
`gltf`          the GLB writer
`usd`           the USDA writer
`series`        one file per frame
`files`         files that are either whole or not there
==============  ==========================================================
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from muslin.base.errors import MuslinError
from muslin.export.animation import Animation, Prop, Shape, Solid
from muslin.export.gltf import MAX_FRAMES, write_glb
from muslin.export.series import write_obj, write_ply, write_pvd
from muslin.export.usd import write_usda

__all__ = ["FORMATS", "MAX_FRAMES", "Animation", "Prop", "Shape", "Solid", "write"]

# Format -> (writer, extension of the path it is given, what a person calls it).
FORMATS: dict[str, tuple[Callable[..., list[Path]], str, str]] = {
    "glb": (write_glb, ".glb", "glTF 2.0 binary, one file: Blender, browsers, viewers"),
    "usda": (write_usda, ".usda", "OpenUSD text, one file: Blender, Houdini, Maya, usdview"),
    "pvd": (
        write_pvd,
        ".pvd",
        "VTK, a PVD and a VTU per frame, with displacement and stretch (the principal one furthest from 1): ParaView",
    ),
    "vtu": (write_pvd, ".pvd", "the same as pvd"),
    "ply": (write_ply, ".ply", "PLY, a file per frame: Blender, MeshLab, ParaView"),
    "obj": (write_obj, ".obj", "Wavefront OBJ, a file per frame: Blender and most others"),
}


def write(
    animation: Animation,
    path: str | os.PathLike[str],
    to: str,
    notice: Callable[[str], Any] | None = None,
    **options: Any,
) -> list[Path]:
    """Write an animation as `to`.

    Parameters
    ----------
    animation : Animation
    path : path-like
        What the files are called, with or without the format's extension (`out/drape`, `out/drape.glb`). An
        existing folder, or a path that ends in a slash, receives files named like the animation. Folders are
        made as needed, files of the same names replaced.
    to : str
        One of `FORMATS`.
    notice : callable str -> object, optional
        Called with what a person should know (frames left out, old files in the way); default prints to
        standard error.
    **options
        For glb: `max_frames`, `interpolation` (see `gltf.write_glb`).

    Returns
    -------
    list of Path
        The files written, the one to open first.

    Raises
    ------
    MuslinError
        If the format or an option is unknown, a frame is malformed or a file cannot be written.
    """
    if to not in FORMATS:
        raise MuslinError(f"There is no export format {to!r}.", f"Choose one of: {', '.join(FORMATS)}.")
    writer, extension, _ = FORMATS[to]
    unknown = set(options) - ({"max_frames", "interpolation"} if to == "glb" else set())
    if unknown:
        raise MuslinError(f"Export to {to} has no option {', '.join(sorted(unknown))}.")
    return writer(animation, target(path, animation.name, extension), notice or _say, **options)


def target(path: str | os.PathLike[str], name: str, extension: str) -> Path:
    """The path with the extension: of a folder, the file in it named like the animation."""
    given = os.fspath(path)
    file = Path(given)
    if file.is_dir() or given.endswith(("/", os.sep)):
        file /= "".join(c if c.isalnum() or c in "-_. " else "_" for c in name).strip(". ") or "cloth"
    known = {e for _, e, _ in FORMATS.values()} | {".vtu"}
    # "run.1" is a name with a dot, "drape.obj" asked to become GLB a name with an extension to replace.
    return file.with_suffix(extension) if file.suffix.lower() in known else Path(f"{file}{extension}")


def _say(message: str) -> None:
    print(f"note: {message}", file=sys.stderr)
