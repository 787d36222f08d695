"""A page in a browser, through viser: a server on this machine, for this machine only.

The server answers in a thread of its own and only puts what people do into a queue; one loop, in the thread that
calls `show`, takes from it and sends. So what is shown is touched by one thread. Of frames a slow browser gets the last
(viser keeps one message per property).
"""

from __future__ import annotations

import contextlib
import io
import queue
import time
import webbrowser
from collections.abc import Callable
from typing import Any

from muslin.base import optional

FPS = 30

#: How long a page is given to draw its first picture [s].
DRAWN = 20.0

Command = Callable[[], None]


def require() -> Any:
    """The viser module.

    Raises
    ------
    MuslinError
        If it is not installed; names the extra that brings it.
    """
    return optional.require("viser", "The viewer in a browser", "view")


def show(
    page: Served,
    title: str,
    open_page: bool = True,
    say: Callable[[str], None] = print,
    running: Callable[[], bool] = lambda: True,
) -> None:
    """Serve a page until Ctrl-C.

    Parameters
    ----------
    page : Served
        It is closed in the end.
    title : str
        Said with its address.
    open_page : bool
        Open the page in this machine's browser.
    say : callable
        Told the address.
    running : callable
        Asked before every frame; False ends it.
    """
    try:
        say(f"{title}: {page.address}  (Ctrl-C ends)")
        if open_page:
            webbrowser.open(page.address)
        page.loop(running)
    except KeyboardInterrupt:
        say("Closed.")
    finally:
        page.close()


class Served:
    """A server for one page, and the commands that come back from it."""

    def __init__(self, port: int = 8080):
        viser = require()
        self.commands: queue.SimpleQueue[Command] = queue.SimpleQueue()
        with contextlib.redirect_stdout(io.StringIO()):  # its greeting; ours says more
            self.server = viser.ViserServer(host="127.0.0.1", port=port, label="Muslin", verbose=False)
        # a page could otherwise ask the server for a public address at a tunnel service
        self.server.request_share_url = lambda verbose=True: None
        self.address = f"http://127.0.0.1:{self.server.get_port()}"
        self._looking: set[int] = set()
        self.server.on_client_connect(self._arrived)

    def _arrived(self, client: Any) -> None:
        """Wait, in a thread of viser's, until a page has drawn something: only then does anybody look."""
        with contextlib.suppress(Exception):  # a page that closes again, or draws too slowly to answer
            client.get_render(height=32, width=32, timeout=DRAWN)
        self._looking.add(client.client_id)

    def looked_at(self) -> bool:
        """Whether somebody sees the page."""
        return bool(self._looking & self.server.get_clients().keys())

    def close(self) -> None:
        """Stop serving."""
        with contextlib.redirect_stdout(io.StringIO()):  # its farewell
            self.server.stop()

    def loop(self, running: Callable[[], bool] = lambda: True) -> None:
        """Take commands and send what has changed."""
        raise NotImplementedError

    def obey(self, until: float) -> None:
        """Do what was asked for; wait for more until a time on the performance counter."""
        while True:
            wait = until - time.perf_counter()
            try:
                command = self.commands.get(timeout=wait) if wait > 0 else self.commands.get_nowait()
            except queue.Empty:
                return
            command()
