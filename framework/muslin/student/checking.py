"""A task against the public cases and the properties: what came, the most likely mistake, and the next step.

What is green here gets full points from the grader, but for hidden cases. `check` runs in the command's process and
asks a worker, where `examine` runs the student's code.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from muslin.base.errors import MuslinError
from muslin.judging import judge
from muslin.student.worker import Crashed, Stopped, Worker
from muslin.student.workspace import Workspace

GREEN, WRONG, TODO, ERROR = "green", "wrong", "to do", "error"

#: What the inputs of the properties are drawn from; the grader draws once, from a seed of its own.
SEEDS = ("check 0", "check 1", "check 2", "check 3")

#: How long the mistake behind an answer is looked for; the verdict stands without [s].
EXPLAINING = 10.0

#: A worker is renewed after so many checks: each leaves about 4 MB of kernels behind.
RENEWED_AFTER = 40


@dataclass(frozen=True)
class Report:
    """What came of one task.

    Attributes
    ----------
    task : str
    status : str
        "green", "wrong", "to do" (still the stub) or "error" (it cannot be run).
    message : str
        For people; the first line says it all.
    case : int, optional
        The worst public case of a wrong answer.
    mistake, advice : str
        The most likely mistake in words and one next step; empty where none is recognised.
    notes : tuple of str
        What a reader notices in the function's text (see `reading`).
    """

    task: str
    status: str
    message: str
    case: int | None = None
    mistake: str = ""
    advice: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Draft:
    """A verdict that stands, before anyone has looked for the mistake behind it; that may take long, or for ever.

    Attributes
    ----------
    report : Report
    allowed : float
        How long the look may take: the same report follows, explained, or the draft is all there is [s].
    """

    report: Report
    allowed: float


#: Finds the likely mistake in a student's text.
Explain = Callable[[], Any]


def examine(folder: Path, assignment: str, names: tuple[str, ...]) -> Iterator[Report]:
    """Evaluate and judge tasks."""
    return (found for found in drafted(folder, assignment, names) if isinstance(found, Report))


def drafted(folder: Path, assignment: str, names: tuple[str, ...]) -> Iterator[Report | Draft]:
    """Evaluate and judge tasks; what is not green is told before it is explained. Runs in a worker."""
    from muslin import tasks
    from muslin.base.errors import NotImplementedYet
    from muslin.judging import reference
    from muslin.reading import source
    from muslin.tasks.batch import evaluate

    table = tasks.assignment(assignment)
    loaded: dict[str, tasks.Functions] = {}  # file by file: a file that crashes costs its own tasks only
    for name in names:
        inputs, expected = reference.cases(assignment, name)
        arguments: dict[str, Any] = dict(inputs)
        file = table.tasks[name].file
        try:
            if file not in loaded:
                if not (folder / file).is_file():
                    raise MuslinError(f"{file} is missing.", "Bring it back with: muslin upgrade")
                inside = {key: task for key, task in table.tasks.items() if task.file == file}
                loaded[file] = tasks.load(folder, replace(table, tasks=inside))
            got = evaluate(loaded[file][name], **arguments)
        except NotImplementedYet as error:
            yield Report(name, TODO, str(error))
            continue
        except MuslinError as error:
            report = Report(name, ERROR, str(error))
            yield Draft(report, EXPLAINING)
            function = loaded[file][name] if file in loaded else None
            found = None
            if function is not None:
                from muslin.grading.diagnosis import misfit

                found = misfit(table.tasks[name], expected, inputs, assignment, source.glimpse(folder / file))
            yield replace(_explained(report, found), notes=_notes(function, report.message))
            continue
        outputs = got if isinstance(got, tuple) else (got,)
        report, explain = _compared(table, name, outputs, inputs, expected, folder / file)
        if report.status == GREEN:
            held = _held(table, name, loaded[file][name], inputs, expected, folder / file)
            report, explain = held or (report, explain)
        if report.status != GREEN:
            yield Draft(report, EXPLAINING)
            report = replace(_explained(report, explain()), notes=_notes(loaded[file][name]))
        yield report


def _explained(report: Report, found: Any) -> Report:
    """A report with the likely mistake, if one was found."""
    if found is None:
        return report
    return replace(report, mistake=f"{report.mistake} {found.mistake}".strip(), advice=found.advice)


def _compared(
    table: Any, name: str, outputs: Any, inputs: Any, expected: Any, path: Path
) -> tuple[Report, Explain]:
    """The public cases, and who looks for what is wrong, in the file too."""
    from muslin.judging import reference
    from muslin.reading import source

    own = judge(table.name, name)
    limits = own.limits(inputs)
    verdict = reference.compare(table.tasks[name], outputs, expected, inputs, own.terms, limits)
    if verdict.ok:
        return Report(name, GREEN, verdict.message, verdict.case), lambda: None

    def explain() -> Any:
        from muslin.grading.diagnosis import diagnose

        return diagnose(table.tasks[name], outputs, expected, inputs, table.name, source.glimpse(path))

    return Report(name, WRONG, verdict.message, verdict.case), explain


def _held(
    table: Any, name: str, function: Any, cases: Any, expected: Any, path: Path
) -> tuple[Report, Explain] | None:
    """What must hold for all inputs, tried on some that are no public cases; the first that does not hold."""
    from muslin.judging import properties
    from muslin.judging.reference import shown
    from muslin.tasks.batch import evaluate

    task = table.tasks[name]
    drawn = [pair for seed in SEEDS for pair in properties.draw(table.name, name, seed)]
    if not drawn:
        return None
    arguments: dict[str, Any] = properties.batch([inputs for _, inputs in drawn])
    try:
        got = evaluate(function, **arguments)
    except MuslinError as error:
        return Report(name, ERROR, str(error)), lambda: None
    outputs = properties.apart(got if isinstance(got, tuple) else (got,), [inputs for _, inputs in drawn])
    for (prop, inputs), results in zip(drawn, outputs, strict=True):
        errors = properties.errors(prop, inputs, results)
        if errors.max(initial=0.0) > prop.tolerance:

            def explain() -> Any:
                from muslin.grading.upheld import upheld
                from muslin.reading import source

                return upheld(task, expected, cases, drawn, outputs, table.name, source.glimpse(path))

            sample = int(errors.argmax())  # of groups of samples: the first of the group
            lines = shown({value.name: inputs[value.name][sample] for value in task.inputs})
            lines += shown(
                {value.name: out[sample] for value, out in zip(task.results, results, strict=True)}
            )
            message = "\n".join([f"the public cases agree, but not all inputs do ({prop.name})", *lines])
            mistake = f"This must hold, and does not: {prop.statement}"
            advice = "Work these inputs by hand: the grader tries others of their kind."
            return Report(name, WRONG, message, mistake=mistake, advice=advice), explain
    return None


def _notes(function: Callable[..., Any] | None, message: str = "") -> tuple[str, ...]:
    """What is noticed in a function's text; nothing if an error tells of it already."""
    from muslin import reading

    if function is None or any(note.words[1:] in message for note in reading.of(function)):
        return ()
    return tuple(reading.told(function))


