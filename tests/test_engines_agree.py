"""Taichi and Quadrants give the same numbers, where both are installed: the first steps of every scene, and grades."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from muslin.base import engine
from muslin.simulation import scenes

ROOT = Path(__file__).resolve().parent.parent
BOTH = all(known.installed for known in engine.ENGINES.values())
pytestmark = pytest.mark.skipif(not BOTH, reason="needs both engines: pip install -e '.[quadrants]'")

#: Steps of each scene; the two that acceptance names take twenty.
STEPS = {"throw": 20, "drape": 20}

COMPUTE = """
import sys
import numpy as np
import muslin
from muslin.simulation import scenes
functions = {{name: muslin.load({solutions!r} + "/" + name) for name in ("cloth", "solids")}}
found = {{}}
for name in scenes.SCENES:
    f = functions["solids" if name in scenes.SOLIDS else "cloth"]
    run = muslin.simulate(name, functions=f, steps={steps!r}.get(name, 3))
    found[name + ": x"], found[name + ": v"] = run.x, run.v
    found[name + ": energy"] = np.array(run.energies["elastic"])
np.savez({out!r}, **found)
"""

#: Grades the solution, the stubs, and submissions with a misconception in every function: 68 in four.
GRADE = """
import json, sys
from pathlib import Path
import muslin
from muslin.base import paths
sys.path.insert(0, {suite!r})
import suite
folders = {{"solution": paths.solution("cloth"), "stubs": paths.assignment("cloth")}}
for k, chosen in zip(range({rounds}), suite.rounds("wrong")):
    folders["wrong %d" % k] = suite.submission(Path({out!r}) / str(k), chosen)
found = {{}}
for name, folder in folders.items():
    record = muslin.grade(folder, seed="engines")
    found[name] = dict(score=record.score, simulation=record.simulation.status)
    for task in record:
        checks = [(check.name, check.status, check.cause) for check in task.checks]
        found[name][task.name] = task.status, task.score, task.message, checks
print(json.dumps(found))
"""
ROUNDS = 4


@pytest.fixture(scope="module")
def computed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("engines")
    results = {}
    for name in engine.ENGINES:
        out = folder / f"{name}.npz"
        code = COMPUTE.format(solutions=str(ROOT / "solutions"), steps=STEPS, out=str(out))
        environment = os.environ | {engine.VARIABLE: name, "MUSLIN_THREADS": "1"}
        subprocess.run([sys.executable, "-c", code], env=environment, check=True, capture_output=True)
        with np.load(out) as data:
            results[name] = dict(data)
    return results


def test_the_first_steps_of_every_scene_are_the_same_on_either_engine(computed):
    ours, theirs = computed["taichi"], computed["quadrants"]
    assert set(ours) == set(theirs)
    assert {name.split(":")[0] for name in ours} == set(scenes.SCENES)
    for name, values in ours.items():
        assert np.abs(values).max() > 0 or name.endswith("energy"), name
        np.testing.assert_allclose(
            theirs[name], values, rtol=0, atol=1e-12 * np.abs(values).max(), err_msg=name
        )


def graded(name: str, folder: Path) -> dict[str, dict[str, object]]:
    """What grading says on an engine, by submission."""
    suite = str(ROOT / "tests" / "misconceptions")
    code = GRADE.format(suite=suite, rounds=ROUNDS, out=str(folder))
    environment = os.environ | {engine.VARIABLE: name, "XDG_CACHE_HOME": str(folder)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, check=True, stdout=subprocess.PIPE)
    return dict(json.loads(done.stdout))


def test_the_solution_the_stubs_and_misconceptions_get_the_same_grade_on_either_engine(tmp_path):
    ours, theirs = (graded(name, tmp_path / name) for name in engine.ENGINES)
    assert ours["solution"]["score"] == 100
    assert ours["stubs"]["score"] == 0
    assert len(ours) == 2 + ROUNDS
    for name, said in ours.items():
        assert theirs[name] == said, name
