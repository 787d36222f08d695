"""Classroom 50's result.json, schema result/v1: whole points, and exactly the keys it knows."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from typing import Any

from muslin.grading.record import PASSED, Record
from muslin.grading.views.text import half_up, one_line

#: What only the platform knows, and the environment variable its runner says it in.
FROM_RUNNER = {
    "classroom": "CLASSROOM",
    "assignment": "ASSIGNMENT",
    "assignment_type": "ASSIGNMENT_TYPE",
    "owner": "OWNER",
    "submission": "SUBMISSION_TAG",
    "commit": "COMMIT_URL",
    "release": "RELEASE_URL",
    "review": "REVIEW_URL",
}


def context_of(environ: Mapping[str, str]) -> dict[str, str]:
    """Context for `render` from the environment of Classroom 50's runner (`os.environ`); what is unset is left out."""
    return {key: environ[name] for key, name in FROM_RUNNER.items() if environ.get(name)}


def render(record: Record, context: Mapping[str, Any] | None = None) -> str:
    """The record for Classroom 50.

    Parameters
    ----------
    record : Record
    context : mapping, optional
        What only the platform knows: classroom, assignment, assignment_type, owner, submission, commit, release,
        review, datetime, and optionally graded_at and submitted_by. Its runner overwrites most of them.
    """
    given = dict(context or {})
    known = {
        "classroom": "unknown",
        "assignment": one_line(record.assignment.get("name", "")) or "unknown",
        "assignment_type": "individual",
        "owner": "unknown",
        "submission": one_line(record.submission.sha256) or "unknown",
        "commit": "unknown",
        "release": "unknown",
        "review": given.get("commit", "unknown"),
        "datetime": f"{datetime.now(timezone.utc):%Y-%m-%dT%H:%M:%SZ}",
    }
    scores = whole([task.score for task in record.tasks])
    most = whole([task.max_score for task in record.tasks])
    data: dict[str, Any] = {
        "schema": "classroom50/result/v1",
        **{key: given.get(key, value) for key, value in known.items()},
        **{key: given[key] for key in ("graded_at", "submitted_by") if key in given},
        "score": sum(scores),
        "max-score": sum(most),
        "tests": [
            {
                "test-name": one_line(task.name),
                "passed": task.status == PASSED,
                "score": score,
                "max-score": maximum,
            }
            for task, score, maximum in zip(record.tasks, scores, most, strict=True)
        ],
    }
    return json.dumps(data, indent=1, allow_nan=False) + "\n"


def whole(values: Sequence[float]) -> list[int]:
    """Whole numbers near `values` whose sum is the sum of `values`, rounded half up.

    Each is rounded down; the points still missing go to those who lost most by that, the earlier first.
    Rounding every task by itself could move the total by several points.
    """
    down = [math.floor(value + 1e-9) for value in values]
    missing = half_up(sum(values)) - sum(down)
    by_loss = sorted(range(len(down)), key=lambda k: (down[k] - values[k], k))
    for k in by_loss[:missing]:
        down[k] += 1
    return down
