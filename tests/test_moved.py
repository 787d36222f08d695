"""What has moved is found under its old name, which says where it is now."""

import importlib
import sys
import warnings

import pytest

from muslin.base import moved

#: Names the documentation gave before the rooms.
NAMED = {
    "muslin.batch": "evaluate",
    "muslin.body": "Body",
    "muslin.cloth": "Cloth",
    "muslin.colliders": "Sphere",
    "muslin.elements.element": "Element",
    "muslin.elements.limit": "StretchLimit",
    "muslin.errors": "MuslinError",
    "muslin.integrators": "linearly_implicit_euler",
    "muslin.material": "lame",
    "muslin.model": "Model",
    "muslin.runs": "RunFolder",
    "muslin.runtime": "choose",
    "muslin.scenes": "get",
    "muslin.scenes.scene": "Scene",
    "muslin.show": "render_run",
    "muslin.simulation": "simulate",
    "muslin.solvers": "System",
}


@pytest.mark.parametrize("old", NAMED)
def test_an_old_name_gives_what_the_new_one_has_and_says_where_that_is(old):
    forgotten = {name: sys.modules.pop(name) for name in [*sys.modules] if name == old and moved.home(name)}
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        module = importlib.import_module(old)
    sys.modules.update(forgotten)
    new = moved.home(old)
    if new is None:
        assert module.__name__ == old
        assert callable(getattr(module, NAMED[old]))
        return
    assert getattr(module, NAMED[old]) is getattr(importlib.import_module(new), NAMED[old])
    assert f"{old} is now {new}." in [str(warning.message) for warning in said]


def test_what_never_was_is_not_found():
    with pytest.raises(ModuleNotFoundError, match=r"muslin\.batches"):
        importlib.import_module("muslin.batches")
    assert moved.home("muslin.grading.grader") is None
    assert moved.home("numpy.batch") is None
