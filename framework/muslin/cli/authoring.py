"""Commands of those who write assignments and have them graded: new, lint, release, pack, reference."""

from __future__ import annotations

from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.cli.app import Group, Out, app
from muslin.cli.console import say

new_app = typer.Typer(
    cls=Group, help="Begin a new assignment or a new task, that works at once.", no_args_is_help=True
)
app.add_typer(new_app, name="new")
reference_app = typer.Typer(cls=Group, help="Reference data: verify or build them.", no_args_is_help=True)
app.add_typer(reference_app, name="reference")


@new_app.command("assignment")
def new_assignment(
    name: Annotated[str, typer.Argument(help="Its name: small letters, digits and -.")],
    task: Annotated[str, typer.Option(help="Name of its first task.")] = "example",
) -> None:
    """Write a new assignment with one task, release it and make its reference data."""
    from muslin.authoring import scaffold

    _begun(name, scaffold.new_assignment(name, task))


@new_app.command("task")
def new_task(
    name: Annotated[str, typer.Argument(help="Name of the function.")],
    assignment: Annotated[
        str | None,
        typer.Option(help="The assignment it belongs to. Default: cloth, or the only one of your own."),
    ] = None,
    file: Annotated[str | None, typer.Option(help="The file it goes to. Default: one of its own.")] = None,
    section: Annotated[
        str | None, typer.Option(help="Its section of the handout. Default: a new one.")
    ] = None,
) -> None:
    """Add a task to an assignment, release it and make its reference data."""
    from muslin.authoring import scaffold

    assignment = assignment or paths.usual()
    _begun(assignment, scaffold.new_task(name, assignment, file, section))


def _begun(assignment: str, written: list[Path]) -> None:
    for path in written:
        say(f"Wrote {paths.shown(path)}.")
    say(f"It works already. What is still to be written: muslin lint {assignment}")


@app.command()
def lint(
    assignment: Annotated[str | None, typer.Argument(help="An assignment. Default: all.")] = None,
    thorough: Annotated[
        bool,
        typer.Option(
            "--thorough",
            help="Also make the reference run again, hold the laws, try every variant of the suite.",
        ),
    ] = False,
) -> None:
    """Look an assignment over: what is missing or wrong, one line each."""
    from muslin.authoring import lint as linting

    every = paths.assignments("solutions")
    findings = []
    for name in [assignment] if assignment else every:
        found = linting.lint(name, thorough)
        for finding in found:
            say(str(finding))
        if not found:
            say(f"{name}: nothing to fix.")
        findings += found
    if findings:
        say(f"{len(findings)} to fix.")
    if findings or not (assignment or every):
        raise typer.Exit(1)


@app.command()
def release(
    assignment: Annotated[str, typer.Argument(help="An assignment, e.g. cloth.")],
    check: Annotated[
        bool, typer.Option("--check", help="Only say whether the released files are in step.")
    ] = False,
    variant: Annotated[
        str | None, typer.Option(help="Write a term's own variant of the assignment, of this name.")
    ] = None,
    seed: Annotated[
        str | None,
        typer.Option(help="Words that a variant is drawn from: your secret."),
    ] = None,
    pick: Annotated[
        list[str] | None,
        typer.Option(
            help="An energy, parameters or a convention of a variant, instead of those drawn; repeat it."
        ),
    ] = None,
    per_student: Annotated[
        bool, typer.Option("--per-student", help="Give each student constants of their own in a variant.")
    ] = False,
    out: Out = None,
) -> None:
    """Make the students' files from the solution: stubs, handout, task table.

    With --variant and --seed, first make the solution of an assignment of your own: another energy of the stretches
    (linearised, St. Venant-Kirchhoff, Green's strains with the area, Neo-Hooke), other parameters (mu and lam, E and
    nu, mu and kappa, halves), other conventions (rows or columns, signs of the normals, nominal stress, V transposed,
    order of results, thickness inside). Of these at least so many that the published solution gets at most half of
    the points. With --per-student everybody's energy has two constants of their own, drawn from their login or number.
    """
    from muslin.authoring import release as releasing

    if variant is not None:
        if check or out is not None:
            raise MuslinError("A variant is written to a folder of its own.", "Leave --check and --out away.")
        _write_variant(assignment, variant, seed or "", pick or [], per_student)
    elif seed is not None or pick or per_student:
        raise MuslinError("--seed, --pick and --per-student belong to a variant.", "Add --variant NAME.")
    elif check:
        findings = releasing.out_of_step(assignment)
        for finding in findings:
            say(finding)
        if findings:
            raise typer.Exit(1)
        say(f"{paths.shown(paths.assignment(assignment))} is in step with its solution.")
    else:
        written = releasing.release(assignment, out)
        say(f"Wrote {len(written)} files to {paths.shown(out or paths.assignment(assignment))}.")
        for path in releasing.left_over(assignment) if out is None else ():
            say(f"{paths.shown(path)} is left over: nothing in the solution leads to it. Delete it.")


