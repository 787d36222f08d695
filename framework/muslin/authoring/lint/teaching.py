"""The words: handout, docstrings, and what a scaffold leaves to be replaced."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from muslin.authoring import release as releasing
from muslin.authoring.lint.finding import Finding, Subject
from muslin.base import paths
from muslin.reading import syntax

#: What a scaffold leaves for its author to replace.
PLACEHOLDER = "TODO"


def check_handout(subject: Subject) -> Iterator[Finding]:
    """Every section and every task has its heading in the handout."""
    path = subject.source / releasing.HANDOUT
    if not path.is_file():
        yield Finding(paths.shown(path), "there is no handout", "write it: it teaches every task")
        return
    headings = re.findall(r"^#{2,6} +(.+?) *$", path.read_text(encoding="utf-8"), re.MULTILINE)
    for task in subject.table.tasks.values():
        if not any(re.match(rf"{re.escape(task.section)}\b", heading) for heading in headings):
            what = f"there is no section {task.section}, which {task.name} belongs to"
            yield Finding(paths.shown(path), what, f'give it a heading "## {task.section} ..."')
        if task.name not in headings:
            what = f"the handout does not teach {task.name}"
            yield Finding(paths.shown(path), what, f'give it a heading "### {task.name}"')


def check_docstrings(subject: Subject) -> Iterator[Finding]:
    """Every function says what its arguments are."""
    for file in subject.table.files:
        path = subject.source / file
        tree = ast.parse(path.read_text(encoding="utf-8")) if path.is_file() else ast.Module([], [])
        functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
        for task in subject.table.tasks.values():
            if task.file != file or task.name not in functions:
                continue
            text = ast.get_docstring(functions[task.name]) or ""
            silent = [v.name for v in task.arguments if not re.search(rf"\b{re.escape(v.name)}\b", text)]
            if silent and not _in_a_range(silent, text):
                what = f"its docstring does not say what {', '.join(silent)} {'are' if silent[1:] else 'is'}"
                yield Finding(subject.where(file, task.name), what, "add shape and unit")


def _in_a_range(names: list[str], text: str) -> bool:
    """Whether a docstring speaks of `x0..x2` and the names lie in between."""
    spans = re.findall(r"\b([A-Za-z_]+)(\d+)\s*(?:\.\.+|-|to)\s*\1(\d+)\b", text)
    covered = {f"{stem}{k}" for stem, low, high in spans for k in range(int(low), int(high) + 1)}
    return set(names) <= covered


def check_placeholders(subject: Subject) -> Iterator[Finding]:
    """Nothing of the scaffold is left."""
    suite = [suite_file(subject, task) for task in subject.table.tasks]
    own = [p for p in sorted(subject.source.glob("*")) if p.suffix in (".py", ".md", ".toml")]
    for path in [*own, *(p for p in suite if p.is_file())]:
        for number, line in enumerate(syntax.lines(path.read_text(encoding="utf-8", errors="replace")), 1):
            if re.search(rf"\b{PLACEHOLDER}\b", line):
                said = re.sub(rf".*?\b{PLACEHOLDER}\b:? *", "", line).strip(" \"',}-<>") or "this"
                yield Finding(
                    f"{paths.shown(path)}, line {number}", f"still {PLACEHOLDER}: {said}", "write it"
                )


def suite_file(subject: Subject, task: str) -> Path:
    """Where the variants of a task are."""
    return paths.misconceptions(subject.name) / f"{task}.py"
