"""The commands that look: view, mesh."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from muslin.cli.app import Cloth, Functions, Scale, Setting, app
from muslin.cli.console import say
from muslin.cli.simulating import _settings


class Backend(str, Enum):
    """Faces of the viewer."""

    auto = "auto"
    window = "window"
    browser = "browser"


@app.command()
def view(
    scene: Annotated[str, typer.Argument(help="A scene; `muslin scenes` lists them.")] = "hang",
    mesh: Cloth = None,
    scale: Scale = None,
    functions: Functions = None,
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
    """Look at a scene while it runs: turn it, pull the cloth with the mouse, switch the sphere on and off."""
    from muslin import viewer

    viewer.view(
        scene, functions, backend.value, port=port, open_page=not no_open, say=_say,
        **_settings(setting, mesh=mesh, scale=scale),
    )  # fmt: skip


@app.command()
def mesh(
    file: Annotated[
        Path, typer.Argument(help="A mesh of triangles or tetrahedra, in any format Muslin reads.")
    ],
) -> None:
    """Say what a mesh file holds, or why it can be neither cloth nor a solid."""
    from muslin.mesh.describing import describe

    for line in describe(file):
        say(line)


def _say(line: str) -> None:
    say(line)
