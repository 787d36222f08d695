"""Attack 2: a forked daemon, in a session of its own, outlives grading and rewrites the results.

Defence: no process can be made (filter), all of a worker's process space dies with it (namespace), the fork server
adopts and kills what is left (everywhere).
"""

from attacking import TARGET, honest

from muslin.grading import fork_server

HOSTILE = """
import os, time

def daemon():
    if os.fork():
        return
    os.setsid()
    if os.fork():
        os._exit(0)
    for _ in range(600):
        for folder in ("/tmp", "/dev/shm", "/var/tmp", "."):
            try:
                open(folder + "/{token}-results.json", "w").write("1000 points")
            except OSError:
                pass
        time.sleep(0.1)
    os._exit(0)

try:
    daemon()
except OSError as error:
    print("no daemon:", error)
"""


def test_no_daemon_outlives_grading(attack, level):
    record = attack({TARGET: HOSTILE.replace("{token}", attack.token) + honest()}, level=level)
    assert record["sphere_contact"].status == "passed"  # it harms nobody, and is itself not punished


def test_without_the_filter_daemons_are_found_and_killed(attack, level, monkeypatch):
    """As on macOS and old kernels, where the fork server alone must do it."""
    monkeypatch.setattr(fork_server, "FILTERS", False)
    only_here = HOSTILE.replace('("/tmp", "/dev/shm", "/var/tmp", ".")', '(".",)')  # elsewhere it could write
    record = attack({TARGET: only_here.replace("{token}", attack.token) + honest()}, level=level)
    assert record["sphere_contact"].status == "passed"
