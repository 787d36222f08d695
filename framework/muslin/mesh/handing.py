"""A mesh as callers hand it over: made already, as arrays, or as the path of a file."""

from __future__ import annotations

import os
from typing import Any, TypeVar, cast

from muslin.base.errors import MeshError
from muslin.base.handed import short
from muslin.mesh.files import load
from muslin.mesh.surface import Mesh
from muslin.mesh.tetfiles import load_tets
from muslin.mesh.tets import TetMesh

M = TypeVar("M", bound="Mesh | TetMesh")


def taken(mesh: Any, kind: type[M]) -> M:
    """What was given as a mesh, as one.

    Parameters
    ----------
    mesh : Mesh, TetMesh, (vertices, cells) or path
    kind : type
        Which of the two is wanted.

    Raises
    ------
    MeshError
        If it is none of these, or a mesh of the other kind.
    """
    if isinstance(mesh, kind):
        return mesh
    cloth = kind is Mesh
    if isinstance(mesh, (Mesh, TetMesh)):
        raise MeshError(
            f"{mesh.name!r} is a {type(mesh).__name__}; a {'cloth' if cloth else 'solid'} needs a {kind.__name__}.",
            "Its surface is mesh.shell()." if cloth else "One of tetrahedra: see muslin.mesh.load_tets.",
        )
    if isinstance(mesh, (str, os.PathLike)):
        return cast(M, load(mesh) if cloth else load_tets(mesh))
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return cast(M, kind.from_arrays(*mesh))
    raise MeshError(
        f"{short(mesh)} is not a mesh.",
        f"Give a {kind.__name__}, a pair (vertices, {'triangles' if cloth else 'tetrahedra'}), or a file's path.",
    )
