"""Mesh files: `load` and `save`."""

from __future__ import annotations

import contextlib
import io
import math
import os
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from muslin.errors import MeshError
from muslin.mesh.checks import Places, check_coordinates, check_faces, check_surface
from muslin.mesh.polygons import Polygons, triangulate
from muslin.mesh.surface import Mesh, flat_to_3d, frozen
from muslin.mesh.text import PLY_SIZES, PlyHeader, decode, ply_header, read_ascii_ply, read_obj, read_off
from muslin.paths import shown

# Extension -> (what a person calls it, what meshio calls it).
FORMATS = {
    ".obj": ("OBJ", "obj"),
    ".off": ("OFF", "off"),
    ".ply": ("PLY", "ply"),
    ".stl": ("STL", "stl"),
    ".vtk": ("VTK", "vtk"),
    ".vtu": ("VTU", "vtu"),
    ".msh": ("Gmsh", "gmsh"),
}
_MOST = 20_000_000  # points of a structured grid
_EXPORT_AGAIN = "Export the mesh again, in doubt as OBJ."


def load(path: str | os.PathLike[str]) -> Mesh:
    """Cloth mesh of a file.

    Reads OBJ, OFF, PLY, STL, VTK, VTU and Gmsh. Polygons are cut into triangles, STL's separate corners
    welded where they are exactly equal, elements that are no surface (points, lines, solids) left out with
    the vertices only they use; each leaves a notice in `Mesh.notices`.

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
    file, content, suffix = _content(path)
    found = _parse(content, file, suffix, Path(path))
    X, notices = flat_to_3d(found.points, file)
    places = Places(file, found.base, vertex_lines=found.point_lines, face_lines=found.face_lines)
    surface = found.faces
    if not surface and found.ignored:
        raise MeshError(
            f"{file} has no triangles, only {_kinds(found.ignored)}.",
            "Cloth is a surface: export its faces, not solids, lines or points.",
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
    if found.ignored:
        X, T, places, dropped = _drop_ignored(X, T, places, found.ignored_points)
        also = f", with {dropped} vertices only they use" if dropped else ""
        notices = (*notices, f"{file}: {_kinds(found.ignored)} left out{also}.")
    check_surface(X, T, places)
    notices = (*notices, *_coincident_notice(file, X, places))
    return frozen(X, T, Path(path).stem, notices)


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
    known = [s for s in FORMATS if s != ".msh"]
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
        with _contained():
            meshio.write(str(target), surface, file_format=FORMATS[suffix][1])
    except (Exception, SystemExit) as error:
        reason = f"{error.strerror}" if isinstance(error, OSError) and error.strerror else str(error)
        raise MeshError(
            f"{shown(target)} could not be written: {_one_line(reason)}.",
            "Check the folder and its permissions.",
        ) from None


def obj_text(vertices: np.ndarray, faces: np.ndarray, comment: str = "") -> str:
    """OBJ text of vertices (n, 3) and faces (m, k), every digit kept and nothing else (no date)."""
    head = [f"# {comment}"] if comment else []
    points = ["v {!r} {!r} {!r}".format(*row) for row in np.asarray(vertices, dtype=np.float64).tolist()]
    corners = ["f " + " ".join(map(str, row)) for row in (np.asarray(faces) + 1).tolist()]
    return "\n".join([*head, *points, *corners]) + "\n"


def _content(path: Any) -> tuple[str, bytes, str]:
    """Name to show, bytes and extension of a mesh file that is there and may be read."""
    try:
        source = Path(path)
        file = shown(source)
        suffix = source.suffix.lower()
        known = ", ".join(FORMATS)
        if source.is_dir():
            raise MeshError(f"{file} is a folder.", "Name a mesh file in it.")
        if not source.exists():
            raise MeshError(f"There is no file {file}.", "Check the path and the working folder.")
        if not source.is_file():
            raise MeshError(f"{file} is not an ordinary file.", "Name a mesh file.")
        if suffix not in FORMATS:
            raise MeshError(
                f"{file}: unknown mesh format {suffix or '(no extension)'}.", f"Known formats are {known}."
            )
        content = source.read_bytes()
    except (OSError, ValueError, TypeError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else error
        raise MeshError(
            f"Mesh file {path!a} cannot be read: {_one_line(reason)}.", "Check the path."
        ) from None
    if not content.strip():
        raise MeshError(f"{file} is empty.", _EXPORT_AGAIN)
    return file, content, suffix


def _parse(content: bytes, file: str, suffix: str, path: Path) -> Polygons:
    kind = FORMATS[suffix][0]
    if suffix == ".obj":
        return read_obj(decode(content, file, kind), file)
    if suffix == ".off":
        return read_off(decode(content, file, kind), file)
    if suffix == ".ply":
        header = ply_header(content, file)
        if header.format == "ascii":
            return read_ascii_ply(decode(content, file, kind), header, file)
        _accept_binary_ply(header, len(content), file)
    elif suffix == ".stl":
        _accept_stl(content, file)
    elif suffix == ".msh":
        _accept_gmsh(content, file)
    elif suffix == ".vtk":
        _accept_vtk(content, file)
    elif suffix == ".vtu" and content.count(b"<Piece") > 1:
        raise MeshError(f"{file} is in several pieces.", "Merge them into one piece before saving.")
    found = _through_meshio(path, file, suffix)
    if suffix == ".stl" and found.faces:
        corners = 3 * sum(len(ids) for ids, _ in found.faces)
        found.notices = (
            f"{file}: STL has no shared vertices: {corners} corners welded into {len(found.points)}.",
        )
    return found


def _through_meshio(path: Path, file: str, suffix: str) -> Polygons:
    """What meshio finds in a file, or a MeshError with its reason, whichever way it gives up."""
    import meshio

    kind, meshio_name = FORMATS[suffix]
    output = io.StringIO()
    try:
        with _contained(output) as warned:
            mesh = meshio.read(path, file_format=meshio_name)
        # numpy stops at unreadable text with no more than a warning; meshio the same at a missing end.
        incomplete = [str(w.message) for w in warned if "could not be read to its end" in str(w.message)]
        if incomplete or "not closed by" in output.getvalue():
            raise ValueError((incomplete or [output.getvalue()])[0])
        return _from_meshio(mesh, file)
    except MeshError:
        raise
    except SystemExit:
        reason = output.getvalue()
    except Exception as error:
        reason = str(error)
    reason = _one_line(reason.split("Error:")[0])
    raise MeshError(
        f"{file} cannot be read as {kind}: the file is damaged, incomplete or of another format"
        f"{f' ({reason})' if reason else ''}.",
        _EXPORT_AGAIN,
    ) from None


@contextlib.contextmanager
def _contained(output: io.StringIO | None = None) -> Iterator[list[warnings.WarningMessage]]:
    """Keep off the screen what meshio prints (it goes to `output`) and numpy's warnings (yielded)."""
    output = io.StringIO() if output is None else output
    with (
        contextlib.redirect_stdout(output),
        contextlib.redirect_stderr(output),
        warnings.catch_warnings(record=True) as warned,
        np.errstate(all="ignore"),
    ):
        warnings.simplefilter("always")
        yield warned


