"""Open a session with the face this machine can show."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from muslin.base import child, engine
from muslin.base.engine import inside
from muslin.base.errors import MuslinError

#: Opens a window off-screen and reads a picture back; run in a process of its own, since a driver that is missing
#: or broken may end the process that asks for it.
PROBE = """
from muslin.base.engine import ti
ti.init(arch=ti.cpu, log_level=ti.CRITICAL)
window = ti.ui.Window("probe", (64, 64), show_window={shown})
window.get_canvas().set_background_color((1.0, 1.0, 1.0))
{look}
"""


def view(
    scene: str,
    functions: Path | str | None = None,
    backend: str = "auto",
    *,
    port: int = 8080,
    open_page: bool = True,
    say: Callable[[str], None] = print,
    **parameters: Any,
) -> None:
    """Look at a scene while it runs, until the window is closed or Ctrl-C.

    Parameters
    ----------
    scene : str
    functions : path, optional
        Folder of student functions. Those not done yet, or wrong on the public cases, are stood in for.
    backend : {"auto", "window", "browser"}
    port, open_page
        Of the browser's page.
    say : callable
        Told what happens.
    **parameters
        Scene parameters.

    Raises
    ------
    MuslinError
        If the scene cannot begin, or the face asked for cannot be shown here.
    """
    if backend not in ("auto", "window", "browser"):
        raise MuslinError(f"There is no backend {backend!r}.", "There is: auto, window, browser.")
    if backend == "window" and (why := no_window()):
        raise MuslinError(f"A window cannot be opened here: {why}.", "Use --backend browser.")
    if backend == "auto":
        backend = "browser" if no_window() else "window"
    from muslin.viewer import browser

    if backend == "browser":
        browser.require()
    from muslin.viewer.session import begin

    if functions is not None:
        say("Trying your functions on the public cases ...")
    session = begin(scene, functions, **parameters)
    for remark in session.scene.remarks(session.model.body.mesh, session.model.pinned):
        say(f"note: {remark}")
    for line in session.credits():
        say(line)
    if backend == "window":
        from muslin.viewer import window

        window.run(session, say=say)
    else:
        browser.run(session, port, open_page and has_desktop(), say)


def no_window(shown: bool = True) -> str:
    """Why Taichi's window cannot be opened here; empty if it can.

    Parameters
    ----------
    shown : bool
        On the screen; False asks for a window off-screen only.
    """
    if shown and not has_desktop():
        return "there is no display"
    if not inside.has_windows():
        return f"{engine.chosen().title} has none"
    look = "window.show()" if shown else "window.get_image_buffer_as_numpy()"
    try:
        with tempfile.TemporaryDirectory() as litter:  # Taichi leaves a file where it stands
            probe = PROBE.format(shown=shown, look=look)
            done = child.run([sys.executable, "-c", probe], limit=60, folder=litter)
    except OSError:
        done = None
    if done is None or done.late:
        return "the graphics driver does not answer"
    if done.status == 0:
        return ""
    return "it needs a Vulkan driver (Debian, Ubuntu: libvulkan1 and mesa-vulkan-drivers)"


def has_desktop() -> bool:
    """Whether a window or a browser would appear in front of anybody."""
    if sys.platform == "linux":
        return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
    return not os.environ.get("SSH_CONNECTION")
