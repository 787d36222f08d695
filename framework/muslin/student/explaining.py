"""One public case of a task, step by step: inputs, what lies on the way, the student's variables, the result.

`steps` runs in a worker, as student code does.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np

from muslin.base.errors import MuslinError
from muslin.judging import judge
from muslin.judging.knowledge import known
from muslin.judging.told import Told
from muslin.student.checking import EXPLAINING
from muslin.student.rows import beside, changed, named, titled
from muslin.tasks import manifest as tables
from muslin.tasks.wiring import case_called, results_called, to_called, to_own

Values = Mapping[str, np.ndarray]

#: Rounds of a loop that are shown, beside its last.
ROUNDS = 2


def steps(folder: Path, assignment: str, name: str, case: int | None) -> Iterator[str]:
    """Lines that explain a case of a task; without a number, the simplest wrong one, or the first.

    Raises
    ------
    MuslinError
        If there is no such case, or the function cannot be run.
    """
    from muslin import reading, tasks
    from muslin.judging import reference
    from muslin.physics import alone
    from muslin.reading import source
    from muslin.student import plain
    from muslin.tasks import plain as in_python
    from muslin.tasks.batch import evaluate

    table = tasks.assignment(assignment)
    task, own = table.tasks[name], judge(assignment, name)
    functions = tasks.load(folder, table)
    inputs, expected = reference.cases(assignment, name)
    count = len(expected[0])
    if case is not None and not 0 <= case < count:
        raise MuslinError(f"{name} has public cases 0 to {count - 1}, not {case}.")
    got: tuple[Any, ...] | None = None
    trouble = ""
    try:
        answer = evaluate(functions[name], **dict[str, Any](inputs))
        got = answer if isinstance(answer, tuple) else (answer,)
    except MuslinError as error:
        trouble = str(error)
    verdict = (
        reference.compare(task, got, expected, inputs, own.terms, own.limits(inputs))
        if got is not None
        else None
    )
    if case is None:
        case = verdict.case if verdict is not None and verdict.case is not None else 0

    def whole(k: int) -> tuple[Values, Values, Values]:
        """Inputs, results, and all that is known of a case."""
        here = {key: value[k] for key, value in inputs.items()}
        results = {v.name: e[k] for v, e in zip(task.results, expected, strict=True)}
        return here, results, {**here, **(own.steps(here) if own.steps else {})}

    here, results, way = whole(case)

    yield f"{name}: {task.title}; case {case} of 0 to {count - 1}"
    yield from titled("Inputs", here)
    yield from titled("On the way, in the handout's symbols", {k: v for k, v in way.items() if k not in here})
    if got is None:
        yield ""
        yield "Your function does not run yet"
        yield from (f"  {line}" for line in trouble.split("\n"))
        yield from titled("Expected", results)
    else:
        others = [whole(k) for k in range(0, count, max(1, count // 4)) if k != case]
        cases = [(inputs_there, {**way_there, **right}) for inputs_there, right, way_there in others]
        mine_here = [g[case] for g in got]

        def run(values: Values) -> tuple[Any, list[tuple[int, str, Any]]]:
            """The function line by line, in plain Python."""
            given = in_python.arguments(functions[name], task, values) if task.in_python else dict(values)
            return plain.values(folder / task.file, name, given, taichi=not task.in_python)

        yield from _variables(run, here, {**way, **results}, mine_here, cases)
        for entry, mine, right in zip(task.results, got, expected, strict=True):
            yield ""
            yield from beside(entry.name if len(expected) > 1 else "Result", mine[case], right[case])
        assert verdict is not None
        text = source.glimpse(folder / table.tasks[name].file)
        yield from _verdict(table.tasks[name], got, expected, inputs, verdict, assignment, text)
        if not verdict.ok:
            yield from (f"  look: {note}" for note in reading.told(functions[name]))
            made, _ = alone.CELLS[alone.of_assignment(table.tasks)]
            if made().case(case_called(task, here)) is not None:
                yield f"Pull at it in the browser: muslin play --case {name}:{case}"
    yield from _whole(functions, assignment, name, case)


class Looking(str):
    """A line after which the mistake is looked for; `allowed` says for how long [s]."""

    allowed = EXPLAINING


def _verdict(
    task: Any, got: Any, expected: Any, inputs: Values, verdict: Any, assignment: str, text: str
) -> Iterator[str]:
    yield ""
    if verdict.ok:
        yield f"All of your answers are right: {verdict.message}"
        return
    yield Looking(f"{verdict.message.splitlines()[0]}.")
    from muslin.grading.diagnosis import diagnose

    found = diagnose(task, got, expected, inputs, assignment, text)
    if found is not None:
        yield f"likely: {found.mistake}"
        yield f"   try: {found.advice}"


#: The student's function on the inputs of a case: its result, and every variable each time it got a value.
Run = Callable[[Values], tuple[Any, list[tuple[int, str, Any]]]]


def _elsewhere(
    run: Run, found: Sequence[tuple[int, str, Any]], cases: Sequence[tuple[Values, Values]]
) -> list[tuple[list[np.ndarray], Values]]:
    """The same variables in other cases, beside what is known there; cases in which other lines run are left out."""
    there = []
    for inputs, way in cases:
        try:
            _, others = run(inputs)
        except Exception:  # a division by zero, say
            continue
        if [entry[:2] for entry in others] == [entry[:2] for entry in found]:
            there.append(([np.asarray(value) for _, _, value in others], way))
    return there


def _variables(
    run: Run,
    here: Values,
    way: Values,
    got: list[np.ndarray],
    cases: Sequence[tuple[Values, Values]],
) -> Iterator[str]:
    """The student's variables, and which quantity each is; and where Python and Taichi part.

    `cases` are the inputs of a few other cases, and what is known there.
    """
    try:
        result, found = run(here)
        back = result if isinstance(result, tuple) else (result,)
    except Exception as error:  # a view into the function is a help, not a duty
        yield ""
        yield f"(Your variables cannot be shown: {type(error).__name__}: {error}.)"
        return
    if found:
        yield ""
        yield "Your variables, line by line"
        others = _elsewhere(run, found, cases)
        shown = _shown(found)
        before: dict[str, np.ndarray] = {}
        left_out = 0
        for number, (line, variable, what_it_holds) in enumerate(found):
            value = np.asarray(what_it_holds)
            if number not in shown:
                left_out += 1
                before[variable] = value
                continue
            if left_out:
                yield f"  ...         {left_out} more values, round after round of the loop"
                left_out = 0
            what = _recognised(value, {k: v for k, v in way.items() if k != variable})
            for elsewhere, their_way in others:  # two quantities may agree by chance in one case, not in all
                if np.any(elsewhere[number]):
                    what = [label for label in what if label in _recognised(elsewhere[number], their_way)]
            head = f"  line {line:<4} {variable}"
            entries = changed(head, before[variable], value) if variable in before and not what else None
            if entries is not None:
                yield from entries
            else:
                yield from named(f"{head} = ", value, f"   this is {what[0]}" if what else "")
            before[variable] = value
    same = len(back) == len(got) and all(
        np.shape(b) == np.shape(g) and np.allclose(b, g, rtol=1e-6, atol=1e-9 * np.abs(g).max(initial=0.0))
        for b, g in zip(back, got, strict=True)
    )
    if not same:
        yield ""
        yield "Plain Python comes to another result from the same lines than Taichi does. Most often a variable was"
        yield "born as a whole number (x = 0, ti.Vector([0, 0, 1])) and so cuts off what it is given later: write 0.0."


def _shown(found: Sequence[tuple[int, str, Any]]) -> set[int]:
    """Which values are shown: of what is set again and again, in a loop, the first two rounds and the last."""
    times = Counter(entry[:2] for entry in found)
    shown = set()
    for again, numbers in groupby(range(len(found)), key=lambda k: times[found[k][:2]] > 1):
        loop = list(numbers)
        if again:
            kept = {
                *_until(loop, [found[k][:2] for k in loop], ROUNDS),
                *_until(loop[::-1], [found[k][:2] for k in loop[::-1]], 1),
            }
            loop = sorted(kept) if len(loop) - len(kept) > 3 else loop
        shown |= set(loop)
    return shown


def _until(numbers: Sequence[int], names: Sequence[Any], rounds: int) -> Iterator[int]:
    """The numbers up to where one of the names comes for more than so many times."""
    seen: Counter[Any] = Counter()
    for number, name in zip(numbers, names, strict=True):
        seen[name] += 1
        if seen[name] > rounds:
            return
        yield number


def _recognised(value: np.ndarray, way: Values) -> list[str]:
    """Which known quantities a value is: themselves, negated or transposed; none if it says nothing."""
    size = np.abs(value).max(initial=0.0)
    if size == 0 or (np.ndim(value) == 0 and float(value) in (1.0, 2.0, -1.0, 0.5)):
        return []
    changes = (("", lambda a: a), ("minus ", lambda a: -a), ("the transpose of ", np.transpose))
    return [
        words + label
        for words, change in changes
        for label, other in way.items()
        if np.shape(candidate := change(np.asarray(other))) == np.shape(value)
        and np.allclose(candidate, value, rtol=1e-9, atol=1e-12 * size)
    ]


def _whole(functions: Any, assignment: str, name: str, case: int) -> Iterator[str]:
    """The assignment's own example, from its beginning to this task: yours and expected."""
    from muslin.tasks.batch import evaluate

    way = example(assignment, case)
    if way is None or name not in known(assignment, "example_tasks"):
        return
    title, shown = next(way)
    yield ""
    yield f"{title} Each function gets right inputs; what differs is its own."
    told = Told(assignment, f"explain {case}")
    while True:
        if isinstance(shown, dict):
            for symbol, value in shown.items():
                yield from titled("", {symbol: value})
            title, shown = next(way)
            continue
        symbol, task = title, shown[0]
        entry = functions.assignment.tasks[task]
        values = to_own(entry, {key: np.asarray(value)[None] for key, value in shown[1].items()})
        answers = told.answer(task, values)
        right = answers[0][0]
        try:
            mine = evaluate(functions[task], **dict[str, Any](values))
        except MuslinError:
            yield from titled("", {f"{symbol} (yours: not yet)": right})
        else:
            yield from _agreeing(symbol, mine[0], right)
        if task == name:
            return
        title, shown = way.send(results_called(entry, answers)[0][0])


