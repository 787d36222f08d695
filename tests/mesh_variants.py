"""One mesh in the many ways its format allows, written here by hand: no code of the readers is used.

`VARIANTS` maps a file name to the bytes; all hold `POINTS`, and the triangles `TRIANGLES` in this order and
winding, or `QUADS` in place of them where the name says so.
"""

from __future__ import annotations

import base64
import itertools
import lzma
import struct
import zlib

import numpy as np

#: Corners of two rows of three squares in space, coordinates that single precision holds exactly.
POINTS = np.array([[0.5 * i, 0.25 * j, 0.125 * i * j - 1] for j in range(3) for i in range(4)])
QUADS = np.array([[a, a + 1, a + 5, a + 4] for j in range(2) for a in range(4 * j, 4 * j + 3)])
TRIANGLES = np.concatenate([[q[[0, 1, 2]], q[[0, 2, 3]]] for q in QUADS])
#: The two rows as strips: their triangles are the same squares, cut along the other diagonal.
STRIPS = [[4, 0, 5, 1, 6, 2, 7, 3], [8, 4, 9, 5, 10, 6, 11, 7]]

VARIANTS: dict[str, bytes] = {}


# PLY: order of elements, names, types, properties besides.


def _ply_value(kind: str, value: float, order: str) -> bytes | str:
    if order == "ascii":
        return f"{value:g} " if kind in "fd" else f"{int(value)} "
    return struct.pack(order + kind, value if kind in "fd" else int(value))


_PLY_NAMES = {
    "b": "char",
    "B": "uchar",
    "h": "short",
    "H": "ushort",
    "i": "int",
    "I": "uint",
    "f": "float",
    "d": "double",
}
_PLY_NEW_NAMES = {
    "b": "int8", "B": "uint8", "h": "int16", "H": "uint16", "i": "int32", "I": "uint32", "f": "float32", "d": "float64"
}  # fmt: skip


