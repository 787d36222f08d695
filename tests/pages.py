"""A real browser for tests: headless Chromium, driven over its DevTools protocol."""

import base64
import io
import itertools
import json
import re
import shutil
import socket
import subprocess
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from PIL import Image

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
                "--webgl-antialiasing-mode=none",
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


def visited(page, visit):
    """What `visit(address)` finds wrong in a page, which is served meanwhile and closed in the end."""
    done = []

    def visiting():
        try:
            return visit(page.address)
        finally:
            done.append(True)

    try:
        with ThreadPoolExecutor(1) as pool:
            found = pool.submit(visiting)
            page.loop(lambda: not done)
            # viser's own pointer handling makes Chromium say this once; it changes nothing
            return [
                line for line in found.result() if "preventDefault inside passive event listener" not in line
            ]
    finally:
        page.close()
