"""OpenUSD in ASCII: a Mesh prim per body with time-sampled points.

https://openusd.org/release/api/class_usd_geom_mesh.html
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import IO

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
    frame k of the program that opens it; `timeCodesPerSecond` says how fast they follow each other.

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
    t = body.triangles
    file.write(
        f'    def Mesh "{body.name}" (\n        prepend apiSchemas = ["MaterialBindingAPI"]\n    )\n    {{\n'
        "        uniform bool doubleSided = 1\n"
        '        uniform token subdivisionScheme = "none"\n'
        f"        rel material:binding = <{scene}/Materials/{body.name}>\n"
        f"        int[] faceVertexCounts = [{', '.join(['3'] * len(t))}]\n"
        f"        int[] faceVertexIndices = [{', '.join(map(str, t.ravel().tolist()))}]\n"
    )
    colour = _rows(np.array([linear(body.colour).round(6).tolist()]))
    _attribute(file, "color3f[] primvars:displayColor", [], [colour], "constant")
    if body.rest is not None:
        st = _rows(texture_coordinates(body.rest))
        _attribute(file, "texCoord2f[] primvars:st", [], [st], "vertex")

    # USDA wants all samples of one attribute together, and a frame is read only once: points go straight to
    # the file, what is derived from them waits.
    extents: list[str] = []
    strains: dict[str, str] = {}
    with tempfile.SpooledTemporaryFile(_IN_MEMORY, "w+", encoding="utf-8", newline="\n") as normals:

        def points() -> Iterator[str]:
            for k, code in enumerate(codes or [""]):
                x = body.at(k).astype(np.float32)
                normals.write(_rows(unit_normals(x, t), digits=5) + "\n")
                extents.append(_rows(np.stack([x.min(axis=0), x.max(axis=0)])))
                strain = animation.strain_at(k) if body.rest is not None else None
                if strain is not None:
                    strains[code] = f"[{', '.join([f'{s:.7g}' for s in strain.tolist()])}]"
                yield _rows(x)

        _attribute(file, "point3f[] points", codes, points())
        normals.seek(0)
        _attribute(file, "normal3f[] normals", codes, (line.rstrip("\n") for line in normals), "vertex")
    _attribute(file, "float3[] extent", codes, extents)
    if strains:
        _attribute(file, "float[] primvars:strain", [c for c in strains if c], strains.values(), "vertex")
    file.write("    }\n\n")


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
