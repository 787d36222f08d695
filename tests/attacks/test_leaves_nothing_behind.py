"""Beyond the table: what is left when many are graded, at once, or when a grading is stopped in the middle.

Defence: whoever starts a process makes its temporary folder and removes it; what is killed takes its own along, and
what nobody could remove is swept by the next.

`MUSLIN_GRADINGS=50 pytest tests/attacks/test_leaves_nothing_behind.py` runs more than the few of every day.
"""

import itertools
import os
import signal
import subprocess
import sys
import time

import pytest
import test_leaves_folders_that_resist as resisting
from attacking import BYSTANDER, LEVEL, honest, processes, write

from muslin.authoring import reference_data

GRADINGS = int(os.environ.get("MUSLIN_GRADINGS", "5"))
HANGS = "import time\ntime.sleep(1e6)\n"
KINDS = {
    "honest": "",
    "deep": resisting.DEEP,
    "closed": resisting.CLOSED,
    "ends": "import os\nos._exit(3)\n",
    "crashes": "import ctypes\nctypes.string_at(0)\n",
    "threads": "import threading\nfor _ in range(90):\n    try:\n        threading.Thread(target=input).start()\n"
    "    except RuntimeError:\n        pass\n",
    "garbage": "raise ValueError('\\x1b[2J')\n",
}
GRADE = """
import sys
import muslin
for submission in sys.argv[2:]:
    print(muslin.grade(submission, safety=sys.argv[1]).score)
"""
GRADE_CLASS = """
import sys
from muslin.classes.run import grade_class
print(grade_class(sys.argv[2], sys.argv[3], hidden=sys.argv[4], safety=sys.argv[1], jobs=2).told())
"""


def test_gradings_in_a_row_leave_nothing(attack, tmp_path):
    kinds = list(itertools.islice(itertools.cycle(KINDS.items()), GRADINGS))
    submissions = [
        write(tmp_path / f"{k}-{name}", {BYSTANDER: f"# {k}\n{code}{honest(BYSTANDER)}"})
        for k, (name, code) in enumerate(kinds)
    ]
    attack.grade(submissions[0])  # whatever is opened once only
    before = attack._traces()
    for submission in submissions:
        record = attack.grade(submission, fresh=True)
        assert attack._traces() == before, submission.name
        assert record["kinetic_energy"].max_score > 0


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    return reference_data.build("cloth", tmp_path_factory.mktemp("h") / "hidden", "a secret", 1, hidden=True)


@pytest.fixture
def scratch(tmp_path):
    """A temporary folder for processes of our own, to see what they leave."""
    folder = tmp_path / "scratch"
    folder.mkdir()
    for above in (folder, *folder.parents[:3]):
        above.chmod(0o711)
    return folder


def _started(scratch, program, *arguments):
    # its name is in the environment of every process there will be, be it as TMPDIR or as HOME
    environment = {**os.environ, "TMPDIR": str(scratch)}
    command = [sys.executable, "-c", program, LEVEL, *map(str, arguments)]
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def _class(folder, code, size=2):
    for k in range(size):
        write(folder / f"student{k}", {BYSTANDER: f"# {k}\n{code}{honest(BYSTANDER)}"})
    return folder


def test_two_graders_and_two_classes_at_once_leave_nothing(tmp_path, scratch, hidden):
    submissions = [
        write(tmp_path / f"s{k}", {BYSTANDER: f"# {k}\n" + honest(BYSTANDER)})
        for k in range(max(2, GRADINGS // 10))
    ]
    room = _class(tmp_path / "room", "", max(2, GRADINGS // 5))
    running = [_started(scratch, GRADE, *submissions) for _ in range(2)]
    running += [_started(scratch, GRADE_CLASS, room, tmp_path / f"out{k}", hidden) for k in range(2)]
    said = [process.communicate(timeout=600) for process in running]
    assert not any(process.returncode for process in running), said
    assert said[0][0] == said[1][0]
    assert not processes(str(scratch))
    assert not list(scratch.iterdir())
    tables = [(tmp_path / f"out{k}" / "grades.csv").read_bytes() for k in range(2)]
    assert tables[0] == tables[1]


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_class_that_is_stopped_leaves_no_hidden_answers(tmp_path, scratch, hidden, how):
    room = _class(tmp_path / "room", HANGS)
    run = _started(scratch, GRADE_CLASS, room, tmp_path / "out", hidden)
    until = time.monotonic() + 120
    while time.monotonic() < until and run.poll() is None:
        if len(processes(str(scratch))) >= 7 and list(scratch.glob("muslin-class-*/hidden data/*")):
            break  # the run, and two gradings with a fork server and a worker each
        time.sleep(0.1)
    assert run.poll() is None, run.communicate()
    run.send_signal(how)
    run.communicate(timeout=60)
    until = time.monotonic() + 30
    while (processes(str(scratch)) or list(scratch.iterdir())) and time.monotonic() < until:
        time.sleep(0.1)
    assert not processes(str(scratch))
    assert not list(scratch.iterdir())
