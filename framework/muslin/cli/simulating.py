"""Commands that simulate and show: simulate, scenes, render, export, demo, doctor."""

from __future__ import annotations

import contextlib
from enum import Enum
from pathlib import Path
from typing import Annotated

import typer

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.cli.app import (
    INTERRUPTED,
    Cloth,
    Functions,
    Out,
    Quality,
    Scale,
    Setting,
    app,
    print_verdicts,
)
from muslin.cli.console import note, progress, say, say_raw


class Road(str, Enum):
    """Roads to the Hessian."""

    closed = "closed"
    lecture = "lecture"


class Demo(str, Enum):
    """What can be shown off."""

    cloth = "cloth"
    cape = "cape"
    solids = "solids"


@app.command()
def simulate(
    scene: Annotated[str, typer.Argument(help="A scene; `muslin scenes` lists them.")],
    mesh: Cloth = None,
    scale: Scale = None,
    functions: Functions = None,
    steps: Annotated[int | None, typer.Option(help="Time steps.")] = None,
    setting: Setting = None,
    energy: Annotated[
        str | None,
        typer.Option(
            help="Of cloth linearised (the student's), area, or volumetric; of solids neo-hookean (the student's), "
            "corotated, st-venant-kirchhoff, or stable-neo-hookean."
        ),
    ] = None,
    hessian: Annotated[Road, typer.Option(help="Road to the Hessian of student functions.")] = Road.closed,
    display: Annotated[
        Path | None,
        typer.Option(help="A finer mesh to carry along and show, undeformed like the scene's own."),
    ] = None,
    out: Out = None,
    resume: Annotated[bool, typer.Option(help="Go on from the last checkpoint in --out.")] = False,
    arch: Annotated[str, typer.Option(help="Where element kernels run: cpu, cuda, vulkan or metal.")] = "cpu",
    precision: Annotated[str | None, typer.Option(help="Their numbers: f64 or f32.")] = None,
) -> None:
    """Simulate a scene and write a run: frames, energy log, checkpoints."""
    from muslin.base import runtime
    from muslin.simulation import simulating as simulation

    if notice := runtime.choose(arch, precision):
        note(notice)
    folder = out or Path("runs") / scene
    with progress(f"simulating {scene}") as tick:
        run = simulation.simulate(
            scene, functions=functions, steps=steps, mesh=mesh, energy=energy, hessian=hessian.value,
            display=display, out=folder, resume=resume, on_step=tick, on_notice=note,
            **_settings(setting, scale=scale),
        )  # fmt: skip
    last = run.energies[-1]
    if run.interrupted:
        say(
            f"Stopped at step {last.step} of {run.scene.steps}; {paths.shown(folder)} is usable. "
            f"Go on with: muslin simulate {scene} --out {paths.shown(folder)} --resume"
        )
        raise typer.Exit(INTERRUPTED)
    say(
        f"{run.scene.title}: {len(run.x)} vertices, {last.step} steps to t = {last.time:.3f} s. "
        f"Energies [J]: {run.scene.energies_told(last)}."
    )
    say(f"Run in {paths.shown(folder)}. Look at it with: muslin render {paths.shown(folder)}")


@app.command()
def scenes(
    scene: Annotated[
        str | None, typer.Argument(help="Say what its parameters are and mean. Default: list the scenes.")
    ] = None,
    markdown: Annotated[bool, typer.Option("--markdown", help="The tables of docs/scenes.md.")] = False,
) -> None:
    """List the scenes, or the parameters of one: value, meaning, unit."""
    from muslin.simulation import scenes as known
    from muslin.simulation.scenes import meanings

    if markdown:
        say_raw(meanings.tables())
        return
    if scene is not None:
        say("\n".join(meanings.lines(known.get(scene))))
        return
    from muslin.student.workspace import find

    names = known.SCENES
    with contextlib.suppress(MuslinError):  # in a workspace of solids those come first
        if find().scene in known.SOLIDS:
            names = known.SOLIDS + known.CLOTHS
    for name in names:
        say(f"{name:10} {known.get(name).title}")
    say("\nWhat can be set in one, and what it means: muslin scenes NAME")


