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
import test_fills_the_memory as memory
import test_forks_and_threads_without_end as forks
import test_leaves_folders_that_resist as resisting
import test_never_ends as never_ends
from attacking import BYSTANDER, LEVEL, honest, mounts, processes, system_v_key, write

from muslin.authoring import reference_data
from muslin.base import paths

GRADINGS = int(os.environ.get("MUSLIN_GRADINGS", "10"))
HANGS = "import time\ntime.sleep(1e6)\n"
SHARES = """
import ctypes
libc = ctypes.CDLL(None)
libc.shmget(KEY, ctypes.c_size_t(4096), 0o1600)
libc.semget(KEY, 1, 0o1600)
libc.msgget(KEY, 0o1600)
libc.mq_open(b"/TOKEN", 0o102, 0o600, None)
for folder in ("/dev/shm", "/tmp", "/var/tmp"):
    try:
        open(folder + "/TOKEN", "w").close()
    except OSError:
        pass
"""
ENDLESS = (
    never_ends.KERNEL.replace("ENDLESS", "kinetic_energy")
    .replace("ARGUMENTS", "v0, v1, v2, area, rho, h")
    .replace("RESULT", "area * k")
)
#: What is handed in: code in front of the solution's, or HONEST where that goes.
KINDS = {
    "honest": "",
    "endless": f"HONEST{ENDLESS}",
    "forks": forks.HOSTILE,
    "ends": "import os\nos._exit(3)\n",
    "memory": memory.HOSTILE,
    "crashes": "import ctypes\nctypes.string_at(0)\n",
    "shares": SHARES,
    "deep": resisting.DEEP,
    "closed": resisting.CLOSED,
    "garbage": "raise ValueError('\\x1b[2J')\n",
}


#: Kinds that leave the other task of their file alone.
SOUND = ("honest", "endless", "forks", "memory", "shares", "deep", "closed")


#: Kinds that cost no deadline: what graders that run side by side meet every day.
BRIEF = ("honest", "shares", "deep", "ends", "closed", "garbage", "crashes")


def handed_in(folder, token, number, kinds=(*KINDS, "stubs")):
    """So many submissions, each with bytes of its own: one of every kind, and so on from the beginning."""
    kinds = itertools.islice(itertools.cycle(kinds), number)
    return [
        write(folder / f"{k}-{kind}", {BYSTANDER: f"# {k}\n{_written(kind, token)}"})
        for k, kind in enumerate(kinds)
    ]


def _written(kind, token):
    if kind == "stubs":
        return (paths.assignment("cloth") / BYSTANDER).read_text(encoding="utf-8")
    code = KINDS[kind] if "HONEST" in KINDS[kind] else f"{KINDS[kind]}HONEST"
    code = code.replace("TOKEN", token).replace("KEY", str(system_v_key(token)))
    return code.replace("HONEST", honest(BYSTANDER))


GRADE = """
import sys
import muslin
for submission in sys.argv[2:]:
    record = muslin.grade(submission, safety=sys.argv[1], deadline=8.0, fresh=True)
    print([(task.name, task.status, task.score) for task in record.tasks])
"""
GRADE_CLASS = """
import sys
from muslin.classes.run import grade_class
print(grade_class(sys.argv[2], sys.argv[3], hidden=sys.argv[4], safety=sys.argv[1], jobs=2).told())
"""


def test_gradings_in_a_row_leave_nothing(attack, tmp_path):
    submissions = handed_in(tmp_path, attack.token, GRADINGS)
    attack.grade(submissions[0])  # whatever is opened once only
    before = attack._traces()
    assert not any(before[kind] for kind in ("processes", "files", "mounts", "system v"))
    for submission in submissions:
        record = attack.grade(submission, fresh=True, deadline=8.0)
        assert attack._traces() == before, submission.name
        assert (record["mass_block"].status == "passed") == (submission.name.partition("-")[2] in SOUND)


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


def test_two_graders_and_two_classes_at_once_leave_nothing(attack, tmp_path, scratch, hidden):
    kinds = {} if GRADINGS > 10 else {"kinds": BRIEF}
    submissions = handed_in(tmp_path / "alone", attack.token, max(3, GRADINGS // 4), **kinds)
    handed_in(tmp_path / "room", attack.token, max(3, GRADINGS // 4), **kinds)
    running = [_started(scratch, GRADE, *submissions) for _ in range(2)]
    running += [
        _started(scratch, GRADE_CLASS, tmp_path / "room", tmp_path / f"out{k}", hidden) for k in range(2)
    ]
    said = [process.communicate(timeout=1800) for process in running]
    assert not any(process.returncode for process in running), said
    assert said[0][0] == said[1][0]
    assert said[0][0].count("[(") == len(submissions)
    left = attack._traces()
    assert not any(left[kind] for kind in ("files", "mounts", "system v")), left
    assert not processes(str(scratch))
    assert not mounts(str(scratch))
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
