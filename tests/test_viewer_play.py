"""`muslin play`: one triangle or tetrahedron to pull at; numbers are those of `evaluate`, a mistake is seen at once."""

import json
import shutil
import time
from pathlib import Path

import numpy as np
import pytest
from pages import Tab, free_port, in_a_browser, visited, wait_for

import muslin
from muslin.base.errors import MuslinError
from muslin.judging import reference
from muslin.physics import alone
from muslin.viewer.play import POSES, begin
from muslin.viewer.play_page import PlayPage

ROOT = Path(__file__).parent.parent
WRONG = ("lam / 2 * (s[0] + s[1] - 2) ** 2", "lam * (s[0] + s[1] - 2) ** 2")


@pytest.fixture
def mistaken(tmp_path):
    """The answers to cloth with a factor of two too much in psi."""
    folder = tmp_path / "cloth"
    shutil.copytree(ROOT / "solutions" / "cloth", folder)
    file = folder / "strain_energy.py"
    text = file.read_text(encoding="utf-8")
    assert WRONG[0] in text
    file.write_text(text.replace(*WRONG), encoding="utf-8")
    return folder


def rows_of(play):
    return {row.symbol: row for row in play.rows}


@pytest.mark.parametrize("what", ["triangle", "tetrahedron"])
def test_what_the_framework_shows_agrees_with_a_deformation_that_is_known(what):
    play = begin(what, None, mu=3.0, lam=2.0)
    rng = np.random.default_rng(3)
    A = np.eye(3) + 0.3 * rng.standard_normal((3, 3))
    play.move(play.cell.X @ A.T)
    rows = rows_of(play)
    F = rows["F"].framework
    assert np.allclose((play.cell.X[1:] - play.cell.X[0]) @ F.T, play.x[1:] - play.x[0], atol=1e-13)
    if what == "triangle":  # the normal goes to the normal
        n = np.cross(play.x[1] - play.x[0], play.x[2] - play.x[0])
        assert np.allclose(F @ [0, 0, 1], n / np.linalg.norm(n), atol=1e-13)
    else:
        assert np.allclose(F, A, atol=1e-13)
    body, step = play.cell.body(), 1e-6
    slopes = np.zeros_like(play.x)
    for i in np.ndindex(play.x.shape):
        moved = play.x.copy()
        moved[i] += step
        up = body.energy(moved)
        moved[i] -= 2 * step
        slopes[i] = (up - body.energy(moved)) / (2 * step)
    assert np.allclose(rows["f"].framework, -slopes, atol=1e-8)
    # stress times the rate of F is the rate of psi
    rate = play.cell.framework(play.x + step * play.x[::-1])["F"] - F
    psi = [play.cell.framework(play.x + sign * step * play.x[::-1])["psi"] for sign in (1, -1)]
    rate = (rate + F - play.cell.framework(play.x - step * play.x[::-1])["F"]) / (2 * step)
    assert np.isclose((psi[0] - psi[1]) / (2 * step), np.sum(rows["P"].framework * rate), rtol=1e-7)
    directions = play.cell.directions(play.x)
    assert np.allclose(np.linalg.norm(directions, axis=1), rows["s"].framework[: len(directions)])
    assert abs(directions[0] @ directions[1]) < 1e-12


@pytest.mark.parametrize("assignment", ["cloth", "solids"])
def test_right_functions_and_the_framework_say_the_same_in_every_pose(assignment):
    play = begin(None, ROOT / "solutions" / assignment)
    for pose in POSES:
        play.pose(pose)
        assert not [row.symbol for row in play.rows if row.apart], pose
        assert not [row.trouble for row in play.rows if row.trouble]
        assert np.allclose(play.modes["yours"][0], play.modes["framework"][0], atol=1e-9)
    assert play.failing() == []
    assert {"F", "psi", "P", "f", "s"} <= rows_of(play).keys()


def test_the_numbers_are_those_of_evaluate():
    play = begin(None, ROOT / "solutions" / "cloth", mu=2.0, lam=5.0)
    play.drag(1, play.x[1] + (0.3, 0.2, -0.4))
    functions, rows = muslin.load(ROOT / "solutions" / "cloth"), rows_of(play)
    corners = {f"x{k}": play.x[k] for k in range(3)}
    grads = muslin.evaluate(functions.dphi_dX, **{f"X{k}": play.cell.X[k] for k in range(3)})
    F = muslin.evaluate(functions.deformation_gradient, **corners, dphi_dX=grads, N=np.array([0.0, 0.0, 1.0]))
    assert np.abs(rows["F"].yours - F[0]).max() <= 1e-12
    psi = muslin.evaluate(functions.psi, s=rows["s"].yours, mu=2.0, lam=5.0)
    assert abs(rows["psi"].yours - psi[0]) <= 1e-12


