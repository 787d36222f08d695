"""Malformed mesh files, and the words their message should contain.

`MALFORMED` maps a file name to its bytes and these words; `write` puts them all into a folder. The loader's
tests and the command line's use the same table.
"""

from __future__ import annotations

import struct
from pathlib import Path

SQUARE_V = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
SQUARE_F = "f 1 2 3\nf 1 3 4\n"
SQUARE_XYZ = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
JUNK = bytes((i * 73 + 41) % 256 for i in range(600))

PLY_HEAD = (
    "ply\nformat {kind} 1.0\nelement vertex {n}\nproperty float x\nproperty float y\nproperty float z\n"
    "element face {m}\nproperty list uchar int vertex_indices\nend_header\n"
)


def ply(points: str, faces: str, n: int = 4, m: int = 2) -> bytes:
    return (PLY_HEAD.format(kind="ascii", n=n, m=m) + points + faces).encode()


def binary_ply(n: int = 4, m: int = 2, faces: tuple = ((0, 1, 2), (0, 2, 3))) -> bytes:
    points = struct.pack("<12f", 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0)
    body = b"".join(struct.pack(f"<B{len(face)}i", len(face), *face) for face in faces)
    return PLY_HEAD.format(kind="binary_little_endian", n=n, m=m).encode() + points + body


def off(points: str, faces: str, counts: str = "4 2 0") -> bytes:
    return f"OFF\n{counts}\n{points}{faces}".encode()


def binary_stl(triangles: list, promised: int | None = None) -> bytes:
    count = len(triangles) if promised is None else promised
    facets = b"".join(
        struct.pack("<12fH", 0, 0, 1, *(x for corner in t for x in corner), 0) for t in triangles
    )
    return b"made for a test".ljust(80, b"\0") + struct.pack("<I", count) + facets


def ascii_stl(*triangles: str, end: str = "endsolid\n") -> bytes:
    facets = [
        "facet normal 0 0 1\nouter loop\n"
        + "".join(f"vertex {p}\n" for p in t.split(","))
        + "endloop\nendfacet\n"
        for t in triangles
    ]
    return ("solid\n" + "".join(facets) + end).encode()


def vtk(
    points: str = SQUARE_XYZ, cells: str = "3 0 1 2\n3 0 2 3\n", types: str = "5\n5\n", n: int = 4
) -> bytes:
    count, size = len(cells.splitlines()), len(cells.split())
    return (
        f"# vtk DataFile Version 3.0\ntest\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {n} double\n{points}"
        f"CELLS {count} {size}\n{cells}CELL_TYPES {count}\n{types}"
    ).encode()


def vtu(
    connectivity: str = "0 1 2 0 2 3", offsets: str = "3 6", types: str = "5 5", pieces: int = 1
) -> bytes:
    piece = (
        f'<Piece NumberOfPoints="4" NumberOfCells="{len(types.split())}">'
        '<Points><DataArray type="Float64" NumberOfComponents="3" format="ascii">0 0 0 1 0 0 1 1 0 0 1 0'
        '</DataArray></Points><Cells><DataArray type="Int32" Name="connectivity" format="ascii">'
        f"{connectivity}</DataArray>"
        f'<DataArray type="Int32" Name="offsets" format="ascii">{offsets}</DataArray>'
        f'<DataArray type="UInt8" Name="types" format="ascii">{types}</DataArray></Cells></Piece>'
    )
    return (
        '<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">'
        f"<UnstructuredGrid>{piece * pieces}</UnstructuredGrid></VTKFile>"
    ).encode()


def msh2(
    elements: str = "1 2 2 0 1 1 2 3\n2 2 2 0 1 1 3 4\n",
    nodes: str = "1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n",
    end: str = "$EndElements\n",
) -> bytes:
    return (
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n"
        f"$Nodes\n{len(nodes.splitlines())}\n{nodes}$EndNodes\n"
        f"$Elements\n{len(elements.splitlines())}\n{elements}{end}"
    ).encode()


def obj(text: str) -> bytes:
    return text.encode()


SQUARE_STL = [((0, 0, 0), (1, 0, 0), (1, 1, 0)), ((0, 0, 0), (1, 1, 0), (0, 1, 0))]

