"""Where the picture is taken from: a pinhole camera, and the closest one that still sees everything."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from muslin.base.errors import MuslinError

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """A pinhole camera.

    Parameters
    ----------
    eye, target : (3,) floats
        Where the camera stands and what it looks at [m].
    up : (3,) floats
        The direction that is up in the picture, and the direction the sky is in.
    fov : float
        Vertical angle of view [degrees].
    near : float
        Nothing closer than this along the line of sight is drawn [m].
    """

    eye: Vector = (0.0, 1.0, 3.0)
    target: Vector = (0.0, 0.0, 0.0)
    up: Vector = (0.0, 1.0, 0.0)
    fov: float = 30.0
    near: float = 0.01

    def axes(self) -> NDArray[np.float64]:
        """Rows right, up and forward of the camera, orthonormal, shape (3, 3)."""
        forward = np.subtract(self.target, self.eye).astype(float)
        return _axes(forward, self.up)

    def focal(self, size: tuple[int, int]) -> float:
        """Focal length in pixels for a picture of `size` = (width, height)."""
        return 0.5 * size[1] / float(np.tan(np.radians(self.fov) / 2))

    def view(self, points: ArrayLike) -> NDArray[np.float64]:
        """Coordinates along right, up and forward, (n, 3) -> (n, 3) [m]."""
        return (np.asarray(points, dtype=float) - np.asarray(self.eye)) @ self.axes().T

    def project(self, points: ArrayLike, size: tuple[int, int]) -> NDArray[np.float64]:
        """Pixel position and depth of points.

        Parameters
        ----------
        points : (n, 3) array [m]
        size : (width, height) of the picture

        Returns
        -------
        (n, 3) array
            x to the right and y down in pixels, the picture's top left corner at (0, 0) and the first
            pixel's centre at (0.5, 0.5); then the depth along the line of sight [m].
        """
        p = self.view(points)
        f = self.focal(size)
        with np.errstate(divide="ignore", invalid="ignore"):
            x = size[0] / 2 + f * p[:, 0] / p[:, 2]
            y = size[1] / 2 - f * p[:, 1] / p[:, 2]
        return np.stack([x, y, p[:, 2]], axis=1)


def fit_camera(
    points: ArrayLike,
    direction: Vector = (0.35, 0.4, 1.0),
    size: tuple[int, int] = (1280, 720),
    up: Vector = (0.0, 1.0, 0.0),
    margin: float = 0.06,
    fov: float = 30.0,
) -> Camera:
    """The camera nearest to `points` that has all of them in the picture.

    Every point lies inside the picture and at least `margin` (a fraction of half the width or height) away
    from its border. It is the nearest such camera with this direction and angle of view: the points touch
    either the left and right margins or the top and bottom ones, and are centred the other way.

    Seen along the axes of the camera, a point (x, y, z) is inside the picture of a camera at (a, b, c) when
    |x - a| <= t (z - c) and |y - b| <= s (z - c), with t and s the tangents of half the angles of view: two
    linear inequalities per point and axis, which the largest c solves in closed form.

    Parameters
    ----------
    points : (..., 3) array
        What must be seen [m]: the vertices of one frame, or of the whole motion.
    direction : (3,) floats
        From the scene towards the camera; any length.
    size : (int, int)
        Width and height of the picture; only their ratio counts.
    up : (3,) floats
        Up in the picture.
    margin : float
        Free border, as a fraction of half the picture, in [0, 1).
    fov : float
        Vertical angle of view [degrees].

    Raises
    ------
    MuslinError
        If there are no points, or one is not finite.
    """
    p = np.asarray(points, dtype=float).reshape(-1, 3)
    if len(p) == 0:
        raise MuslinError("fit_camera was given no points.", "Pass the vertices that the picture must show.")
    if not np.isfinite(p).all():
        raise MuslinError(f"fit_camera was given a point that is not finite, number {_first_bad(p)}.")
    right, above, forward = _axes(-np.asarray(direction, dtype=float), up)
    origin = p.mean(axis=0)
    x, y, z = (p - origin) @ right, (p - origin) @ above, (p - origin) @ forward
    s = np.tan(np.radians(fov) / 2) * (1 - margin)
    t = np.tan(np.radians(fov) / 2) * size[0] / size[1] * (1 - margin)
    x_high, x_low = np.max(x - t * z), np.max(-x - t * z)
    y_high, y_low = np.max(y - s * z), np.max(-y - s * z)
    extent = max(float(np.ptp(p, axis=0).max()), 1e-3)
    c = min(-(x_high + x_low) / (2 * t), -(y_high + y_low) / (2 * s), z.min() - 0.05 * extent)
    eye = origin + right * (x_high - x_low) / 2 + above * (y_high - y_low) / 2 + forward * c
    target = eye + forward * (0.5 * (z.min() + z.max()) - c)
    near = min(0.01, 0.5 * float(z.min() - c))
    return Camera(_vector(eye), _vector(target), _vector(above), fov, near)


def _axes(forward: NDArray[np.float64], up: ArrayLike) -> NDArray[np.float64]:
    length = np.linalg.norm(forward)
    if not length > 0:
        raise MuslinError("The camera looks nowhere: its eye and its target are the same point.")
    f = forward / length
    right = np.cross(f, np.asarray(up, dtype=float))
    if np.linalg.norm(right) < 1e-9 * max(float(np.linalg.norm(up)), 1e-300):
        right = np.cross(f, np.eye(3)[np.argmin(np.abs(f))])  # looking straight up or down
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(right, f), f])


def _first_bad(p: NDArray[np.float64]) -> int:
    return int(np.flatnonzero(~np.isfinite(p).all(axis=1))[0])


def _vector(v: NDArray[np.float64]) -> Vector:
    return (float(v[0]), float(v[1]), float(v[2]))
