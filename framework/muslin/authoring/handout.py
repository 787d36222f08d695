"""The handout, with its task table, signatures and pictures filled in."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from muslin.authoring.regions import read
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.tasks import Assignment, Task, Value

PICTURES = "pictures"


_COMMENT = re.compile(r"<!--(.*?)-->", re.DOTALL)


def handout(path: Path, table: Assignment, pictures: Mapping[str, bytes]) -> str:
    """The handout with its generated parts filled in."""
    text = read(path)
    explained = set()

    def fill(match: re.Match[str]) -> str:
        line = text.count("\n", 0, match.start()) + 1
        keyword, _, rest = match[1].strip().partition(":")
        rest = rest.strip()
        if keyword == "tasks":
            return _task_table(table)
        if keyword == "signature" and rest in table.tasks:
            explained.add(rest)
            return _signature(table.tasks[rest])
        if keyword == "picture" and "|" in rest:
            file, caption = (part.strip() for part in rest.split("|", 1))
            return f"![{caption}]({PICTURES}/{file})" if f"{PICTURES}/{file}" in pictures else ""
        if keyword == "note":
            return ""
        raise MuslinError(
            f"{paths.shown(path)}, line {line}: the marker {match[0]} is not understood.",
            "There are: tasks, signature: TASK, picture: FILE | caption, note: text.",
        )

    filled = _COMMENT.sub(fill, text)
    if missing := [name for name in table.tasks if name not in explained]:
        raise MuslinError(
            f"{paths.shown(path)} does not explain {', '.join(missing)}.",
            f"Give it a section with <!-- signature: {missing[0]} -->.",
        )
    filled = re.sub(r"\n{3,}", "\n\n", filled).strip("\n")
    return f"<!-- Written by `muslin release {table.name}`; edits made here are lost. -->\n\n{filled}\n"


def _task_table(table: Assignment) -> str:
    rows = [
        f"| {task.section} | [`{name}`](#{name.lower()}) | {task.title} | `{task.file}` | {task.points} |"
        for name, task in table.tasks.items()
    ]
    total = sum(task.points for task in table.tasks.values())
    head = ["| section | function | what it is | file | points |", "| --- | --- | --- | --- | ---: |"]
    return "\n".join([*head, *rows, f"| | | | **total** | **{total}** |"])


def _signature(task: Task) -> str:
    arguments = ", ".join(value.name for value in task.arguments)
    head = f"**`{task.name}({arguments})`** in `{task.file}`, {task.points} points"
    rows = ["| | shape | unit | meaning |", "| --- | --- | --- | --- |"]
    rows += [_row(f"`{value.name}`", value) for value in task.arguments]
    word = "returns" if len(task.results) == 1 else "returns, in this order,"
    for value in task.results:
        rows.append(_row(f"{word} `{value.name}`" if len(task.results) > 1 else f"*{word}*", value))
        word = "and"
    return "\n".join([head, "", *rows])


def _row(label: str, value: Value) -> str:
    if value.is_function:
        return f"| {label} | function | {value.unit} | {value.meaning} |"
    shape, is_int = value.shape, value.integer
    size = "×".join(map(str, shape)) + f" (`{value.kind}`)" if shape else "number"
    unit = value.unit.replace("^2", "²").replace("^3", "³")
    return f"| {label} | {'integer' if is_int else size} | {unit} | {value.meaning} |"
