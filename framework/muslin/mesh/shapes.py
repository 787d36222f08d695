"""Meshes from formulas: a regular grid, and unstructured rectangles and sectors.

The unstructured ones fill an outline with a jittered hexagonal lattice, triangulate by Delaunay and relax
towards the middle of the neighbours. The same arguments give the same mesh.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from muslin.base.errors import MeshError
from muslin.mesh.checks import LARGEST, SMALLEST
from muslin.mesh.surface import Mesh, frozen

SMALLEST_ANGLE = 20.0  # degrees; `unstructured` and `sector` give nothing worse
_JITTER = 0.3  # of the spacing, each way
_ROUNDS = (4, 8, 18)  # rounds of relaxation, until the angles are good; then another draw
_ATTEMPTS = 8


#: Which way the diagonals of a grid run.
DIAGONALS = ("uniform", "alternating", "zigzag")


def grid(
    nx: int,
    ny: int,
    width: float = 1.0,
    height: float = 1.0,
    plane: str = "xy",
    diagonals: str = "uniform",
    name: str = "grid",
) -> Mesh:
    """Rectangle of nx x ny vertices around the origin.

    Parameters
    ----------
    nx, ny : int
        Vertices along the width and the height, at least 2 each.
    width, height : float
        [m]
    plane : {"xy", "xz"}
        "xy": upright, height along y, normals along +z. "xz": level, height along -z, normals along +y (up).
    diagonals : {"uniform", "alternating", "zigzag"}
        All diagonals falling to the right; every second one rising; or those of every second row. Uniform ones make a
        sheet stiffer along one diagonal than along the other. Of the others, alternating ones stretch most easily where
        a grid is coarse, and zigzag ones bend alike in every direction (see `muslin.physics.bending`).
    name : str

    Returns
    -------
    Mesh
        Vertex i + nx j is column i from the left, row j from below; 2 (nx - 1) (ny - 1) triangles.

    Raises
    ------
    MeshError
        If a size is not positive, or a count below 2.
    """
    for value, what in ((nx, "nx"), (ny, "ny")):
        if not isinstance(value, (int, np.integer)) or isinstance(value, bool) or value < 2:
            raise MeshError(
                f"grid: {what} is {value!r}.", "It should be a whole number of vertices, at least 2."
            )
    positive("grid", width=width, height=height)
    _choice("grid", "diagonals", diagonals, DIAGONALS)
    u, v = np.meshgrid(_centred(width, nx), _centred(height, ny))
    i, j = np.meshgrid(np.arange(nx - 1), np.arange(ny - 1))
    a = (i + nx * j).ravel()  # corners a b c d of a cell, counterclockwise from below left
    b, c, d = a + 1, a + nx + 1, a + nx
    falling = np.stack([a, b, d, b, c, d], axis=1)
    rising = np.stack([a, b, c, a, c, d], axis=1)
    odd = {"uniform": 0 * i, "alternating": i + j, "zigzag": j}[diagonals].ravel() % 2 == 1
    triangles = np.where(odd[:, None], rising, falling).reshape(-1, 3)
    return frozen(_embed(u.ravel(), v.ravel(), plane), triangles, name)


def unstructured(
    width: float = 1.0,
    height: float = 1.0,
    spacing: float = 0.05,
    plane: str = "xy",
    seed: int = 0,
    name: str = "unstructured",
) -> Mesh:
    """Unstructured rectangle around the origin, its boundary vertices exactly on the boundary.

    Parameters
    ----------
    width, height : float
        [m]
    spacing : float
        Typical edge length, at most the shorter side [m].
    plane : {"xy", "xz"}
        As in `grid`.
    seed : int
        Another seed, another mesh.
    name : str

    Returns
    -------
    Mesh
        No angle below 20 degrees.

    Raises
    ------
    MeshError
        If a size is not positive, or the spacing does not fit.
    """
    positive("unstructured", width=width, height=height, spacing=spacing)
    if spacing > min(width, height):
        raise MeshError(
            f"unstructured: a spacing of {spacing:g} m is longer than a side of {width:g} x {height:g} m.",
            "Choose a smaller spacing.",
        )
    w, h = width / 2, height / 2
    u, v = _centred(width, _steps(width, spacing) + 1), _centred(height, _steps(height, spacing) + 1)
    outline = np.concatenate(
        [
            np.column_stack([u[:-1], np.full(len(u) - 1, -h)]),
            np.column_stack([np.full(len(v) - 1, w), v[:-1]]),
            np.column_stack([u[:0:-1], np.full(len(u) - 1, h)]),
            np.column_stack([np.full(len(v) - 1, -w), v[:0:-1]]),
        ]
    )

    def depth(p: np.ndarray) -> np.ndarray:
        return np.minimum(w - np.abs(p[:, 0]), h - np.abs(p[:, 1]))

    points, triangles = _fill(outline, depth, spacing, seed)
    return frozen(_embed(points[:, 0], points[:, 1], plane), triangles, name)


def sector(
    inner: float = 0.18,
    outer: float = 1.1,
    angle: float = 2.2,
    spacing: float = 0.022,
    seed: int = 0,
    name: str = "sector",
) -> Mesh:
    """Unstructured flat sector of a ring in the plane z = 0: the pattern of a cape.

    It is centred on the origin and opens downwards, symmetric about the negative y axis; normals along +z.

    Parameters
    ----------
    inner, outer : float
        Radii of the neck and the hem [m].
    angle : float
        Opening angle, below 2 pi [rad].
    spacing : float
        Typical edge length [m].
    seed : int
        Another seed, another mesh.
    name : str

    Returns
    -------
    Mesh
        Boundary vertices lie on the two arcs and the two straight sides; no angle below 20 degrees.

    Raises
    ------
    MeshError
        If the sizes are not positive and in order, or the spacing is too coarse for the shape.
    """
    positive("sector", inner=inner, outer=outer, angle=angle, spacing=spacing)
    if inner >= outer or spacing > outer - inner or spacing > inner * angle:
        raise MeshError(
            f"sector: inner radius {inner:g}, outer radius {outer:g} and spacing {spacing:g} m "
            "do not fit together.",
            "The spacing should be shorter than each side, and the inner radius smaller than the outer.",
        )
    if angle >= 2 * math.pi or 2 * inner * math.sin(min(math.pi, 2 * math.pi - angle) / 2) < spacing:
        raise MeshError(
            f"sector: with an angle of {angle:g} rad the two sides meet (nearer than the spacing).",
            "Choose an angle well below 2 pi.",
        )
    middle = -math.pi / 2
    turn_in = _centred(angle, _steps(inner * angle, spacing) + 1) + middle
    turn_out = _centred(angle, _steps(outer * angle, spacing) + 1) + middle
    radii = np.linspace(inner, outer, _steps(outer - inner, spacing) + 1)
    outline = np.concatenate(
        [
            _polar(np.full(len(turn_out) - 1, outer), turn_out[:-1]),
            _polar(radii[:0:-1], turn_out[-1]),
            _polar(np.full(len(turn_in) - 1, inner), turn_in[:0:-1]),
            _polar(radii[:-1], turn_in[0]),
        ]
    )

    def depth(p: np.ndarray) -> np.ndarray:
        r = np.hypot(p[:, 0], p[:, 1])
        off = np.abs(np.arctan2(p[:, 0], -p[:, 1]))  # angle from the negative y axis
        beside = r * np.sin(np.clip(angle / 2 - off, -math.pi / 2, math.pi / 2))
        return np.minimum(np.minimum(r - inner, outer - r), beside)

    points, triangles = _fill(outline, depth, spacing, seed)
    return frozen(_embed(points[:, 0], points[:, 1], "xy"), triangles, name)


def _fill(
    outline: np.ndarray, depth: Callable[[np.ndarray], np.ndarray], spacing: float, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Triangulate the inside of an outline.

    Parameters
    ----------
    outline : (b, 2) float
        The polygon's corners, counterclockwise, a spacing apart; they become the first b vertices.
    depth : callable
        (k, 2) points -> (k,) distance to the outline, negative outside.
    spacing : float
    seed : int

    Returns
    -------
    points : (n, 2) float64
    triangles : (m, 3) int64
    """
    if not isinstance(seed, (int, np.integer)) or seed < 0:
        raise MeshError(f"The seed is {seed!r}.", "It should be a whole number, not negative.")
    rng = np.random.default_rng(seed)
    reach = float(np.abs(outline).max()) * 1.5 + 2 * spacing
    columns, rows = math.ceil(reach / spacing), math.ceil(reach / spacing / math.sqrt(0.75))
    if columns * rows > 2_500_000:
        raise MeshError(
            f"A spacing of {spacing:g} m would take millions of vertices.", "Choose a larger spacing."
        )
    i, j = np.meshgrid(np.arange(-columns, columns + 1), np.arange(-rows, rows + 1))
    lattice = np.column_stack([(i + 0.5 * (j % 2)).ravel(), math.sqrt(0.75) * j.ravel()]) * spacing
    for _ in range(_ATTEMPTS):
        points = np.concatenate([outline, _scatter(lattice, depth, spacing, rng)])
        triangles = _delaunay(points, outline, spacing)
        for rounds in _ROUNDS:
            for _ in range(rounds):
                points = _relax(points, triangles, len(outline))
                triangles = _delaunay(points, outline, spacing)
            if _is_good(points, triangles, len(outline)):
                return points, triangles
    raise MeshError(
        f"With a spacing of {spacing:g} m and seed {seed} the triangles do not come out well shaped.",
        "Choose a smaller spacing, or another seed.",
    )


