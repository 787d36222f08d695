"""The task table of an assignment, any folder of student functions read against it, and how they are evaluated.

A manifest (`assignment.toml`) is the single list of what a student fills in (`manifest`). `load` reads a folder by
path, so any folder with those files is a submission; one broken file costs only its own tasks (`loading`).
"""

from muslin.tasks.kinds import form, kind_of
from muslin.tasks.loading import Functions, answered, failure_of, is_stub, load, taken, usable
from muslin.tasks.manifest import (
    EXPERIMENTS,
    MANIFEST,
    Assignment,
    Grading,
    Question,
    Task,
    Value,
    assignment,
    named_in,
    read_assignment,
)

__all__ = [
    "EXPERIMENTS",
    "MANIFEST",
    "Assignment",
    "Functions",
    "Grading",
    "Question",
    "Task",
    "Value",
    "answered",
    "assignment",
    "failure_of",
    "form",
    "is_stub",
    "kind_of",
    "load",
    "named_in",
    "read_assignment",
    "taken",
    "usable",
]
