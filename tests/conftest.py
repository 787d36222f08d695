"""Fixtures of more than one file."""

from __future__ import annotations

import os
import shutil
import signal
from pathlib import Path

import pytest

from muslin.base import paths

# In the background of a shell Ctrl-C is ignored, and tests of it could not end.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# xdist gives its workers a width; what a command prints into a pipe is not folded without one.
os.environ.pop("COLUMNS", None)

ROOT = Path(__file__).resolve().parent.parent

#: What a checkout needs for assignments to be written, released and checked in it.
COPIED = (
    "pyproject.toml",
    "LICENSE",
    "framework/muslin",
    "solutions",
    "assignments",
    "data",
    "tests/misconceptions",
)


@pytest.fixture(scope="session")
def lost_diagnoses():
    """What was raised while a mistake was looked for: `diagnose` answers None then, so that no grade is lost."""
    from muslin.grading import diagnosis

    lost, real = [], diagnosis._diagnose

    def watched(*question):
        try:
            return real(*question)
        except Exception as error:
            lost.append(error)
            raise

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(diagnosis, "_diagnose", watched)
        yield lost


@pytest.fixture(autouse=True)
def no_diagnosis_is_lost(lost_diagnoses):
    """A fault in the diagnosis is not taken for a mistake without a name."""
    yield
    found = list(lost_diagnoses)
    lost_diagnoses.clear()
    assert found == []


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """A copy of the repository in which a test may do as it likes."""
    for name in COPIED:
        source, target = ROOT / name, tmp_path / name
        if source.is_dir():
            shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source, target)
    monkeypatch.setattr(paths, "_REPOSITORY", tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path
