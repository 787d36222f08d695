"""Each student's report and picture, made in one process of its own: should a drawing hang, only it is lost."""

from __future__ import annotations

import base64
import contextlib
import hashlib
import io
import json
import os
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.base.child import Child, python
from muslin.base.errors import MuslinError
from muslin.base.version import __version__
from muslin.classes.gradebook import Row
from muslin.classes.ledger import write
from muslin.grading.record import from_json
from muslin.grading.views.text import points

#: How long one report may take [s], the first with Taichi's start and compilation.
FIRST, EACH = 240.0, 60.0

#: Size of a picture on the contact sheet, and how many colours it has: small files, side by side.
SIZE, COLOURS = (240, 180), 64


@dataclass(frozen=True)
class Printed:
    """What was made for a row: a PNG for the contact sheet, or why there is none."""

    picture: bytes
    why: str


def make(folder: Path, rows: Sequence[Row], on_done: Callable[[int], None]) -> dict[str, Printed]:
    """Write `reports/KEY.html` and `pictures/KEY.png` of every row with a record; what is there already stays.

    Parameters
    ----------
    folder : Path
        Of the report.
    rows : sequence of Row
    on_done : callable
        Called with how many are done.

    Returns
    -------
    dict of Printed
        By key.
    """
    made: dict[str, Printed] = {}
    machine = _Machine()
    try:
        for done, row in enumerate((r for r in rows if r.record is not None), 1):
            made[row.key] = _printed(folder, row, machine)
            on_done(done)
    finally:
        machine.stop()
    return made


def _printed(folder: Path, row: Row, machine: _Machine) -> Printed:
    assert row.record is not None
    counts = row.as_it_counts()
    assert counts is not None
    work = {"record": counts.as_json(), "head": _head(row)}
    told = {**work, "record": counts.as_json(timing=False), "muslin": __version__}
    digest = hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
    report, picture = folder / "reports" / f"{row.key}.html", folder / "pictures" / f"{row.key}.png"
    note = folder / "pictures" / f"{row.key}.json"
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError):
        known = json.loads(note.read_bytes())
        if known["digest"] == digest and report.is_file():
            return Printed(picture.read_bytes() if picture.is_file() else b"", str(known["why"]))
    answer = machine.ask(work)
    drawn = base64.b64decode(answer["picture"])
    write(report, answer["report"].encode())
    if drawn:
        write(picture, drawn)
    else:
        picture.unlink(missing_ok=True)
    if not answer.get("again"):
        write(note, json.dumps({"digest": digest, "why": answer["why"]}).encode())
    return Printed(drawn, answer["why"])


def _head(row: Row) -> dict[str, Any]:
    """What was set by hand, for the head of the student's report."""
    if not row.overrides and not row.submission.late and not (row.late and row.late.said):
        return {}
    return {"counts": f"Counts: {points(row.counts or 0.0)} points.", "notes": row.notes()}


class _Machine:
    """The process that draws; started when it is needed, and again should it have been stopped."""

    def __init__(self) -> None:
        self._child: Child | None = None
        self._broken = 0

    def ask(self, work: dict[str, Any]) -> dict[str, Any]:
        """A report and a picture; without pictures, if they cannot be had in time."""
        if self._broken < 3:
            with contextlib.suppress(OSError, ValueError):  # none can be started; no answer that can be read
                return dict(json.loads(self._answer(json.dumps(work).encode() + b"\n")))
            self._broken += 1
            self.stop()
        return _made(work, draw=False) | {"why": "Drawing it took too long or failed.", "again": True}

    def _answer(self, question: bytes) -> bytes:
        limit = EACH if self._child else FIRST
        self._child = self._child or Child(python("muslin.classes.reports:main"))
        with self._child.limited(limit):  # it may hang before it has read everything
            return self._child.line() if self._child.say(question) else b""

    def stop(self) -> None:
        if self._child:
            self._child.close()
            self._child = None


def _made(work: dict[str, Any], draw: bool) -> dict[str, Any]:
    from muslin.grading import views

    record = from_json(work["record"])
    picture, why = b"", ""
    if draw:
        try:
            from muslin.grading.views import pictures

            picture = _small(pictures.draw(record, (2 * SIZE[0], 2 * SIZE[1]), "draft")[0])
        except MuslinError as error:
            why = str(error)
        except Exception as error:
            why = f"The renderer failed ({type(error).__name__})."
    page = views.render(record, "html", quality="draft" if picture else "none", **work["head"])
    return {"report": page, "picture": base64.b64encode(picture).decode(), "why": why}


def _small(png: bytes) -> bytes:
    """A picture at the size of the contact sheet, in few colours."""
    from PIL import Image

    with Image.open(io.BytesIO(png)) as image:
        small = image.convert("RGB").resize(SIZE, Image.Resampling.LANCZOS)
        stream = io.BytesIO()
        small.quantize(COLOURS).save(stream, format="PNG", optimize=True)
        return stream.getvalue()


def main() -> None:
    """Answer each line on standard input with a line on standard output."""
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing else gets between
    for line in sys.stdin.buffer:
        out.write(json.dumps(_made(json.loads(line), draw=True)).encode() + b"\n")
        out.flush()