MALFORMED: dict[str, tuple[bytes, tuple[str, ...]]] = {
    # Nothing there, or something else.
    "empty.obj": (b"", ("is empty",)),
    "blank.off": (b"  \n\n ", ("is empty",)),
    "empty.vtu": (b"", ("is empty",)),
    "only-comments.obj": (b"# nothing\n# here\n", ("no vertices",)),
    "unknown.xyz": (b"0 0 0\n", ("unknown mesh format .xyz", ".obj", ".msh")),
    "no-extension": (b"v 0 0 0\n", ("unknown mesh format", "no extension", ".obj")),
    "binary-junk.obj": (JUNK, ("not a text file",)),
    "binary-junk.off": (JUNK, ("not a text file",)),
    "binary-junk.ply": (JUNK, ("not a PLY file",)),
    "binary-junk.stl": (JUNK, ("STL", "promises")),
    "binary-junk.vtk": (JUNK, ("cannot be read as VTK",)),
    "binary-junk.vtu": (JUNK, ("cannot be read as VTU",)),
    "binary-junk.msh": (JUNK, ("cannot be read as Gmsh",)),
    "prose.obj": (b"Dear student,\nthis is no mesh.\n", ("no vertices",)),
    "prose.off": (b"Dear student,\nthis is no mesh.\n", ("not an OFF file", "Dear student")),
    "prose.ply": (b"Dear student,\nthis is no mesh.\n", ("not a PLY file",)),
    "prose.stl": (b"Dear student,\nthis is no mesh.\n", ("not an STL file",)),
    "prose.vtk": (b"Dear student,\nthis is no mesh.\n", ("cannot be read as VTK",)),
    "prose.vtu": (b"Dear student,\nthis is no mesh.\n", ("cannot be read as VTU",)),
    "prose.msh": (b"Dear student,\nthis is no mesh.\n", ("cannot be read as Gmsh",)),
    "utf-16.obj": ((SQUARE_V + SQUARE_F).encode("utf-16"), ("UTF-16",)),
    # Lines that cannot be read.
    "word-for-number.obj": (obj("v 0 0 0\nv 1 zero 0\n"), ("line 2", "should be numbers", "v 1 zero 0")),
    "one-coordinate.obj": (obj("v 0\n"), ("line 1", "three coordinates")),
    "mixed-dimensions.obj": (obj("v 0 0 0\nv 1 0\n"), ("line 2", "2 coordinates", "with 3")),
    "word-for-index.obj": (obj(SQUARE_V + "f 1 2 x\n"), ("line 5", "whole number")),
    "empty-index.obj": (obj(SQUARE_V + "f 1 2 /3\n"), ("line 5", "whole number")),
    "two-corners.obj": (obj(SQUARE_V + "f 1 2\n"), ("line 5", "2 corners", "at least three")),
    "huge-index.obj": (obj(SQUARE_V + "f 1 2 99999999999999999999\n"), ("line 5", "out of range")),
    "no-number.off": (
        off("0 0 0\n1 0 ?\n1 1 0\n0 1 0\n", "3 0 1 2\n3 0 2 3\n"),
        ("line 4", "numbers", "1 0 ?"),
    ),
    "no-number.ply": (ply("0 0 0\n1 0 ?\n1 1 0\n0 1 0\n", "3 0 1 2\n3 0 2 3\n"), ("line 11", "numbers")),
    "missing-values.ply": (
        ply("0 0 0\n1 0\n1 1 0\n0 1 0\n", "3 0 1 2\n3 0 2 3\n"),
        ("line 11", "2 of 3 values"),
    ),
    "bad-counts.off": (off(SQUARE_XYZ, "3 0 1 2\n", counts="four one"), ("line 2", "whole number")),
    "negative-counts.off": (off(SQUARE_XYZ, "", counts="4 -2 0"), ("line 2", "numbers of vertices")),
    "short-face.off": (off(SQUARE_XYZ, "3 0 1 2\n3 0 2\n"), ("line 8", "3 corners with 2 indices")),
    "two-corners.off": (off(SQUARE_XYZ, "3 0 1 2\n2 0 2\n"), ("line 8", "2 corners")),
    "binary.off": (b"OFF BINARY\n" + bytes(8), ("not a text file",)),
    "four-dimensions.off": (b"4OFF\n1 0 0\n0 0 0 0\n", ("not an OFF file", "4OFF")),
    "unknown-format.ply": (b"ply\nformat klingon 1.0\nend_header\n", ("PLY format", "klingon")),
    "no-corner-list.ply": (
        b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        b"element face 1\nproperty uchar red\nend_header\n0 0 0\n9\n",
        ("element face", "vertex_indices"),
    ),
    "bad-header.ply": (b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", ("line 3", "a count")),
    "no-number.vtk": (vtk(points="0 0 0\n1 0 ?\n1 1 0\n0 1 0\n"), ("cannot be read as VTK",)),
    "word-in-vertex.stl": (ascii_stl("0 0 0,1 zero 0,1 1 0"), ("line 5", "numbers", "1 zero 0")),
    "odd-word.stl": (ascii_stl("0 0 0,1 0 0,1 1 0").replace(b"outer", b"inner"), ("line 3", "inner loop")),
    "unended-facet.stl": (
        ascii_stl("0 0 0,1 0 0,1 1 0", "0 0 0,1 1 0,0 1 0").replace(b"endfacet\n", b"", 1),
        ("line 8", "before the one before it has ended"),
    ),
    "short-vertex.stl": (ascii_stl("0 0 0,1 0,1 1 0"), ("line 5", "three coordinates")),
    "unknown-type.ply": (
        binary_ply().replace(b"float z", b"quaternion z"),
        ("line 6", "quaternion", "no type of PLY"),
    ),
    "list-for-coordinate.ply": (
        binary_ply().replace(b"property float z", b"property list uchar float z"),
        ("cannot be read as PLY", "coordinate z is a list"),
    ),
    "corners-in-floats.ply": (
        binary_ply().replace(b"uchar int", b"uchar float"),
        ("cannot be read as PLY", "not whole numbers"),
    ),
    "two-corners-binary.ply": (
        binary_ply(m=1, faces=((0, 1),)),
        ("cannot be read as PLY", "face 0 has fewer than three corners"),
    ),
    # Cut short.
    "truncated.off": (off(SQUARE_XYZ, "3 0 1 2\n"), ("ends after 5 of 6", "truncated")),
    "header-only.off": (b"OFF\n", ("ends after the OFF header",)),
    "extra-lines.off": (off(SQUARE_XYZ, "3 0 1 2\n3 0 2 3\n3 0 1 3\n"), ("has 7 of 6", "counts are wrong")),
    "truncated.ply": (ply(SQUARE_XYZ, "3 0 1 2\n"), ("ends after 5 of 6", "truncated")),
    "header-cut.ply": (b"ply\nformat ascii 1.0\nelement vertex 4\n", ("no complete PLY header",)),
    "truncated-binary.ply": (binary_ply()[:-9], ("truncated", "bytes")),
    "huge-counts.ply": (binary_ply(n=10**9, m=10**9), ("truncated", "bytes")),
    "truncated-binary.stl": (
        binary_stl(SQUARE_STL, promised=3),
        ("promises 3 triangles", "234 bytes", "184"),
    ),
    "truncated-ascii.stl": (ascii_stl("0 0 0,1 0 0,1 1 0", end=""), ("truncated", "endsolid")),
    "two-vertices.stl": (ascii_stl("0 0 0,1 0 0"), ("line 7", "2 vertices, not three")),
    "truncated.vtk": (vtk()[:-40], ("cannot be read as VTK",)),
    "truncated-points.vtk": (vtk(n=5), ("cannot be read as VTK",)),
    "truncated.vtu": (vtu()[:-60], ("cannot be read as VTU",)),
    "short-connectivity.vtu": (vtu(connectivity="0 1 2 0 2"), ("cannot be read as VTU",)),
    "truncated.msh": (msh2()[:-40], ("cannot be read as Gmsh",)),
    "huge-counts.msh": (
        msh2().replace(b"$Nodes\n4", b"$Nodes\n4000000000"),
        ("truncated", "promises 4000000000 nodes"),
    ),
    "huge-counts.vtk": (
        b"# vtk DataFile Version 3.0\ntest\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 99999 99999 99999\n"
        b"ORIGIN 0 0 0\nSPACING 1 1 1\n",
        ("structured grid", "20,000,000"),
    ),
    "unclosed.msh": (msh2(end=""), ("cannot be read as Gmsh", "not closed")),
    # Nothing to make cloth of.
    "points-only.obj": (obj(SQUARE_V), ("no triangles", "faces")),
    "lines-only.obj": (obj(SQUARE_V + "l 1 2 3 4\n"), ("no triangles", "1 line element")),
    "no-faces.off": (off(SQUARE_XYZ, "", counts="4 0 0"), ("no triangles",)),
    "no-vertices.off": (off("", "", counts="0 0 0"), ("no vertices",)),
    "no-vertices.ply": (ply("", "", n=0, m=0), ("no vertices",)),
    "no-facets.stl": (ascii_stl(), ("no vertices",)),
    "only-tetrahedra.vtk": (
        vtk(cells="4 0 1 2 3\n", types="10\n"),
        ("no triangles", "1 tetra element", "solids"),
    ),
    "only-tetrahedra.msh": (msh2("1 4 2 0 1 1 2 3 4\n"), ("no triangles", "tetra")),
    "curved.msh": (
        msh2("1 9 2 0 1 1 2 3 4 5 6\n", "1 0 0 0\n2 1 0 0\n3 1 1 0\n4 .5 0 0\n5 1 .5 0\n6 .5 .5 0\n"),
        ("1 curved face", "triangle6"),
    ),
    "polydata.vtk": (
        b"# vtk DataFile Version 3.0\ntest\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\n",
        ("no triangles", "faces"),
    ),
    "structured-field.vtk": (vtk().replace(b"UNSTRUCTURED_GRID", b"FIELD"), ("no mesh Muslin reads",)),
    "image.vti.vtu": (
        b'<VTKFile type="ImageData"><ImageData/></VTKFile>',
        ("ImageData", "no mesh Muslin reads"),
    ),
    "pieces-mixed-up.vtu": (
        vtu(connectivity="0 1 2 0 2 7", pieces=2),
        ("cannot be read as VTU", "points that it does not have"),
    ),
    "compressed.vtu": (
        vtu().replace(b"<VTKFile", b'<VTKFile compressor="vtkSecretDataCompressor"'),
        ("compressed with", "vtkSecretDataCompressor"),
    ),
    "extra-properties.ply": (
        binary_ply().replace(b"vertex_indices\n", b"vertex_indices\nproperty uchar red\n"),
        ("cannot be read as PLY", "fewer than three corners"),
    ),
    # Coordinates.
    "nan.obj": (
        obj(SQUARE_V.replace("v 1 1 0", "v nan 1 0") + SQUARE_F),
        ("vertex 3 (line 3)", "not finite"),
    ),
    "infinite.off": (
        off(SQUARE_XYZ.replace("1 1 0", "1 inf 0"), "3 0 1 2\n3 0 2 3\n"),
        ("vertex 2 (line 5)", "not finite"),
    ),
    "overflow.ply": (
        ply(SQUARE_XYZ.replace("1 1 0", "1 1e999 0"), "3 0 1 2\n3 0 2 3\n"),
        ("vertex 2 (line 12)", "not finite"),
    ),
    "nan.stl": (ascii_stl("0 0 0,1 0 0,nan 1 0"), ("vertex 2", "not finite")),
    "nan.vtk": (vtk(points=SQUARE_XYZ.replace("1 1 0", "nan 1 0")), ("vertex 2", "not finite")),
    "far-away.obj": (obj("v 1e300 0 0\nv 0 1 0\nv 0 0 0\nf 1 2 3\n"), ("vertex 1 (line 1)", "units")),
    # Indices.
    "out-of-range.obj": (
        obj("# square\n" + SQUARE_V + "f 1 2 3\nf 1 3 5\nf 1 9 2\n"),
        ("2 faces use", "there are 4: 1 to 4", "face 2 (line 7)", "vertex 5"),
    ),
    "zero-index.obj": (
        obj(SQUARE_V + "f 0 1 2\nf 0 2 3\n"),
        ("2 faces use", "face 1 (line 5)", "vertex 0", "count from 1"),
    ),
    "negative-too-far.obj": (obj(SQUARE_V + "f -1 -2 -5\n"), ("line 5", "-5", "only 4 vertices")),
    "out-of-range-textured.obj": (obj(SQUARE_V + "vt 0 0\nf 1/1 2/1 7/1\n"), ("face 1 (line 6)", "vertex 7")),
    "out-of-range.off": (off(SQUARE_XYZ, "3 0 1 2\n3 0 2 4\n"), ("face 1 (line 8)", "vertex 4", "0 to 3")),
    "negative-index.off": (off(SQUARE_XYZ, "3 0 1 -2\n3 0 2 3\n"), ("face 0 (line 7)", "vertex -2")),
    "out-of-range.ply": (ply(SQUARE_XYZ, "3 0 1 2\n3 0 2 4\n"), ("face 1 (line 15)", "vertex 4")),
    "out-of-range-binary.ply": (binary_ply(faces=((0, 1, 2), (0, 2, 7))), ("face 1", "vertex 7")),
    "negative-binary.ply": (binary_ply(faces=((0, 1, 2), (0, 2, -1))), ("face 1", "vertex -1")),
    "out-of-range.vtk": (vtk(cells="3 0 1 2\n3 0 2 8\n"), ("face 1", "vertex 8")),
    "out-of-range.vtu": (vtu(connectivity="0 1 2 0 2 8"), ("face 1", "vertex 8")),
    "huge-node.msh": (
        msh2(nodes="1 0 0 0\n2 1 0 0\n3 1 1 0\n99999999999 0 1 0\n"),
        ("node numbered 99999999999",),
    ),
    "zero-node.msh": (
        msh2("1 2 2 0 1 1 2 3\n2 2 2 0 1 1 3 0\n"),
        ("line 14", "element 2", "node 0", "from 1"),
    ),
    "missing-node.msh": (
        msh2("1 2 2 0 1 1 2 3\n2 2 2 0 1 1 3 9\n"),
        ("cannot be read as Gmsh", "out of bounds"),
    ),
    # Faces.
    "repeated-vertex.obj": (
        obj(SQUARE_V + "f 1 2 3\nf 1 3 3\n"),
        ("face 2 (line 6)", "degenerate", "1, 3, 3"),
    ),
    "repeated-in-quad.obj": (obj(SQUARE_V + "f 1 2 3 2\n"), ("face 1 (line 5)", "same vertex twice")),
    "collinear.obj": (
        obj("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"),
        ("face 1 (line 5)", "degenerate", "area 0"),
    ),
    "needle.obj": (obj("v 0 0 0\nv 1000 0 0\nv 500 1e-5 0\nf 1 2 3\n"), ("face 1 (line 4)", "degenerate")),
    "coincident-corners.stl": (ascii_stl("0 0 0,1 0 0,1 0 0"), ("degenerate", "same vertex twice")),
    "duplicate.obj": (
        obj(SQUARE_V + SQUARE_F + "f 2 3 1\n"),
        ("face 3 (line 7)", "duplicate", "the same as face 1 (line 5)"),
    ),
    "duplicate-turned.off": (
        off(SQUARE_XYZ, "3 0 1 2\n3 0 2 3\n3 0 2 1\n", counts="4 3 0"),
        ("face 2 (line 9)", "duplicate", "face 0 (line 7)"),
    ),
    "duplicate.stl": (binary_stl([*SQUARE_STL, SQUARE_STL[0]]), ("face 2", "duplicate")),
    "non-manifold.obj": (
        obj(SQUARE_V + "v 0.5 0.5 1\n" + SQUARE_F + "f 3 1 5\n"),
        ("1 edge is non-manifold", "vertex 1 (line 1)", "vertex 3 (line 3)", "face 3 (line 8)"),
    ),
    "winding.obj": (
        obj(SQUARE_V + "f 1 2 3\nf 1 4 3\n"),
        ("inconsistent winding", "vertex 1 (line 1)", "vertex 3 (line 3)", "face 2 (line 6)"),
    ),
    "winding-quads.off": (
        off(SQUARE_XYZ + "2 0 0\n2 1 0\n", "4 0 1 2 3\n4 1 2 5 4\n", counts="6 2 0"),
        ("inconsistent winding", "face 1 (line 10)"),
    ),
    "c-shape.obj": (
        obj("v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\nv 0 3 0\nv 3 3 0\nv 3 1 0\nv 0 1 0\nf 1 2 3 4 5 6 7 8\n"),
        ("1 polygon cannot be cut", "face 1 (line 9)", "8 corners"),
    ),
    "crossing-quad.obj": (
        obj(SQUARE_V + "f 1 2 4 3\n"),
        ("1 polygon cannot be cut", "face 1 (line 5)", "cross"),
    ),
}


def write(folder: Path) -> list[Path]:
    """Write every malformed mesh into a folder; the paths, in the table's order."""
    for name, (content, _) in MALFORMED.items():
        (folder / name).write_bytes(content)
    return [folder / name for name in MALFORMED]
