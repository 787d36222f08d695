"""VTU and VTP, VTK's files in XML: the geometry, however its arrays are written down.

An array stands in its element as text or base64, or appended behind the XML in base64 or raw bytes; plain, or
in blocks compressed with zlib, LZMA or LZ4. Only the arrays of points and cells are read, so data of any
kind, strings and UserData do not matter. meshio refuses a file for an element, version or compression it
does not know, and every VTP.

https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html
"""

from __future__ import annotations

import base64
import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from xml.etree import ElementTree

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.polygons import Polygons
from muslin.mesh.vtkcells import POLYGON, STRIP, from_cells

TYPES = {
    "Int8": "i1", "UInt8": "u1", "Int16": "i2", "UInt16": "u2", "Int32": "i4", "UInt32": "u4",
    "Int64": "i8", "UInt64": "u8", "Float32": "f4", "Float64": "f8",
}  # fmt: skip
# Cells of a PolyData, in the order of their numbers, and what they are in vtkCellType.h.
_SURFACE = {"Verts": 2, "Lines": 4, "Polys": POLYGON, "Strips": STRIP}


@dataclass(frozen=True)
class _Arrays:
    """How a file writes its arrays down: byte order, type of the sizes, compression, and what is appended."""

    file: str
    order: str
    header: np.dtype
    inflate: Callable[[bytes, int], bytes] | None
    appended: bytes
    raw: bool
    ends: tuple[int, ...]  # of the appended arrays

    def values(self, element: ElementTree.Element | None, what: str) -> np.ndarray:
        """Numbers of a DataArray."""
        if element is None:
            raise ValueError(f"it has no {what}")
        kind, form = element.get("type", ""), element.get("format", "ascii").lower()
        if kind not in TYPES:
            raise ValueError(f"{what} are of type {kind[:20]!a}")
        dtype = np.dtype(self.order + TYPES[kind])
        text = (element.text or "").strip()
        if form == "ascii":
            words = text.split()
            return np.array(words, dtype=np.float64 if dtype.kind == "f" else np.int64)
        if form == "binary":
            content = self._content(_base64(text.encode()), what)
        elif form == "appended":
            begin = int(element.get("offset", ""))
            if not 0 <= begin < len(self.appended):
                raise ValueError(f"{what} are not in the appended data")
            end = next((e for e in self.ends if e > begin), len(self.appended))
            piece = self.appended[begin:end]
            content = self._content(piece if self.raw else _base64(piece), what)
        else:
            raise ValueError(f"{what} are of format {form[:20]!a}")
        if len(content) % dtype.itemsize:
            raise ValueError(f"{what} end within a number")
        return np.frombuffer(content, dtype)

    def _content(self, data: bytes, what: str) -> bytes:
        """Bytes of an array behind its header of sizes."""
        width = self.header.itemsize
        first = self._sizes(data, 0, 1, what)[0]
        if self.inflate is None:
            if len(data) < width + first:
                raise ValueError(f"{what} promise {first} bytes and have {len(data) - width}")
            return data[width : width + first]
        if first == 0:
            return b""
        size, last, *packed = self._sizes(data, width, 2 + first, what)
        sizes = [size] * (first - 1) + [last or size]
        at = width * (3 + first)
        blocks = []
        for size, length in zip(sizes, packed, strict=True):
            block = data[at : at + length]
            if len(block) < length:
                raise ValueError(f"{what} are cut short")
            blocks.append(self.inflate(block, size))
            if len(blocks[-1]) != size:
                raise ValueError(f"{what} are not what their sizes promise")
            at += length
        return b"".join(blocks)

    def _sizes(self, data: bytes, at: int, count: int, what: str) -> list[int]:
        if at + count * self.header.itemsize > len(data):
            raise ValueError(f"{what} are cut short")
        sizes: list[int] = np.frombuffer(data, self.header, count, at).tolist()
        return sizes


def _unzip(block: bytes, size: int) -> bytes:
    return zlib.decompressobj().decompress(block, size + 1)


def _un_lzma(block: bytes, size: int) -> bytes:
    found: bytes = import_module("lzma").LZMADecompressor().decompress(block, size + 1)
    return found


def _un_lz4(block: bytes, size: int) -> bytes:
    if size > 255 * len(block):  # more than LZ4 can pack: do not set the room aside
        raise ValueError("an LZ4 block is smaller than its size can be")
    found: bytes = import_module("lz4.block").decompress(block, uncompressed_size=size)
    return found


_PLAIN = "Save the mesh without compression, or with zlib."
#: Compressor -> module it needs, function, and where the module comes from.
_COMPRESSORS: dict[str, tuple[str, Callable[[bytes, int], bytes], str]] = {
    "vtkZLibDataCompressor": ("zlib", _unzip, "This Python was built without it."),
    "vtkLZMADataCompressor": ("lzma", _un_lzma, "This Python was built without it."),
    "vtkLZ4DataCompressor": ("lz4.block", _un_lz4, "Install it with: python -m pip install lz4."),
}


def _inflater(name: str | None, file: str) -> Callable[[bytes, int], bytes] | None:
    if not name:
        return None
    if name not in _COMPRESSORS:
        raise MeshError(f"{file} is compressed with {name[:40]!a}, which Muslin does not know.", _PLAIN)
    module, inflate, remedy = _COMPRESSORS[name]
    try:
        import_module(module)
    except ImportError:
        short = name.removeprefix("vtk").removesuffix("DataCompressor")
        raise MeshError(
            f"{file} is compressed with {short}, and the Python package {module.split('.')[0]} is not here.",
            f"{remedy} Or {_PLAIN[0].lower()}{_PLAIN[1:]}",
        ) from None
    return inflate


