"""Everything a person may do in a session: one name, one key, one home."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from muslin.viewer.session import Session


@dataclass(frozen=True)
class Action:
    """Something to do: its key, its name on a button, what it does, and the switch it turns if it is one."""

    key: str
    name: str
    do: Callable[[Session], None]
    switch: str = ""


def _switching(key: str, name: str, switch: str) -> Action:
    return Action(key, name, lambda session: setattr(session, switch, not getattr(session, switch)), switch)


def _one_step(session: Session) -> None:
    session.playing = False
    session.step()


def _camera(session: Session) -> None:
    session.camera_resets += 1


#: All that keys and buttons do. In a page w, a, s, d, q and e move the camera (viser), and can mean nothing else.
ACTIONS: tuple[Action, ...] = (
    _switching("space", "Play", "playing"),
    Action("n", "Step", _one_step),
    Action("r", "Reset", Session.reset),
    Action("v", "Reset camera", _camera),
    _switching("c", "Sphere", "sphere"),
    _switching("t", "Strain colours", "strain"),
    _switching("f", "Wireframe", "wireframe"),
)
