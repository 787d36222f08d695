"""Pages of HTML from templates: every value is escaped, whoever wrote it.

A template is a file `*.html.j2` beside the module that fills it, and is named by its path in this package.
"""

from __future__ import annotations

import functools
import re
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from muslin.base.text import capped, one_line

_ROOT = Path(__file__).parent.parent

#: Code in a sentence: what stands between two backticks in one line.
_CODE = re.compile(r"`([^`\n]+)`")


@functools.cache
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(_ROOT),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"line": one_line, "capped": capped, "coded": coded}
    environment.globals |= {"verbatim": verbatim}
    return environment


def filled(template: str, **values: Any) -> str:
    """A template with its values.

    Parameters
    ----------
    template : str
        Its path in this package without `.html.j2`: "classes/page".
    **values
        Only what the package itself says is HTML (see `verbatim`) is taken as such. In a template the filters
        `line` and `capped` are those of `muslin.base.text`, and `coded` is that of this module, the last of a chain.
    """
    return _environment().get_template(f"{template}.html.j2").render(**values)


def verbatim(file: str) -> Markup:
    """A style sheet or script of this package, to stand in a page as it is."""
    return Markup((_ROOT / file).read_text(encoding="utf-8"))


def coded(text: str) -> Markup:
    """A sentence whose code, between backticks, is shown as code. Every piece is escaped, inside and outside.

    A backtick without another in its line stays what it is.
    """
    return Markup(filled("base/coded", pieces=_CODE.split(text)))  # every second one was between backticks
