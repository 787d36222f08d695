"""One file per frame: VTU with a PVD that says when, PLY, OBJ."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xml.sax.saxutils import quoteattr

import numpy as np

from muslin.export.animation import Animation, Body, Solid, bodies
from muslin.export.files import Notice, numbered, warn_of_leftovers, whole
from muslin.render.stage import texture_coordinates


def write_pvd(animation: Animation, path: Path, notice: Notice) -> list[Path]:
    """Write `drape.pvd`, the file to open in ParaView, and `drape_0000.vtu`, ... beside it.

    Point data of the cloth: `displacement` from the rest shape [m], and `stretch` [1] where the animation has
    it. Props are parts of their own, in `drape_sphere_0000.vtu`; one that stands still is one file. So are the
    tetrahedra of a solid, in `drape_solid_0000.vtu`, with `displacement` [m] and the cells' `von_mises` [Pa]. All
    numbers are float64. The mesh of an adaptive cloth is that of each frame. If writing is interrupted, the PVD names
    the frames written so far.

    Parameters
    ----------
    animation : Animation
    path : Path
        Of the PVD.
    notice : callable str -> object
        Told of frames of an earlier export that lie beside the new ones.

    Returns
    -------
    list of Path
        The PVD first.

    Raises
    ------
    MuslinError
        If a file cannot be written.
    """
    import meshio

    pieces = path.with_suffix(".vtu")
    parts = list(bodies(animation))
    entries: list[str] = []
    written: dict[Path, None] = {}  # in order

    def piece(body: Body, k: int) -> Path:
        file = numbered(pieces, k, "" if body.rest is not None else body.name)
        if file not in written:
            data: dict[str, Any] = {}
            if body.rest is not None and animation.adapted is not None:
                shape = animation.adapted(k)
                x, triangles = shape.x, shape.triangles
                data = {"displacement": x - shape.rest, "stretch": shape.strain}
            else:
                x, triangles = body.at(k), body.triangles
                if body.rest is not None:
                    data["displacement"] = x - body.rest
                    strain = animation.strain_at(k)
                    if strain is not None:
                        data["stretch"] = strain
            _meshio(file, meshio.Mesh(x, [("triangle", triangles)], point_data=data), "vtu")
            written[file] = None
        return file

    def inside(solid: Solid, k: int) -> Path:
        file = numbered(pieces, k, "solid")
        x = np.asarray(solid.frames[k], dtype=np.float64)
        cells = {} if solid.stress is None else {"von_mises": [solid.stress(x)]}
        moved = {"displacement": x - solid.rest}
        _meshio(file, meshio.Mesh(x, [("tetra", solid.cells)], point_data=moved, cell_data=cells), "vtu")
        written[file] = None
        return file

    try:
        for k, time in enumerate(animation.times.tolist()):
            if animation.solid is not None:
                file = inside(animation.solid, k)
                entries.append(
                    f'    <DataSet timestep="{time!r}" part="{len(parts)}" name="solid"'
                    f" file={quoteattr(file.name)}/>\n"
                )
            for i, body in enumerate(parts):
                file = piece(body, k if body.moves else 0)
                entries.append(
                    f'    <DataSet timestep="{time!r}" part="{i}" name={quoteattr(body.name)}'
                    f" file={quoteattr(file.name)}/>\n"
                )
    finally:
        with whole(path, "w") as pvd:
            pvd.write('<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n  <Collection>\n')
            pvd.write("".join(entries) + "  </Collection>\n</VTKFile>\n")
    warn_of_leftovers(list(written), notice)
    return [path, *written]


def write_ply(animation: Animation, path: Path, notice: Notice) -> list[Path]:
    """Write binary PLY files `drape_0000.ply`, ...; props in `drape_sphere_0000.ply`, ...

    A prop that stands still is one file. Positions are float64; `stretch` is a vertex property where the animation has
    it. meshio's PLY has the date in its header; ours are the same bytes each time.

    Parameters
    ----------
    animation : Animation
    path : Path
        What the names begin with: `drape.ply`.
    notice : callable str -> object
        Told of frames of an earlier export that lie beside the new ones.

    Returns
    -------
    list of Path

    Raises
    ------
    MuslinError
        If a file cannot be written.
    """
    written = []
    for body in bodies(animation):
        cloth = body.rest is not None
        for k in range(len(animation) if body.moves else 1):
            strain = animation.strain_at(k) if cloth else None
            file = numbered(path, k, "" if cloth else body.name)
            with whole(file) as out:
                out.write(_ply(body.at(k), body.triangles, {} if strain is None else {"stretch": strain}))
            written.append(file)
    warn_of_leftovers(written, notice)
    return written


def write_obj(animation: Animation, path: Path, notice: Notice) -> list[Path]:
    """Write OBJ files `drape_0000.obj`, ...: the cloth with texture coordinates, and the props, as objects.

    Parameters
    ----------
    animation : Animation
    path : Path
        What the names begin with: `drape.obj`.
    notice : callable str -> object
        Told of frames of an earlier export that lie beside the new ones.

    Returns
    -------
    list of Path

    Raises
    ------
    MuslinError
        If a file cannot be written.
    """
    parts = list(bodies(animation))
    written = []
    for k, time in enumerate(animation.times.tolist()):
        file = numbered(path, k)
        with whole(file, "w") as out:
            out.write(f"# {animation.name}, frame {k}, {time:.6g} s, exported by Muslin\n")
            out.writelines(_objects(parts, k))
        written.append(file)
    warn_of_leftovers(written, notice)
    return written


def _ply(x: np.ndarray, triangles: np.ndarray, data: dict[str, np.ndarray]) -> bytes:
    """A surface as a binary PLY file, with numbers at its vertices."""
    names = ["x", "y", "z", *data]
    header = [
        "ply", "format binary_little_endian 1.0", "comment exported by Muslin",
        f"element vertex {len(x)}", *(f"property double {name}" for name in names),
        f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header\n",
    ]  # fmt: skip
    faces = np.empty(len(triangles), dtype=[("corners", "u1"), ("of", "<i4", 3)])
    faces["corners"], faces["of"] = 3, triangles
    vertices = np.column_stack([x, *data.values()]).astype("<f8")
    return "\n".join(header).encode("ascii") + vertices.tobytes() + faces.tobytes()


def _objects(parts: list[Body], k: int) -> Iterator[str]:
    first = 1  # OBJ counts vertices from 1, through all objects
    for body in parts:
        x = body.at(k)
        yield f"o {body.name}\n"
        yield _lines("v %r %r %r\n", x)
        if body.rest is None:
            yield _lines("f %d %d %d\n", body.triangles + first)
        else:  # the cloth comes first, so that its texture coordinates count like its vertices
            yield _lines("vt %.9g %.9g\n", texture_coordinates(body.rest))
            yield _lines("f %d/%d %d/%d %d/%d\n", np.repeat(body.triangles + first, 2, axis=1))
        first += len(x)


def _lines(line: str, values: np.ndarray) -> str:
    return (line * len(values)) % tuple(values.ravel().tolist())


def _meshio(path: Path, mesh: Any, kind: str) -> None:
    import meshio

    with whole(path) as file:
        meshio.write(file.name, mesh, file_format=kind)  # its VTU writer wants a name, not a file
