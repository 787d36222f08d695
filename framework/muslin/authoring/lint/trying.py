"""Data, misconceptions and functions: whole, enough, and right."""

from __future__ import annotations

import ast
import importlib.util
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from muslin import tasks
from muslin.authoring import reference_data
from muslin.authoring.lint.finding import Finding, Subject, of_error
from muslin.authoring.lint.teaching import suite_file
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import known as mistaken
from muslin.judging import checking
from muslin.tasks import Task

#: How many variants of each verdict a task must have.
FEWEST_WRONG, FEWEST_RIGHT = 5, 2


def check_reference(subject: Subject) -> Iterator[Finding]:
    """The public reference data are whole, and what is drawn and true today; in thorough mode the run with them."""
    where = paths.shown(paths.reference(subject.name))
    report = reference_data.verify(subject.name, simulation=subject.thorough)
    do = f"run: muslin reference build {subject.name}, then: muslin reference mistakes {subject.name}"
    for problem in report.problems:
        yield Finding(where, problem.rstrip("."), do)
    for error in report.slips:
        yield of_error(where, error)
    if not report.problems and not report.slips:
        yield from _mistakes(subject)


def _mistakes(subject: Subject) -> Iterator[Finding]:
    """What known mistakes make of the public cases was made of these cases."""
    for name in subject.table.tasks:
        if not mistaken.current(subject.name, name):
            where = paths.shown(paths.known(subject.name) / f"{name}.npz")
            do = f"run: muslin reference mistakes {subject.name} --task {name}"
            yield Finding(where, "what mistakes make of the public cases is missing, or of other cases", do)


def check_misconceptions(subject: Subject) -> Iterator[Finding]:
    """The suite has enough wrong and right variants of every task."""
    suite = _suite()
    for task in subject.table.tasks.values():
        path = suite_file(subject, task.name)
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


def check_solutions(subject: Subject) -> Iterator[Finding]:
    """The solution agrees with the reference data."""
    functions = tasks.load(subject.source, subject.table)
    for task in subject.table.tasks.values():
        try:
            (verdict,) = checking.check(functions, [task.name])
        except MuslinError:
            continue  # no data: said above
        if not verdict.ok:
            what = f"the solution fails: {verdict.message.splitlines()[0]}"
            yield Finding(
                subject.where(task.file, task.name), what.rstrip("."), f"correct it, or truth_{task.name}"
            )


def check_variants(subject: Subject) -> Iterator[Finding]:
    """In thorough mode: every wrong variant is caught, every right one passes."""
    if not subject.thorough:
        return
    suite = _suite()
    with tempfile.TemporaryDirectory() as scratch:
        for verdict in ("wrong", "right"):
            for number, chosen in enumerate(suite.rounds(verdict, subject.name)):
                folder = suite.submission(Path(scratch) / f"{verdict}-{number}", chosen, subject.name)
                functions = tasks.load(folder, subject.table)
                for name, variant in chosen.items():
                    (result,) = checking.check(functions, [name])
                    if result.ok == (verdict == "wrong"):
                        what = f"the {verdict} variant {variant.name!r} {'passes' if result.ok else 'fails'}"
                        where = paths.shown(suite_file(subject, name))
                        yield Finding(where, what, "correct it, or draw cases that tell it apart")


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
