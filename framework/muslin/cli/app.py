"""The `muslin` command itself: what all commands share, and how what goes wrong is told."""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command_name

from muslin.base.errors import MuslinError, no_folder, of_system
from muslin.base.text import visible
from muslin.base.version import __version__
from muslin.cli import console
from muslin.cli.console import say

# The threads of NumPy's BLAS have nothing to do here, and spin: a fifth of a second of CPU time in every command.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


class Group(TyperGroup):
    """Commands, each with the whole of its first sentence."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write the list of commands, broken between words."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        with formatter.section("Commands"):
            formatter.write_dl(
                [(n, c.get_short_help_str(limit=1000)) for n, c in commands if c and not c.hidden]
            )


app = typer.Typer(
    cls=Group,
    help="Muslin: learn the animation of cloth and solids by filling in the finite element functions of a working "
    "simulator.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)

INTERRUPTED = 130

#: Click's own exception, which typer does not name.
_MISUSE: Any = typer.BadParameter.__mro__[2]

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
Cloth = Annotated[
    str | None,
    typer.Option(
        "--mesh", help="Another undeformed cloth or solid: a file, or one of Muslin's meshes by its name."
    ),
]
Scale = Annotated[
    str | None,
    typer.Option(
        "--scale", metavar="FACTOR|fit",
        help="Multiply the mesh's coordinates: 0.001 from millimetres; fit: to the size the scene is made for.",
    ),
]  # fmt: skip
Out = Annotated[Path | None, typer.Option("--out", help="Where to write.")]


class Quality(str, Enum):
    """Render qualities."""

    draft = "draft"
    good = "good"
    best = "best"


def _version(wanted: bool) -> None:
    if wanted:
        say(f"muslin {__version__}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """Muslin's commands."""


def print_verdicts(verdicts: list[Any]) -> None:
    """A line for each verdict, more where something is wrong."""
    width = max(len(verdict.task) for verdict in verdicts)
    for verdict in verdicts:
        first, *more = verdict.message.split("\n")
        say(f"  {'ok  ' if verdict.ok else 'FAIL'} {verdict.task:{width}}  {first}")
        for line in more:
            say(f"         {line}")
    say(f"{sum(v.ok for v in verdicts)} of {len(verdicts)} tasks agree with the reference data.")


@contextlib.contextmanager
def _alone(words: list[str]) -> Iterator[None]:
    """Leave the command line nothing but the command that is asked for, if it is one: to read them all takes time."""
    everything = app.registered_commands, app.registered_groups
    commands, groups = everything
    asked = [command for command in commands if [_name(command)] == words]
    inside = [group for group in groups if [group.name] == words]
    if len(asked) + len(inside) == 1:
        app.registered_commands, app.registered_groups = asked, inside
    try:
        yield
    finally:
        app.registered_commands, app.registered_groups = everything


def _name(command: Any) -> str:
    return command.name or get_command_name(command.callback.__name__)


def main() -> None:
    """Run the command line: what goes wrong becomes one message and a non-zero exit."""
    console.prepare()
    try:
        with _alone(sys.argv[1:2]):
            code = app(standalone_mode=False)
        if sys.stdout is not None:
            sys.stdout.flush()
    except MuslinError as error:
        code = _told(str(error), 1)
    except (KeyboardInterrupt, typer.Abort):
        code = _told("stopped.", INTERRUPTED)
    except BrokenPipeError:
        os._exit(1)  # the reader of our output has gone; nothing is left to say
    except _MISUSE as error:
        code = _misused(error)
    except OSError as error:
        if os.environ.get("MUSLIN_DEBUG"):
            raise
        code = _told(str(of_system(error)), 1)
    except Exception as error:
        if os.environ.get("MUSLIN_DEBUG"):
            raise
        told = (
            f"an error in Muslin itself, not in your files: {type(error).__name__}: {visible(str(error))}. "
            "Set MUSLIN_DEBUG=1 to see where, and please report it."
        )
        gone = no_folder()  # Python 3.13 then imports no library: SystemError
        code = _told(told, 70) if gone is None else _told(str(gone), 1)
    if code:
        sys.exit(code)


def _told(what: str, code: int) -> int:
    """Say what went wrong, even where standard output or standard error cannot be written; gives the exit code."""
    for stream in (sys.stdout, sys.stderr):
        try:
            if stream is not None:
                stream.flush()
        except OSError:  # full or closed: what it still holds would be tried again at exit
            os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    with contextlib.suppress(OSError):
        say(f"muslin: {what}", err=True)
    return code


def _misused(error: Any) -> int:
    """Say how a command is called that was called otherwise."""
    words = io.StringIO()
    error.show(file=words)
    with contextlib.suppress(OSError):
        say(visible(words.getvalue().rstrip("\n")), err=True)
    return int(error.exit_code)
