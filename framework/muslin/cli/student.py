"""Commands for students: start, check, list, hint, reset, ... Each runs in the workspace without options."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from muslin import paths
from muslin.cli.app import app, chosen_tasks
from muslin.errors import MuslinError

Functions = Annotated[
    Path | None, typer.Option("--functions", help="Folder with the task files. Default: this workspace.")
]
Here = Annotated[Path | None, typer.Argument(help="The workspace. Default: the one you are in.")]
Tasks = Annotated[list[str] | None, typer.Argument(help="Tasks, sections (S7) or files. Default: all.")]
OneTask = Annotated[str | None, typer.Argument(metavar="TASK", help="Default: the next open task.")]


@app.command()
def start(
    assignment: Annotated[str, typer.Argument(help="The assignment, for example cloth.")],
    folder: Annotated[
        Path | None, typer.Argument(metavar="DIR", help="Default: a folder of its name.")
    ] = None,
) -> None:
    """Make a workspace: task files, handout, editor settings. Nothing is overwritten."""
    from muslin.student import workspace

    folder = folder or Path(assignment)
    workspace.start(assignment, folder)
    made = workspace.find(folder)
    first = next(iter(made.table.tasks.values()))
    here = folder.resolve() == Path.cwd()
    typer.echo(f"{made.table.title}: {len(made.table.tasks)} functions, in {paths.shown(folder)}.")
    typer.echo("")
    steps = [
        *([] if here else [(f"cd {paths.shown(folder)}", "go there")]),
        ("muslin list", "what there is to do"),
        ("muslin watch", "check whenever you save a file"),
    ]
    for command, meaning in steps:
        typer.echo(f"  {command:24}  {meaning}")
    typer.echo("")
    typer.echo(f"Read README.md, then write the first function: {first.name}, at {made.place(first.name)}.")


@app.command()
def check(tasks: Tasks = None, functions: Functions = None) -> None:
    """Check functions against the public cases: what is wrong, the likely mistake, the next step."""
    from muslin.student import checking, progress
    from muslin.student.workspace import find

    workspace = find(functions)
    chosen = chosen_tasks(tasks, workspace.table)
    names = chosen or list(workspace.table.tasks)
    width = max(map(len, names))
    green = 0
    with checking.Checker() as checker:
        for report in checker.check(workspace, names):
            green += report.status == checking.GREEN
            typer.echo("\n".join(checking.told(workspace, report, width)))
    typer.echo(f"{green} of {len(names)} tasks agree with the reference data.")
    if note := _news(workspace):
        typer.echo(note)
    if workspace.started and green == len(names):
        following = progress.open_task(progress.standings(workspace), names[-1])
        if following is not None:
            typer.echo(f"Next: {following.task.name}, at {workspace.place(following.task.name)}")
    if green < len(names):
        raise typer.Exit(1)


@app.command("list")
def list_(folder: Here = None) -> None:
    """List the tasks: points, where each stands, what it is simulated with."""
    from muslin.student import progress
    from muslin.student.workspace import find

    workspace = find(folder)
    typer.echo("\n".join(progress.listed(workspace)))
    following = progress.open_task(progress.standings(workspace))
    if following is not None:
        typer.echo(f"Next: {following.task.name}, at {workspace.place(following.task.name)}")
    if note := _news(workspace):
        typer.echo(note)


@app.command()
def hint(
    task: OneTask = None,
    level: Annotated[int | None, typer.Option(help="Which hint. Default: one more than last time.")] = None,
    functions: Functions = None,
) -> None:
    """Show a hint; the next time, the next one, which says a little more."""
    from muslin.student import hints
    from muslin.student.workspace import find

    workspace = find(functions)
    typer.echo("\n".join(hints.shown(workspace, _one(workspace, task), level)))


@app.command()
def reset(
    task: Annotated[str, typer.Argument(metavar="TASK|FILE", help="A task, or a whole file.")],
    functions: Functions = None,
) -> None:
    """Put a function, or a whole file, back to what was given. What you had is kept as a backup."""
    from muslin.student import resetting
    from muslin.student.workspace import find

    typer.echo(resetting.reset(find(functions), task))


def _one(workspace: object, task: str | None) -> str:
    """One task: the one named, or the next open one."""
    from muslin.student import progress
    from muslin.student.workspace import Workspace

    assert isinstance(workspace, Workspace)
    if task is None:
        following = progress.open_task(progress.standings(workspace))
        return following.task.name if following else next(iter(workspace.table.tasks))
    found = chosen_tasks([task], workspace.table)
    if len(found) > 1:
        raise MuslinError(f"{task} has several tasks.", f"Name one: {', '.join(found)}.")
    return found[0]


def _news(workspace: object) -> str:
    """Says so if a newer version of the assignment is there than the workspace has."""
    from muslin.student.workspace import Workspace

    assert isinstance(workspace, Workspace)
    if not workspace.started or workspace.version == workspace.table.version:
        return ""
    return (
        f"{workspace.table.name} {workspace.table.version} is out, this workspace has {workspace.version}: "
        "muslin upgrade brings what is new; what you wrote stays."
    )