def _base64(text: bytes) -> bytes:
    """Bytes of base64 in one part or several: each "=" ends one."""
    packed = re.sub(rb"\s+", b"", text)
    parts = re.findall(rb"[^=]+={0,2}", packed)
    return b"".join(base64.b64decode(part, validate=True) for part in parts)


def _parsed(content: bytes, file: str) -> tuple[ElementTree.Element, _Arrays]:
    """The XML of a file, and how its arrays are to be read."""
    appended, raw = b"", False
    if tag := re.search(rb"<AppendedData\b([^>]*)>", content):
        # Raw bytes are no XML: parse what stands before them.
        raw = b"raw" in tag[1]
        begin = content.find(b"_", tag.end()) + 1
        end = content.rfind(b"</AppendedData>")
        if begin == 0 or end < begin:
            raise ValueError("its AppendedData have no end")
        appended, content = content[begin:end], content[: tag.start()] + b"</VTKFile>"
    try:
        root = ElementTree.fromstring(content)
    except ElementTree.ParseError as error:
        raise ValueError(f"its XML breaks off or is wrong: {error}") from None
    if root.tag != "VTKFile":
        raise ValueError(f"its first element is {root.tag[:30]!a}, not VTKFile")
    order = ">" if root.get("byte_order") == "BigEndian" else "<"
    header = np.dtype(order + TYPES.get(root.get("header_type", "UInt32"), "u4"))
    offsets = {int(a.get("offset", "0")) for a in root.iter() if a.get("format") == "appended"}
    ends = tuple(sorted(offsets))
    inflate = _inflater(root.get("compressor"), file)
    return root, _Arrays(file, order, header, inflate, appended, raw, ends)


def read_vtk_xml(content: bytes, file: str) -> Polygons:
    """Polygons of a VTU or VTP file; several pieces become one mesh.

    Raises
    ------
    MeshError
        For what Muslin does not read, or needs a package for.
    ValueError
        For what breaks the rules of the format.
    """
    root, arrays = _parsed(content, file)
    kind = root.get("type", "")
    if kind not in _PIECES:
        raise MeshError(
            f"{file} holds VTK's {kind[:30]!a}, which is no mesh Muslin reads.",
            "In ParaView: Filters > Extract Surface, and save that as .vtp.",
        )
    pieces = root.findall(f"{kind}/Piece")
    if not pieces:
        raise ValueError("it has no Piece")
    points, types, sizes, corners = [], [], [], []
    before = 0
    for piece in pieces:
        x = _points(piece, arrays)
        cell_types, cell_sizes, connectivity = _PIECES[kind](piece, arrays)
        if (
            len(pieces) > 1
            and len(connectivity)
            and not 0 <= connectivity.min() <= connectivity.max() < len(x)
        ):
            raise ValueError("a piece uses points that it does not have")
        points.append(x)
        types.append(cell_types)
        sizes.append(cell_sizes)
        corners.append(connectivity + before)
        before += len(x)
    offsets = np.append(0, np.cumsum(np.concatenate(sizes)))
    return from_cells(np.concatenate(points), np.concatenate(types), offsets, np.concatenate(corners), file)


def _points(piece: ElementTree.Element, arrays: _Arrays) -> np.ndarray:
    x = arrays.values(piece.find("Points/DataArray"), "Points").astype(np.float64)
    count = _count(piece, "NumberOfPoints")
    if len(x) != 3 * count:
        raise ValueError(f"{count} points promised, {len(x) / 3:g} there")
    return x.reshape(-1, 3)


def _grid_piece(piece: ElementTree.Element, arrays: _Arrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Types, sizes and corners of the cells of a piece of an UnstructuredGrid."""
    types = arrays.values(piece.find("Cells/DataArray[@Name='types']"), "types")
    sizes, corners = _cells(piece, "Cells", _count(piece, "NumberOfCells"), arrays)
    if len(types) != len(sizes):
        raise ValueError(f"{len(sizes)} cells promised, {len(types)} types there")
    return types, sizes, corners


def _surface_piece(piece: ElementTree.Element, arrays: _Arrays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of a PolyData."""
    found = [
        (kind, *_cells(piece, name, _count(piece, f"NumberOf{name}"), arrays))
        for name, kind in _SURFACE.items()
        if _count(piece, f"NumberOf{name}")
    ]
    none = np.zeros(0, dtype=np.int64)
    return (
        np.concatenate([none, *(np.full(len(sizes), kind) for kind, sizes, _ in found)]),
        np.concatenate([none, *(sizes for _, sizes, _ in found)]),
        np.concatenate([none, *(corners for *_, corners in found)]),
    )


_PIECES = {"UnstructuredGrid": _grid_piece, "PolyData": _surface_piece}


def _count(piece: ElementTree.Element, name: str) -> int:
    count = int(piece.get(name, "0"))
    if count < 0:
        raise ValueError(f"{name} is {count}")
    return count


def _cells(
    piece: ElementTree.Element, name: str, count: int, arrays: _Arrays
) -> tuple[np.ndarray, np.ndarray]:
    """Sizes (c,) and corners (k,) of the cells below an element."""
    corners = arrays.values(piece.find(f"{name}/DataArray[@Name='connectivity']"), "connectivity")
    ends = arrays.values(piece.find(f"{name}/DataArray[@Name='offsets']"), "offsets").astype(np.int64)
    if len(ends) != count:
        raise ValueError(f"{count} cells promised, {len(ends)} offsets there")
    sizes = np.diff(ends, prepend=0)
    if (sizes < 0).any() or sizes.sum() != len(corners):
        raise ValueError(f"the cells take {sizes.sum()} corners, and {len(corners)} are there")
    return sizes, corners.astype(np.int64)
