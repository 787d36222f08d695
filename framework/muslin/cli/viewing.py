"""The commands that look: view, play, mesh."""

from __future__ import annotations

import contextlib
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from muslin.base.errors import MuslinError
from muslin.cli.app import Cloth, Scale, Setting, app
from muslin.cli.console import say
from muslin.cli.simulating import _settings
from muslin.cli.student import Functions


class Backend(str, Enum):
    """Faces of the viewer."""

    auto = "auto"
    window = "window"
    browser = "browser"


@app.command()
def view(
    scene: Annotated[
        str | None,
        typer.Argument(help="A scene; `muslin scenes` lists them. Default: the assignment's own, or hang."),
    ] = None,
    mesh: Cloth = None,
    scale: Scale = None,
    functions: Functions = None,
    native: Annotated[
        bool, typer.Option("--native", help="Muslin's own functions, in a workspace, too.")
    ] = False,
    setting: Setting = None,
    port: Annotated[int, typer.Option(help="Port of the browser's page.", min=1, max=65535)] = 8080,
    no_open: Annotated[
        bool, typer.Option("--no-open", help="Do not open the page, only say where it is.")
    ] = False,
    backend: Annotated[
        Backend,
        typer.Option(help="A window of its own (needs Vulkan), or a page in the browser (extra `view`)."),
    ] = Backend.auto,
) -> None:
    """Look at a scene while it runs: turn it, pull with the mouse, switch the sphere on and off.

    In a workspace with your functions, as muslin run; elsewhere with Muslin's own.
    """
    from muslin import viewer
    from muslin.base.engine import silence
    from muslin.student import running, workspace

    settings = _settings(setting, mesh=mesh, scale=scale)
    here = None
    try:
        here = workspace.find(functions)
    except MuslinError:
        if functions is not None:  # elsewhere no assignment is meant
            raise
    if here is not None:
        scene = scene or here.scene
        about = functions is not None or bool(scene and here.scene and _alike(scene, here.scene))
        if about and not native:
            functions, settings = here.folder, running.shown(here) | settings
            _say("With your functions; with Muslin's own: muslin view --native")
        else:
            functions = None
            _say("With Muslin's own functions.")
    silence.compile_in_silence()
    viewer.view(
        scene or "hang", functions, backend.value, port=port, open_page=not no_open, say=_say, **settings
    )  # fmt: skip


def _alike(scene: str, other: str) -> bool:
    """Whether two scenes are of the same kind of body."""
    from muslin.simulation import scenes

    return bool(scenes.get(scene).WORD == scenes.get(other).WORD)


@app.command()
def play(
    what: Annotated[
        str | None,
        typer.Argument(metavar="[triangle|tetrahedron]", help="Default: what this workspace is about."),
    ] = None,
    functions: Functions = None,
    case: Annotated[
        str | None, typer.Option(metavar="TASK:NUMBER", help="Begin with a public case, as explain shows it.")
    ] = None,
    mu: Annotated[float, typer.Option(help="Lamé's parameter: the shear modulus [Pa].")] = 1.0,
    lam: Annotated[float, typer.Option(help="Lamé's other parameter [Pa].")] = 1.0,
    port: Annotated[int, typer.Option(help="Port of the browser's page.", min=1, max=65535)] = 8080,
    no_open: Annotated[
        bool, typer.Option("--no-open", help="Do not open the page, only say where it is.")
    ] = False,
) -> None:
    """Pull at one triangle or tetrahedron in the browser: F, stretches, stress, modes; yours and Muslin's."""
    from muslin.base.engine import silence
    from muslin.student.workspace import find
    from muslin.viewer.opening import has_desktop
    from muslin.viewer.play_page import play as shown

    silence.compile_in_silence()
    if functions is None:
        with contextlib.suppress(MuslinError):  # elsewhere there are no functions to show
            functions = find().folder
    shown(what, functions, case, port=port, open_page=not no_open and has_desktop(), say=_say, mu=mu, lam=lam)


@app.command()
def mesh(
    file: Annotated[
        Path,
        typer.Argument(
            help="Triangles or tetrahedra, in any format Muslin reads; or one of Muslin's meshes by its name."
        ),
    ],
) -> None:
    """Say what a mesh file holds, or why it can be neither cloth nor a solid."""
    from muslin.base import paths
    from muslin.mesh.describing import describe

    shipped = paths.meshes() / f"{file}.obj"
    for line in describe(shipped if shipped.is_file() and not file.exists() else file):
        say(line)


def _say(line: str) -> None:
    say(line)