def _from_meshio(mesh: Any, file: str) -> Polygons:
    faces: list[tuple[np.ndarray, np.ndarray]] = []
    ignored: dict[str, int] = {}
    ignored_points = [np.zeros(0, dtype=np.int64)]
    start = 0
    for block in mesh.cells:
        count = len(block.data)
        if block.type in ("triangle", "quad", "polygon"):
            corners = np.asarray(block.data)
            if corners.dtype.kind not in "iu" or corners.ndim != 2 or corners.shape[1] < 3:
                raise ValueError("a face with fewer than three corners")
            if count:
                faces.append((np.arange(start, start + count), corners.astype(np.int64)))
            start += count
        elif block.type.startswith(("triangle", "quad", "VTK_LAGRANGE_TRI", "VTK_LAGRANGE_QUAD")):
            raise MeshError(
                f"{file} has {count} curved face{'s' * (count != 1)} ({block.type}).",
                "Muslin's triangles are straight: save the mesh with first-order elements.",
            )
        elif count:
            ignored[block.type] = ignored.get(block.type, 0) + count
            if not block.type.startswith("polyhedron"):
                ignored_points.append(np.ravel(block.data).astype(np.int64))
    points = np.asarray(mesh.points, dtype=np.float64)
    return Polygons(points, faces, ignored=ignored, ignored_points=np.concatenate(ignored_points))


def _accept_binary_ply(header: PlyHeader, size: int, file: str) -> None:
    """Refuse binary PLY that meshio would misread: cut short, or with more than vertices and corner lists."""
    vertex, face = header.element("vertex"), header.element("face")
    others = [e.name for e in header.elements if e.count and e.name not in ("vertex", "face")]
    kinds = [kind for _, kind in vertex.properties]
    unread = [
        kind for kind in kinds if kind not in PLY_SIZES or kind in ("char", "short", "ushort", "float64")
    ]
    count, *_ = [kind for _, kind in face.properties] or [("uchar", "int")]
    if others or unread or len(face.properties) > 1 or {"short", "ushort", "char", "float64"} & set(count):
        extra = (
            _one_line(", ".join(map(str, others or unread))) or "more than a list of corners for each face"
        )
        raise MeshError(f"{file} is a binary PLY file with {extra}.", "Save it as ASCII PLY or OBJ.")
    needed = header.size + vertex.count * sum(PLY_SIZES[str(k)] for k in kinds) + 13 * face.count
    if size < needed:
        raise MeshError(
            f"{file} is truncated: {vertex.count} vertices and {face.count} faces "
            f"need at least {needed} bytes, and it has {size}.",
            _EXPORT_AGAIN,
        )


