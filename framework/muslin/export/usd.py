"""OpenUSD in ASCII: a Mesh prim per body with time-sampled points, and triangles too where these change.

https://openusd.org/release/api/class_usd_geom_mesh.html
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np

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

_IN_MEMORY = 64 << 20  # [bytes]


def write_usda(animation: Animation, path: Path, notice: Notice) -> list[Path]:
    """Write the animation as one USDA file. Opens in Blender, Houdini, Maya, usdview, Omniverse.

    One time code per frame where the frames are evenly spaced in time, so that frame k of the animation is
    frame k of the program that opens it; `timeCodesPerSecond` says how fast they follow each other. The mesh of an
    adaptive cloth is that of each frame: its triangles have a sample wherever they change, and hold until the next.

    Parameters
    ----------
    animation : Animation
    path : Path
    notice : callable str -> object
        Not used: nothing is left out.

    Returns
    -------
    list of Path

    Raises
    ------
    MuslinError
        If the file cannot be written.
    """
    rate, codes = time_codes(animation.times)
    parts = list(bodies(animation))
    scene = next(n for n in ("Scene", "Muslin", "World") if n not in (b.name for b in parts))
    with whole(path, "w") as file:
        file.write(
            "#usda 1.0\n(\n"
            f'    doc = "Cloth animation, exported by Muslin"\n    defaultPrim = "{scene}"\n'
            f"    startTimeCode = {codes[0]}\n    endTimeCode = {codes[-1]}\n"
            f"    timeCodesPerSecond = {rate}\n    framesPerSecond = {rate}\n"
            '    metersPerUnit = 1\n    upAxis = "Y"\n)\n\n'
            f'def Xform "{scene}" (\n    kind = "component"\n)\n{{\n'
        )
        for body in parts:
            # Props that stand still have one sample, without a time.
            _write_mesh(file, body, codes if body.moves else [], f"/{scene}", animation)
        file.write('    def Scope "Materials"\n    {\n')
        for body in parts:
            file.write(_material(body, f"/{scene}"))
        file.write("    }\n}\n")
    return [path]


def time_codes(times: np.ndarray) -> tuple[str, list[str]]:
    """Time codes per second, and the time code of each frame, as USDA writes them.

    Parameters
    ----------
    times : (k,) float64
        [s]

    Returns
    -------
    rate : str
        [1/s], a whole number where the median step allows it.
    codes : list of k str
        times * rate; whole numbers for evenly spaced frames.
    """
    rate = 1 / float(np.median(np.diff(times))) if len(times) > 1 else 24.0
    if abs(rate - round(rate)) < 1e-6 * rate and round(rate):
        rate = float(round(rate))
    codes = times * rate
    nearest = codes.round()
    codes = np.where(np.abs(codes - nearest) < 1e-4, nearest, codes)
    return f"{rate:.12g}", [f"{c:.15g}" for c in codes]


def _write_mesh(file: IO[str], body: Body, codes: list[str], scene: str, animation: Animation) -> None:
    adapted = animation.adapted if body.rest is not None else None
    file.write(
        f'    def Mesh "{body.name}" (\n        prepend apiSchemas = ["MaterialBindingAPI"]\n    )\n    {{\n'
        "        uniform bool doubleSided = 1\n"
        '        uniform token subdivisionScheme = "none"\n'
        f"        rel material:binding = <{scene}/Materials/{body.name}>\n"
    )
    if adapted is None:
        for name, value in _corners(body.triangles).items():
            file.write(f"        int[] {name} = {value}\n")
    colour = _rows(np.array([linear(body.colour).round(6).tolist()]))
    _attribute(file, "color3f[] primvars:displayColor", [], [colour], "constant")
    if body.rest is not None and adapted is None:
        st = _rows(texture_coordinates(body.rest))
        _attribute(file, "texCoord2f[] primvars:st", [], [st], "vertex")

    # USDA wants all samples of one attribute together, and a frame is read only once: points go straight to
    # the file, what is derived from them waits.
    extents: list[str] = []
    strains: dict[str, str] = {}
    mesh: dict[str, dict[str, str]] = {"faceVertexCounts": {}, "faceVertexIndices": {}}
    with _waiting() as normals, _waiting() as textures:

        def points() -> Iterator[str]:
            last: np.ndarray | None = None
            for k, code in enumerate(codes or [""]):
                shape = adapted(k) if adapted is not None else None
                t = body.triangles if shape is None else shape.triangles
                x = (body.at(k) if shape is None else shape.x).astype(np.float32)
                if shape is not None:
                    textures.write(_rows(texture_coordinates(shape.rest)) + "\n")
                    if last is None or not np.array_equal(last, t):
                        for name, value in _corners(t).items():
                            mesh[name][code] = value
                    last = t
                normals.write(_rows(unit_normals(x, t), digits=5) + "\n")
                extents.append(_rows(np.stack([x.min(axis=0), x.max(axis=0)])))
                strain = None
                if body.rest is not None:
                    strain = animation.strain_at(k) if shape is None else shape.strain
                if strain is not None:
                    strains[code] = f"[{', '.join([f'{s:.7g}' for s in strain.tolist()])}]"
                yield _rows(x)

        _attribute(file, "point3f[] points", codes, points())
        _attribute(file, "normal3f[] normals", codes, _lines(normals), "vertex")
        if adapted is not None:
            _attribute(file, "texCoord2f[] primvars:st", codes, _lines(textures), "vertex")
    if adapted is not None:
        for name, samples in mesh.items():
            _attribute(file, f"int[] {name}", [code for code in samples if code], samples.values())
    _attribute(file, "float3[] extent", codes, extents)
    if strains:
        _attribute(file, "float[] primvars:strain", [c for c in strains if c], strains.values(), "vertex")
    file.write("    }\n\n")


def _corners(triangles: np.ndarray) -> dict[str, str]:
    """Triangles as attributes of a Mesh."""
    return {
        "faceVertexCounts": f"[{', '.join(['3'] * len(triangles))}]",
        "faceVertexIndices": f"[{', '.join(map(str, triangles.ravel().tolist()))}]",
    }


def _waiting() -> Any:
    """A file for samples that are written later."""
    return tempfile.SpooledTemporaryFile(_IN_MEMORY, "w+", encoding="utf-8", newline="\n")


def _lines(waiting: Any) -> Iterator[str]:
    waiting.seek(0)
    return (line.rstrip("\n") for line in waiting)


def _attribute(
    file: IO[str], declaration: str, codes: list[str], values: Iterable[str], interpolation: str = ""
) -> None:
    """Write an attribute: a time sample per code, or one value where there are no codes."""
    metadata = f' (\n            interpolation = "{interpolation}"\n        )' if interpolation else ""
    if not codes:
        file.write(f"        {declaration} = {next(iter(values))}{metadata}\n")
        return
    if metadata:
        file.write(f"        {declaration}{metadata}\n")
    file.write(f"        {declaration}.timeSamples = {{\n")
    for code, value in zip(codes, values, strict=True):
        file.write(f"            {code}: {value},\n")
    file.write("        }\n")


def _rows(values: np.ndarray, digits: int = 9) -> str:
    """Array of tuples: 9 digits are every float32 exactly."""
    one = "(" + ", ".join([f"%.{digits}g"] * values.shape[1]) + ")"
    return f"[{', '.join([one] * len(values))}]" % tuple(values.ravel().tolist())


def _material(body: Body, scene: str) -> str:
    path = f"{scene}/Materials/{body.name}"
    colour = ", ".join(map(str, linear(body.colour).round(6).tolist()))
    return f"""        def Material "{body.name}"
        {{
            token outputs:surface.connect = <{path}/Surface.outputs:surface>

            def Shader "Surface"
            {{
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor = ({colour})
                float inputs:roughness = {ROUGHNESS_CLOTH if body.rest is not None else ROUGHNESS_PROP}
                token outputs:surface
            }}
        }}
"""
