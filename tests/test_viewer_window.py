"""The viewer's own window, off-screen; only where a Vulkan driver is present."""

import subprocess
import sys

import pytest

from muslin.base.errors import MuslinError
from muslin.viewer import no_window, opening, view

#: Draws a session off-screen, pulls the cloth as the window's mouse does, switches all on; prints what it saw.
SCRIPT = """
import numpy as np
from muslin.viewer import begin
from muslin.viewer.window import Face

session = begin("hang", resolution=12)
face = Face(session, (640, 360), shown=False)

def picture():
    face.draw()
    seen = face.window.get_image_buffer_as_numpy()[..., :3]
    r, g, b = seen[200:].transpose(2, 0, 1)  # beside the panel
    return int(((r > g + 0.2) & (r > b + 0.2)).sum())

cloth = picture()
vertex = session.nearest(session.x.mean(axis=0))
place = face.orbit.camera.project(session.x[vertex][None], (640, 360))[0]
cursor = (place[0] / 640, 1 - place[1] / 360)
picked = session.pick(face.orbit.camera.eye, face._ray(*cursor))
session.grab(picked)
face.point(cursor)
face.point((cursor[0] + 0.1, cursor[1]))
for _ in range(30):
    session.step()
moved = np.linalg.norm(session.pull[0] - session.pull[1])
picture()
session.release()
session.strain = session.wireframe = session.sphere = True
strained = picture()
print(picked == vertex, cloth > 4000, strained < cloth / 2, bool(moved < 0.1), repr(session.message))
"""


@pytest.fixture(scope="module")
def vulkan():
    if why := no_window(shown=False):
        pytest.skip(f"no window here: {why}")


def test_the_window_shows_the_cloth_and_the_mouse_pulls_it(vulkan, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT], capture_output=True, text=True, timeout=300, check=False, cwd=tmp_path
    )
    assert done.stdout.strip() == "True True True True ''", done.stdout + done.stderr


def test_without_a_display_there_is_no_window(monkeypatch):
    monkeypatch.setattr(opening, "has_desktop", lambda: False)
    assert no_window() == "there is no display"
    with pytest.raises(MuslinError, match="--backend browser"):
        view("drape", backend="window")


def test_a_driver_that_ends_the_process_does_not_end_ours(monkeypatch):
    monkeypatch.setattr(opening, "PROBE", "import os\nos.abort()  # {shown} {look}")
    assert "Vulkan driver" in no_window(shown=False)
