"""What one slip makes of a right formula: mistakes nobody wrote down, tried before students make them.

`solutions/<assignment>/judge/roads/*.py` hold ways to write each function in the notation of the task files. One
thing at a time is changed in their syntax trees (`muslin.authoring.edits`). Each change is run on the public cases
in plain Python, and what it makes of them is kept as one number per case (`muslin.grading.slips`), with words.
Only these data ship: they hold no formula.
"""

from __future__ import annotations

import ast
import re
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from muslin import tasks
from muslin.authoring.edits import WORDS, Change, Edit, Reader, applied
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import slips
from muslin.judging import reference
from muslin.reading.arithmetic import Unclear
from muslin.reading.meaning import Meaning
from muslin.student import plain

#: Where the roads of an assignment lie, below its folder in `solutions/`.
ROADS = Path("judge") / "roads"

#: Comments of lines that say nothing of what a quantity is.
VAGUE = re.compile(
    r"before the loop|^the result$|^the (\w+ )?(components|rows|columns|entries|values|results)$"
)

#: Cause, mistake, advice.
Words = tuple[str, str, str]


def compiled(function: ast.FunctionDef, changes: Mapping[int, Any], names: dict[str, Any]) -> Any:
    """A function with changes made, ready to be called where these names are known."""
    edited = applied(function, changes) if changes else function
    module = ast.fix_missing_locations(ast.Module([edited], []))
    inside = dict(names)
    exec(compile(module, "<slip>", "exec"), inside)
    return inside[function.name]


def run(function: Any, cases: Sequence[Mapping[str, Any]], task: tasks.Task) -> list[np.ndarray] | None:
    """Results of a function in plain Python, one array each; None if they are no results of this task.

    Parameters
    ----------
    function : callable
    cases : sequence of dict
        Arguments by name, made with `plain.own`.
    task : Task
    """
    rows: list[tuple[np.ndarray, ...]] = []
    for case in cases:
        try:
            out = function(**case)
        except (ZeroDivisionError, np.linalg.LinAlgError, OverflowError):
            rows.append(tuple(np.full(v.shape, np.nan) for v in task.results))
            continue
        except Exception:
            return None
        out = out if isinstance(out, tuple) else (out,)
        arrays = tuple(np.asarray(o) for o in out)
        if [a.shape for a in arrays] != [v.shape for v in task.results]:
            return None
        if any(a.dtype.kind not in "ifb" for a in arrays):
            return None
        rows.append(tuple(a.astype(float) for a in arrays))
    return [np.stack(column) for column in zip(*rows, strict=True)]


def written_down(assignment: str) -> bool:
    """Whether an assignment writes roads down, from which slips are made."""
    return (paths.source(assignment) / ROADS).is_dir()


def roads(assignment: str) -> dict[str, list[tuple[ast.FunctionDef, list[str]]]]:
    """The roads to each task, and the lines of the file they stand in.

    Raises
    ------
    MuslinError
        If the assignment has none.
    """
    folder = paths.source(assignment) / ROADS
    found: dict[str, list[tuple[ast.FunctionDef, list[str]]]] = {}
    for path in sorted(folder.glob("*.py")):
        text = path.read_text(encoding="utf-8")
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef):
                found.setdefault(node.name.partition("__")[0], []).append((node, text.splitlines()))
    if not found:
        raise MuslinError(f"There are no ways to write the functions of {assignment}: {paths.shown(folder)}.")
    return found


def make(assignment: str, name: str) -> slips.Slips:
    """All slips of one task: what each makes of the public cases, and its words.

    Parameters
    ----------
    assignment, name : str
        Which task.

    Returns
    -------
    Slips
        The plainest first; of those that come to the same on the public cases only the first.
    """
    task = tasks.assignment(assignment).tasks[name]
    inputs, expected = reference.cases(assignment, name)
    cases = [{k: plain.own(a[row]) for k, a in inputs.items()} for row in range(len(expected[0]))]
    nearby = [{key: _moved(value) for key, value in case.items()} for case in cases]
    right = [slips.print_of(np.asarray(e, dtype=float)) for e in expected]
    found: list[tuple[int, Words, list[np.ndarray]]] = []
    texts: set[str] = set()  # of what has been tried
    with plain.looked_at() as names, warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        candidates = sorted(_candidates(assignment, task), key=lambda candidate: candidate[0])
        for rank, words, function, changes in candidates:
            try:
                edited = applied(function, changes)
                text = ast.unparse(edited)
                if text in texts:
                    continue
                texts.add(text)
                made_of = compiled(edited, {}, names)
            except (ValueError, SyntaxError, AttributeError, TypeError):  # an edit that cannot be made here
                continue
            made = run(made_of, cases[:1], task) and run(made_of, cases, task)
            if made:
                near = run(made_of, nearby, task) if not changes or _suspicious(made) else None
                found.append((rank, words, _prints(made, near)))
    found.sort(key=lambda entry: entry[0])
    wrong = [entry for entry in found if any(_differ(*pair) for pair in zip(entry[2], right, strict=True))]
    made_slips = slips.Slips.of([(words, prints) for _, words, prints in wrong])
    places = list(_places(assignment, task, inputs))
    return replace(
        made_slips,
        places=np.array([words for words, _ in places], dtype=str),
        marks=np.array([mark for _, mark in places], dtype=np.float32).reshape(len(places), len(cases)),
    )


