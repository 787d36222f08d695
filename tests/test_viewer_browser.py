"""The viewer's page in a real browser: it shows the cloth, obeys keys and mouse, and asks nobody else for anything."""

import json
import re
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from pages import Tab, free_port, in_a_browser, visited, wait_for, with_viser

from muslin.base.errors import MuslinError
from muslin.viewer import begin, browser


def cloth_pixels(picture):
    """Where the picture has the cloth's red, (k, 2) as (x, y)."""
    r, g, b = picture.transpose(2, 0, 1)
    y, x = np.nonzero((r > g + 60) & (r > b + 60))
    return np.stack([x, y], axis=1)


@in_a_browser
def test_the_page_shows_the_cloth_without_an_error_or_a_request_and_ctrl_c_ends_it(tmp_path):
    viewer = subprocess.Popen(
        [
            sys.executable, "-u", "-m", "muslin.cli", "view", "hang", "--set", "resolution=16",
            "--port", str(free_port()), "--no-open", "--backend", "browser",
        ],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
    )  # fmt: skip
    tab = None
    try:
        line = viewer.stdout.readline()
        address = re.search(r"http://127\.0\.0\.1:\d+", line)
        assert address, line + viewer.stdout.read()
        tab = Tab(address[0], tmp_path / "profile")
        wait_for(lambda: len(cloth_pixels(tab.picture())) > 3000, "there is no cloth in the page")
        time.sleep(3)
        canvas = tab("Runtime.evaluate", expression="document.querySelectorAll('canvas').length")
        assert canvas["result"]["value"] >= 1
        assert tab.errors() == []
    finally:
        if tab:
            tab.close()
        viewer.send_signal(signal.SIGINT)
        said, _ = viewer.communicate(timeout=60)
    assert viewer.returncode == 0, said
    assert "Closed." in said
    assert "Traceback" not in said


@in_a_browser
def test_keys_and_mouse_reach_the_session(tmp_path):
    session = begin("hang", resolution=12, steps=0)
    face = browser.Face(session, free_port())

    def visit(address):
        tab = Tab(address, tmp_path / "profile")
        try:
            wait_for(lambda: len(cloth_pixels(tab.picture())) > 3000, "there is no cloth in the page")
            tab.key("n")
            wait_for(lambda: not session.playing, "n did not pause")
            looking = np.array(next(iter(face.server.get_clients().values())).camera.position)
            count = wait_for(lambda: len(cloth_pixels(tab.picture())), "there is no cloth in the page")
            for key, switch in (
                ("t", "strain"),
                ("f", "wireframe"),
                ("c", "sphere"),
                ("c", "sphere"),
                ("f", "wireframe"),
            ):
                before = getattr(session, switch)
                tab.key(key)
                wait_for(lambda s=switch, b=before: getattr(session, s) != b, f"{key} did nothing")
            wait_for(lambda: len(cloth_pixels(tab.picture())) < count / 2, "strain colours are not shown")
            tab.key("t")
            wait_for(lambda: not session.strain, "t did nothing the second time")
            wait_for(lambda: len(cloth_pixels(tab.picture())) > count / 2, "the cloth is not red again")
            assert np.allclose(
                next(iter(face.server.get_clients().values())).camera.position, looking, atol=1e-6
            )
            red = cloth_pixels(tab.picture())
            x, y = red[np.argmin(np.linalg.norm(red - np.median(red, axis=0), axis=1))].tolist()
            tab.mouse("mouseMoved", x, y)
            tab.mouse("mousePressed", x, y)
            for k in range(1, 11):
                tab.mouse("mouseMoved", x + 6 * k, y - 3 * k)
                time.sleep(0.1)
            wait_for(
                lambda: session.pull is not None and np.ptp(session.pull, axis=0).max() > 0.03,
                "nothing is pulled",
            )
            pull = session.pull
            session.playing = True
            wait_for(
                lambda: np.linalg.norm(np.subtract(*session.pull)) < 0.7 * np.linalg.norm(np.subtract(*pull)),
                "the cloth does not follow",
            )
            tab.mouse("mouseReleased", x + 60, y - 30)
            wait_for(lambda: session.grabbed is None, "the cloth is not let go")
            session.playing = False
            tab.key("t")
            wait_for(lambda: session.strain, "t did nothing")
            (client,) = face.server.get_clients().values()
            camera = np.array(client.camera.position)
            tab.mouse("mouseMoved", x, y)
            tab.mouse("mousePressed", x, y)
            for k in range(1, 11):
                tab.mouse("mouseMoved", x + 6 * k, y - 3 * k)
                session.playing = k > 3  # the coloured cloth is sent again and again meanwhile
                time.sleep(0.1)
            wait_for(lambda: session.grabbed is not None, "nothing is pulled in strain colours")
            tab.mouse("mouseReleased", x + 60, y - 30)
            wait_for(lambda: session.grabbed is None, "the cloth is not let go in strain colours")
            assert np.allclose(client.camera.position, camera, atol=1e-6), "the camera has turned"
            assert not session.message
            return tab.errors()
        finally:
            tab.close()

    assert visited(face, visit) == []


@with_viser
def test_while_nobody_looks_time_stands_still():
    session = begin("hang", resolution=6)
    face = browser.Face(session, free_port())
    try:
        turns = iter(range(5))
        face.loop(lambda: next(turns, None) is not None)
        assert session.steps == 0
        assert face.server.request_share_url() is None  # no tunnel to the outside
    finally:
        face.close()


@with_viser
def test_an_error_is_shown_with_its_text_as_it_is():
    session = begin("hang", resolution=6)
    face = browser.Face(session, free_port())
    try:
        session._fail("x_1 is *wrong* <b>")
        face.show()
        assert face.trouble.visible
        assert face.trouble.content.startswith(r"**x\_1 is \*wrong\* \<b\>")
        session.reset()
        face.show()
        assert not face.trouble.visible
    finally:
        face.close()


def test_without_viser_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    with pytest.raises(MuslinError, match=r"muslin\[view\]"):
        browser.require()


def test_a_coloured_mesh_is_a_whole_glb():
    data = browser.glb(np.eye(3), np.array([[0, 1, 2]]), np.ones((3, 3)))
    assert data[:4] == b"glTF"
    assert int.from_bytes(data[8:12], "little") == len(data)
    length = int.from_bytes(data[12:16], "little")
    head = json.loads(data[20 : 20 + length])
    assert head["buffers"][0]["byteLength"] == len(data) - 28 - length