@app.command()
def render(
    run: Annotated[Path, typer.Argument(help="A run, written by `muslin simulate`.")],
    out: Annotated[
        str | None,
        typer.Option(
            metavar="PATH",
            help="The film, fall.mp4, or its name without ending, or a folder. Default: RUN/<scene>.",
        ),
    ] = None,
    to: Annotated[
        str | None,
        typer.Option(help="Film: mp4, webp, gif, frames, or none. Default: as --out ends, or mp4."),
    ] = None,
    quality: Annotated[Quality, typer.Option(help="How carefully to draw.")] = Quality.good,
    size: Annotated[str, typer.Option(help="Width x height in pixels.")] = "1280x720",
    still: Annotated[float | None, typer.Option(help="Time of the still [s]. Default: the scene's.")] = None,
    strain: Annotated[bool, typer.Option(help="Colour a cloth by its stretch, with a legend.")] = False,
    stress: Annotated[
        bool, typer.Option(help="Colour a solid by its von Mises stress, with a legend.")
    ] = False,
    wireframe: Annotated[bool, typer.Option(help="Draw the triangles' edges.")] = False,
) -> None:
    """Render a run off-screen: a film, a still and a plot of the energies."""
    from muslin.present import pictures as show

    with progress("rendering") as tick:
        written = show.render_run(
            run, out, to, still, tick,
            size=_size(size), quality=quality.value, strain=strain, stress=stress, wireframe=wireframe,
        )  # fmt: skip
    say(f"Wrote {show.shown(written)}.")


@app.command()
def export(
    run: Annotated[Path, typer.Argument(help="A run, written by `muslin simulate`.")],
    to: Annotated[
        str | None, typer.Option(help="glb, usda, pvd, vtu, ply or obj. Default: as --out ends, or glb.")
    ] = None,
    out: Annotated[
        str | None,
        typer.Option(metavar="PATH", help="The file, or a folder. Default: RUN/<format>/<scene>."),
    ] = None,
) -> None:
    """Export a run for Blender, ParaView and other programs, with what it meets and the ground."""
    from muslin.present.exporting import export_run
    from muslin.present.pictures import shown

    written = export_run(run, to, out)
    say(
        f"Wrote {len(written)} file{'s' * (len(written) > 1)}: {shown(written[:3])}{', ...' * (len(written) > 3)}"
    )


@app.command()
def demo(
    what: Annotated[
        Demo,
        typer.Argument(
            help="cloth: draped, and every task checked, within a minute; cape: 11,000 vertices on a figure that walks "
            "for 8 s, some ten minutes; solids: a bear of jelly."
        ),
    ] = Demo.cloth,
    out: Annotated[Path, typer.Option(help="Folder for film, still and run.")] = Path("demo"),
    quality: Annotated[Quality, typer.Option(help="How carefully to draw.")] = Quality.good,
) -> None:
    """Drape a cloth over a sphere, film it, and check every task against the reference data; or film another."""
    out.mkdir(parents=True, exist_ok=True)  # refused now, and not when the first picture is written
    if what is Demo.cape:
        from muslin.present import demo_cape

        demo_cape.run(out, quality.value, progress, say)
        return
    if what is Demo.solids:
        from muslin.present import demo_solids

        demo_solids.run(out, quality.value, progress, say)
        return
    from muslin.present import demo as show_off

    show_off.run(out, quality.value, progress, say, print_verdicts)


@app.command()
def doctor() -> None:
    """Examine this machine: what Muslin needs, and what to do where it is missing."""
    from muslin import doctor as examiner

    if not examiner.report(examiner.examine(), lambda line, style: say(line, style=style)):
        raise typer.Exit(1)


def _settings(pairs: list[str] | None, **options: str | None) -> dict[str, str]:
    """Scene parameters of `--set` and of options of their own, where given."""
    settings = {name: value for name, value in options.items() if value is not None}
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


def _size(text: str) -> tuple[int, int]:
    try:
        width, height = (int(part) for part in text.lower().split("x"))
        if not (16 <= width <= 8192 and 16 <= height <= 8192):
            raise ValueError
    except ValueError:
        raise MuslinError(f"--size {text!r} is not a picture size.", "For example: --size 1280x720") from None
    return width, height
