"""The command line: `muslin COMMAND`. Each command is a thin face of one function elsewhere."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from muslin import __version__, paths
from muslin.errors import MuslinError

if TYPE_CHECKING:
    from muslin.tasks import Assignment

app = typer.Typer(
    help="Muslin: learn cloth animation by filling in the finite-element functions of a working simulator.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
reference_app = typer.Typer(help="Reference data: verify or build them.", no_args_is_help=True)
app.add_typer(reference_app, name="reference")

INTERRUPTED = 130

Functions = Annotated[
    Path | None,
    typer.Option(
        "--functions", help="Folder with the student functions to run. Default: Muslin's own element."
    ),
]
Setting = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Change a scene parameter; may be repeated."),
]
Out = Annotated[Path | None, typer.Option("--out", help="Where to write.")]


class Road(str, Enum):
    """Roads to the Hessian."""

    closed = "closed"
    lecture = "lecture"


class Quality(str, Enum):
    """Render qualities."""

    draft = "draft"
    good = "good"
    best = "best"


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


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"muslin {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Muslin's commands."""


@app.command()
def simulate(
    scene: Annotated[str, typer.Argument(help="A scene; `muslin scenes` lists them.")],
    mesh: Annotated[Path | None, typer.Option(help="Another undeformed cloth.")] = None,
    functions: Functions = None,
    steps: Annotated[int | None, typer.Option(help="Time steps.")] = None,
    setting: Setting = None,
    energy: Annotated[
        str, typer.Option(help="linearised (the student's), area, or volumetric.")
    ] = "linearised",
    hessian: Annotated[Road, typer.Option(help="Road to the Hessian of student functions.")] = Road.closed,
    display: Annotated[
        Path | None,
        typer.Option(help="A finer mesh to carry along and show, undeformed like the cloth."),
    ] = None,
    out: Out = None,
    resume: Annotated[bool, typer.Option(help="Go on from the last checkpoint in --out.")] = False,
) -> None:
    """Simulate a scene and write a run: frames, energy log, checkpoints."""
    from muslin import simulation

    folder = out or Path("runs") / scene
    with _progress(f"simulating {scene}") as tick:
        run = simulation.simulate(
            scene, functions=functions, steps=steps, mesh=mesh, energy=energy, hessian=hessian.value,
            display=display, out=folder, resume=resume, on_step=tick, **_settings(setting),
        )  # fmt: skip
    for notice in run.mesh.notices:
        typer.echo(f"note: {notice}", err=True)
    last = run.energies[-1]
    if run.interrupted:
        typer.echo(
            f"Stopped at step {last.step} of {run.scene.steps}; {paths.shown(folder)} is usable. "
            f"Go on with: muslin simulate {scene} --out {paths.shown(folder)} --resume"
        )
        raise typer.Exit(INTERRUPTED)
    typer.echo(
        f"{run.scene.title}: {len(run.x)} vertices, {last.step} steps to t = {last.time:.3f} s. "
        f"Energies [J]: kinetic {last.kinetic:.4g}, elastic {last.elastic:.4g}, gravity {last.gravity:.4g}."
    )
    typer.echo(f"Run in {paths.shown(folder)}. Look at it with: muslin render {paths.shown(folder)}")


@app.command()
def scenes() -> None:
    """List the scenes and their parameters."""
    from muslin import scenes as known

    for name in known.SCENES:
        scene = known.get(name)
        typer.echo(f"{name:10} {scene.title}")
        changed = ", ".join(f"{k}={_plain(v)}" for k, v in scene.parameters().items() if v is not None)
        typer.echo(f"           {changed}\n")


@app.command()
def render(
    run: Annotated[Path, typer.Argument(help="A run, written by `muslin simulate`.")],
    out: Annotated[
        Path | None,
        typer.Option(help="Path of the pictures without ending. Default: RUN/<scene>."),
    ] = None,
    to: Annotated[str, typer.Option(help="Film: mp4, webp, gif, frames, or none.")] = "mp4",
    quality: Annotated[Quality, typer.Option(help="How carefully to draw.")] = Quality.good,
    size: Annotated[str, typer.Option(help="Width x height in pixels.")] = "1280x720",
    still: Annotated[float | None, typer.Option(help="Time of the still [s]. Default: the scene's.")] = None,
    strain: Annotated[bool, typer.Option(help="Colour the cloth by its stretch, with a legend.")] = False,
    wireframe: Annotated[bool, typer.Option(help="Draw the triangles' edges.")] = False,
) -> None:
    """Render a run off-screen: a film, a still and a plot of the energies."""
    from muslin import show

    with _progress("rendering") as tick:
        written = show.render_run(
            run, out, None if to == "none" else to, still, tick,
            size=_size(size), quality=quality.value, strain=strain, wireframe=wireframe,
        )  # fmt: skip
    typer.echo(f"Wrote {show.shown(written)}.")


