"""Child processes: what they say comes whole, a limit ends them with all they started, and none is left."""

import os
import signal
import subprocess
import sys
import time

import pytest

from muslin.base import child
from muslin.base.child import Child, forked, killer, last_line, python, run

posix = pytest.mark.skipif(sys.platform == "win32", reason="groups of processes and signals")

#: Says the number of a process of its own, which sleeps and holds the same pipes; then sleeps itself, or not.
PARENT = (
    "import subprocess, sys, time\n"
    "p = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)'])\n"
    "print(p.pid, flush=True)\n"
)
SLEEP = "time.sleep(600)\n"


def code(text):
    return [sys.executable, "-c", text]


def gone(pid, within=20.0):
    end = time.monotonic() + within
    while time.monotonic() < end:
        try:
            with open(f"/proc/{pid}/stat") as file:
                if file.read().rpartition(")")[2].split()[0] == "Z":
                    return True
        except FileNotFoundError:
            return True
        time.sleep(0.05)
    return False


def test_what_is_given_and_said_may_be_larger_than_a_pipe():
    text = "import sys; d = sys.stdin.buffer.read(); sys.stdout.buffer.write(d); sys.stderr.buffer.write(d)"
    given = os.urandom(1 << 20)
    done = run(code(text), given, limit=60)
    assert (done.output, done.errors, done.status, done.late) == (given, given, 0, False)


def test_how_a_process_ended_is_told():
    assert run(code("import sys; sys.exit(3)"), limit=60).status == 3
    assert killer(3) == killer(0) == ""


@posix
def test_a_signal_is_told_by_its_name():
    done = run(code("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)"), limit=60)
    assert killer(done.status) == "SIGSEGV"
    assert killer(-200) == "signal 200"


def test_what_cannot_be_started_is_an_error_of_the_system(tmp_path):
    for start in (lambda command: run(command, limit=1), Child):
        with pytest.raises(OSError, match="nowhere"):
            start([str(tmp_path / "nowhere")])


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="looks into /proc")
@pytest.mark.parametrize("text", [PARENT + SLEEP, PARENT], ids=["it sleeps", "it has ended"])
def test_a_limit_ends_it_with_what_it_started_and_keeps_what_it_said(text):
    done = run(code(text), limit=3)
    assert done.late
    assert gone(int(done.output))


@pytest.mark.skipif(not os.path.isdir("/proc"), reason="looks into /proc")
@pytest.mark.parametrize("text", [PARENT + SLEEP, PARENT], ids=["it sleeps", "it has ended"])
def test_leaving_the_block_ends_it_with_what_it_started(text):
    with Child(code(text)) as process:
        pid = int(process.line())
    assert gone(pid)
    assert process.wait(0) is not None


def test_one_that_hangs_is_ended_while_a_line_is_waited_for():
    with Child(code("import time; time.sleep(600)")) as process:
        with process.limited(0.5):
            assert process.line() == b""
        assert process.late


def test_lines_go_to_and_fro_and_the_last_error_is_kept():
    text = (
        "import sys\nfor line in sys.stdin:\n    print(line.upper(), end='', flush=True)\n"
        "print('x' * 100000, 'the end', sep='\\n', file=sys.stderr)"
    )
    with Child(code(text)) as process:
        for word in (b"one\n", b"two\n"):
            assert process.say(word)
            assert process.line() == word.upper()
        process.said_all()
        assert process.rest() == b""
        assert process.wait(60) == 0
        assert process.last_error() == "the end"
    assert not process.late


def test_one_that_has_gone_takes_nothing_and_says_so():
    with Child(code("pass")) as process:
        assert process.wait(60) == 0
        assert not process.say(b"x" * (1 << 20))


@posix
def test_ctrl_c_is_not_for_it():
    """What a terminal sends goes to the group in front: theirs is another."""
    with Child(code("import os; print(os.getpgid(0), flush=True); input()")) as process:
        assert int(process.line()) != os.getpgid(0)


def test_our_functions_are_called_wherever_we_stand(tmp_path, monkeypatch):
    (tmp_path / "json.py").write_text("raise SystemExit('the one in the working folder')")
    monkeypatch.chdir(tmp_path)
    done = run(python("muslin.cli:main"), limit=60)
    assert b"the working folder" not in done.errors
    assert b"Muslin: learn" in done.output + done.errors


def echo(channel, factor):
    while True:
        channel.send(factor * channel.recv())


def test_a_forked_one_takes_objects_and_is_ended():
    process, channel = forked(echo, 3)
    channel.send([1, 2])
    assert channel.poll(60)
    assert channel.recv() == [1, 2, 1, 2, 1, 2]
    code = child.stop(process)
    assert sys.platform == "win32" or killer(code) == "SIGKILL"
    assert not process.is_alive()


@posix
def test_a_forked_one_hears_that_its_parent_has_gone():
    text = (
        "import time\nfrom muslin.base.child import forked\n"
        "def listen(channel):\n"
        "    try:\n        channel.recv()\n"
        "    except EOFError:\n        pass\n"
        "if __name__ == '__main__':\n"
        "    process, _ = forked(listen)\n    print(process.pid, flush=True)\n    time.sleep(600)\n"
    )
    parent = subprocess.Popen(code(text), stdout=subprocess.PIPE)
    pid = int(parent.stdout.readline())
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    assert sys.platform != "linux" or gone(pid)


def test_the_last_line_is_one_that_can_be_shown():
    assert last_line(b"") == ""
    assert last_line(b"a\n\nb\xff\n \n") == "b\ufffd"
    assert len(last_line(b"x" * 1000)) == 300
