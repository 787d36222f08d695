"""The command that measures something with a student's own functions: experiment."""

from __future__ import annotations

from typing import Annotated

import typer

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
    for known, script in experimenting.scripts(workspace).items():
        say(f"  {known:12} {experimenting.title(script)}")
    say("Run one with: muslin experiment NAME. What to ask of it: experiments/README.md")
