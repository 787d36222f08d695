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

#: The files that take longest, as measured on two cores, longest first. They begin first, so that none is left alone at
#: the end; a file that takes less than half a minute need not be here.
LONGEST = (
    "test_grading_misconceptions", "test_engines_agree", "test_grading_strangers", "test_course", "test_class_grading",
    "test_answers_nobody_asked_for", "test_variants", "test_leaves_nothing_behind", "test_docs_recipes", "test_places",
    "test_packing_students", "test_grading", "test_plain_python_is_judged_behind_the_same_walls", "test_authoring_lint",
    "test_authoring_scaffold", "test_never_ends", "test_hidden_inputs_leave_by_another_way", "test_viewer_browser",
    "test_simulation_solids", "test_grading_repairs", "test_viewer_play", "test_authoring_slips", "test_solids_judges",
    "test_reads_what_the_instructor_keeps", "test_engine_precision", "test_hangs_the_compiler", "test_class_mess",
    "test_class_again", "test_engine_stand_ins", "test_notebook",
)  # fmt: skip

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


def pytest_configure(config):
    """Keep our order: xdist would begin with the files of most tests, and end with those of few long ones."""
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(items):
    """The longest files first."""
    rank = {name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: rank.get(item.path.stem, len(rank)))


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
