"""An interactive look at a scene: turn it, pull the cloth, switch the sphere.  `muslin view`.

| file | what it holds |
|---|---|
| `opening` | `view`: begin a session and show it with the face this machine has |
| `session` | `begin` a `Session`: it steps, is grabbed, reset, paused; no window needed |
| `scenery` | what a session looks like, as arrays |
| `window`  | its face in a window of its own: Taichi GGUI, where a Vulkan driver is present |
| `browser` | its face in a browser: viser, from the extra `view` |

Scene parameters and keys in, pictures out; nothing is written.
"""

from __future__ import annotations

from muslin.viewer.actions import ACTIONS
from muslin.viewer.opening import no_window, view
from muslin.viewer.session import Session, begin, faults

__all__ = ["ACTIONS", "Session", "begin", "faults", "no_window", "view"]
