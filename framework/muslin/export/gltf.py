"""glTF 2.0 in one binary file: a mesh per body, its further frames as morph targets.

Frame 0 is the mesh; frame k is morph target k - 1, stored as differences of positions and normals; one
animation moves the weights so that at the time of frame k target k - 1 alone counts.
Khronos, "glTF 2.0 Specification", version 2.0.1
"""

from __future__ import annotations

import json
import shutil
import struct
import tempfile
from pathlib import Path
from typing import IO, Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.export.animation import (
    ROUGHNESS_CLOTH,
    ROUGHNESS_PROP,
    Animation,
    Body,
    bodies,
    unit_normals,
)
from muslin.export.files import Notice, whole
from muslin.render.materials import linear
from muslin.render.stage import texture_coordinates

# Viewers in a browser spend one layer of a texture array and one uniform on each morph target. WebGL 2
# promises 256 of either, and a material's own uniforms need about thirty.
MAX_FRAMES = 200
FLOAT, UNSIGNED_INT = 5126, 5125
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3"}
_IN_MEMORY = 64 << 20  # [bytes]


class _Buffer:
    """The binary chunk as it grows, with its views and accessors."""

    def __init__(self, file: IO[bytes]):
        self.file, self.size = file, 0
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []

    def add(self, values: np.ndarray, target: int | None = None, bounds: bool = False) -> int:
        """Append an array, (n,) or (n, c) of float32 or uint32, all 4 bytes wide; return its accessor."""
        view = {"buffer": 0, "byteOffset": self.size, "byteLength": values.nbytes}
        accessor = {
            "bufferView": len(self.views),
            "componentType": FLOAT if values.dtype == np.float32 else UNSIGNED_INT,
            "count": len(values),
            "type": _KINDS[values[0].size],
        }
        if bounds:
            rows = values.reshape(len(values), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.file.write(values.astype(values.dtype.newbyteorder("<")).tobytes())
        self.size += values.nbytes
        self.views.append(view | ({"target": target} if target else {}))
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def write_glb(
    animation: Animation,
    path: Path,
    notice: Notice,
    max_frames: int | None = None,
    interpolation: str = "LINEAR",
) -> list[Path]:
    """Write the animation as one GLB file. Opens in Blender, browsers (three.js), Windows and macOS viewers.

    Parameters
    ----------
    animation : Animation
    path : Path
    notice : callable str -> object
        Told if frames were left out.
    max_frames : int, optional
        Most frames to keep, evenly chosen, first and last included; default `MAX_FRAMES`.
    interpolation : {"LINEAR", "STEP"}
        Whether to blend between frames.

    Returns
    -------
    list of Path

    Raises
    ------
    MuslinError
        If an option is unknown, the frames are closer in time than float32 can tell apart, the result would
        exceed the format's 4 GiB, or the file cannot be written.
    """
    limit = MAX_FRAMES if max_frames is None else max_frames
    if limit < 2:
        raise MuslinError(f"A GLB animation cannot have at most {limit} frames.", "Keep at least 2.")
    if interpolation not in ("LINEAR", "STEP"):
        raise MuslinError(f"GLB has no interpolation {interpolation!r}.", "Use LINEAR or STEP.")
    kept = np.unique(np.linspace(0, len(animation) - 1, min(limit, len(animation))).round().astype(int))
    if len(kept) < len(animation):
        notice(
            f"{path.name} keeps {len(kept)} of {len(animation)} frames, evenly chosen, as viewers limit morph"
            " targets; max_frames changes that, other formats keep all."
        )
    times = animation.times[kept].astype(np.float32)
    if (np.diff(times) <= 0).any():
        raise MuslinError(
            f"The frames of {animation.name!r} are too close in time for GLB, which has only float32.",
            "Start the times at 0, or export to usda or pvd.",
        )

    with tempfile.SpooledTemporaryFile(max_size=_IN_MEMORY) as binary:
        buffer = _Buffer(binary)
        document = _document(animation, buffer, kept, times, interpolation)
        text = json.dumps(document, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        total = 12 + 8 + len(text) + 8 + buffer.size
        if total >= 1 << 32:
            raise MuslinError(
                f"{path.name} would take {total / 2**30:.1f} GiB, and GLB ends at 4.",
                "Lower max_frames, or export to usda or pvd.",
            )
        binary.seek(0)
        with whole(path) as file:
            file.write(struct.pack("<4sII", b"glTF", 2, total))
            file.write(struct.pack("<I4s", len(text), b"JSON") + text)
            file.write(struct.pack("<I4s", buffer.size, b"BIN\0"))
            shutil.copyfileobj(binary, file, 1 << 20)
    return [path]


def _document(
    animation: Animation, buffer: _Buffer, kept: np.ndarray, times: np.ndarray, interpolation: str
) -> dict[str, Any]:
    """The JSON chunk; fills the buffer on the way."""
    from muslin.base.version import __version__

    parts = list(bodies(animation))
    meshes = [_mesh(body, i, buffer, kept) for i, body in enumerate(parts)]
    document: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": f"Muslin {__version__}"},
        "scene": 0,
        "scenes": [{"name": animation.name, "nodes": list(range(len(parts)))}],
        "nodes": [{"name": body.name, "mesh": i} for i, body in enumerate(parts)],
        "meshes": meshes,
        "materials": [_material(body) for body in parts],
    }
    if len(kept) > 1:
        # At keyframe k only target k - 1 counts; at the first none does.
        time = buffer.add(times, bounds=True)
        weights = buffer.add(np.eye(len(kept), len(kept) - 1, k=-1, dtype=np.float32).ravel())
        moving = [i for i, body in enumerate(parts) if body.moves]
        document["animations"] = [
            {
                "name": animation.name,
                "samplers": [{"input": time, "output": weights, "interpolation": interpolation}],
                "channels": [{"sampler": 0, "target": {"node": i, "path": "weights"}} for i in moving],
            }
        ]
    return document | {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.size}],
    }


