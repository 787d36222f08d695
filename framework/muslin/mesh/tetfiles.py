"""Files of tetrahedra: `load_tets`, and `load_any` where either kind of mesh will do."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.checks import Places, counted
from muslin.mesh.files import FORMATS, Format, content_of, kinds, load, parsed
from muslin.mesh.medit import read_medit
from muslin.mesh.polygons import Polygons
from muslin.mesh.surface import Mesh, flat_to_3d
from muslin.mesh.tetgen import read_tetgen
from muslin.mesh.tets import TetMesh, check_cells, check_solid, frozen_solid, turned_outwards
from muslin.mesh.text import decode

_TETGEN = Format("TetGen", read_tetgen)

#: Extension -> format.
TET_FORMATS = {
    ".mesh": Format("Medit", lambda c, file, _: read_medit(decode(c, file, "Medit"), file)),
    ".node": _TETGEN,
    ".ele": _TETGEN,
    **{suffix: FORMATS[suffix] for suffix in (".msh", ".vtk", ".vtu")},
}


def load_tets(path: str | os.PathLike[str]) -> TetMesh:
    """Solid mesh of a file.

    Reads Medit's .mesh, TetGen's .node and .ele (either is named, both are read), Gmsh and VTK (legacy and VTU).
    Elements that are no tetrahedra (the triangles of a boundary, say) and vertices in no tetrahedron are left out;
    each leaves a notice in `TetMesh.notices`.

    Parameters
    ----------
    path : path-like
        The extension says the format.

    Returns
    -------
    TetMesh
        Named like the file.

    Raises
    ------
    MeshError
        If there is no such file, it cannot be read, or what it holds cannot be a solid (see `check_solid`). The
        message names the file and the line or element.
    """
    file, content, suffix = content_of(path, TET_FORMATS, _is_surface)
    return _solid(parsed(content, file, Path(path), TET_FORMATS[suffix]), file, Path(path).stem)


def _is_surface(file: str, suffix: str) -> MeshError | None:
    """What is said of a surface where a solid is asked for."""
    if suffix not in FORMATS:
        return None
    return MeshError(
        f"{file} is a surface ({FORMATS[suffix].name}), and a solid needs tetrahedra that fill it.",
        f"Fill it in Gmsh, TetGen or fTetWild and save the tetrahedra as one of {', '.join(TET_FORMATS)}; "
        f"or let it move as cloth: muslin run drape --mesh {file}",
    )


def load_any(path: str | os.PathLike[str]) -> Mesh | TetMesh:
    """The solid of a file if it has tetrahedra, else its surface."""
    if Path(path).suffix.lower() not in TET_FORMATS:
        return load(path)
    file, content, suffix = content_of(path, TET_FORMATS)
    found = parsed(content, file, Path(path), TET_FORMATS[suffix])
    if found.tetrahedra is None and suffix in FORMATS:
        return load(path)
    return _solid(found, file, Path(path).stem)


def _solid(found: Polygons, file: str, name: str) -> TetMesh:
    others = {kind: count for kind, count in found.ignored.items() if kind != "tetra"}
    others |= {"face": faces} if (faces := sum(len(ids) for ids, _ in found.faces)) else {}
    cells = found.tetrahedra
    if cells is None or not len(cells):
        raise MeshError(
            f"{file} has no tetrahedra" + (f", only {kinds(others)}." if others else "."),
            "Export the solid's straight (first-order) tetrahedra, not only its surface.",
        )
    X, notices = flat_to_3d(found.points, file)
    places = Places(
        file,
        found.base,
        vertex_lines=found.point_lines,
        face_lines=found.tetrahedron_lines,
        kind="tetrahedron",
    )
    check_cells(X, cells, places)
    T, turned = turned_outwards(X, cells, places)
    if others:
        notices = (*notices, f"{file}: {kinds(others)} left out.")
    used = np.unique(T)
    numbers = None
    if len(used) < len(X):
        left = counted(len(X) - len(used), "vertex", "vertices")
        notices = (*notices, f"{file}: {left} in no tetrahedron left out.")
        lines = None if found.point_lines is None else found.point_lines[used]
        places = Places(file, found.base, used, None, lines, found.tetrahedron_lines, kind="tetrahedron")
        X, T, numbers = X[used], np.searchsorted(used, T), used
    check_solid(X, T, places)
    return frozen_solid(X, T, name, (*found.notices, *notices, *turned), numbers)
