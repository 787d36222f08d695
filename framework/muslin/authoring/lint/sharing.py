"""What students get: in step with the solution, and without an answer or a hidden datum."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from muslin import tasks
from muslin.authoring import reference_data, wheel
from muslin.authoring import release as releasing
from muslin.authoring.leaks import leaks
from muslin.authoring.lint.finding import Finding, Subject
from muslin.base import paths
from muslin.base.errors import NotImplementedYet


def check_release(subject: Subject) -> Iterator[Finding]:
    """The released folder is what the solution gives."""
    for sentence in releasing.out_of_step(subject.name):
        where, _, rest = sentence.partition(": ")
        what, _, do = rest.partition("; ")
        yield Finding(where, what or "is not in step", do or f"run: muslin release {subject.name}")


def given_away(name: str) -> Iterator[Finding]:
    """Answers and hidden data in what students get: everything the wheel holds, the released folder included."""
    source, held = paths.solution(name), wheel.contents(assignment=name)
    texts = {
        paths.shown(path): path.read_bytes()
        for inside, path in held.items()
        if path.suffix in (".py", ".md", ".toml", ".json", ".txt", ".css", ".svg")
        and not inside.startswith(
            (
                f"muslin/_shipped/assignments/{name}/",  # `check_release` looks closer there
                "muslin/authoring/templates/",  # what is to be replaced anyway
            )
        )
    }
    for leak in leaks(source, texts, results=True):
        where, _, what = leak.partition(": ")
        yield Finding(where, what, "students get this file: say it otherwise, or keep it elsewhere")
    inside_solutions = (paths.root() / "solutions").resolve()
    for path in held.values():
        if path.resolve().is_relative_to(inside_solutions) and path.parent.name != "practice":
            yield Finding("pyproject.toml", f"the wheel holds {paths.shown(path)}", "solutions stay here")
    yield from _hidden(held)


def _hidden(held: dict[str, Path]) -> Iterator[Finding]:
    """Reference data that are not the public ones."""
    folders = {path.parent for path in held.values() if path.name == reference_data.PROVENANCE}
    for folder in sorted(folders):
        record = json.loads((folder / reference_data.PROVENANCE).read_text(encoding="utf-8"))
        if record.get("seed") != reference_data.PUBLIC_SEED:
            do = f"move {paths.shown(folder)} out of what students get"
            yield Finding(paths.shown(folder), "hidden reference data (their seed is not the public one)", do)
    public = {folder.parent for folder in folders} | {paths.reference("")}
    for path in sorted(held.values()):
        stray = path.suffix in (".npz", ".npy") and not folders & {path.parent, path.parent.parent}
        if stray and any(path.is_relative_to(folder) for folder in public):
            yield Finding(paths.shown(path), "reference data without a provenance", "remove them")
        if path.suffix == ".npz" and path.parent in folders:
            record = json.loads((path.parent / reference_data.PROVENANCE).read_text(encoding="utf-8"))
            if path.name not in record.get("files", {}):
                yield Finding(paths.shown(path), "reference data that are not on record", "remove them")


def check_what_students_get(subject: Subject) -> Iterator[Finding]:
    """No answer and no hidden datum in what students get, nor hidden data beside the solution."""
    yield from given_away(subject.name)
    for path in sorted(subject.source.rglob(reference_data.PROVENANCE)):
        do = f"move {paths.shown(path.parent)} out of what is shared"
        yield Finding(paths.shown(path.parent), "reference data beside the solution", do)


def check_stubs(subject: Subject) -> Iterator[Finding]:
    """Every released function is still to be written."""
    stubs = tasks.load(paths.assignment(subject.name), subject.table)
    for task in subject.table.tasks.values():
        failure = tasks.failure_of(stubs[task.name])
        if isinstance(failure, NotImplementedYet):
            continue
        where = f"{paths.shown(stubs.folder / task.file)}, {task.name}"
        what = f"the stub cannot be used: {failure.message}" if failure else "the stub is already written"
        yield Finding(where, what.rstrip("."), f"run: muslin release {subject.name}")
