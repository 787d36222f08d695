"""The misconception suite: one-mistake wrong variants of every task's function, and right ones written otherwise.

`<assignment>/<task>.py` holds blocks, each a whole function with the task's own name, introduced by a line

    # wrong: <name> | cause: <what the diagnosis calls it>
    # right: <name>

Three more wrong variants of every task are generated from the manifest: zeros, NaN and a wrong shape.
"""

from __future__ import annotations

import ast
import itertools
import re
import textwrap
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from muslin import tasks
from muslin.base import paths

HEADER = re.compile(r"^# (wrong|right): ([\w-]+)(?: \| cause: (.+))?$", re.MULTILINE)


@dataclass(frozen=True)
class Variant:
    """One way to write a task's function.

    `verdict` is "wrong" or "right". `cause` is what the diagnosis calls the mistake; empty where there is none
    to make: for a right variant, and for a wrong shape, which is refused before anything is compared.
    """

    task: str
    name: str
    verdict: str
    cause: str
    code: str
    generated: bool = False

    def __str__(self) -> str:
        return f"{self.task}: {self.name}"


def variants(assignment: str = "cloth") -> list[Variant]:
    """All variants of all tasks, in the order of the task table."""
    return [
        variant
        for task in tasks.assignment(assignment).tasks.values()
        for variant in (*written(task, assignment), *generated(task))
    ]


def written(task: tasks.Task, assignment: str = "cloth") -> list[Variant]:
    """Variants of one task's file."""
    text = (paths.misconceptions(assignment) / f"{task.name}.py").read_text(encoding="utf-8")
    headers = list(HEADER.finditer(text))
    ends = [header.start() for header in headers[1:]] + [len(text)]
    return [
        Variant(task.name, header[2], header[1], header[3] or "", text[header.end() : end].strip() + "\n")
        for header, end in zip(headers, ends, strict=True)
    ]


def generated(task: tasks.Task) -> list[Variant]:
    """Zeros, NaN and a wrong shape, from the manifest."""
    head = f"{_head(task)}    return "
    kinds = [value.kind for value in task.results]
    first = {"int": "int", "scalar": "vec3", "vec3": "mat3"}
    wrong = [first.get(kind, "vec3") for kind in kinds]
    filled = _filled_python if task.in_python else _filled
    nan = "np.nan" if task.in_python else "ti.math.nan"
    return [
        Variant(task.name, "zeros", "wrong", "zeros", f"{head}{filled(kinds, '0.0')}\n", True),
        Variant(task.name, "nan", "wrong", "nan", f"{head}{filled(kinds, nan)}\n", True),
        Variant(task.name, "wrong-shape", "wrong", "", f"{head}{filled(wrong, '0.0')}\n", True),
    ]


def _head(task: tasks.Task) -> str:
    """The first lines of a task's function."""
    decorator = "" if task.in_python else "@ti.func\n"
    return f"{decorator}def {task.name}({', '.join(value.name for value in task.arguments)}):\n"


def function(task: tasks.Task, name: str, body: str, verdict: str = "") -> Variant:
    """A variant of a task from the body of its function alone."""
    inside = textwrap.indent(textwrap.dedent(body).strip("\n"), "    ").rstrip()
    return Variant(task.name, name, verdict, "", f"{_head(task)}{inside}\n")


def _filled_python(kinds: list[str], number: str) -> str:
    """The same for a task in plain Python."""
    return ", ".join(f"np.full({tasks.form(kind)[0]}, {number})" for kind in kinds)


def _filled(kinds: list[str], number: str) -> str:
    """Source of a value of each kind with this number everywhere."""

    def filled(kind: str) -> str:
        shape, integer = tasks.form(kind)
        if integer:
            return "0"
        row = f"[{', '.join([number] * (shape[-1] if shape else 1))}]"
        if len(shape) == 2:
            return f"ti.Matrix([{', '.join([row] * shape[0])}])"
        return f"ti.Vector({row})" if shape else number

    return ", ".join(filled(kind) for kind in kinds)


def submission(folder: Path | str, chosen: Mapping[str, Variant], assignment: str = "cloth") -> Path:
    """Write the reference solution with the functions of some tasks replaced by variants.

    Parameters
    ----------
    folder : path
        Where to; made if need be.
    chosen : dict of Variant
        By task.

    Returns
    -------
    Path
        The folder.
    """
    table = tasks.assignment(assignment)
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    for file in table.files:
        source = (paths.source(assignment) / file).read_text(encoding="utf-8")
        for name, variant in chosen.items():
            if table.tasks[name].file == file:
                source = replaced(source, name, variant.code)
        (folder / file).write_text(source, encoding="utf-8")
    return folder


def replaced(source: str, function: str, code: str) -> str:
    """A file's source with one of its functions written otherwise; everything else stays as it is."""
    node = next(n for n in ast.parse(source).body if isinstance(n, ast.FunctionDef) and n.name == function)
    lines = source.splitlines(keepends=True)
    first = min([node.lineno, *(decorator.lineno for decorator in node.decorator_list)]) - 1
    return "".join(lines[:first]) + code + "".join(lines[node.end_lineno :])


def rounds(verdict: str, assignment: str = "cloth") -> Iterator[dict[str, Variant]]:
    """All "wrong" or all "right" variants in as few submissions as there can be: one of each task in each."""
    columns: dict[str, list[Variant]] = {}
    for variant in variants(assignment):
        if variant.verdict == verdict:
            columns.setdefault(variant.task, []).append(variant)
    for row in itertools.zip_longest(*columns.values()):
        yield {variant.task: variant for variant in row if variant is not None}
