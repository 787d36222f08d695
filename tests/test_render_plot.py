"""Plots contain their curves."""

import numpy as np
import pytest
from PIL import Image

from muslin.base.errors import MuslinError
from muslin.render import line_plot, plot_energies, plot_momenta
from muslin.render.materials import linear, srgb
from muslin.render.plot import COLOURS, ENERGY_COLOURS


def pixels(image, colour):
    """Rows and columns of the pixels of a colour."""
    rgb = 255 * srgb(linear(colour))
    return np.nonzero(np.abs(image.astype(int) - rgb).max(axis=2) < 12)


def test_an_energy_plot_shows_every_curve_and_is_written(tmp_path):
    t = np.linspace(0, 2, 100)
    table = {
        "kinetic": np.sin(3 * t) ** 2,
        "elastic": 0.5 * t,
        "gravity": 2 - t,
        "total": 2.2 - 0.1 * t,
    }
    image = plot_energies(table, t, tmp_path / "e.png", "drape")
    assert image.shape == (540, 960, 3)
    assert (np.array(Image.open(tmp_path / "e.png")) == image).all()
    for name in table:
        rows, columns = pixels(image, ENERGY_COLOURS[name])
        assert np.ptp(columns) > 600  # from one end of the axes to the other
        assert len(rows) > 300


def test_momenta_are_drawn_in_pictures_of_their_own_where_a_run_has_them():
    t = np.linspace(0, 2, 100)
    table = {name: (k + 1) * np.sin(3 * t + k) for k, name in enumerate(("px", "py", "pz", "lx", "ly", "lz"))}
    for image in plot_momenta(table, t):
        for colour in COLOURS[:3]:
            assert np.ptp(pixels(image, colour)[1]) > 600
    assert len(plot_momenta(table, t)) == 2
    old = table | dict.fromkeys(("lx", "ly", "lz"), np.full(100, np.nan))
    assert len(plot_momenta(old, t)) == 1
    assert plot_momenta({"kinetic": t}, t) == []


def test_a_rising_line_rises_and_a_power_law_is_straight_on_logarithmic_axes():
    x = np.logspace(-6, 0, 40)
    for curve, log in (((np.arange(9.0), np.arange(9.0)), False), ((x, x**2), True)):
        image = line_plot({"a": curve}, log_x=log, log_y=log)
        rows, columns = pixels(image, COLOURS[0])
        inside = rows > 90  # without the legend
        slope = np.polyfit(columns[inside], rows[inside], 1)
        assert slope[0] < -0.3
        assert np.abs(np.polyval(slope, columns[inside]) - rows[inside]).max() < 3


def test_gaps_constants_and_nothing_can_be_plotted():
    nothing = line_plot({})
    assert (line_plot({"a": ([], [])}).shape, nothing.dtype) == (nothing.shape, np.uint8)
    dot, constant, gap = (
        line_plot({"a": ([1.0], [2.0])}, markers=True),
        line_plot({"a": ([0, 1, 2], [5.0, 5.0, 5.0])}, y_unit="J"),
        line_plot({"a": ([0, 1, 2, 3], [1.0, np.nan, np.inf, -2.0])}, log_y=True, markers=True),
    )
    for image in (dot, constant, gap):
        assert (image != nothing).any()
        assert len(pixels(image, COLOURS[0])[0]) > 0
    rows, columns = pixels(constant, COLOURS[0])
    inside = rows > 90  # without the legend
    assert np.ptp(rows[inside]) < 8, "a constant is level"
    assert np.ptp(columns[inside]) > 600
    level = plot_energies({"kinetic": np.full(5, 1.2e7)}, np.arange(5))
    assert len(pixels(level, ENERGY_COLOURS["kinetic"])[0]) > 300


def test_columns_of_different_length_are_refused():
    with pytest.raises(MuslinError, match="kinetic"):
        plot_energies({"kinetic": np.zeros(4)}, np.zeros(5))
