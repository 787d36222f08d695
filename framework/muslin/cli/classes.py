"""Commands for a whole class: class grade."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin.base import paths
from muslin.base.child import SHORTEST
from muslin.base.errors import MuslinError
from muslin.base.text import one_line
from muslin.cli.app import INTERRUPTED, Group, app
from muslin.cli.console import progress, say
from muslin.cli.grading import Safety

class_app = typer.Typer(cls=Group, help="A whole class: grade it and report on it.", no_args_is_help=True)
app.add_typer(class_app, name="class")


@class_app.callback()
def _class() -> None:
    """A whole class: grade it and report on it."""


@class_app.command("grade")
def class_grade(
    submissions: Annotated[
        Path,
        typer.Argument(
            help="What Canvas, Moodle, Gradescope or GitHub Classroom let you download, unpacked; or a folder with "
            "a folder or an archive per student."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the report. Naming it again goes on where it was.")],
    assignment: Annotated[
        str | None,
        typer.Option(
            help="The assignment they answer. Default: what their own assignment.toml says, else cloth."
        ),
    ] = None,
    hidden: Annotated[Path | None, typer.Option(help="Hidden reference data of your own.")] = None,
    jobs: Annotated[
        int | None, typer.Option(help="Submissions at a time. Default: this machine's cores.", min=1)
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Grade on a Dask cluster: the address of its scheduler.")
    ] = None,
    overrides: Annotated[
        Path | None,
        typer.Option(help="Scores set by hand: a CSV of student, task, score, reason, and bonus."),
    ] = None,
    roster: Annotated[
        Path | None,
        typer.Option(
            help="The platform's own table: Canvas' gradebook, Moodle's grading worksheet, Gradescope's roster. "
            "It comes back with the scores in it, in OUT/upload."
        ),
    ] = None,
    column: Annotated[
        str | None, typer.Option(help="The column of the roster for the scores. Default: this assignment's.")
    ] = None,
    scale: Annotated[
        bool, typer.Option("--scale", help="Scale scores to the points the platform gives.")
    ] = False,
    missing: Annotated[
        float | None,
        typer.Option(help="Score of who is on the roster and handed in nothing. Default: none.", min=0.0),
    ] = None,
    rules: Annotated[
        Path | None,
        typer.Option(help="A TOML file: what being late costs, and who is who where it is unclear."),
    ] = None,
    regrade: Annotated[
        list[str] | None,
        typer.Option(
            help="After a correction of the assignment: grade this task again and no other. Repeatable."
        ),
    ] = None,
    feedback: Annotated[
        bool,
        typer.Option(
            "--feedback", help="Put the reports into OUT/upload, named for Canvas' or Moodle's upload."
        ),
    ] = False,
    seed: Annotated[
        str | None,
        typer.Option(help="Draw the hidden cases from this. Default: each submission's own bytes."),
    ] = None,
    safety: Annotated[Safety, typer.Option(help="How submissions are kept apart.")] = Safety.auto,
    deadline: Annotated[
        float | None, typer.Option(help="Seconds a task may take. Default: the assignment's.", min=SHORTEST)
    ] = None,
) -> None:
    """Grade all submissions and write grades.csv and index.html. It can be stopped at any time and goes on later."""
    from muslin.classes.again import TABLE
    from muslin.classes.returning import Wanted
    from muslin.classes.run import grade_class

    if jobs and scheduler:
        raise MuslinError("With --scheduler, the cluster says how many run at a time.", "Leave out --jobs.")

    def found(total: int, taken: int) -> None:
        graded = f", {taken} of them graded already" if taken else ""
        say(f"{total} submission{'s' * (total != 1)}{graded}.", err=True)

    try:
        with progress("grading") as tick:
            graded = grade_class(
                submissions, out, assignment, hidden=hidden, jobs=jobs, scheduler=scheduler, by_hand=overrides,
                back=Wanted(roster, column, scale, missing, rules, feedback), regrade=regrade or (),
                seed=seed, safety=safety.value, deadline=deadline, on_find=found, on_progress=tick,
            )  # fmt: skip
    except KeyboardInterrupt:
        say("Stopped; every result so far is kept. The same command goes on from here.", err=True)
        raise typer.Exit(INTERRUPTED) from None
    for note in graded.notes:
        say(f"note: {one_line(note, 500)}", err=True)
    say(graded.told())
    if graded.changed:
        say(f"Wrote {paths.shown(graded.folder / TABLE)}.")
    say(f"Wrote {paths.shown(graded.folder / 'grades.csv')} and {paths.shown(graded.folder / 'index.html')}.")
    for path in graded.returned.files:
        say(f"Ready to upload: {paths.shown(path)}.")
