"""What runs on a platform: a submission is graded, and the platform's own result file written by this process.

    python -I -m muslin.packing.grading gradescope /autograder
    python -I -m muslin.packing.grading classroom50 CHECKOUT PACK RESULT.json
    python -I -m muslin.packing.grading try ASSIGNMENT

Whatever a submission is or does, the result file is valid: where grading itself fails, it gives every task no
points, and says why. Students' code never runs in this process, and the processes it does run in can neither
read what only root may nor write any result.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from muslin import tasks
from muslin.base.errors import MuslinError
from muslin.base.writing import write
from muslin.tasks.constants import NOBODY

if TYPE_CHECKING:
    from muslin.grading.submission import Handed

#: In a pack: where it says which assignment it grades, and the folder of hidden data.
SETTINGS, HIDDEN = "muslin.json", "hidden"

#: On Gradescope we are root without namespaces: a user for every worker, or nothing. Never a worker that is root.
SAFETY = "uid"

#: What a student reads when the fault is ours.
OURS = (
    "The autograder itself has failed, which is no fault of yours. Your work has been received; "
    "please tell your instructor, who can grade it again."
)


def gradescope(root: Path) -> None:
    """Grade `<root>/submission` and write `<root>/results/results.json`.

    Hidden data, if the pack has any, are in `<root>/source/hidden`.
    """
    from muslin.grading import views
    from muslin.grading.grader import grade

    source = root / "source"
    assignment, hidden = _assignment(source), source / HIDDEN
    try:
        handed = _handed(root / "submission", assignment, root / "submission_metadata.json")
        if handed.unreadable and tasks.assignment(assignment).constants:
            text = json.dumps(_without_points(assignment, handed.unreadable), indent=1) + "\n"
        else:
            record = grade(handed, assignment, hidden=hidden if hidden.is_dir() else None, safety=SAFETY)
            text = views.render(record, "gradescope")
    except Exception as error:
        traceback.print_exception(error)
        text = json.dumps(_without_points(assignment, OURS), indent=1) + "\n"
    _put(root / "results" / "results.json", text)


def classroom50(checkout: Path, pack: Path, result: Path) -> None:
    """Grade a student's checkout and write Classroom 50's `result.json`; what only it knows is in the environment."""
    from muslin.grading import views
    from muslin.grading.grader import grade
    from muslin.grading.views.classroom50 import context_of

    assignment = _assignment(pack)
    record = grade(_handed(checkout, assignment), assignment)
    print(views.render(record, "terminal"))
    _put(result, views.render(record, "classroom50", context=context_of(os.environ)))


def try_out(assignment: str) -> None:
    """Grade the untouched stubs: does everything work here that grading needs?"""
    from muslin.base import paths
    from muslin.grading.grader import grade

    stubs = replace(_handed(paths.assignment(assignment), assignment), student=NOBODY)
    record = grade(stubs, assignment, safety=SAFETY)
    if any(task.status != "not implemented" for task in record.tasks):
        raise MuslinError(f"Grading does not work here: {record.tasks[0].message}", "Run: muslin doctor")
    print(f"Grading works here; submissions are kept apart by: {record.safety.level}.")
    for note in record.safety.notes:
        print(note)


def _assignment(pack: Path) -> str:
    return str(json.loads((pack / SETTINGS).read_text(encoding="utf-8"))["assignment"])


def _handed(submission: Path, assignment: str, metadata: Path | None = None) -> Handed:
    """What was handed in; nothing is an empty folder. With Gradescope's metadata, also whose it is."""
    from muslin.classes.finding import Student, Submission
    from muslin.classes.whose import assigned
    from muslin.grading.submission import collect

    table = tasks.assignment(assignment)
    with tempfile.TemporaryDirectory() as nothing:
        handed = collect(submission if submission.exists() else Path(nothing), table)
    if metadata is None or table.constants is None:
        return handed
    users = json.loads(metadata.read_text(encoding="utf-8"))["users"]
    known = [Student(str(user.get("name", "")), str(user[key])) for user in users
             for key in ("email", "sid", "id") if user.get(key)]  # fmt: skip
    return assigned(handed, Submission("", tuple(known), ()), (), table)


def _without_points(assignment: str, why: str) -> dict[str, Any]:
    """A Gradescope result in which every task has failed for the same reason."""
    table = tasks.assignment(assignment)
    return {
        "score": 0,
        "output": why,
        "output_format": "text",
        "stdout_visibility": "hidden",
        "tests": [
            {
                "name": f"{task.name}: {task.title}",
                "score": 0,
                "max_score": task.points,
                "status": "failed",
                "output": why,
                "output_format": "text",
            }
            for task in table.tasks.values()
        ],
    }


def _put(path: Path, text: str) -> None:
    """Write a file at once and whole, never through a link somebody has left there."""
    write(path, text.encode())
    path.chmod(0o644)


COMMANDS: Mapping[str, Callable[..., None]] = {
    "gradescope": lambda root: gradescope(Path(root)),
    "classroom50": lambda checkout, pack, result: classroom50(Path(checkout), Path(pack), Path(result)),
    "try": try_out,
}


if __name__ == "__main__":
    try:
        COMMANDS[sys.argv[1]](*sys.argv[2:])
    except MuslinError as error:
        sys.exit(f"muslin: {error}")