def _accept_stl(content: bytes, file: str) -> None:
    """Refuse an STL file that is cut short: meshio takes what it finds."""
    promised = int.from_bytes(content[80:84], "little")
    if len(content) >= 84 and len(content) == 84 + 50 * promised:
        return
    if b"\0" in content:
        raise MeshError(
            f"{file} is a damaged binary STL file: it promises {promised} triangles, which take "
            f"{84 + 50 * promised} bytes, and has {len(content)}.",
            _EXPORT_AGAIN,
        )
    text = content.lower()
    if not text.lstrip().startswith(b"solid"):
        raise MeshError(
            f"{file} is not an STL file.", "Is it the right file? ASCII STL begins with the word solid."
        )
    if b"endsolid" not in text:
        raise MeshError(f"{file} is truncated: it has no endsolid.", _EXPORT_AGAIN)
    if len(re.findall(rb"^\s*vertex\b", text, re.MULTILINE)) != 3 * len(
        re.findall(rb"^\s*facet\b", text, re.MULTILINE)
    ):
        raise MeshError(f"{file} has facets without exactly three vertices.", _EXPORT_AGAIN)


def _accept_vtk(content: bytes, file: str) -> None:
    """Refuse a structured grid of a size that meshio would fill the memory with."""
    size = re.search(rb"^DIMENSIONS\s+(\d+)\s+(\d+)\s+(\d+)", content, re.MULTILINE)
    if size and math.prod(map(int, size.groups())) > _MOST:
        raise MeshError(f"{file} is a structured grid of more than {_MOST:,} points.", "Save a coarser one.")


def _accept_gmsh(content: bytes, file: str) -> None:
    """Refuse what meshio takes on trust in ASCII Gmsh: how many nodes there are, and their numbers."""
    if not re.search(rb"\$MeshFormat\s+\S+\s+0\b", content):
        return
    nodes = re.search(rb"^\$Nodes\s+(\d+)(?:[ \t]+(\d+))?(.*?)(^\$|\Z)", content, re.MULTILINE | re.DOTALL)
    if nodes:
        promised = max(int(count) for count in nodes.groups()[:2] if count)
        if promised > len(content):
            raise MeshError(f"{file} is truncated: it promises {promised} nodes.", _EXPORT_AGAIN)
        # meshio sets up a table as long as the largest number.
        if huge := re.search(rb"^\s*(\d{9,})(?=\s)", nodes[3], re.MULTILINE):
            raise MeshError(f"{file} has a node numbered {huge[1].decode()}.", "Renumber the nodes from 1.")
    # Version 2: a node number below 1 would count from the end.
    if not re.search(rb"\$MeshFormat\s+2\S*\s+0\b", content):
        return
    lines = content.split(b"\n")
    with contextlib.suppress(ValueError, IndexError):
        start = next((i for i, line in enumerate(lines) if line.strip() == b"$Elements"), len(lines))
        for number, line in enumerate(lines[start + 2 :], start=start + 3):
            if line.startswith(b"$"):
                return
            values = [int(token) for token in line.split()]
            if values and min(values[3 + values[2] :]) < 1:
                raise MeshError(
                    f"{file}, line {number}: element {values[0]} uses a vertex that does not exist, "
                    f"node {min(values[3 + values[2] :])}.",
                    "Gmsh counts nodes from 1.",
                )


def _drop_ignored(
    X: np.ndarray, T: np.ndarray, places: Places, candidates: np.ndarray
) -> tuple[np.ndarray, np.ndarray, Places, int]:
    """Leave out vertices that only ignored elements use; other unused vertices stay, to be refused."""
    keep = np.ones(len(X), dtype=bool)
    keep[candidates[(candidates >= 0) & (candidates < len(X))]] = False
    keep[T.ravel()] = True
    if keep.all():
        return X, T, places, 0
    lines = places.vertex_lines
    renumbered = Places(
        places.mesh,
        places.base,
        vertices=np.flatnonzero(keep),
        faces=places.faces,
        vertex_lines=None if lines is None else lines[keep],
        face_lines=places.face_lines,
    )
    return X[keep], (np.cumsum(keep) - 1)[T], renumbered, int((~keep).sum())


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


def _kinds(ignored: dict[str, int]) -> str:
    return ", ".join(
        f"{count} {_one_line(kind)} element{'s' * (count != 1)}" for kind, count in ignored.items()
    )


def _one_line(reason: object) -> str:
    """One short line, without the terminal's colours or what a traceback would begin with."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(reason))
    text = re.sub(r"[^ -~\s]|[\x1c-\x1f]", "?", text)
    return " ".join(text.replace("Traceback", "").split())[:160].strip(" .:")