def test_a_wrong_function_is_apart_and_its_failing_case_can_be_looked_at(mistaken):
    play = begin(None, mistaken)
    assert not any(row.apart for row in play.rows)  # at rest there is nothing to see
    play.pose("stretched along one axis")
    assert [row.symbol for row in play.rows if row.apart] == ["psi"]
    ((task, number),) = play.failing()
    assert task == "psi"
    play.case(task, number)
    assert [row.symbol for row in play.rows if row.apart] == ["psi"]
    inputs, _ = reference.cases("cloth", "psi")
    assert np.allclose(np.sort(rows_of(play)["s"].framework), np.sort(inputs["s"][number]))


def test_one_function_is_shown_though_the_others_are_stubs(tmp_path):
    folder = tmp_path / "cloth"
    shutil.copytree(ROOT / "assignments" / "cloth", folder)
    shutil.copy(ROOT / "solutions" / "cloth" / "strain_energy.py", folder)
    play = begin(None, folder)
    play.pose("sheared")
    rows = rows_of(play)
    assert rows["psi"].yours is not None
    assert not rows["psi"].apart
    assert "not implemented yet" in rows["F" if "F" in rows and rows["F"].trouble else "phi"].trouble
    assert play.modes.keys() == {"framework"}


def test_equal_stretches_are_stepped_through(mistaken):
    play = begin(None, ROOT / "solutions" / "cloth")
    for gap in (0.3, 1e-3, 1e-6, 1e-9, 0.0):
        play.nearly_equal(gap)
        s = rows_of(play)["s"].framework
        assert np.isclose(s[0] - s[1], gap, atol=1e-14)
        assert np.allclose(play.modes["yours"][0], play.modes["framework"][0], atol=1e-8)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("circle", None), "triangle, tetrahedron"),
        (("tetrahedron", ROOT / "solutions" / "cloth"), "about a triangle"),
        ((None, ROOT / "solutions" / "cloth", "psi"), "psi:3"),
        ((None, ROOT / "solutions" / "cloth", "psi:900"), "public cases 0 to"),
        ((None, ROOT / "solutions" / "cloth", "pi:1"), "no task 'pi'"),
        ((None, ROOT / "solutions" / "cloth", "filter_velocity:1"), "no triangle"),
    ],
)
def test_what_cannot_be_played_with_is_said(arguments, said):
    with pytest.raises(MuslinError, match=said):
        begin(*arguments)


def test_corners_in_one_line_are_not_taken():
    play = begin("triangle", None)
    before = play.x
    play.drag(0, (play.x[1] + play.x[2]) / 2)
    play.drag(0, np.full(3, np.nan))
    assert play.x is before


def test_every_cell_has_an_assignment_of_its_own():
    tables = {name: muslin.load(ROOT / "solutions" / name).assignment.tasks for name in ("cloth", "solids")}
    assert [alone.of_assignment(tasks) for tasks in tables.values()] == ["triangle", "tetrahedron"]


@in_a_browser
def test_a_corner_is_dragged_in_the_browser_and_the_mistake_is_seen(mistaken, tmp_path):
    page = PlayPage(begin(None, mistaken), free_port())
    play = page.play

    def shown(tab, query, what="innerText"):
        found = tab("Runtime.evaluate", expression=f"document.querySelector({json.dumps(query)})?.{what}")
        return found["result"].get("value")

    def visit(address):
        tab = Tab(address, tmp_path / "profile")
        try:
            wait_for(lambda: len(dark(tab.picture())) > 200, "there are no corners in the page")
            x, y = dark(tab.picture())[0].tolist()  # the topmost corner
            before = play.x.copy()
            time.sleep(1)
            tab.mouse("mouseMoved", x, y + 4)
            tab.mouse("mousePressed", x, y + 4)
            for k in range(1, 11):
                tab.mouse("mouseMoved", x + 6 * k, y + 4 - 3 * k)
                time.sleep(0.1)
            tab.mouse("mouseReleased", x + 60, y - 26)
            wait_for(lambda: np.abs(play.x - before).max() > 0.05, "the corner does not follow")
            time.sleep(1)
            assert (np.abs(play.x - before).max(axis=1) > 1e-9).sum() == 1, "one corner moves"
            wait_for(
                lambda: shown(tab, "[data-symbol=psi]", "dataset.apart") == "1", "the mistake is not seen"
            )
            for whose in ("yours", "framework"):
                value = getattr(rows_of(play)["psi"], whose)
                text = wait_for(
                    lambda w=whose: shown(tab, f"[data-symbol=psi] [data-whose={w}] td", "title"), "no number"
                )
                assert abs(float(text) - float(value)) <= 1e-12 * max(1, abs(float(value)))
            assert shown(tab, "[data-symbol=F]", "dataset.apart") == "0"
            return tab.errors()
        finally:
            tab.close()

    assert visited(page, visit) == []


def dark(picture):
    """Where the picture is nearly black, (k, 2) as (x, y), from the top; above there may be a notice of viser's."""
    y, x = np.nonzero(picture[160:, :590].max(axis=2) < 70)
    return np.stack([x, y + 160], axis=1)