def noticed(folder: Path, assignment: str, name: str) -> Iterator[str]:
    """What is noticed in a task's function, which is not run; runs in a worker."""
    from muslin import tasks

    table = tasks.assignment(assignment)
    inside = {key: task for key, task in table.tasks.items() if task.file == table.tasks[name].file}
    yield from _notes(tasks.load(folder, replace(table, tasks=inside))[name])


class Checker:
    """Checks tasks in a worker, and replaces the worker when it crashes or has served long enough.

    Parameters
    ----------
    ready : tuple of str
        Modules the worker imports before it is asked anything.
    """

    def __init__(self, ready: tuple[str, ...] = ()) -> None:
        self._worker: Worker | None = None
        self._ready = ready

    def __enter__(self) -> Checker:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the worker."""
        if self._worker is not None:
            self._worker.close()
        self._worker = None

    def warm(self) -> None:
        """Have a worker ready: start one if there is none, renew one that has served long enough."""
        if self._worker is not None and self._worker.asked >= RENEWED_AFTER:
            self.close()
        if self._worker is None:
            self._worker = Worker(ready=self._ready)

    def check(
        self, workspace: Workspace, names: list[str], stop: Callable[[], bool] | None = None
    ) -> Iterator[Report]:
        """Reports of tasks, in order; a crash or an endless loop costs its own task only.

        What is found is remembered in the workspace. When `stop`, asked now and then, says so, the rest is left.
        """
        keys = {name: workspace.key(name) for name in names}
        waiting = list(names)
        while waiting:
            crash, draft = None, None
            try:
                for found in self._asked(workspace, list(waiting), stop):
                    if isinstance(found, Draft):
                        draft = found.report
                        continue
                    draft = None
                    waiting.remove(found.task)
                    yield self._kept(workspace, found, keys)
            except Stopped:
                self._worker = None
                return
            except Crashed as error:
                crash = error
            if crash is not None:  # after the handler: a process forked inside it inherits the exception
                self._worker = None
                name = waiting.pop(0)
                yield self._kept(workspace, draft or self._crashed(workspace, name, crash), keys)

    def _asked(
        self, workspace: Workspace, names: list[str], stop: Callable[[], bool] | None
    ) -> Iterator[Report | Draft]:
        self.warm()
        assert self._worker is not None
        arguments = (workspace.folder, workspace.table.name, tuple(names))
        deadline = workspace.table.grading.deadline
        yield from self._worker.ask(drafted, *arguments, deadline=deadline, stop=stop)

    def _kept(self, workspace: Workspace, report: Report, keys: dict[str, str]) -> Report:
        kept = {"key": keys[report.task], "status": report.status, "first": report.message.split("\n")[0]}
        workspace.remember("verdicts", report.task, kept)
        return report

    def _read(self, workspace: Workspace, name: str) -> tuple[str, ...]:
        """What is noticed in a function that cannot be run; in a worker, since its file must be imported."""
        arguments = (workspace.folder, workspace.table.name, name)
        try:
            with Worker() as worker:
                return tuple(worker.ask(noticed, *arguments, deadline=workspace.table.grading.deadline))
        except MuslinError:
            return ()

    def _endless(self, workspace: Workspace, told: Report) -> Report:
        """What keeps a function in plain Python from coming to an end, added to what is told of it."""
        from muslin.grading.diagnosis import misfit
        from muslin.judging import reference
        from muslin.reading import source

        table = workspace.table
        task = table.tasks[told.task]
        if not task.in_python:
            return told
        inputs, expected = reference.cases(table.name, told.task)
        found = misfit(task, expected, inputs, table.name, source.glimpse(workspace.folder / task.file))
        return replace(told, mistake=found.mistake, advice=found.advice) if found else told

    def _crashed(self, workspace: Workspace, name: str, crash: Crashed) -> Report:
        """What a crash was about: a second look, slower, names an index out of range."""
        told = Report(name, ERROR, crash.message, notes=self._read(workspace, name))
        if crash.late:
            return self._endless(workspace, told)
        try:
            with Worker(debug=True) as worker:
                arguments = (workspace.folder, workspace.table.name, (name,))
                for report in worker.ask(examine, *arguments, deadline=workspace.table.grading.deadline):
                    if report.status == ERROR:
                        return report
        except MuslinError:
            pass
        return told


def summary(workspace: Workspace, reports: list[Report]) -> str:
    """How many are green; where everything is, what comes next."""
    green = sum(report.status == GREEN for report in reports)
    line = f"{green} of {len(reports)} tasks agree with the reference data."
    if green < len(workspace.table.tasks):
        return line
    return f"{line} Everything is green.\nNext: {workspace.next_step()}"


def told(workspace: Workspace, report: Report, width: int = 0, brief: bool = False) -> list[str]:
    """A report in lines for a terminal.

    Parameters
    ----------
    workspace : Workspace
    report : Report
    width : int
        Of the column of names.
    brief : bool
        One line only.
    """
    mark = {GREEN: "ok  ", WRONG: "FAIL", TODO: "todo", ERROR: "FAIL"}[report.status]
    first, *more = report.message.split("\n")
    lines = [f"  {mark} {report.task:{width}}  {first}"]
    if brief or report.status in (GREEN, TODO):
        return lines
    lines += [f"         {line}" for line in more]
    rows = [("likely", report.mistake), ("try", report.advice), *(("look", note) for note in report.notes)]
    rows.append(("read", workspace.chapter(report.task)))
    if report.status == WRONG:
        at = f" --case {report.case}" if report.case is not None else ""
        rows.append(("more", f"muslin explain {report.task}{at}   or   muslin hint {report.task}"))
    return lines + [f"       {label:>6}: {text}" for label, text in rows if text]
