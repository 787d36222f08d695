"""The viewer's page in a real browser: it shows the cloth, obeys keys and mouse, and asks nobody else for anything."""

import base64
import io
import itertools
import json
import re
import shutil
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from PIL import Image

from muslin.base.errors import MuslinError
from muslin.viewer import begin, browser

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
BROWSER = next((path for name in BROWSERS if (path := shutil.which(name))), None)
try:
    import viser
    from websockets.sync.client import connect
except ImportError:
    viser = None
with_viser = pytest.mark.skipif(viser is None, reason="viser is not installed: pip install muslin[view]")
in_a_browser = pytest.mark.skipif(
    BROWSER is None or viser is None,
    reason="viser is not installed: pip install muslin[view]"
    if viser is None
    else f"no browser on PATH (looked for {', '.join(BROWSERS)})",
)

#: How long the page may take on a busy machine that draws without a graphics card [s].
PATIENCE = 120


class Tab:
    """A headless browser with one page, driven over its DevTools protocol."""

    def __init__(self, url, profile):
        self.browser = subprocess.Popen(
            [
                BROWSER, "--headless=new", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run",
                "--disable-background-networking", "--disable-component-update", "--disable-extensions",
                "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
                "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--remote-debugging-port=0",
                f"--user-data-dir={profile}", "about:blank",
            ],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        note = profile / "DevToolsActivePort"
        until = time.monotonic() + PATIENCE
        while not note.exists() or len(note.read_text().split()) < 2:
            assert time.monotonic() < until, "the browser did not start"
            time.sleep(0.1)
        port, path = note.read_text().split()
        self.socket = connect(f"ws://127.0.0.1:{port}{path}", max_size=None)
        self.numbers, self.events, self.session = itertools.count(1), [], None
        target = self("Target.createTarget", url="about:blank")["targetId"]
        self.session = self("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]
        for domain in ("Runtime", "Log", "Network", "Page"):
            self(f"{domain}.enable")
        size = {"width": 1000, "height": 600, "deviceScaleFactor": 1, "mobile": False}
        self("Emulation.setDeviceMetricsOverride", **size)
        self("Page.navigate", url=url)

    def __call__(self, method, **parameters):
        number = next(self.numbers)
        message = {"id": number, "method": method, "params": parameters}
        self.socket.send(json.dumps(message | ({"sessionId": self.session} if self.session else {})))
        while True:
            answer = json.loads(self.socket.recv(timeout=PATIENCE))
            if answer.get("id") == number:
                if "error" in answer:
                    raise ConnectionError(answer["error"]["message"])
                return answer["result"]
            self.events.append(answer)

    def picture(self):
        """What is in the page, (height, width, 3) ints, without the panel at its right."""
        try:
            shot = self("Page.captureScreenshot", format="png")["data"]
        except ConnectionError:  # on the way from one page to the next
            return np.zeros((1, 1, 3), int)
        return np.asarray(Image.open(io.BytesIO(base64.b64decode(shot))).convert("RGB")).astype(int)[:, :640]

    def key(self, key):
        for kind in ("keyDown", "keyUp"):
            self("Input.dispatchKeyEvent", type=kind, key=key, code=f"Key{key.upper()}")

    def mouse(self, kind, x, y):
        buttons = 0 if kind == "mouseReleased" else 1
        self("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", buttons=buttons, clickCount=1)

    def errors(self):
        """Errors in the console, and requests to anywhere but the viewer."""
        found = []
        for event in self.events:
            what, said = event.get("method"), event.get("params", {})
            if (
                what == "Runtime.exceptionThrown"
                or (what == "Runtime.consoleAPICalled" and said["type"] in ("error", "assert"))
                or (what == "Log.entryAdded" and said["entry"]["level"] == "error")
            ):
                found.append(json.dumps(said)[:500])
            if what == "Network.requestWillBeSent":
                url = said["request"]["url"]
                if not re.match(r"(http://127\.0\.0\.1:\d+/|data:|blob:http://127\.0\.0\.1:)", url):
                    found.append(url[:200])
        return found

    def close(self):
        self.socket.close()
        self.browser.terminate()
        self.browser.wait(timeout=30)


def cloth_pixels(picture):
    """Where the picture has the cloth's red, (k, 2) as (x, y)."""
    r, g, b = picture.transpose(2, 0, 1)
    y, x = np.nonzero((r > g + 60) & (r > b + 60))
    return np.stack([x, y], axis=1)


def wait_for(what, problem):
    until = time.monotonic() + PATIENCE
    while not (found := what()):
        assert time.monotonic() < until, problem
        time.sleep(0.2)
    return found


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


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
    done = []

    def visit():
        tab = Tab(face.address, tmp_path / "profile")
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
            # viser's own pointer handling makes Chromium say this once; it changes nothing
            return [c for c in tab.errors() if "preventDefault inside passive event listener" not in c]
        finally:
            tab.close()
            done.append(True)

    try:
        with ThreadPoolExecutor(1) as pool:
            visiting = pool.submit(visit)
            face.loop(lambda: not done)
            assert visiting.result() == []
    finally:
        face.close()


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
