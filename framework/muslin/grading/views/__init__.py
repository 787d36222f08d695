"""Views of a record: every format a grading can be handed on in.

    views.render(record, "gradescope")              # the text of a results.json
    views.write(record, "html", "out")              # out/report.html

| file | what it makes |
|---|---|
| `terminal`    | text for people, in colour if asked |
| `record_json` | the record itself |
| `gradescope`, `exercism`, `classroom50`, `junit` | what these platforms read |
| `grades_csv`  | a row for the grade book |
| `html_report` | one page, `report.html.j2`: `pictures` and `energy_plot` draw for it, `report.css` is its look |
| `story`       | the words all of them share |
| `text`        | what makes hostile text harmless |

A view is a function of the record and nothing else. Text in a record may come from a submission, so every view
escapes all of it. Formats that have one are described by a JSON schema: `schema("gradescope")`.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

from muslin.base import writing
from muslin.base.errors import MuslinError
from muslin.grading.record import Record
from muslin.grading.views import (
    classroom50,
    exercism,
    grades_csv,
    gradescope,
    html_report,
    junit,
    record_json,
    terminal,
)

#: Format -> (function that makes it, name of its file).
FORMATS: dict[str, tuple[Callable[..., str], str]] = {
    "terminal": (terminal.render, "report.txt"),
    "json": (record_json.render, "record.json"),
    "gradescope": (gradescope.render, "results.json"),
    "exercism": (exercism.render, "results.json"),
    "classroom50": (classroom50.render, "result.json"),
    "junit": (junit.render, "junit.xml"),
    "csv": (grades_csv.render, "grades.csv"),
    "html": (html_report.render, "report.html"),
}

SCHEMAS = ("record", "gradescope", "exercism", "classroom50")

__all__ = ["FORMATS", "SCHEMAS", "render", "schema", "write"]


def render(record: Record, format: str, **options: Any) -> str:
    """The record in a format.

    Parameters
    ----------
    record : Record
    format : str
        One of `FORMATS`.
    **options
        Of that format's function, such as `colour` of the terminal or `context` of Classroom 50.

    Raises
    ------
    MuslinError
        If there is no such format.
    """
    if format not in FORMATS:
        raise MuslinError(f"There is no report format {format!r}.", f"There is: {', '.join(FORMATS)}.")
    return FORMATS[format][0](record, **options)


def write(record: Record, format: str, folder: Path | str, **options: Any) -> Path:
    """Write the record in a format into a folder, which is made if need be; returns the file.

    Raises
    ------
    MuslinError
        If there is no such format, or the file cannot be written.
    """
    text = render(record, format, **options)
    path = Path(folder) / FORMATS[format][1]
    writing.write(path, text.encode())
    return path


def schema(name: str) -> dict[str, Any]:
    """JSON schema (draft 2020-12) of a format: one of `SCHEMAS`.

    Raises
    ------
    MuslinError
        If there is none of that name.
    """
    if name not in SCHEMAS:
        raise MuslinError(f"There is no schema {name!r}.", f"There is: {', '.join(SCHEMAS)}.")
    text = (resources.files("muslin.grading") / "schemas" / f"{name}.json").read_text("utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded
