"""What is still missing or wrong in an assignment, said before a student finds out.

`CHECKS` is the list of what is looked at, the quick ones first. Each finding is one line: where, what, what to do.
"""

from __future__ import annotations

import ast
import graphlib
import importlib.util
import json
import re
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields
from pathlib import Path
from types import ModuleType
from typing import Any

from muslin import tasks
from muslin.authoring import reference_data, wheel
from muslin.authoring import release as releasing
from muslin.base import paths
from muslin.base.errors import MuslinError, NotImplementedYet
from muslin.grading import known as mistaken
from muslin.reading import syntax
from muslin.tasks import MANIFEST, Assignment, Task

#: How many of each a task must have.
FEWEST_HINTS, FEWEST_WRONG, FEWEST_RIGHT = 2, 5, 2

#: What a scaffold leaves for its author to replace.
PLACEHOLDER = "TODO"


@dataclass(frozen=True)
class Finding:
    """Something to mend: `where` (a file, perhaps with line or task), `what`, and what to `do`."""

    where: str
    what: str
    do: str

    def __str__(self) -> str:
        return f"{self.where}: {self.what}; {self.do}".replace("\n", " ")


@dataclass(frozen=True)
class Subject:
    """An assignment being looked at."""

    name: str
    table: Assignment
    thorough: bool = False

    @property
    def source(self) -> Path:
        """Its solution folder."""
        return paths.solution(self.name)

    def where(self, file: str, task: str = "") -> str:
        """A file of its solution, perhaps with a task, as findings name it."""
        return f"{paths.shown(self.source / file)}{f', {task}' if task else ''}"


def lint(name: str, thorough: bool = False) -> list[Finding]:
    """Look an assignment over.

    Parameters
    ----------
    name : str
        The assignment.
    thorough : bool
        Also make the reference data anew and try every variant of the misconception suite.

    Returns
    -------
    list of Finding
        Empty if nothing is to be mended.

    Raises
    ------
    MuslinError
        If there is no such assignment, or no solutions here.
    """
    every = paths.assignments("solutions")
    if every and name not in every:
        raise MuslinError(f"There is no assignment {name!r} in solutions/.", f"There is: {', '.join(every)}.")
    source = paths.solution(name)
    try:
        subject = Subject(name, tasks.read_assignment(source), thorough)
    except MuslinError as error:
        return [_complaint(source / MANIFEST, error)]
    found: list[Finding] = []
    for title, check in CHECKS.items():
        try:
            found += check(subject)
        except MuslinError as error:
            found.append(_complaint(title, error))
        if found and check is _fields:
            break  # all other checks build on a sound manifest
    return list(dict.fromkeys(found))


def _complaint(where: Path | str, error: MuslinError) -> Finding:
    shown = paths.shown(where) if isinstance(where, Path) else where
    return Finding(shown, error.message.rstrip("."), (error.hint or "mend it").rstrip("."))


# ------------------------------------------------------------------------------------------ the manifest


def _fields(subject: Subject) -> Iterator[Finding]:
    """Names, numbers and words of the manifest."""
    table, where = subject.table, subject.where(MANIFEST)
    raw = wheel.read_toml(subject.source / MANIFEST)
    known = {"schema", "task", *(field.name for field in fields(Assignment))}
    for entry in sorted(set(raw) - known):
        yield Finding(where, f"there is no entry {entry!r}", f"the entries are {', '.join(sorted(known))}")
    if table.name != subject.name:
        yield Finding(where, f"the name is {table.name!r}", f"give it the folder's name, {subject.name!r}")
    if not re.fullmatch(r"\d+(\.\d+)+", str(table.version)):
        yield Finding(where, f"the version is {table.version!r}", 'write it as "1.0"')
    if not str(table.title).strip():
        yield Finding(where, "the title is empty", "give it one")
    for task in table.tasks.values():
        at = subject.where(MANIFEST, task.name)
        yield from (Finding(at, what, do) for what, do in _task_fields(task, raw["task"][task.name]))


def _task_fields(task: Task, raw: dict[str, Any]) -> Iterator[tuple[str, str]]:
    known = {field.name for field in fields(Task)} - {"name"}
    for entry in sorted(set(raw) - known):
        yield f"there is no entry {entry!r}", f"the entries of a task are {', '.join(sorted(known))}"
    if isinstance(task.points, bool) or not isinstance(task.points, int) or task.points <= 0:
        yield f"its points are {task.points!r}", "give it a whole number of points, 1 or more"
    if not re.fullmatch(r"[A-Za-z_]\w*\.py", str(task.file)):
        yield f"its file is {task.file!r}", "name a Python file in the same folder"
    for name in ("section", "title"):
        if not str(getattr(task, name)).strip():
            yield f"its {name} is empty", "give it one"
    for value in (*task.arguments, *task.results):
        if not value.name.isidentifier():
            yield f"{value.name!r} is no name in Python", "choose another"
        if not value.meaning:
            yield f"nobody says what {value.name} means", 'write "kind [unit] meaning"'
    for what, values in (("arguments", task.arguments), ("results", task.results)):
        if not values:
            yield f"it has no {what}", "add them"


def _prerequisites(subject: Subject) -> Iterator[Finding]:
    """Every task another one needs exists, and none needs itself in the end."""
    known = subject.table.tasks
    for task in known.values():
        for needed in task.needs:
            if needed not in known:
                what = f"it needs {needed!r}, which is no task"
                yield Finding(subject.where(MANIFEST, task.name), what, "correct or remove it in needs")
    try:
        graphlib.TopologicalSorter({task.name: task.needs for task in known.values()}).prepare()
    except graphlib.CycleError as error:
        circle = " needs ".join(reversed(error.args[1]))
        yield Finding(subject.where(MANIFEST), f"{circle}: a circle", "take one of them out of needs")


def _hints(subject: Subject) -> Iterator[Finding]:
    """Hints in levels, from a nudge to nearly the answer."""
    for task in subject.table.tasks.values():
        at = subject.where(MANIFEST, task.name)
        hints = [str(hint).strip() for hint in task.hints]
        if len(hints) < FEWEST_HINTS:
            what = f"it has {len(hints) or 'no'} hint{'s' if len(hints) != 1 else ''}"
            yield Finding(at, what, f"write at least {FEWEST_HINTS}, from a nudge to nearly the answer")
        if len(set(hints)) < len(hints) or not all(hints):
            yield Finding(at, "a hint is empty or said twice", "make every level say more")


# ------------------------------------------------------------------------- the handout and the solution


def _handout(subject: Subject) -> Iterator[Finding]:
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


def _docstrings(subject: Subject) -> Iterator[Finding]:
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


def _placeholders(subject: Subject) -> Iterator[Finding]:
    """Nothing of the scaffold is left."""
    suite = [_suite_file(subject, task) for task in subject.table.tasks]
    own = [p for p in sorted(subject.source.glob("*")) if p.suffix in (".py", ".md", ".toml")]
    for path in [*own, *(p for p in suite if p.is_file())]:
        for number, line in enumerate(syntax.lines(path.read_text(encoding="utf-8", errors="replace")), 1):
            if re.search(rf"\b{PLACEHOLDER}\b", line):
                said = re.sub(rf".*?\b{PLACEHOLDER}\b:? *", "", line).strip(" \"',}-<>") or "this"
                yield Finding(
                    f"{paths.shown(path)}, line {number}", f"still {PLACEHOLDER}: {said}", "write it"
                )


# --------------------------------------------------------------------------------- what students receive


def _released(subject: Subject) -> Iterator[Finding]:
    """The released folder is what the solution gives."""
    for sentence in releasing.out_of_step(subject.name):
        where, _, rest = sentence.partition(": ")
        what, _, do = rest.partition("; ")
        yield Finding(where, what or "is not in step", do or f"run: muslin release {subject.name}")


def given_away(name: str) -> Iterator[Finding]:
    """Answers and hidden data in what students get: everything the wheel holds, the released folder included."""
    source, held = paths.solution(name), wheel.contents()
    texts = {
        paths.shown(path): path.read_bytes()
        for inside, path in held.items()
        if path.suffix in (".py", ".md", ".toml", ".json", ".txt", ".css", ".svg")
        and not inside.startswith(
            (
                f"muslin/_shipped/assignments/{name}/",  # `_released` looks closer there
                "muslin/authoring/templates/",  # what is to be replaced anyway
            )
        )
    }
    for leak in releasing.leaks(source, texts, results=True):
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


def _given_away(subject: Subject) -> Iterator[Finding]:
    """No answer and no hidden datum in what students get."""
    return given_away(subject.name)


# -------------------------------------------------------------------------------- data, suite, functions


def _reference(subject: Subject) -> Iterator[Finding]:
    """The public reference data are whole, and in thorough mode also true."""
    where = paths.shown(paths.reference(subject.name))
    report = reference_data.verify(subject.name, regenerate=subject.thorough)
    for problem in report.problems:
        yield Finding(where, problem.rstrip("."), f"run: muslin reference build {subject.name}")
    if not report.problems:
        yield from _mistakes(subject)


def _mistakes(subject: Subject) -> Iterator[Finding]:
    """What known mistakes make of the public cases was made of these cases."""
    for name in subject.table.tasks:
        if not mistaken.current(subject.name, name):
            where = paths.shown(paths.known(subject.name) / f"{name}.npz")
            do = f"run: muslin reference mistakes {subject.name} --task {name}"
            yield Finding(where, "what mistakes make of the public cases is missing, or of other cases", do)


def _misconceptions(subject: Subject) -> Iterator[Finding]:
    """The suite has enough wrong and right variants of every task."""
    suite = _suite()
    for task in subject.table.tasks.values():
        path = _suite_file(subject, task.name)
        if not path.is_file():
            do = f"write {FEWEST_WRONG} wrong and {FEWEST_RIGHT} right variants there"
            yield Finding(paths.shown(path), f"{task.name} has no misconceptions", do)
            continue
        variants = suite.written(task, subject.name)
        for verdict, fewest, what in (
            ("wrong", FEWEST_WRONG, "misconceptions"),
            ("right", FEWEST_RIGHT, "right variants"),
        ):
            count = sum(variant.verdict == verdict for variant in variants)
            if count < fewest:
                do = f"write {fewest - count} more"
                yield Finding(paths.shown(path), f"{task.name} has {count} of {fewest} {what}", do)
        for variant in variants:
            if fault := _fault(variant.code, task):
                yield Finding(paths.shown(path), f"the variant {variant.name!r} {fault}", "correct it")
        names = [variant.name for variant in variants]
        for name in sorted({name for name in names if names.count(name) > 1}):
            yield Finding(paths.shown(path), f"there are two variants {name!r}", "rename one")


def _fault(code: str, task: Task) -> str:
    """Why a variant is no function of its task."""
    try:
        tree = ast.parse(code)
    except SyntaxError as error:
        return f"is not Python: {error.msg}"
    found = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name == task.name]
    return "" if found else f"does not define {task.name}"


def _stubs(subject: Subject) -> Iterator[Finding]:
    """Every released function is still to be written."""
    stubs = tasks.load(paths.assignment(subject.name), subject.table)
    for task in subject.table.tasks.values():
        failure = tasks.failure_of(stubs[task.name])
        if isinstance(failure, NotImplementedYet):
            continue
        where = f"{paths.shown(stubs.folder / task.file)}, {task.name}"
        what = f"the stub cannot be used: {failure.message}" if failure else "the stub is already written"
        yield Finding(where, what.rstrip("."), f"run: muslin release {subject.name}")


def _solutions(subject: Subject) -> Iterator[Finding]:
    """The solution agrees with the reference data."""
    from muslin.judging import reference

    functions = tasks.load(subject.source, subject.table)
    for task in subject.table.tasks.values():
        try:
            (verdict,) = reference.check(functions, [task.name])
        except MuslinError:
            continue  # no data: said above
        if not verdict.ok:
            what = f"the solution fails: {verdict.message.splitlines()[0]}"
            yield Finding(subject.where(task.file, task.name), what.rstrip("."), "correct it, or the data")


def _variants(subject: Subject) -> Iterator[Finding]:
    """In thorough mode: every wrong variant is caught, every right one passes."""
    from muslin.judging import reference

    if not subject.thorough:
        return
    suite = _suite()
    with tempfile.TemporaryDirectory() as scratch:
        for verdict in ("wrong", "right"):
            for number, chosen in enumerate(suite.rounds(verdict, subject.name)):
                folder = suite.submission(Path(scratch) / f"{verdict}-{number}", chosen, subject.name)
                functions = tasks.load(folder, subject.table)
                for name, variant in chosen.items():
                    (result,) = reference.check(functions, [name])
                    if result.ok == (verdict == "wrong"):
                        what = f"the {verdict} variant {variant.name!r} {'passes' if result.ok else 'fails'}"
                        where = paths.shown(_suite_file(subject, name))
                        yield Finding(where, what, "correct it, or draw cases that tell it apart")


def _suite_file(subject: Subject, task: str) -> Path:
    return paths.misconceptions(subject.name) / f"{task}.py"


def _suite() -> ModuleType:
    """The misconception suite of this checkout, which is no part of the package."""
    path = paths.root() / "tests" / "misconceptions" / "suite.py"
    spec = importlib.util.spec_from_file_location("muslin_misconception_suite", path)
    if spec is None or spec.loader is None or not path.is_file():
        raise MuslinError(f"{paths.shown(path)} is missing.", "Restore it.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # its dataclasses look themselves up
    spec.loader.exec_module(module)
    return module


#: What is looked at, in this order.
CHECKS: dict[str, Callable[[Subject], Iterator[Finding]]] = {
    "manifest": _fields,
    "prerequisites": _prerequisites,
    "hints": _hints,
    "handout": _handout,
    "docstrings": _docstrings,
    "placeholders": _placeholders,
    "released folder": _released,
    "what students get": _given_away,
    "reference data": _reference,
    "misconceptions": _misconceptions,
    "stubs": _stubs,
    "solution": _solutions,
    "variants": _variants,
}
