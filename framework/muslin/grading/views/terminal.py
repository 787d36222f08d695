"""For the terminal: plain text, in colour where a flag asks for it."""

from __future__ import annotations

import re

from muslin.grading.record import ERROR, FAILED, NOT_IMPLEMENTED, PASSED, SKIPPED, Record, TaskResult
from muslin.grading.views import story
from muslin.grading.views.text import capped, one_line, points

_COLOURS = {PASSED: "32", FAILED: "31", ERROR: "31", NOT_IMPLEMENTED: "36", SKIPPED: "2"}

#: How a line of a log gives orders to a CI system (GitHub's `::error::` and `##[error]`, Azure's `##vso[...]`).
_COMMAND = re.compile(r"^\s*::|##(?=\w*\[)", re.MULTILINE)
_WIDTH = max(map(len, story.WORDS.values()))


def render(record: Record, colour: bool = False) -> str:
    """The record as text.

    Parameters
    ----------
    record : Record
    colour : bool
        Use ANSI colours; what came from the submission never brings its own.
    """

    def paint(text: str, code: str) -> str:
        return f"\x1b[{code}m{text}\x1b[0m" if colour else text

    def status(word: str, width: int = _WIDTH) -> str:
        return paint(f"{story.WORDS[word]:{width}}", _COLOURS[word])

    widest = max((len(points(task.max_score)) for task in record.tasks), default=1)
    name_width = max((len(one_line(task.name)) for task in record.tasks), default=1)
    lines = [
        paint(one_line(record.assignment.get("title", "")), "1"),
        one_line(record.submission.name),
        "",
        f"  {paint(f'{points(record.score)} of {points(record.max_score)} points', '1')}  {_bar(record)}",
        "",
    ]
    for number, task in story.numbered(record):
        score = f"{points(task.score):>{widest + 3}} / {points(task.max_score):{widest}}"
        name = f"{one_line(task.name):{name_width}}"
        lines.append(
            f"  {number:>4}  {status(task.status)}  {score}  {name}  {one_line(task.title)}".rstrip()
        )
        lines += _details(task)
    lines += ["", f"  Simulation: {status(record.simulation.status, 0)}"]
    lines += _indented(story.simulation_told(record), 4 * story.MESSAGE)
    lines.append("")
    lines += [f"  {name:10}  {one_line(value, 500)}" for name, value in story.circumstances(record)]
    return (
        _COMMAND.sub(lambda match: match[0].replace(":", r"\x3a").replace("#", r"\x23"), "\n".join(lines))
        + "\n"
    )


def _details(task: TaskResult) -> list[str]:
    lines = []
    if task.status in (FAILED, ERROR):
        lines += _indented(story.task_told(task), 4 * story.MESSAGE)
    if task.output:
        lines += _indented("Your code printed:", 100)
        lines += _indented(story.printed(task, story.OUTPUT), 2 * story.OUTPUT)
    return [*lines, ""] if lines else []


def _bar(record: Record, width: int = 30) -> str:
    done = int(width * record.score / record.max_score) if record.max_score > 0 else 0
    return "[" + "#" * done + "." * (width - done) + "]"


def _indented(text: str, limit: int, margin: str = "          ") -> list[str]:
    return [f"{margin}{line}".rstrip() for line in capped(text, limit).split("\n")]