def ply(order: str, elements: list, names: dict | None = None, end: str = "\n") -> bytes:
    """A PLY file: elements (name, properties, rows); a property is (name, type) or (name, count type, type)."""
    names = names or _PLY_NAMES
    word = {"ascii": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = ["ply", f"format {word} 1.0", "comment by hand", "obj_info nothing"]
    body: list[bytes] = []
    for element, properties, rows in elements:
        head.append(f"element {element} {len(rows)}")
        for name, *kinds in properties:
            listed = "list " if len(kinds) == 2 else ""
            head.append(f"property {listed}{' '.join(names[k] for k in kinds)} {name}")
        for row in rows:
            parts = []
            for (_, *kinds), value in zip(properties, row, strict=True):
                if len(kinds) == 2:
                    parts.append(_ply_value(kinds[0], len(value), order))
                    parts += [_ply_value(kinds[1], v, order) for v in value]
                else:
                    parts.append(_ply_value(kinds[0], value, order))
            body.append(("".join(parts) + end).encode() if order == "ascii" else b"".join(parts))
    return (end.join([*head, "end_header"]) + end).encode() + b"".join(body)


XYZ = [("x", "f"), ("y", "f"), ("z", "f")]


def _ply_variants() -> None:
    where = {"ascii": "text", "<": "little", ">": "big"}
    for order in where:
        plain = ("vertex", XYZ, POINTS.tolist())
        face = ("face", [("vertex_indices", "B", "i")], [[t] for t in TRIANGLES.tolist()])
        rows = [[t, [0.5] * 6, 200, 100] for t in TRIANGLES.tolist()]
        painted = (
            "face",
            [("vertex_index", "B", "i"), ("texcoord", "B", "f"), ("red", "B"), ("flags", "h")],
            rows,
        )
        uneven = [[9, [0.5] * (k % 3), t] for k, t in enumerate(TRIANGLES.tolist())]
        before = ("face", [("red", "B"), ("texcoord", "H", "d"), ("vertex_indices", "i", "I")], uneven)
        coloured = (
            "vertex",
            [("nx", "f"), ("red", "B"), ("x", "d"), ("quality", "d"), ("y", "d"), ("z", "d"), ("alpha", "b")],
            [[0, 7, x, 0.5, y, z, -1] for x, y, z in POINTS.tolist()],
        )
        linked = (
            "vertex",
            [("near", "B", "i"), *XYZ],
            [[[1] * (k % 3), *p] for k, p in enumerate(POINTS.tolist())],
        )
        edge = ("edge", [("vertex1", "i"), ("vertex2", "i")], [[0, 1], [1, 2]])
        material = ("material", [("name", "B", "B"), ("shine", "d")], [[[72, 105], 0.5], [[], 1]])
        strips = ("tristrips", [("vertex_indices", "i", "i")], [[STRIPS[0] + [-1] + STRIPS[1]]])
        two_strips = ("tristrips", [("vertex_indices", "i", "i")], [[s] for s in STRIPS])
        mixed = ("face", [("vertex_indices", "B", "i")], [[q] for q in QUADS.tolist()])
        small = ("face", [("vertex_index", "b", "H")], [[t] for t in TRIANGLES.tolist()])
        for name, elements in {
            "plain": [plain, face],
            "faces-first": [face, plain],
            "painted": [coloured, painted],
            "uneven-lists": [coloured, before],
            "others-between": [material, plain, edge, face, edge],
            "lists-at-vertices": [linked, small],
            "strips": [plain, strips],
            "two-strips": [two_strips, plain],
            "quads": [plain, mixed],
        }.items():
            VARIANTS[f"{name}.{where[order]}.ply"] = ply(order, elements)
        VARIANTS[f"new-names.{where[order]}.ply"] = ply(order, [plain, face], _PLY_NEW_NAMES)
    VARIANTS["crlf.text.ply"] = ply("ascii", [plain, face], end="\r\n")
    VARIANTS["crlf.big.ply"] = ply(">", [plain, face], end="\r\n")
    VARIANTS["spare-bytes.big.ply"] = ply(">", [plain, face]) + b"\n\n"


# STL: capitals, normals, solids, what follows.


def _stl_text(words: dict[str, str], parts: int = 1, normal: str = " normal 0 0 1", end: str = "\n") -> bytes:
    lines = []
    for share in np.array_split(TRIANGLES, parts):
        lines.append(words["solid"] + " a vertex of facets")
        for triangle in share:
            lines += [f"  {words['facet']}{normal}", f"    {words['outer loop']}"]
            lines += [f"      {words['vertex']} {x:e} {y:g} {z}" for x, y, z in POINTS[triangle]]
            lines += [f"    {words['endloop']}", f"  {words['endfacet']}"]
        lines.append(words["endsolid"])
    return (end.join(lines) + end).encode()


def _stl_binary(head: bytes = b"by hand", attribute: int = 0) -> bytes:
    facets = b"".join(struct.pack("<12fH", 0, 0, 0, *POINTS[t].ravel(), attribute) for t in TRIANGLES)
    return head.ljust(80, b" ")[:80] + struct.pack("<I", len(TRIANGLES)) + facets


def _stl_variants() -> None:
    small = {w: w for w in ("solid", "facet", "outer loop", "vertex", "endloop", "endfacet", "endsolid")}
    large = {w: w.upper() for w in small}
    title = {w: w.title() for w in small}
    apart = {w: w.replace("end", "end ") for w in small}
    VARIANTS["small.text.stl"] = _stl_text(small)
    VARIANTS["capitals.text.stl"] = _stl_text(large, normal=" NORMAL 0.0E+00 0 1")
    VARIANTS["mixed.text.stl"] = _stl_text(title)
    VARIANTS["apart.text.stl"] = _stl_text(apart)
    VARIANTS["no-normals.text.stl"] = _stl_text(small, normal="")
    VARIANTS["solids.text.stl"] = _stl_text(small, parts=3)
    VARIANTS["crlf.text.stl"] = _stl_text(small, end="\r\n")
    VARIANTS["one-line-a-facet.text.stl"] = (
        _stl_text(small)
        .replace(b"\n    outer", b" outer")
        .replace(b"\n      ", b" ")
        .replace(b"\n    end", b" end")
    )
    VARIANTS["plain.binary.stl"] = _stl_binary()
    VARIANTS["solid-in-head.binary.stl"] = _stl_binary(b"solid facet normal vertex")
    VARIANTS["attributes.binary.stl"] = _stl_binary(attribute=0x8FFF)
    VARIANTS["a-byte-more.binary.stl"] = _stl_binary() + b"\n"
    VARIANTS["bytes-more.binary.stl"] = _stl_binary(b"solid") + b"\0" * 7 + b"end"


# Legacy VTK: text and binary, both layouts of cells, kinds of data set, sections besides.


class _Vtk:
    def __init__(self, binary: bool, new: bool, dataset: str):
        self.binary, self.new = binary, new
        version, form = ("5.1" if new else "3.0"), ("BINARY" if binary else "ASCII")
        self.text = f"# vtk DataFile Version {version}\na title\n{form}\nDATASET {dataset}\n".encode()

    def line(self, text: str) -> _Vtk:
        self.text += text.encode() + b"\n"
        return self

    def array(self, values, kind: str) -> _Vtk:
        if self.binary:
            self.text += np.asarray(values, dtype=">" + kind).tobytes() + b"\n"
        else:
            rows = [" ".join(f"{v:g}" for v in row) for row in np.atleast_2d(values).tolist()]
            self.text += "\n".join(rows).encode() + b"\n"
        return self

    def points(self) -> _Vtk:
        self.line(f"POINTS {len(POINTS)} float").array(POINTS, "f4")
        return self

    def cells(self, keyword: str, cells) -> _Vtk:
        flat = [v for cell in cells for v in cell]
        if self.new:
            self.line(f"{keyword} {len(cells) + 1} {len(flat)}")
            self.line("OFFSETS vtktypeint64").array([np.cumsum([0, *map(len, cells)])], "i8")
            return self.line("CONNECTIVITY vtktypeint64").array([flat], "i8")
        self.line(f"{keyword} {len(cells)} {len(flat) + len(cells)}")
        return self.array([[v for cell in cells for v in (len(cell), *cell)]], "i4")

    def strings(self, texts: list[str]) -> _Vtk:
        for text in texts:
            if self.binary:
                self.text += bytes([0xC0 | len(text)]) + text.encode()
            else:
                self.text += text.encode() + b"\n"
        return self.line("") if self.binary else self


def _attributes(file: _Vtk) -> _Vtk:
    n, m = len(POINTS), len(TRIANGLES)
    file.line(f"POINT_DATA {n}").line("NORMALS normals float").array(np.ones((n, 3)), "f4")
    file.line("TEXTURE_COORDINATES uv 2 float").array(np.ones((n, 2)), "f4")
    file.line("SCALARS height float 1").line("LOOKUP_TABLE table").array(np.ones((n, 1)), "f4")
    file.line("LOOKUP_TABLE table 1").array([[1, 0, 0, 1]], "u1" if file.binary else "f4")
    file.line(f"CELL_DATA {m}").line("GLOBAL_IDS ids vtkIdType").array([np.arange(m)], "i4")
    file.line("FIELD FieldData 1").line(f"part 1 {m} string")
    return file.strings([f"part%20{k}" if k else "" for k in range(m)])


def _vtk_variants() -> None:
    triangles, quads = TRIANGLES.tolist(), QUADS.tolist()
    pixels = [[q[0], q[1], q[3], q[2]] for q in quads]
    for binary, new in itertools.product((False, True), (False, True)):
        kind = f"{'binary' if binary else 'text'}-{'5.1' if new else '3.0'}.vtk"

        def begun(dataset: str, binary=binary, new=new) -> _Vtk:
            return _Vtk(binary, new, dataset)

        def grid(cells, number: int, begun=begun) -> _Vtk:
            file = begun("UNSTRUCTURED_GRID").points().cells("CELLS", cells)
            return file.line(f"CELL_TYPES {len(cells)}").array([[number] * len(cells)], "i4")

        VARIANTS[f"grid.{kind}"] = grid(triangles, 5).text
        VARIANTS[f"grid-attributes.{kind}"] = _attributes(grid(triangles, 5)).text
        VARIANTS[f"grid-of-polygons.{kind}"] = grid(triangles, 7).text
        VARIANTS[f"quads-of-grid.{kind}"] = grid(quads, 9).text
        VARIANTS[f"quads-of-pixels.{kind}"] = grid(pixels, 8).text
        VARIANTS[f"strips-of-grid.{kind}"] = grid(STRIPS, 6).text
        VARIANTS[f"surface.{kind}"] = begun("POLYDATA").points().cells("POLYGONS", triangles).text
        several = begun("POLYDATA").points().cells("VERTICES", [[0], [1, 2]]).cells("LINES", [[0, 1, 2]])
        VARIANTS[f"surface-several.{kind}"] = _attributes(several.cells("POLYGONS", triangles)).text
        VARIANTS[f"strips-of-surface.{kind}"] = (
            begun("POLYDATA").points().cells("TRIANGLE_STRIPS", STRIPS).text
        )
        field = begun("POLYDATA").line("FIELD FieldData 3")
        field.line("time 1 1 double").array([[0.5]], "f8")
        field.line("METADATA").line("INFORMATION 1").line("NAME RANGE LOCATION vtkDataArray").line(
            "DATA 2 0 1"
        ).line("")
        field.line("name 1 2 string").strings(["POINTS 3", "b"])
        field.line("ids 2 2 int").array([[1, 2], [3, 4]], "i4")
        field.points().line("METADATA").line("INFORMATION 0").line("").cells("POLYGONS", triangles)
        VARIANTS[f"fields-first.{kind}"] = field.text
        sheet = begun("STRUCTURED_GRID").line("DIMENSIONS 4 3 1").points()
        VARIANTS[f"quads-of-sheet.{kind}"] = sheet.text
    VARIANTS["small-letters.vtk"] = (
        VARIANTS["surface.text-3.0.vtk"]
        .replace(b"POLYDATA", b"polydata")
        .replace(b"POLYGONS", b"polygons")
        .replace(b"POINTS", b"points")
    )
    VARIANTS["crlf.vtk"] = VARIANTS["grid-attributes.text-5.1.vtk"].replace(b"\n", b"\r\n")


# VTU and VTP: how arrays are written down.


def _blocks(data: bytes, size: int) -> list[bytes]:
    return [data[k : k + size] for k in range(0, len(data), size)]


def _lz4_stored(data: bytes) -> bytes:
    """An LZ4 block of literals only: what the format allows for data that does not shrink."""
    n = len(data)
    head = bytes([n << 4]) if n < 15 else b"\xf0" + b"\xff" * ((n - 15) // 255) + bytes([(n - 15) % 255])
    return head + data


_PACK = {"ZLib": zlib.compress, "LZMA": lzma.compress, "LZ4": _lz4_stored}


class VtkXml:
    """A VTU or VTP file whose arrays are all written down in one way."""

    def __init__(self, form: str, order: str = "<", header: str = "UInt32", pack: str = ""):
        self.form, self.order, self.header, self.pack = form, order, header, pack
        self.appended = b""

    def array(self, name: str, values, kind: str, components: int = 1) -> str:
        code = {"Float32": "f4", "Float64": "f8", "Int32": "i4", "Int64": "i8", "UInt8": "u1"}[kind]
        flat = np.asarray(values).ravel()
        tag = f'<DataArray type="{kind}" Name="{name}" NumberOfComponents="{components}"'
        if self.form == "ascii":
            return f'{tag} format="ascii">\n{" ".join(f"{v:g}" for v in flat)}\n</DataArray>'
        head, body = self._packed(flat.astype(self.order + code).tobytes())
        if self.form == "binary":
            return f'{tag} format="binary">\n  {self._base64(head, body)}\n</DataArray>'
        offset = len(self.appended)
        self.appended += head + body if self.form == "raw" else self._base64(head, body).encode()
        return f'{tag} format="appended" offset="{offset}"/>'

    def _packed(self, data: bytes) -> tuple[bytes, bytes]:
        code = self.order + {"UInt32": "I", "UInt64": "Q"}[self.header]
        if not self.pack:
            return struct.pack(code, len(data)), data
        size = 64
        blocks = _blocks(data, size)
        packed = [_PACK[self.pack](block) for block in blocks]
        sizes = [len(blocks), size, len(data) % size, *map(len, packed)]
        return b"".join(struct.pack(code, s) for s in sizes), b"".join(packed)

    def _base64(self, head: bytes, body: bytes) -> str:
        if self.pack:  # the header of sizes is a part of its own
            return base64.b64encode(head).decode() + base64.b64encode(body).decode()
        return base64.b64encode(head + body).decode()

    def file(self, kind: str, inside: str, besides: str = "") -> bytes:
        end = {"<": "LittleEndian", ">": "BigEndian"}[self.order]
        packer = f' compressor="vtk{self.pack}DataCompressor"' if self.pack else ""
        head = (
            f'<?xml version="1.0"?>\n<VTKFile type="{kind}" version="2.2" byte_order="{end}" '
            f'header_type="{self.header}"{packer}>\n{besides}<{kind}>{inside}</{kind}>\n'
        ).encode()
        if self.appended:
            encoding = self.form if self.form == "raw" else "base64"
            head += (
                f'<AppendedData encoding="{encoding}">\n_'.encode() + self.appended + b"\n</AppendedData>\n"
            )
        return head + b"</VTKFile>\n"

    def grid(self, cells, number: int, data: str = "", besides: str = "") -> bytes:
        flat = [v for cell in cells for v in cell]
        inside = (
            '<FieldData><Array type="String" Name="note" format="ascii">72 105 0</Array></FieldData>'
            f'<Piece NumberOfPoints="{len(POINTS)}" NumberOfCells="{len(cells)}">{data}'
            f"<Points>{self.array('Points', POINTS, 'Float32', 3)}</Points><Cells>"
            f"{self.array('connectivity', flat, 'Int64')}"
            f"{self.array('offsets', np.cumsum(list(map(len, cells))), 'Int32')}"
            f"{self.array('types', [number] * len(cells), 'UInt8')}</Cells></Piece>"
        )
        return self.file("UnstructuredGrid", inside, besides)

    def surface(self, polygons, strips=()) -> bytes:
        def below(name: str, cells) -> str:
            flat = [v for cell in cells for v in cell]
            ends = np.cumsum([len(cell) for cell in cells])
            return f"<{name}>{self.array('connectivity', flat, 'Int32')}{self.array('offsets', ends, 'Int32')}</{name}>"

        inside = (
            f'<Piece NumberOfPoints="{len(POINTS)}" NumberOfVerts="0" NumberOfLines="1" '
            f'NumberOfStrips="{len(strips)}" NumberOfPolys="{len(polygons)}">'
            f"<Points>{self.array('Points', POINTS, 'Float64', 3)}</Points>"
            f"{below('Verts', [])}{below('Lines', [[0, 1, 2]])}{below('Strips', strips)}{below('Polys', polygons)}"
            "</Piece>"
        )
        return self.file("PolyData", inside)


#: How the arrays of a file are written down: form, byte order, type of the sizes, compressor.
FORMS = [
    ("ascii", "<", "UInt32", ""),
    *itertools.product(("binary", "base64", "raw"), "<>", ("UInt32", "UInt64"), ("", "ZLib")),
    *itertools.product(("binary", "base64", "raw"), "<", ("UInt32",), ("LZMA", "LZ4")),
]


def _xml_variants() -> None:
    triangles, quads = TRIANGLES.tolist(), QUADS.tolist()
    for form in FORMS:
        kind = "-".join({"<": "little", ">": "big"}.get(word, word) for word in form if word)
        VARIANTS[f"grid.{kind}.vtu"] = VtkXml(*form).grid(triangles, 5)
        VARIANTS[f"surface.{kind}.vtp"] = VtkXml(*form).surface(triangles)
    pixels = [[q[0], q[1], q[3], q[2]] for q in quads]
    VARIANTS["quads-of-pixels.vtu"] = VtkXml("ascii").grid(pixels, 8)
    VARIANTS["quads-of-grid.vtu"] = VtkXml("raw").grid(quads, 9)
    VARIANTS["polygons-of-grid.vtu"] = VtkXml("binary").grid(triangles, 7)
    VARIANTS["strips-of-grid.vtu"] = VtkXml("ascii").grid(STRIPS, 6)
    VARIANTS["strips-of-surface.vtp"] = VtkXml("base64").surface([], STRIPS)
    data = (
        '<PointData Normals="n"><DataArray type="Float32" Name="n" NumberOfComponents="3" format="ascii">'
        + "1 0 0 " * len(POINTS)
        + "</DataArray></PointData>"
        '<CellData><Array type="String" Name="part" format="ascii">65 0</Array></CellData>'
    )
    VARIANTS["attributes.vtu"] = VtkXml("ascii").grid(
        triangles, 5, data, besides="<UserData><Anything/></UserData>"
    )


_ply_variants()
_stl_variants()
_vtk_variants()
_xml_variants()
