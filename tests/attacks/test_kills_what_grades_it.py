"""Beyond the table: the fork server, or the grader itself, is killed or interrupted in the middle.

Defence: a fork server that dies costs nobody: its workers' questions are asked again, of workers with a fork server of
their own. A grader that dies takes all processes along; one that is interrupted stops at once and tidies up.
"""

import os
import signal
import subprocess
import sys
import time

import pytest
from attacking import BYSTANDER, TARGET, honest, processes, write

from muslin.grading import sandbox

HANGS = "import time\ntime.sleep(1e6)\n"
GRADE = """
import sys
from muslin.grading import fork_server
import muslin
fork_server.ENVIRONMENT["MUSLIN_ATTACK"] = sys.argv[2]
muslin.grade(sys.argv[1], deadline=60)
"""


def test_a_fork_server_that_dies_costs_no_verdict(attack, tmp_path, monkeypatch):
    ask, asked = sandbox.Worker._ask, []

    def killing(self, request, arrays, *rest):
        asked.append(request["do"])
        if asked.count("evaluate") == 2 and request["do"] == "evaluate":
            self._server._process.kill()
        return ask(self, request, arrays, *rest)

    files = {TARGET: honest(), BYSTANDER: honest(BYSTANDER)}
    expected = attack.grade(write(tmp_path / "calm", files))
    monkeypatch.setattr(sandbox.Worker, "_ask", killing)
    attack({TARGET: honest()}, spoils=())
    assert expected.score == attack.grade(write(tmp_path / "again", files)).score


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_a_grader_that_dies_takes_all_along(attack, tmp_path, how):
    folder = write(tmp_path / "s", {TARGET: HANGS, BYSTANDER: HANGS})
    scratch = tmp_path / "tmp"
    scratch.mkdir()
    scratch.chmod(0o711)
    environment = {**os.environ, "TMPDIR": str(scratch)}
    command = [sys.executable, "-c", GRADE, str(folder), attack.token]
    grader = subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL)
    until = time.monotonic() + 60
    while len(processes(attack.token)) < 3 and time.monotonic() < until:  # fork server, two workers
        time.sleep(0.1)
    time.sleep(1)
    began = time.monotonic()
    grader.send_signal(how)
    grader.wait(timeout=30)
    assert time.monotonic() - began < 15
    until = time.monotonic() + 10
    while processes(attack.token) and time.monotonic() < until:
        time.sleep(0.1)
    assert not processes(attack.token)
    assert not list(scratch.iterdir())
