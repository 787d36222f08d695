"""Attack 1: atexit handlers, destructors and threads rewrite the results file when grading ends.

Defence: the results are written by the grader, after the submission's processes are dead, to a place they
could never write to.
"""

import json

import pytest
from attacking import TARGET, honest

from muslin.grading import views

HOSTILE = """
import atexit, os, threading, weakref

def rewrite(*_):
    for folder in {folders!r}:
        for name in ("results.json", "record.json"):
            try:
                with open(os.path.join(folder, name), "w") as stream:
                    stream.write('{{"score": 1000, "tests": []}}')
            except OSError:
                pass

class Late:
    def __del__(self):
        rewrite()

late = Late()
atexit.register(rewrite)
weakref.finalize(late, rewrite)
threading.Timer(0.3, rewrite).start()
rewrite()
"""


@pytest.mark.with_simulation
def test_results_are_those_of_the_grader(attack, tmp_path):
    out = tmp_path / "out"
    out.mkdir(mode=0o777)
    record = attack({TARGET: HOSTILE.format(folders=[str(out), ".", "/autograder/results"]) + honest()})
    assert not list(out.iterdir())
    path = views.write(record, "gradescope", out)
    assert json.loads(path.read_text())["score"] == record.score
