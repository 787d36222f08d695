"""The camera projects as geometry says and frames everything it is given."""

import numpy as np
import pytest

from muslin.base.errors import MuslinError
from muslin.render import Camera, fit_camera

SIZES = [(1280, 720), (320, 320), (200, 640)]
DIRECTIONS = [(0.3, 0.4, 1.0), (0, 0, 1), (0, 1, 0), (-2, -0.5, 0.1)]


def test_a_point_straight_ahead_is_in_the_middle_and_one_to_the_right_is_right_of_it():
    camera = Camera(eye=(0, 0, 5), target=(0, 0, 0), fov=90)
    p = camera.project([[0, 0, 0], [1, 0, 0], [0, 1, 0]], (200, 100))
    assert p == pytest.approx(np.array([[100, 50, 5], [110, 50, 5], [100, 40, 5]]))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("direction", DIRECTIONS)
def test_every_point_is_inside_the_margin_and_the_frame_is_tight(size, direction):
    points = np.random.default_rng(3).normal(size=(500, 3)) * [1.0, 0.4, 0.7] + [3, -2, 8]
    camera = fit_camera(points, direction, size, margin=0.1)
    p = camera.project(points, size)
    off = np.abs(p[:, :2] / size * 2 - 1)  # 1 at the border
    assert (p[:, 2] > camera.near).all()
    assert off.max() <= 0.9 + 1e-9
    low, high = (p[:, :2] / size * 2 - 1).min(axis=0), (p[:, :2] / size * 2 - 1).max(axis=0)
    touches = (np.abs(low + 0.9) < 1e-6) & (np.abs(high - 0.9) < 1e-6)
    assert touches.any()  # both margins, in at least one direction: no nearer camera sees them all
    assert np.linalg.norm(np.subtract(camera.eye, camera.target)) > 0


def test_one_point_can_be_framed():
    camera = fit_camera([[1.0, 2.0, 3.0]])
    assert camera.project([[1.0, 2.0, 3.0]], (640, 480))[0, :2] == pytest.approx([320, 240])


def test_no_points_and_points_that_are_not_finite_are_refused():
    with pytest.raises(MuslinError, match="no points"):
        fit_camera(np.zeros((0, 3)))
    with pytest.raises(MuslinError, match="number 1"):
        fit_camera([[0, 0, 0], [0, np.nan, 0]])


def test_a_camera_that_looks_nowhere_is_refused():
    with pytest.raises(MuslinError, match="same point"):
        Camera(eye=(0, 0, 0), target=(0, 0, 0)).project([[0, 0, 1]], (10, 10))