def _write_variant(assignment: str, name: str, seed: str, pick: list[str], per_student: bool) -> None:
    from muslin.authoring import variants

    tables = variants.Tables(assignment)
    choice = variants.picked(tables, pick) if pick else None
    for line in variants.write(assignment, name, seed, choice, per_student=per_student):
        say(line)
    kept = tables.kept(variants.chosen(name) or variants.draw(tables, seed))
    say(f"The published solution of {assignment} still solves tasks of {kept} points in it.")
    say(f"Now: muslin pack students --assignment {name}")


class Platform(str, Enum):
    """What there are packs for."""

    gradescope = "gradescope"
    classroom50 = "classroom50"
    actions = "actions"
    students = "students"


@app.command()
def pack(
    platform: Annotated[
        Platform, typer.Argument(help="Where it will be graded; or `students`, for those who work on it.")
    ],
    assignment: Annotated[str, typer.Option(help="An assignment.")] = "cloth",
    hidden: Annotated[
        Path | None,
        typer.Option(help="Hidden reference data, from `muslin reference build --hidden`; Gradescope only."),
    ] = None,
    out: Out = None,
) -> None:
    """Write what a platform needs to grade an assignment, or what students need to work on it, with its README."""
    from muslin.packing import packs

    written = packs.pack(platform.value, assignment, hidden, out)
    for path in written:
        say(f"Wrote {paths.shown(path)}.")
    if hidden:
        say("It holds your hidden data: give it to nobody but the platform.")


@reference_app.command("verify")
def reference_verify(
    assignment: Annotated[str, typer.Argument(help="An assignment.")] = "cloth",
    folder: Annotated[Path | None, typer.Option(help="Data to verify. Default: the public ones.")] = None,
) -> None:
    """Make the reference data again, from the energy alone, and compare."""
    from muslin.authoring import reference_data

    report = reference_data.verify(assignment, folder)
    for problem in report.problems:
        say(problem)
    if not report.ok:
        raise typer.Exit(1)
    say("The reference data are what their seed and the energy say.")


@reference_app.command("slips")
def reference_slips(
    assignment: Annotated[str, typer.Argument(help="An assignment.")] = "cloth",
    tasks: Annotated[list[str] | None, typer.Option("--task", help="A task. Default: all.")] = None,
) -> None:
    """Make again what slips in right formulas make of the public cases; some minutes for all tasks."""
    from muslin.authoring import mutations

    for path in mutations.build(assignment, tasks):
        say(f"Wrote {paths.shown(path)}.")


@reference_app.command("mistakes")
def reference_mistakes(
    assignment: Annotated[str, typer.Argument(help="An assignment.")] = "cloth",
    tasks: Annotated[list[str] | None, typer.Option("--task", help="A task. Default: all.")] = None,
) -> None:
    """Make again what known mistakes make of the public cases, and what explain and gradcheck ask for; a minute."""
    from muslin.authoring import mistakes

    for written in mistakes.build(assignment, tasks or ()):
        say(f"Wrote {written}.")


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
    from muslin.authoring import mutations, reference_data

    options: dict[str, Any] = {"hidden": hidden}
    if seed is not None:
        options["seed"] = int(seed) if seed.isdigit() and not hidden else seed
    if cases is not None:
        options["cases"] = cases
    folder = reference_data.build(assignment, out, **options)
    say(f"Wrote {paths.shown(folder)}.")
    if out is None and not hidden:
        say(f"Now make again what mistakes make of them: muslin reference mistakes {assignment}")
        if mutations.written_down(assignment):
            say(f"and what slips make of them: muslin reference slips {assignment}")
    if hidden:
        say(
            "Only you can read it. Keep it out of what students get, and grade with: "
            f"muslin grade SUBMISSION --hidden {paths.shown(folder)}"
        )
