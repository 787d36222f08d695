"""The examples of a handout, answered by a folder's functions."""

from __future__ import annotations

import contextlib
import doctest
import io
import re
from pathlib import Path
from typing import Any

_BLOCK = re.compile(r"^```pycon\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def answered(text: str, folder: Path) -> str:
    """A handout whose examples have the answers that they get from the functions in a folder.

    Parameters
    ----------
    text : str
        With examples for the Python prompt, in blocks of `pycon`.
    folder : Path
        The functions, `f` in the examples: `f = muslin.load(".")` there means this folder.
    """
    import muslin

    scope: dict[str, Any] = {"f": muslin.load(folder)}
    parser = doctest.DocTestParser()

    def block(match: re.Match[str]) -> str:
        lines = []
        for example in parser.get_examples(match[1]):
            said = _ran(example.source, scope)
            first, *more = example.source.rstrip("\n").split("\n")
            lines += [f">>> {first}", *(f"... {line}" if line else "..." for line in more)]
            lines += [line or "<BLANKLINE>" for line in said.rstrip("\n").split("\n")] if said else []
        return "```pycon\n" + "\n".join(lines) + "\n\n```"

    return _BLOCK.sub(block, text)


def _ran(source: str, scope: dict[str, Any]) -> str:
    """What a statement shows at the prompt."""
    if "muslin.load(" in source:
        return ""
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(source, "<handout>", "single"), scope)
    return re.sub(r"-0\.(?!\d)", " 0.", said.getvalue())  # to a handout's reader a negative zero is none