def _mesh(body: Body, material: int, buffer: _Buffer, kept: np.ndarray) -> dict[str, Any]:
    x0 = body.at(int(kept[0])).astype(np.float32)
    n0 = unit_normals(x0, body.triangles).astype(np.float32)
    attributes = {
        "POSITION": buffer.add(x0, ARRAY_BUFFER, bounds=True),
        "NORMAL": buffer.add(n0, ARRAY_BUFFER),
    }
    if body.rest is not None:
        uv = texture_coordinates(body.rest) * [1, -1] + [0, 1]  # glTF's v runs down
        attributes["TEXCOORD_0"] = buffer.add(uv.astype(np.float32), ARRAY_BUFFER)
    primitive: dict[str, Any] = {
        "attributes": attributes,
        "indices": buffer.add(body.triangles.astype(np.uint32).ravel(), ELEMENT_ARRAY_BUFFER),
        "material": material,
    }
    mesh: dict[str, Any] = {"name": body.name, "primitives": [primitive]}
    if body.moves:
        targets = primitive["targets"] = []
        for k in kept[1:]:
            x = body.at(int(k)).astype(np.float32)
            n = unit_normals(x, body.triangles).astype(np.float32)
            targets.append(
                {
                    "POSITION": buffer.add(x - x0, ARRAY_BUFFER, bounds=True),
                    "NORMAL": buffer.add(n - n0, ARRAY_BUFFER),
                }
            )
        mesh["weights"] = [0.0] * len(targets)
        mesh["extras"] = {"targetNames": [f"frame {k}" for k in kept[1:]]}
    return mesh


def _material(body: Body) -> dict[str, Any]:
    return {
        "name": body.name,
        "doubleSided": True,
        "pbrMetallicRoughness": {
            "baseColorFactor": [*linear(body.colour).round(6).tolist(), 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": ROUGHNESS_CLOTH if body.rest is not None else ROUGHNESS_PROP,
        },
    }
