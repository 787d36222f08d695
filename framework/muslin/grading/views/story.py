"""What a record has to say, in plain words and in reading order: shared by every view that is read by people.

Views escape what is returned here once more, each in its own way, and cap the whole.
"""

from __future__ import annotations

from collections.abc import Iterator

from muslin.base.engine import ENGINES
from muslin.grading.record import ERROR, FAILED, NOT_IMPLEMENTED, PASSED, SKIPPED, Check, Record, TaskResult
from muslin.grading.views.text import capped

#: How a status is said to a person.
WORDS = {
    PASSED: "passed",
    FAILED: "not right yet",
    NOT_IMPLEMENTED: "not implemented yet",
    ERROR: "cannot be run",
    SKIPPED: "skipped",
}

#: Most characters that are shown of a check's message and of what a submission printed.
MESSAGE, OUTPUT = 4_000, 6_000

#: Most notes that are shown.
NOTES = 20


def numbered(record: Record) -> Iterator[tuple[str, TaskResult]]:
    """Tasks with their numbers: the second task of the first section is "1.2"."""
    sections: list[str] = []
    count = 0
    for task in record.tasks:
        if not sections or task.section != sections[-1]:
            sections.append(task.section)
            count = 0
        count += 1
        yield f"{len(sections)}.{count}", task


def told(check: Check) -> list[str]:
    """A check in lines: its name and message, then the likely mistake and the next step where they are known."""
    first, *more = capped(check.message, MESSAGE).split("\n")  # however long it is, advice follows
    lines = [f"{check.name}: {first}", *(f"  {line}" for line in more)]
    if check.diagnosis:
        lines.append(f"Likely mistake: {check.diagnosis}")
    if check.advice:
        lines.append(f"Next step: {check.advice}")
    return lines


def task_told(task: TaskResult) -> str:
    """What a student should read about a task."""
    if task.status == NOT_IMPLEMENTED:
        return f"Not implemented yet. The handout explains it in section {task.section}, the file is {task.file}."
    failed = [check for check in task.checks if check.status == FAILED]
    if not failed:
        passed = [check for check in task.checks if check.status == PASSED]
        return "\n".join(f"{check.name}: {check.message}" for check in passed) or "Passed."
    lines = [line for check in failed for line in told(check)]
    if skipped := [check.name for check in task.checks if check.status == SKIPPED]:
        lines.append(f"Not looked at because of that: {', '.join(skipped)}.")
    lines.append(f"Handout: section {task.section}. File: {task.file}.")
    return "\n".join(lines)


def simulation_told(record: Record) -> str:
    """What became of the simulation."""
    simulation = record.simulation
    lines = [simulation.message]
    for check in simulation.checks:
        if check.status == FAILED:
            lines += told(check)
    if simulation.stand_ins and simulation.status != SKIPPED:
        lines.append(
            f"Muslin's own code stood in for: {', '.join(simulation.stand_ins)}. "
            "The simulation earns no points of its own."
        )
    return "\n".join(lines)


def printed(task: TaskResult, limit: int) -> str:
    """What the submission printed, escaped and cut, with a margin that no line of it can leave."""
    return "\n".join(f"| {line}".rstrip() for line in capped(task.output.rstrip("\n"), limit).split("\n"))


def circumstances(record: Record) -> list[tuple[str, str]]:
    """How the grading was done: name and value, in reading order."""
    environment, hidden = record.environment, record.hidden
    cases = f"{hidden.get('cases', 0)} drawn per task"
    if hidden.get("instructor"):
        cases += f", {hidden['instructor']} per task from the instructor"
    safety = record.safety
    notes = [*record.submission.notes, *safety.notes]
    if len(notes) > NOTES:
        notes[NOTES - 1 :] = [f"and {len(notes) - NOTES + 1} more"]
    known = [name for name in ("muslin", *ENGINES, "numpy", "mpmath", "python") if name in environment]
    mode = [str(environment.get("precision", "")), f"threads: {environment.get('threads', '')}"]
    mode.append("fast math" if environment.get("fast_math") else "no fast math")
    return [
        ("Submission", f"{record.submission.name}, sha256 {record.submission.sha256}"),
        ("Assignment", f"{record.assignment.get('name', '')} {record.assignment.get('version', '')}".strip()),
        ("Seed", f"{record.seed} (hidden cases: {cases})"),
        ("Safety", f"{safety.level} (asked for: {safety.asked})"),
        ("Versions", ", ".join(f"{name} {environment[name]}" for name in known)),
        ("System", str(environment.get("platform", ""))),
        ("Mode", ", ".join(mode)),
        *(("Note", note) for note in notes),
    ]
