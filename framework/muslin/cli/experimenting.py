"""The command that measures something with a student's own functions: experiment."""

from __future__ import annotations

from typing import Annotated

import typer

from muslin.base import paths
from muslin.cli.app import app
from muslin.cli.console import say
from muslin.cli.student import Functions


@app.command()
def experiment(
    name: Annotated[
        str | None, typer.Argument(metavar="NAME", help="Which. Default: list what there is.")
    ] = None,
    functions: Functions = None,
) -> None:
    """Measure something with your own functions: an experiment of the handout's optional part."""
    from muslin.student import experimenting
    from muslin.student.workspace import find

    workspace = find(functions)
    if name is not None:
        experimenting.run(workspace, name)
        return
    found = experimenting.scripts(workspace)
    for known, script in found.items():
        say(f"  {known:12} {experimenting.title(script)}")
    guides = {script.with_name("README.md") for script in found.values()}
    asked = [f" What to ask of it: {paths.shown(guide)}" for guide in guides if guide.is_file()]
    say(f"Run one with: muslin experiment NAME.{''.join(asked)}")
