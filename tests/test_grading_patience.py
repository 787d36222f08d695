"""How long a worker may take: what it does is charged, what the machine keeps it from is not."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys

import pytest

from muslin.grading.patience import CAP, LOOK, Patience, Sight, TooLate, sight


def charged(steps, seconds=10.0):
    """How many steps (time passed, processor time used by then, busy) a patience of so many seconds stands."""
    at = [Sight(0.0, False)]
    patience = Patience(seconds, look=lambda process: at[0])
    patience.watch(1)
    for count, (passed, used, busy) in enumerate(steps):
        at[0] = Sight(used, busy)
        try:
            patience.charge(passed, passed)
        except TooLate:
            return count
    return None


def test_what_computes_is_charged_the_processor_time_it_uses():
    assert charged((LOOK, k * LOOK, True) for k in range(1000)) == pytest.approx(10 / LOOK, abs=2)


def test_what_sleeps_is_charged_the_time_that_passes():
    assert charged((LOOK, 0.0, False) for _ in range(1000)) == pytest.approx(10 / LOOK, abs=2)


def test_what_gets_no_core_is_charged_what_it_uses_and_capped_in_the_end():
    assert charged((LOOK, k * LOOK / 50, True) for k in range(int(9 * 10 / LOOK))) is None
    assert charged((LOOK, 0.0, True) for _ in range(10_000)) == pytest.approx(CAP * 10 / LOOK, abs=2)


def test_many_threads_are_charged_for_each_core_they_use():
    assert charged((LOOK, 4 * k * LOOK, True) for k in range(1000)) == pytest.approx(10 / LOOK / 4, abs=2)


def test_where_nothing_is_told_of_processes_all_time_counts():
    patience = Patience(1.0, look=lambda process: None)
    patience.watch(1)
    for _ in range(round(1 / LOOK)):
        patience.charge(LOOK, LOOK)
    with pytest.raises(TooLate):
        patience.charge(LOOK, LOOK)


def test_what_has_come_is_taken_and_nobody_charged_however_long_the_grader_was_stopped():
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.send(b"x")
        clock = iter(range(0, 10**9, 10**5))
        patience = Patience(5.0, clock=lambda: next(clock), look=lambda process: Sight(0.5, False))
        patience.watch(1)
        for _ in range(5):
            patience.wait(ours)
        assert ours.recv(1) == b"x"


def test_drops_without_end_come_to_their_end():
    ours, theirs = socket.socketpair()
    time = [0.0]

    def tick():
        time[0] += 0.05
        return time[0]

    with ours, theirs:
        theirs.send(b"x" * 10_000)
        patience = Patience(2.0, clock=tick, look=lambda process: Sight(0.0, False))
        patience.watch(1)

        def read_all():
            while True:
                patience.wait(ours)
                ours.recv(1)

        with pytest.raises(TooLate):
            read_all()


def test_who_waits_for_an_answer_is_not_charged_for_it_however_seldom_the_grader_gets_a_core():
    """Each call comes late, and whoever looks then finds its caller asleep: 75 s of that leave all 10 s."""
    ours, theirs = socket.socketpair()
    clock = iter([0.3 * k for k in range(1000)])
    with ours, theirs:
        patience = Patience(10.0, clock=lambda: next(clock), look=lambda process: Sight(0.0, False))
        patience.watch(1)
        for _ in range(250):
            theirs.send(b"x")
            patience.wait(ours)
            ours.recv(1)
            patience.answered(1e-3)
        patience.charge(9.9, 9.9)
        with pytest.raises(TooLate):
            patience.charge(0.2, 0.2)


def test_what_has_come_while_one_looked_is_no_sleep():
    patience = Patience(1.0, look=lambda process: Sight(0.0, False))
    patience.watch(1)
    for _ in range(20):
        patience.charge(LOOK, LOOK, lambda: True)


def test_answers_without_end_come_to_their_end():
    patience = Patience(1.0, look=lambda process: Sight(0.0, False))
    for _ in range(round(CAP)):
        patience.answered(0.999)
    with pytest.raises(TooLate):
        patience.answered(0.1)


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="no /proc on this system")
def test_a_process_is_seen_to_compute_and_to_sleep():
    code = "import sys\nwhile True:\n    print(flush=True)\n    sys.stdin.readline()\n    sum(range(3_000_000))\n"
    with subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as process:
        used = []
        for _ in range(3):
            process.stdout.readline()
            used.append(sight(process.pid).used)
            process.stdin.write(b"\n")
            process.stdin.flush()
        process.stdout.readline()
        process.send_signal(signal.SIGSTOP)
        os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WNOWAIT)
        assert not sight(process.pid).busy
        process.kill()
    assert used == sorted(used)
    assert used[-1] > used[0]
    assert sight(process.pid) is None
