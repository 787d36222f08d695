"""The command line: `muslin COMMAND`. Each command is a thin face of one function elsewhere.

- `app`         the command itself, what all commands share, `main`
- `console`     the terminal: width, colours, letters it lacks, progress
- `student`     start, check, watch, list, hint, reset, run, handout, explain, gradcheck, submit, upgrade
- `simulating`  simulate, scenes, render, export, demo, doctor
- `viewing`     view, play, mesh
- `grading`     grade
- `classes`     class grade
- `authoring`   release, reference
- `benching`    bench

Commands import what they do when they run, so that `muslin --help` is instant.
"""

from muslin.cli.app import INTERRUPTED, app, main

from muslin.cli import student, experimenting, simulating, viewing, grading, classes, authoring, benching  # isort: skip  # noqa: RUF100  (in the order of --help)

__all__ = [
    "INTERRUPTED",
    "app",
    "authoring",
    "benching",
    "classes",
    "experimenting",
    "grading",
    "main",
    "simulating",
    "student",
    "viewing",
]
