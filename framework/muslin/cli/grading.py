"""Commands that judge: grade."""

from __future__ import annotations

import sys
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from muslin.base import paths
from muslin.base.child import SHORTEST
from muslin.base.errors import MuslinError
from muslin.cli.app import app
from muslin.cli.console import coloured, progress, say, say_raw


class Safety(str, Enum):
    """How a submission is kept apart."""

    auto = "auto"
    namespace = "namespace"
    uid = "uid"
    process = "process"


class Format(str, Enum):
    """Report formats."""

    terminal = "terminal"
    json = "json"
    gradescope = "gradescope"
    exercism = "exercism"
    classroom50 = "classroom50"
    junit = "junit"
    csv = "csv"
    html = "html"


@app.command()
def grade(
    submission: Annotated[Path, typer.Argument(help="A folder, zip or tar with the task files.")],
    assignment: Annotated[
        str | None,
        typer.Option(
            help="The assignment it answers. Default: what its assignment.toml says, else the one whose files it has."
        ),
    ] = None,
    hidden: Annotated[
        Path | None,
        typer.Option(help="Hidden reference data of your own, from `muslin reference build --hidden`."),
    ] = None,
    seed: Annotated[
        str | None,
        typer.Option(help="Draw the hidden cases from this. Default: the submission's own bytes."),
    ] = None,
    safety: Annotated[Safety, typer.Option(help="How the submission is kept apart.")] = Safety.auto,
    formats: Annotated[
        list[Format] | None,
        typer.Option(
            "--format",
            metavar="FORMAT",
            help=f"Report format: {', '.join(format.value for format in Format)}. With --out it may be repeated.",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the reports. Without --format: the record and the HTML report."),
    ] = None,
    deadline: Annotated[
        float | None, typer.Option(help="Seconds a task may take. Default: the assignment's.", min=SHORTEST)
    ] = None,
    student: Annotated[
        str | None,
        typer.Option(
            metavar="ID",
            help="Whose it is, where everybody has constants of their own. Default: as the submission says.",
        ),
    ] = None,
    fresh: Annotated[
        bool, typer.Option("--fresh", help="Take nothing over from an earlier grading of the same files.")
    ] = False,
) -> None:
    """Grade a submission in a sandbox. The exit code is 0 when grading has finished, whatever the score."""
    from muslin.grading import views
    from muslin.grading.grader import grade as graded

    if formats and len(formats) > 1 and out is None:
        raise MuslinError("Several formats need a folder to go to.", "Add --out DIR.")
    if out is not None and out.exists() and not out.is_dir():
        raise MuslinError(f"{paths.shown(out)} is not a folder.", "Name a folder with --out.")
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)  # what cannot be written is said before the work
    with progress("grading") as tick:
        record = graded(
            submission, assignment, hidden=hidden, seed=seed, safety=safety.value, deadline=deadline,
            fresh=fresh, student=student, on_progress=lambda done, total, _: tick(done, total),
        )  # fmt: skip
    chosen = [format.value for format in formats or ()]
    if out is None:
        name = chosen[0] if chosen else "terminal"
        if name == "terminal":
            say(views.render(record, name, colour=coloured(sys.stdout)).rstrip("\n"))
        else:
            say_raw(views.render(record, name).rstrip("\n"))
        return
    say(views.render(record, "terminal", colour=coloured(sys.stdout)))
    written = [views.write(record, name, out) for name in chosen or ("json", "html")]
    say(f"Wrote {', '.join(paths.shown(path) for path in written)}.")