def _places(
    assignment: str, task: tasks.Task, inputs: Mapping[str, np.ndarray]
) -> Iterator[tuple[str, np.ndarray]]:
    """What the lines of all roads compute: in words, and the print of each on the public cases."""
    seen: list[np.ndarray] = []
    with np.errstate(all="ignore"):
        for function, source in roads(assignment).get(task.name, []):
            if ast.get_docstring(function):
                continue
            try:
                meaning = Meaning({task.name: function}, task.name, inputs)
            except Unclear:  # too long to be followed line by line
                continue
            for node in ast.walk(function):
                if not isinstance(node, (ast.Assign, ast.Return)) or node.value is None:
                    continue
                value = meaning.values.get(id(node.value))
                words = source[node.lineno - 1].partition("#")[2].strip()
                if value is None or isinstance(value, (tuple, list)) or not words or VAGUE.search(words):
                    continue
                array = np.asarray(value, dtype=np.float64)
                mark = slips.print_of(np.broadcast_to(array, (meaning.count, *array.shape[1:])))
                known = any(np.allclose(mark, other, rtol=1e-9, atol=0) for other in seen)
                if np.isfinite(mark).all() and np.ptp(mark) and not known:
                    seen.append(mark)
                    yield words, mark


def _candidates(
    assignment: str, task: tasks.Task
) -> Iterator[tuple[int, Words, ast.FunctionDef, Mapping[int, Change]]]:
    """Mistakes as a whole, and every slip on every road: rank, words, function, what to change in it."""
    for road, (function, source) in enumerate(roads(assignment).get(task.name, [])):
        whole = ast.get_docstring(function)
        if whole:
            mistake, _, advice = (" ".join(part.split()) for part in whole.partition("\n\n"))
            yield 0, (function.name.partition("__")[2].replace("_", " "), mistake, advice), function, {}
            continue
        for edit in Reader(function, source, task).edits():
            # The plainer kind first, the smaller change first, the shorter road first.
            rank = 100 * list(WORDS).index(edit.kind) + 10 * min(len(edit.changes), 5) + road
            yield rank, _words(edit), function, edit.changes


def _moved(value: Any) -> Any:
    """An input that differs in the last digits: what is singular shows itself."""
    if isinstance(value, int):
        return value
    return value * (1 + 1e-13 * np.cos(np.arange(np.size(value)).reshape(np.shape(value))))


def _suspicious(made: list[np.ndarray]) -> bool:
    """Whether some results are not finite, or far larger than the others: then something may be singular."""
    sizes = [np.abs(array).reshape(len(array), -1).max(axis=1) for array in made]
    return any(not (size <= 1e6 * np.nanmedian(size)).all() for size in sizes)


def _prints(made: list[np.ndarray], near: list[np.ndarray] | None) -> list[np.ndarray]:
    """Prints, NaN where they hang on the last digits of the inputs."""
    prints = [slips.print_of(array) for array in made]
    others = [slips.print_of(array) for array in near] if near else prints
    pairs = zip(prints, others, strict=True)
    return [np.where(np.abs(p - q) <= 1e-7 * np.abs(p) + 1e-12, p, np.nan) for p, q in pairs]


def _differ(a: np.ndarray, b: np.ndarray) -> bool:
    return not np.allclose(a, b, rtol=1e-7, atol=0, equal_nan=True)


def _words(edit: Edit) -> Words:
    mistake, advice = (text.format(place=edit.place, of=edit.of) for text in WORDS[edit.kind])
    return f"{edit.kind}: {edit.place}", f"Most likely {mistake}.", advice


def build(assignment: str, names: Sequence[str] | None = None) -> Iterator[Path]:
    """Write the slips of tasks, by default of all; made again when the public cases change.

    Raises
    ------
    MuslinError
        If the assignment has no roads, or none to a task of that name.
    """
    known = roads(assignment)
    if unknown := sorted(set(names or ()) - set(known)):
        raise MuslinError(
            f"There is no way written down to {', '.join(unknown)}.", f"There is: {', '.join(known)}."
        )
    paths.slips(assignment).mkdir(parents=True, exist_ok=True)
    for name in names or known:
        yield make(assignment, name).save(paths.slips(assignment) / f"{name}.npz")