def _scatter(
    lattice: np.ndarray, depth: Callable[[np.ndarray], np.ndarray], spacing: float, rng: np.random.Generator
) -> np.ndarray:
    """Points of the lattice, turned and jittered at random, that lie well inside."""
    turn = rng.uniform(0, math.pi / 3)
    points = lattice @ np.array([[math.cos(turn), math.sin(turn)], [-math.sin(turn), math.cos(turn)]])
    points = points[depth(points) > 0]
    points = points + rng.uniform(-_JITTER, _JITTER, points.shape) * spacing
    return points[depth(points) > 0.65 * spacing]


def _delaunay(points: np.ndarray, outline: np.ndarray, spacing: float) -> np.ndarray:
    """Delaunay triangles inside the outline, counterclockwise, in an order of our own, not Qhull's."""
    from scipy.spatial import Delaunay

    triangles = Delaunay(points).simplices.astype(np.int64)
    area = _signed_area(points, triangles)
    triangles[area < 0] = triangles[area < 0][:, ::-1]
    # Three points on a straight side may make a triangle of round-off: no part of the mesh.
    triangles = triangles[np.abs(area) > 1e-6 * spacing**2]
    # Only a triangle between boundary vertices can lie outside.
    doubtful = (triangles < len(outline)).all(axis=1)
    centre = points[triangles[doubtful]].mean(axis=1)
    keep = ~doubtful
    keep[doubtful] = _inside(centre, outline)
    triangles = triangles[keep]
    lowest = np.argmin(triangles, axis=1)[:, None]
    triangles = np.take_along_axis(triangles, (lowest + np.arange(3)) % 3, axis=1)
    return triangles[np.lexsort(triangles.T[::-1])]


