"""Gmsh, read by meshio on a short leash: what it takes on trust is checked first, and what it prints kept back."""

from __future__ import annotations

import contextlib
import io
import re
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons
from muslin.mesh.refusals import EXPORT_AGAIN, damaged


def read_gmsh(content: bytes, file: str, path: Path) -> Polygons:
    """What meshio finds in a Gmsh file, or a MeshError with its reason, whichever way it gives up."""
    import meshio

    _accept(content, file)
    output = io.StringIO()
    try:
        with contained(output) as warned:
            mesh = meshio.read(path, file_format="gmsh")
        # numpy stops at unreadable text with no more than a warning; meshio the same at a missing end.
        incomplete = [str(w.message) for w in warned if "could not be read to its end" in str(w.message)]
        if incomplete or "not closed by" in output.getvalue():
            raise ValueError((incomplete or [output.getvalue()])[0])
        return _polygons(mesh, file)
    except MeshError:
        raise
    except SystemExit:
        reason = output.getvalue()
    except Exception as error:
        reason = str(error)
    raise damaged(file, "Gmsh", reason.split("Error:")[0]) from None


@contextlib.contextmanager
def contained(output: io.StringIO | None = None) -> Iterator[list[warnings.WarningMessage]]:
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


def _polygons(mesh: Any, file: str) -> Polygons:
    faces: list[tuple[np.ndarray, np.ndarray]] = []
    ignored: dict[str, int] = {}
    ignored_points = [np.zeros(0, dtype=np.int64)]
    tetrahedra: list[np.ndarray] = []
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
            if block.type == "tetra":
                tetrahedra.append(np.asarray(block.data).astype(np.int64))
    points = np.asarray(mesh.points, dtype=np.float64)
    return Polygons(
        points,
        faces,
        ignored=ignored,
        ignored_points=np.concatenate(ignored_points),
        tetrahedra=np.concatenate(tetrahedra) if tetrahedra else None,
    )


def _accept(content: bytes, file: str) -> None:
    """Refuse what meshio takes on trust in ASCII Gmsh: how many nodes there are, and their numbers."""
    if not re.search(rb"\$MeshFormat\s+\S+\s+0\b", content):
        return
    nodes = re.search(rb"^\$Nodes\s+(\d+)(?:[ \t]+(\d+))?(.*?)(^\$|\Z)", content, re.MULTILINE | re.DOTALL)
    if nodes:
        promised = max(int(count) for count in nodes.groups()[:2] if count)
        if promised > len(content):
            raise MeshError(f"{file} is truncated: it promises {promised} nodes.", EXPORT_AGAIN)
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