def _agreeing(symbol: str, mine: np.ndarray, right: np.ndarray) -> Iterator[str]:
    """A result of the student's, if it differs beside the right one."""
    scale = np.abs(right).max(initial=0.0) or 1.0
    if np.shape(mine) == np.shape(right) and np.abs(mine - right).max(initial=0.0) <= 1e-8 * scale:
        yield from titled("", {f"{symbol} (yours agrees)": right})
    else:
        yield from beside(symbol, mine, right, whole=False)


def example(assignment: str, case: int) -> Any:
    """The assignment's own example, a generator; None if it has none.

    `example(cases, case)` in `practice/` is given the public inputs of tasks by name, and the number of a case. It
    yields first its title and values to show, then more of these, or a symbol with a task and its arguments, for
    which it is sent the right result. `example_tasks` lists those tasks.
    """
    from muslin.judging import reference

    made = known(assignment, "example")
    table = tables.assignment(assignment).tasks
    cases = lambda task: to_called(table[task], reference.cases(assignment, task)[0])  # noqa: E731
    return made(cases, case) if made is not None else None


def record(assignment: str) -> dict[str, np.ndarray]:
    """The right answers that the example asks for in every case, by key."""
    from muslin.judging import reference

    found: dict[str, np.ndarray] = {}
    table = tables.assignment(assignment).tasks
    counts = [len(reference.cases(assignment, name)[1][0]) for name in table]
    for case in range(max(counts)) if known(assignment, "example") is not None else ():
        told, way = Told(assignment, f"explain {case}", found), example(assignment, case)
        item = next(way)
        while item is not None:
            asked = None
            if not isinstance(item[1], dict):
                task, given = item[1]
                entry = table[task]
                values = to_own(entry, {key: np.asarray(value)[None] for key, value in given.items()})
                asked = results_called(entry, told.answer(task, values))[0][0]
            try:
                item = way.send(asked)
            except StopIteration:
                item = None
    return found