@app.command()
def export(
    run: Annotated[Path, typer.Argument(help="A run, written by `muslin simulate`.")],
    to: Annotated[str, typer.Option(help="glb, usda, pvd, vtu, ply or obj.")] = "glb",
    out: Annotated[
        Path | None, typer.Option(help="Path without ending. Default: RUN/<format>/<scene>.")
    ] = None,
) -> None:
    """Export a run for Blender, ParaView and other programs."""
    from muslin import show

    written = show.export_run(run, to, out)
    typer.echo(
        f"Wrote {len(written)} file{'s' * (len(written) > 1)}: {show.shown(written[:3])}{', ...' * (len(written) > 3)}"
    )


@app.command()
def check(
    tasks: Annotated[
        list[str] | None, typer.Argument(help="Tasks, sections (S7) or files to check. Default: all.")
    ] = None,
    functions: Annotated[Path, typer.Option("--functions", help="Folder with the task files.")] = Path(),
) -> None:
    """Check student functions against the public reference data."""
    from muslin import reference
    from muslin.tasks import load

    loaded = load(functions)
    verdicts = reference.check(loaded, _chosen_tasks(tasks, loaded.assignment) or None)
    _print_verdicts(verdicts)
    if not all(verdict.ok for verdict in verdicts):
        raise typer.Exit(1)


