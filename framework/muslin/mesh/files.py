"""Mesh files: `load` and `save`."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MeshError
from muslin.base.paths import shown
from muslin.mesh.checks import Places, check_coordinates, check_faces, check_surface
from muslin.mesh.gmsh import contained, read_gmsh
from muslin.mesh.ply import read_ply
from muslin.mesh.polygons import Polygons, triangulate
from muslin.mesh.refusals import EXPORT_AGAIN, damaged, one_line
from muslin.mesh.stl import read_stl
from muslin.mesh.surface import Mesh, flat_to_3d, frozen
from muslin.mesh.text import decode, read_obj, read_off
from muslin.mesh.vtk import read_vtk
from muslin.mesh.vtkxml import read_vtk_xml


@dataclass(frozen=True)
class Format:
    """A format of mesh files.

    Parameters
    ----------
    name : str
        What a person calls it.
    read : callable
        (content, name of the file, path) -> Polygons. Raises a MeshError, or a ValueError for what breaks the
        rules of the format.
    written_as : str
        What meshio calls it when it writes it, "" where it does not.
    """

    name: str
    read: Callable[[bytes, str, Path], Polygons]
    written_as: str = ""


#: Extension -> format.
FORMATS = {
    ".obj": Format("OBJ", lambda c, file, _: read_obj(decode(c, file, "OBJ"), file), "obj"),
    ".off": Format("OFF", lambda c, file, _: read_off(decode(c, file, "OFF"), file), "off"),
    ".ply": Format("PLY", lambda c, file, _: read_ply(c, file), "ply"),
    ".stl": Format("STL", lambda c, file, _: read_stl(c, file), "stl"),
    ".vtk": Format("VTK", lambda c, file, _: read_vtk(c, file), "vtk"),
    ".vtu": Format("VTU", lambda c, file, _: read_vtk_xml(c, file), "vtu"),
    ".vtp": Format("VTP", lambda c, file, _: read_vtk_xml(c, file)),
    ".msh": Format("Gmsh", read_gmsh),
}
#: Extension -> what files of it are: no surface, or lists of other files.
_SOLIDS = {
    **dict.fromkeys((".node", ".ele"), "TetGen's tetrahedra"),
    ".mesh": "a Medit mesh, mostly of tetrahedra",
}
_LISTS = dict.fromkeys((".pvtu", ".pvtp", ".vtm", ".pvd"), "a list of other files")


def load(path: str | os.PathLike[str]) -> Mesh:
    """Cloth mesh of a file.

    Reads OBJ, OFF, PLY, STL, VTK (legacy, VTU, VTP) and Gmsh. Polygons are cut into triangles, STL's separate
    corners welded where they are exactly equal, elements that are no surface (points, lines, solids) and
    vertices in no triangle left out; each leaves a notice in `Mesh.notices`.

    Parameters
    ----------
    path : path-like
        The extension says the format.

    Returns
    -------
    Mesh
        Named like the file.

    Raises
    ------
    MeshError
        If there is no such file, it cannot be read, or what it holds cannot be cloth (see `check`). The
        message names the file and the line or element.
    """
    file, content, suffix = content_of(path, FORMATS, _is_solid)
    found = parsed(content, file, Path(path), FORMATS[suffix])
    X, notices = flat_to_3d(found.points, file)
    places = Places(file, found.base, vertex_lines=found.point_lines, face_lines=found.face_lines)
    surface = found.faces
    if not surface and found.ignored:
        raise MeshError(
            f"{file} has no triangles, only {kinds(found.ignored)}.",
            "Cloth is a surface: export its faces, not solids, lines or points. (The skin of a solid: "
            "Filters > Extract Surface in ParaView.)",
        )
    check_coordinates(X, places)
    check_faces(surface, len(X), places)
    T, origin = triangulate(X, surface, places)
    lines = found.face_lines
    places = Places(
        file,
        found.base,
        faces=origin,
        vertex_lines=found.point_lines,
        face_lines=None if lines is None else lines[origin],
    )
    notices = (*found.notices, *notices, *_polygon_notices(file, surface))
    X, T, places, left_out = _drop_unused(file, X, T, places, found)
    notices = (*notices, *left_out)
    check_surface(X, T, places)
    notices = (*notices, *_coincident_notice(file, X, places))
    return frozen(X, T, Path(path).stem, notices, places.vertices)


def save(mesh: Mesh, path: str | os.PathLike[str]) -> None:
    """Write a mesh; the extension says the format: obj, off, ply, stl, vtk or vtu.

    All but STL keep the order and every digit of the vertices. STL keeps only the triangles' corners.

    Parameters
    ----------
    mesh : Mesh
    path : path-like

    Raises
    ------
    MeshError
        If the extension is not one of these or the file cannot be written.
    """
    target = Path(path)
    suffix = target.suffix.lower()
    known = [s for s, form in FORMATS.items() if form.written_as]
    if suffix not in known:
        raise MeshError(
            f"{shown(target)}: cannot write meshes of format {suffix or '(no extension)'}.",
            f"Choose one of {', '.join(known)}.",
        )
    try:
        if suffix == ".obj":
            target.write_text(obj_text(mesh.vertices, mesh.triangles), encoding="utf-8", newline="\n")
            return
        import meshio

        surface = meshio.Mesh(np.asarray(mesh.vertices), [("triangle", np.asarray(mesh.triangles))])
        with contained():
            meshio.write(str(target), surface, file_format=FORMATS[suffix].written_as)
    except (Exception, SystemExit) as error:
        reason = f"{error.strerror}" if isinstance(error, OSError) and error.strerror else str(error)
        raise MeshError(
            f"{shown(target)} could not be written: {one_line(reason)}.",
            "Check the folder and its permissions.",
        ) from None


def obj_text(vertices: np.ndarray, faces: np.ndarray, comment: str = "") -> str:
    """OBJ text of vertices (n, 3) and faces (m, k), every digit kept and nothing else (no date)."""
    head = [f"# {comment}"] if comment else []
    points = ["v {!r} {!r} {!r}".format(*row) for row in np.asarray(vertices, dtype=np.float64).tolist()]
    corners = ["f " + " ".join(map(str, row)) for row in (np.asarray(faces) + 1).tolist()]
    return "\n".join([*head, *points, *corners]) + "\n"


def _is_solid(file: str, suffix: str) -> MeshError | None:
    """What is said of a solid where a surface is asked for."""
    if suffix not in _SOLIDS:
        return None
    return MeshError(
        f"{file} is a solid ({_SOLIDS[suffix]}), and cloth is a surface of triangles.",
        f"Save its surface as one of {', '.join(FORMATS)}; or let it move as a solid: muslin run jelly --mesh {file}",
    )


def content_of(
    path: Any,
    formats: Mapping[str, Format],
    of_another: Callable[[str, str], MeshError | None] = lambda file, suffix: None,
) -> tuple[str, bytes, str]:
    """Name to show, bytes and extension of a mesh file that is there and may be read.

    `of_another` says what is wrong with a mesh of another kind: its name and extension -> error.
    """
    try:
        source = Path(path)
        file = shown(source)
        suffix = source.suffix.lower()
        known = ", ".join(formats)
        if source.is_dir():
            raise MeshError(f"{file} is a folder.", "Name a mesh file in it.")
        if not source.exists():
            raise MeshError(f"There is no file {file}.", "Check the path and the working folder.")
        if not source.is_file():
            raise MeshError(f"{file} is not an ordinary file.", "Name a mesh file.")
        if suffix not in formats:
            is_ = f" ({_LISTS[suffix]})" if suffix in _LISTS else ""
            raise of_another(file, suffix) or MeshError(
                f"{file}: unknown mesh format {suffix or '(no extension)'}{is_}.",
                f"Known formats are {known}." + (" Name one of those it lists." if is_ else ""),
            )
        content = source.read_bytes()
    except (OSError, ValueError, TypeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise MeshError(
            f"Mesh file {path!a} cannot be read: {one_line(reason)}.", "Check the path."
        ) from None
    if not content.strip():
        raise MeshError(f"{file} is empty.", EXPORT_AGAIN)
    return file, content, suffix


def parsed(content: bytes, file: str, path: Path, form: Format) -> Polygons:
    """What a file holds, or a `MeshError`, whatever goes wrong on the way."""
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused later, by name
            return form.read(content, file, path)
    except MeshError:
        raise
    except MemoryError:
        raise damaged(file, form.name, "its sizes do not fit into memory") from None
    except Exception as error:
        raise damaged(file, form.name, error) from None


def _drop_unused(
    file: str, X: np.ndarray, T: np.ndarray, places: Places, found: Polygons
) -> tuple[np.ndarray, np.ndarray, Places, tuple[str, ...]]:
    """Leave out vertices in no triangle: those of elements that are no surface, and loose ones."""
    keep = np.zeros(len(X), dtype=bool)
    keep[T.ravel()] = True
    of_ignored = np.zeros(len(X), dtype=bool)
    named = found.ignored_points
    of_ignored[named[(named >= 0) & (named < len(X))]] = True
    notices = []
    if found.ignored:
        count = int((of_ignored & ~keep).sum())
        also = f", with {count} {'vertex' if count == 1 else 'vertices'} only they use" if count else ""
        notices.append(f"{file}: {kinds(found.ignored)} left out{also}.")
    loose = np.flatnonzero(~keep & ~of_ignored)
    if len(loose):
        first = places.vertex(int(loose[0]))
        notices.append(
            f"{file}: {first} is in no triangle and left out."
            if len(loose) == 1
            else f"{file}: {len(loose)} vertices in no triangle left out; the first is {first}."
        )
    if keep.all():
        return X, T, places, tuple(notices)
    lines = places.vertex_lines
    renumbered = replace(
        places, vertices=np.flatnonzero(keep), vertex_lines=None if lines is None else lines[keep]
    )
    return X[keep], (np.cumsum(keep) - 1)[T], renumbered, tuple(notices)


def _polygon_notices(file: str, faces: list[tuple[np.ndarray, np.ndarray]]) -> tuple[str, ...]:
    sizes: dict[int, int] = {}
    for ids, corners in faces:
        k = corners.shape[1]
        sizes[k] = sizes.get(k, 0) + len(ids)
    quads = sizes.get(4, 0)
    larger = sum(count for k, count in sizes.items() if k > 4)
    made = sum((k - 2) * count for k, count in sizes.items() if k > 3)
    cut = [
        f"{n} {one if n == 1 else one + 's'}" for n, one in ((quads, "quad"), (larger, "larger polygon")) if n
    ]
    return (f"{file}: {' and '.join(cut)} cut into {made} triangles.",) if cut else ()


def _coincident_notice(file: str, X: np.ndarray, places: Places) -> tuple[str, ...]:
    order = np.lexsort(X.T)
    same = (X[order[1:]] == X[order[:-1]]).all(axis=1)
    if not same.any():
        return ()
    count, k = int(same.sum()), int(np.argmax(same))
    first, second = sorted((int(order[k]), int(order[k + 1])))
    return (
        f"{file}: {count} {'vertex lies' if count == 1 else 'vertices lie'} exactly on another one, "
        f"for instance {places.vertex(first)} and {places.vertex(second)}: the cloth is not joined there.",
    )


def kinds(ignored: dict[str, int]) -> str:
    """How many elements of each kind."""
    return ", ".join(
        f"{count} {one_line(kind)} element{'s' * (count != 1)}" for kind, count in ignored.items()
    )
