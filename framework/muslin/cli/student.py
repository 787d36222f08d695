"""Commands for students: start, check, list, hint, reset, ... Each runs in the workspace without options."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.cli.app import (
    INTERRUPTED,
    Cloth,
    Quality,
    Scale,
    Setting,
    app,
)
from muslin.cli.console import note, progress, say, say_raw

if TYPE_CHECKING:
    from muslin.student.workspace import Workspace

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
    notebook: Annotated[
        bool,
        typer.Option("--notebook", help="Also make a Jupyter notebook of the handout, a cell per function."),
    ] = False,
    student: Annotated[
        str | None, typer.Option(metavar="ID", help="Your login or number, for constants of your own.")
    ] = None,
    install: Annotated[
        str | None, typer.Option(help="What its first cell installs where Muslin is missing, for pip.")
    ] = None,
) -> None:
    """Make a workspace: task files, handout, editor settings. Nothing is overwritten."""
    from muslin.student import workspace
    from muslin.tasks import constants

    folder = folder or Path(assignment)
    workspace.start(constants.of(assignment, student) if student else assignment, folder)
    made = workspace.find(folder)
    if notebook:
        from muslin.notebook import making

        typer.echo(
            f"The notebook is {paths.shown(making.write(assignment, folder, install or making.REQUIREMENT))}."
        )
    first = next(iter(made.table.tasks.values()))
    here = folder.resolve() == Path.cwd()
    say(f"{made.table.title}: {len(made.table.tasks)} functions, in {paths.shown(folder)}.")
    say("")
    steps = [
        *([] if here else [(f"cd {paths.shown(folder)}", "go there")]),
        ("muslin list", "what there is to do"),
        ("muslin watch", "check whenever you save a file"),
    ]
    for command, meaning in steps:
        say(f"  {command:24}  {meaning}")
    say("")
    say(f"Read README.md, then write the first function: {first.name}, at {made.place(first.name)}.")


Problems = Annotated[
    bool,
    typer.Option("--problems", help="Also say what fails in lines for editors: FILE:LINE: error: what."),
]


@app.command()
def check(tasks: Tasks = None, functions: Functions = None, problems: Problems = False) -> None:
    """Check functions on public cases and for what must always hold: what is wrong, the likely mistake, a next step."""
    from muslin.student import checking
    from muslin.student import progress as standing
    from muslin.student.problems import lines
    from muslin.student.workspace import find

    workspace = find(functions)
    from muslin.tasks.manifest import chosen_tasks

    chosen = chosen_tasks(tasks, workspace.table)
    names = chosen or list(workspace.table.tasks)
    width = max(map(len, names))
    reports = []
    with checking.Checker() as checker:
        for report in checker.check(workspace, names):
            reports.append(report)
            say("\n".join(checking.told(workspace, report, width)))
    if problems:
        for line in lines(workspace, reports):
            say_raw(line)
    green = sum(report.status == checking.GREEN for report in reports)
    say(checking.summary(workspace, reports))
    for news in _news(workspace):
        say(news)
    if workspace.started and green == len(names):
        following = standing.open_task(standing.standings(workspace), names[-1])
        if following is not None:
            say(f"Next: {following.task.name}, at {workspace.place(following.task.name)}")
    if green < len(names):
        raise typer.Exit(1)


@app.command("list")
def list_(folder: Here = None) -> None:
    """List the tasks: points, where each stands, what it is simulated with."""
    from muslin.student import progress as standing
    from muslin.student.workspace import find

    workspace = find(folder)
    say("\n".join(standing.listed(workspace)))
    following = standing.open_task(standing.standings(workspace))
    if following is not None:
        say(f"Next: {following.task.name}, at {workspace.place(following.task.name)}")
    for news in _news(workspace):
        say(news)


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
    say("\n".join(hints.shown(workspace, _one(workspace, task), level)))


@app.command()
def reset(
    task: Annotated[
        str | None, typer.Argument(metavar="TASK|FILE", help="A task, or a whole file.", show_default=False)
    ] = None,
    undo: Annotated[bool, typer.Option("--undo", help="Put back what the last reset took away.")] = False,
    functions: Functions = None,
) -> None:
    """Put a function, or a file, back to what was given (a copy is kept); with --undo, back to what you had."""
    from muslin.student import resetting
    from muslin.student.workspace import find

    if undo == (task is not None):
        raise typer.BadParameter("give a task or a file, or --undo alone")
    say(resetting.reset(find(functions), task) if task is not None else resetting.undo(find(functions)))


def _one(workspace: Workspace, task: str | None) -> str:
    """One task: the one named, or the next open one."""
    from muslin.student import progress as standing

    if task is None:
        following = standing.open_task(standing.standings(workspace))
        return following.task.name if following else next(iter(workspace.table.tasks))
    from muslin.tasks.manifest import chosen_tasks

    found = chosen_tasks([task], workspace.table)
    if len(found) > 1:
        raise MuslinError(f"{task} has several tasks.", f"Name one: {', '.join(found)}.")
    return found[0]


def _news(workspace: Workspace) -> list[str]:
    """What else to know: a newer version of the assignment is there, or nothing could be remembered."""
    news = [f"note: {why}" for why in workspace.forgotten]
    if workspace.started and workspace.version != workspace.table.version:
        news.append(
            f"{workspace.table.name} {workspace.table.version} is out, this workspace has {workspace.version}: "
            "muslin upgrade brings what is new; what you wrote stays."
        )
    return news


@app.command()
def run(
    scene: Annotated[
        str | None, typer.Argument(help="A scene; `muslin scenes` lists them. Default: the assignment's own.")
    ] = None,
    mesh: Cloth = None,
    scale: Scale = None,
    functions: Functions = None,
    steps: Annotated[int | None, typer.Option(help="Time steps.")] = None,
    setting: Setting = None,
    out: Annotated[Path | None, typer.Option(help="Where to write. Default: runs/<scene>.")] = None,
    film: Annotated[bool, typer.Option(help="Make a film, too.")] = True,
    quality: Annotated[Quality, typer.Option(help="How carefully to draw.")] = Quality.draft,
    size: Annotated[str, typer.Option(help="Width x height in pixels.")] = "960x540",
    strain: Annotated[bool, typer.Option(help="Colour a cloth by its stretch, with a legend.")] = False,
    stress: Annotated[
        bool, typer.Option(help="Colour a solid by its von Mises stress, with a legend.")
    ] = False,
    display: Annotated[
        str | None, typer.Option(help="A finer mesh to carry along and show: one of Muslin's, or a file.")
    ] = None,
    as_is: Annotated[
        bool, typer.Option("--as-is", help="Use your wrong functions, too, and see what they do.")
    ] = False,
    compare: Annotated[
        bool, typer.Option("--compare", help="Yours as it is, beside what it should be, in one film.")
    ] = False,
) -> None:
    """Simulate and film a scene with your own functions; Muslin's stand in where yours are not right yet.

    A cloth meets things by your velocity filter alone: --set contact=solve shows it with contacts that are solved for.
    """
    from muslin.student.workspace import find

    workspace = find(functions)  # the likeliest trouble first: the rest takes a second to import
    from muslin.cli.simulating import _settings, _size
    from muslin.simulation import scenes
    from muslin.student import running

    scene = running.scene(workspace, scene)
    settings = running.shown(workspace) | _settings(setting, mesh=mesh, scale=scale)
    chosen = scenes.get(scene, **settings)  # what is misspelt is said before anything else
    picture = _size(size)
    cast = running.cast(workspace, say, as_is or compare)
    folder = out or workspace.folder / "runs" / scene
    options: dict[str, Any] = {"steps": steps, "display": running.mesh(display), **settings}
    options["energy"] = workspace.table.energy or None
    with progress(f"simulating {scene}") as tick:
        came = running.simulate(workspace, cast, scene, folder, tick, on_notice=note, **options)
    if came.uses or not came.trouble:  # else nothing was called
        say("\n".join(running.told(cast, came.uses)))
    if came.trouble:
        say(f"It came apart: {came.trouble}")
    if came.last is not None:
        found = chosen.energies_told(came.last)
        say(f"{came.last.time:.2f} s in {came.last.step} steps. Energies [J]: {found}.")
    from muslin.present import pictures as show

    pictures: dict[str, Any] = {"quality": quality.value, "size": picture, "strain": strain, "stress": stress}
    if came.written:
        with progress("rendering") as tick:
            written = show.render_run(folder, None, "mp4" if film else "none", None, tick, **pictures)
        say(f"Wrote {show.shown(written)}.")
    if compare and came.written and not came.interrupted:
        with progress("simulating what it should be") as tick:
            reference = running.reference(scene, folder, tick, **options)
        with progress("rendering both") as tick:
            written = show.render_pair(
                folder, reference, folder / "compared", "mp4" if film else None, tick, **pictures
            )
        say(f"Yours beside what it should be: {show.shown(written)}.")
    if came.trouble and not came.written:
        raise typer.Exit(1)
    if came.interrupted:
        raise typer.Exit(INTERRUPTED)


@app.command()
def submit(
    folder: Here = None,
    out: Annotated[Path | None, typer.Option(help="Name of the zip.")] = None,
) -> None:
    """Pack the task files into a zip to hand in, read it back, and say where every task stands."""
    from muslin.student import checking, submitting
    from muslin.student.workspace import find

    workspace = find(folder)
    packed = submitting.pack(workspace, out)
    say(f"Packed {len(packed.files)} of {len(workspace.table.files)} files. Checking what is in the zip ...")
    reports = list(submitting.examined(workspace, packed))
    width = max(map(len, workspace.table.tasks))
    for report in reports:
        say("\n".join(checking.told(workspace, report, width, brief=True)))
    green = [workspace.table.tasks[r.task] for r in reports if r.status == checking.GREEN]
    points, total = (sum(t.points for t in tasks) for tasks in (green, workspace.table.tasks.values()))
    say(f"{len(green)} of {len(workspace.table.tasks)} tasks are green: "
               f"{points} of {total} points, if the hidden cases agree too.")  # fmt: skip
    for fault in packed.faults:
        say(f"Attention: {fault}.")
    say(f"Hand in {paths.shown(packed.path)}.")


@app.command()
def watch(
    folder: Here = None,
    scene: Annotated[
        str | None, typer.Option(help="What the key r runs. Default: the assignment's own scene.")
    ] = None,
    problems: Problems = False,
) -> None:
    """Check whenever you save a file. Keys: h hint, l list, n next, r run, q quit."""
    from muslin.student import watching
    from muslin.student.workspace import find

    watching.watch(find(folder), say, scene, say_raw if problems else None)


@app.command()
def upgrade(
    folder: Here = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would be done.")] = False,
) -> None:
    """Bring handout, docstrings and given code up to date; function bodies you wrote are never touched."""
    from muslin.student import upgrading
    from muslin.student.workspace import find

    done = upgrading.upgrade(find(folder), really=not dry_run)
    say("\n".join(upgrading.told(done, really=not dry_run)))


@app.command()
def handout(
    task: Annotated[
        str | None, typer.Argument(metavar="TASK", help="Where to open it. Default: its top.")
    ] = None,
    functions: Functions = None,
    no_open: Annotated[bool, typer.Option("--no-open", help="Only say where it is.")] = False,
) -> None:
    """Open the handout as a page in the browser, with its formulas drawn; at a task, if you name one."""
    import webbrowser

    from muslin.student.workspace import find

    workspace = find(functions)
    address = workspace.page(_one(workspace, task) if task else None)
    if not address:
        raise MuslinError(
            "There is no handout.html here.", "Read README.md, or bring the page back with: muslin upgrade"
        )
    say(address)
    if not no_open and not webbrowser.open(address):
        say("note: no browser could be opened here; open the address above.", err=True)


@app.command()
def explain(
    task: OneTask = None,
    case: Annotated[
        int | None, typer.Option(help="Which public case. Default: the simplest wrong one.")
    ] = None,
    functions: Functions = None,
) -> None:
    """Show one public case step by step: inputs, what lies on the way, your variables, yours and expected."""
    from muslin.student import explaining
    from muslin.student.worker import Crashed, Worker
    from muslin.student.workspace import find

    workspace = find(functions)
    name, line = _one(workspace, task), ""
    asked = workspace.folder, workspace.table.name, name, case
    with Worker() as worker:
        try:
            for line in worker.ask(explaining.steps, *asked, deadline=60):
                say(line)
        except Crashed:
            if not isinstance(line, explaining.Looking):  # else the student's code has long come to its end
                raise
    say(f"\nThe handout: {workspace.chapter(name)}")


@app.command()
def gradcheck(
    tasks: Annotated[list[str] | None, typer.Argument(help="Derivatives to check. Default: all.")] = None,
    functions: Functions = None,
    out: Annotated[
        Path | None, typer.Option(help="Folder for the pictures. Default: runs/gradcheck.")
    ] = None,
) -> None:
    """Compare derivatives with differences of every step size: a V-curve as a picture, and its slope."""
    from muslin.student import gradcheck as v_curves
    from muslin.student.worker import Worker
    from muslin.student.workspace import find

    workspace = find(functions)
    names = v_curves.chosen(tasks, workspace.table)
    folder = out or workspace.folder / "runs" / "gradcheck"
    wrong = False
    with Worker() as worker:
        for found in worker.ask(v_curves.curves, workspace.folder, workspace.table.name, names, deadline=60):
            if isinstance(found, tuple):
                name, why = found
                wrong |= bool(tasks)
                say(f"---- {name}: {why.splitlines()[0]}")
                continue
            wrong |= not found.right
            say("\n".join(v_curves.told(found)))
            say(f"     {paths.shown(v_curves.plot(found, folder / f'{found.task}.png'))}")
    if wrong:
        raise typer.Exit(1)