@app.command()
def grade(
    submission: Annotated[Path, typer.Argument(help="A folder, zip or tar with the task files.")],
    assignment: Annotated[str, typer.Option(help="The assignment it answers.")] = "cloth",
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
        typer.Option("--format", help="Report format; with --out it may be repeated."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder for the reports. Without --format: the record and the HTML report."),
    ] = None,
    deadline: Annotated[
        float | None, typer.Option(help="Seconds a task may take. Default: the assignment's.", min=0.5)
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
    with _progress("grading") as tick:
        record = graded(
            submission, assignment, hidden=hidden, seed=seed, safety=safety.value, deadline=deadline,
            fresh=fresh, on_progress=lambda done, total, _: tick(done, total),
        )  # fmt: skip
    chosen = [format.value for format in formats or ()]
    if out is None:
        name = chosen[0] if chosen else "terminal"
        options = {"colour": sys.stdout.isatty()} if name == "terminal" else {}
        typer.echo(views.render(record, name, **options).rstrip("\n"))
        return
    typer.echo(views.render(record, "terminal", colour=sys.stdout.isatty()))
    written = [views.write(record, name, out) for name in chosen or ("json", "html")]
    typer.echo(f"Wrote {', '.join(paths.shown(path) for path in written)}.")


@app.command()
def demo(
    out: Annotated[Path, typer.Option(help="Folder for film, still and run.")] = Path("demo"),
    quality: Annotated[Quality, typer.Option(help="How carefully to draw.")] = Quality.good,
) -> None:
    """Drape a cloth over a sphere, film it, and check every task against the reference data."""
    from muslin import demo as show_off

    show_off.run(out, quality.value, _progress, typer.echo, _print_verdicts)


@app.command()
def doctor() -> None:
    """Examine this machine: what Muslin needs, and what to do where it is missing."""
    from muslin import doctor as examiner

    if not examiner.report(examiner.examine()):
        raise typer.Exit(1)


@app.command()
def release(
    assignment: Annotated[str, typer.Argument(help="An assignment, e.g. cloth.")],
    check: Annotated[
        bool, typer.Option("--check", help="Only say whether the released files are in step.")
    ] = False,
    out: Out = None,
) -> None:
    """Make the students' files from the solution: stubs, handout, task table."""
    from muslin.authoring import release as releasing

    if check:
        findings = releasing.out_of_step(assignment)
        for finding in findings:
            typer.echo(finding)
        if findings:
            raise typer.Exit(1)
        typer.echo(f"{paths.shown(paths.assignment(assignment))} is in step with its solution.")
    else:
        written = releasing.release(assignment, out)
        typer.echo(f"Wrote {len(written)} files to {paths.shown(out or paths.assignment(assignment))}.")


@reference_app.command("verify")
def reference_verify(
    assignment: Annotated[str, typer.Argument(help="An assignment.")] = "cloth",
    folder: Annotated[Path | None, typer.Option(help="Data to verify. Default: the public ones.")] = None,
) -> None:
    """Make the reference data again, from the energy alone, and compare."""
    from muslin.authoring import reference_data

    report = reference_data.verify(assignment, folder)
    for problem in report.problems:
        typer.echo(problem)
    if not report.ok:
        raise typer.Exit(1)
    typer.echo("The reference data are what their seed and the energy say.")


@reference_app.command("build")
def reference_build(
    assignment: Annotated[str, typer.Argument(help="An assignment.")] = "cloth",
    out: Out = None,
    seed: Annotated[str | None, typer.Option(help="Seed of the random cases.")] = None,
    cases: Annotated[int | None, typer.Option(help="Cases per task.", min=1)] = None,
    hidden: Annotated[
        bool,
        typer.Option("--hidden", help="Hidden data for grading: --seed is your secret, --out their folder."),
    ] = False,
) -> None:
    """Make reference data from the energy alone, by high-precision differentiation."""
    from muslin.authoring import reference_data

    options: dict[str, Any] = {"hidden": hidden}
    if seed is not None:
        options["seed"] = int(seed) if seed.isdigit() and not hidden else seed
    if cases is not None:
        options["cases"] = cases
    folder = reference_data.build(assignment, out, **options)
    typer.echo(f"Wrote {paths.shown(folder)}.")
    if hidden:
        typer.echo(
            "Only you can read it. Keep it out of what students get, and grade with: "
            f"muslin grade SUBMISSION --hidden {paths.shown(folder)}"
        )


# Helpers ---------------------------------------------------------------------------------------------------


def _settings(pairs: list[str] | None) -> dict[str, str]:
    settings = {}
    for pair in pairs or ():
        key, equals, value = pair.partition("=")
        if not equals or not key.strip():
            raise MuslinError(f"--set {pair!r} is not KEY=VALUE.", "For example: --set gravity=0,-9.81,0")
        if key.strip() == "steps":
            raise MuslinError("Set the number of steps with --steps.")
        if key.strip() == "mesh":
            raise MuslinError("Set the mesh with --mesh.")
        settings[key.strip()] = value.strip()
    return settings


def _chosen_tasks(words: list[str] | None, assignment: Assignment) -> list[str]:
    """Tasks meant by words: each a task, a section of the handout (S7), or a file."""
    chosen: list[str] = []
    for word in words or ():
        file = Path(word).name
        found = [t.name for t in assignment.tasks.values() if word in (t.name, t.section) or file == t.file]
        if not found:
            import difflib

            near = difflib.get_close_matches(
                word.lower(), [name.lower() for name in assignment.tasks], 1, 0.5
            )
            meant = next((name for name in assignment.tasks if name.lower() in near), None)
            hint = f"Did you mean {meant}?" if meant else f"There is: {', '.join(assignment.tasks)}."
            raise MuslinError(f"There is no task {word!r}.", hint)
        chosen += [name for name in found if name not in chosen]
    return chosen


def _size(text: str) -> tuple[int, int]:
    try:
        width, height = (int(part) for part in text.lower().split("x"))
        if not (16 <= width <= 8192 and 16 <= height <= 8192):
            raise ValueError
    except ValueError:
        raise MuslinError(f"--size {text!r} is not a picture size.", "For example: --size 1280x720") from None
    return width, height


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return ",".join(f"{v:g}" for v in value)
    return f"{value:.6g}" if isinstance(value, float) else str(value)


@contextmanager
def _progress(title: str) -> Iterator[Callable[[int, int], None]]:
    """Progress bar with time left, on a terminal; now and then a line elsewhere."""
    if sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import (
            BarColumn,
            MofNCompleteColumn,
            Progress,
            TextColumn,
            TimeElapsedColumn,
            TimeRemainingColumn,
        )

        columns = (
            TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(),
            TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn(),
        )  # fmt: skip
        with Progress(*columns, console=Console(stderr=True)) as bar:
            task = bar.add_task(title, total=None)
            yield lambda done, total: bar.update(task, completed=done, total=total)
        return
    began = said = time.monotonic()

    def line(done: int, total: int) -> None:
        nonlocal said
        now = time.monotonic()
        if now - said > 5:
            said = now
            left = (now - began) / done * (total - done)
            print(f"{title}: {done}/{total}, {left:.0f} s left", file=sys.stderr, flush=True)

    yield line


def _print_verdicts(verdicts: list[Any]) -> None:
    width = max(len(verdict.task) for verdict in verdicts)
    for verdict in verdicts:
        first, *more = verdict.message.splitlines()
        typer.echo(f"  {'ok  ' if verdict.ok else 'FAIL'} {verdict.task:{width}}  {first}")
        for line in more:
            typer.echo(f"         {line}")
    typer.echo(f"{sum(v.ok for v in verdicts)} of {len(verdicts)} tasks agree with the reference data.")


def main() -> None:
    """Run the command line: what goes wrong becomes one message and a non-zero exit."""
    try:
        app()
    except MuslinError as error:
        print(f"muslin: {error}", file=sys.stderr)
        sys.exit(1)
    except KeyboardInterrupt:
        print("muslin: stopped.", file=sys.stderr)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        os._exit(1)  # the reader of our output has gone; nothing is left to say
    except Exception as error:
        if os.environ.get("MUSLIN_DEBUG"):
            raise
        print(
            f"muslin: an error in Muslin itself, not in your files: {type(error).__name__}: {error}. "
            "Set MUSLIN_DEBUG=1 to see where, and please report it.",
            file=sys.stderr,
        )
        sys.exit(70)


if __name__ == "__main__":
    main()