def _relax(points: np.ndarray, triangles: np.ndarray, fixed: int) -> np.ndarray:
    """Each free point (from `fixed` on) in the middle of its neighbours."""
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    total = np.column_stack([np.bincount(start, points[end, k], len(points)) for k in range(2)])
    times = np.bincount(start, minlength=len(points))  # around a free point every neighbour follows it once
    moved = points.copy()
    free = np.flatnonzero(times[fixed:] > 0) + fixed
    moved[free] = total[free] / times[free, None]
    return moved


def _is_good(points: np.ndarray, triangles: np.ndarray, b: int) -> bool:
    """Angles of at least 20 degrees, the outline as the boundary, every point used, no holes."""
    if len(triangles) != 2 * len(points) - b - 2 or len(np.unique(triangles)) != len(points):
        return False
    start, end = triangles.ravel(), triangles[:, [1, 2, 0]].ravel()
    n = len(points)
    single = np.setdiff1d(start * n + end, end * n + start)
    ring = np.arange(b)
    if not np.array_equal(single, np.sort(ring * n + (ring + 1) % b)):
        return False
    x = points[triangles]
    sides = x[:, [1, 2, 0]] - x
    before = -sides[:, [2, 0, 1]]
    cross = sides[..., 0] * before[..., 1] - sides[..., 1] * before[..., 0]
    angles = np.arctan2(cross, (sides * before).sum(axis=2))
    return bool(np.degrees(angles.min()) >= SMALLEST_ANGLE)


def _signed_area(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    return 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])


def _inside(points: np.ndarray, outline: np.ndarray) -> np.ndarray:
    """Which points (k, 2) lie inside the polygon: a ray to the right crosses it an odd number of times."""
    start, end = outline, np.roll(outline, -1, axis=0)
    odd = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(start.tolist(), end.tolist(), strict=True):
        if y0 != y1:
            spans = (points[:, 1] < y0) != (points[:, 1] < y1)
            odd ^= spans & (points[:, 0] < x0 + (points[:, 1] - y0) * (x1 - x0) / (y1 - y0))
    return odd


def _embed(u: np.ndarray, v: np.ndarray, plane: str) -> np.ndarray:
    """Points (n, 3) of coordinates in a plane whose normal u x v is +z ("xy") or +y ("xz")."""
    _choice("mesh", "plane", plane, ("xy", "xz"))
    zero = np.zeros_like(u)
    return np.column_stack([u, v, zero] if plane == "xy" else [u, zero, 0.0 - v])


def _centred(length: float, count: int) -> np.ndarray:
    """`count` values from -length/2 to length/2, exactly symmetric."""
    k = np.arange(count)
    return (2 * k - (count - 1)) * (length / 2) / (count - 1)


def _polar(radius: np.ndarray, turn: np.ndarray | float) -> np.ndarray:
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])


def _steps(length: float, spacing: float) -> int:
    return max(1, round(length / spacing))


def positive(shape: str, **sizes: float) -> None:
    """Refuse sizes that are no positive numbers, by name."""
    for what, value in sizes.items():
        if not isinstance(value, (int, float, np.number)) or not SMALLEST < value < LARGEST:
            raise MeshError(f"{shape}: {what} is {value!r}.", "It should be a positive number.")


def _choice(shape: str, what: str, value: str, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise MeshError(f"{shape}: {what} is {value!r}.", f"Choose {' or '.join(map(repr, choices))}.")
