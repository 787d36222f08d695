"""The `muslin` command itself: what all commands share, and how what goes wrong is told."""

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

from muslin import __version__
from muslin.errors import MuslinError

if TYPE_CHECKING:
    from muslin.tasks import Assignment

# The threads of NumPy's BLAS have nothing to do here, and spin: a fifth of a second of CPU time in every command.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

app = typer.Typer(
    help="Muslin: learn cloth animation by filling in the finite-element functions of a working simulator.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

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


class Quality(str, Enum):
    """Render qualities."""

    draft = "draft"
    good = "good"
    best = "best"


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


@contextmanager
def progress(title: str) -> Iterator[Callable[[int, int], None]]:
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


def chosen_tasks(words: list[str] | None, assignment: Assignment) -> list[str]:
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


def print_verdicts(verdicts: list[Any]) -> None:
    """A line for each verdict, more where something is wrong."""
    width = max(len(verdict.task) for verdict in verdicts)
    for verdict in verdicts:
        first, *more = verdict.message.split("\n")
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
