"""`muslin watch` as a student has it: a terminal, an editor that saves, keys."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from muslin.student import workspace

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo-terminal")

SOLUTION = Path(__file__).resolve().parent.parent / "solutions" / "cloth"
STUB = "raise NotImplementedError"


class Terminal:
    """A process on a pseudo-terminal."""

    def __init__(self, folder, *words):
        import pty

        self.master, slave = pty.openpty()
        environment = {**os.environ, "COLUMNS": "200", "TERM": "dumb"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "muslin.cli", *words], cwd=folder, env=environment,
            stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
        )  # fmt: skip
        os.close(slave)
        self.text = self.all = ""

    def until(self, pattern, seconds=60):
        """Wait for a pattern; returns (what was printed before its end, seconds it took)."""
        import select

        began = time.monotonic()
        while time.monotonic() - began < seconds:
            if match := re.search(pattern, self.text):
                before, self.text = self.text[: match.end()], self.text[match.end() :]
                return before, time.monotonic() - began
            if select.select([self.master], [], [], 0.05)[0]:
                try:
                    data = os.read(self.master, 65536).decode()
                except OSError:  # the other end has gone
                    break
                self.text += data
                self.all += data
        raise AssertionError(f"no {pattern!r} in:\n{self.all}")

    def press(self, key):
        os.write(self.master, key.encode())

    def end(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        os.close(self.master)


@pytest.fixture
def watched(tmp_path):
    folder = tmp_path / "cloth"
    workspace.start("cloth", folder)
    terminal = Terminal(folder, "watch")
    terminal.until("Now: phi")
    yield folder, terminal
    terminal.end()


def save(folder, file, old, new, moved=False):
    """Save like an editor: in place, or by a new file moved over the old."""
    path = folder / file
    text = path.read_text(encoding="utf-8").replace(old, new, 1)
    if moved:
        (folder / "temporary").write_text(text, encoding="utf-8")
        (folder / "temporary").replace(path)
    else:
        path.write_text(text, encoding="utf-8")


def test_the_loop_of_saving_seeing_and_going_on(watched):
    folder, terminal = watched
    save(folder, "shape_functions.py", STUB, "return ti.Vector([0.0, 0.0, 0.0])")
    out, _ = terminal.until("Now: phi")
    assert "FAIL phi" in out
    assert "likely: Your result is zero." in out
    right = "return phi_of(X, X0, X1, X2)\n\n\n@ti.func\ndef phi_of(X, X0, X1, X2):"
    right += "\n    D = ti.Matrix.cols([X1 - X0, X2 - X0])"
    right += "\n    p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))"
    right += "\n    return ti.Vector([1.0 - p[0] - p[1], p[0], p[1]])"
    save(folder, "shape_functions.py", "return ti.Vector([0.0, 0.0, 0.0])", right, moved=True)
    out, took = terminal.until("Now: dphi_dX")
    assert "ok   phi" in out
    assert "1/17 tasks, 5/100 points" in out
    busy = os.getloadavg()[0] / (os.cpu_count() or 1)  # processes to each core
    assert took < 10 * max(1.0, busy), "2.5 s on a quiet machine"
    # a comment is no change; another function of the file is not checked again
    save(folder, "shape_functions.py", "    D = ti", "    # edges\n    D = ti")
    terminal.until("no function has changed")
    save(folder, "shape_functions.py", STUB, "return ti.Matrix.zero(float, 3, 3)")
    out, _ = terminal.until("Now: dphi_dX")
    assert "FAIL dphi_dX" in out
    assert " phi " not in out
    # what cannot even be read
    save(folder, "shape_functions.py", "return ti.Matrix.zero(float, 3, 3)", "return (")
    out, _ = terminal.until("Now: dphi_dX")
    assert "Python cannot read this" in out
    terminal.press("h")
    terminal.until("dphi_dX, hint 1 of 3")
    terminal.press("l")
    out, _ = terminal.until("0/17 tasks|1/17 tasks")
    assert "filter_velocity" in out
    terminal.press("n")
    terminal.until("Now: interpolate")
    terminal.press("q")
    terminal.until("Watching has ended")
    assert terminal.process.wait(10) == 0


def test_a_crash_of_student_code_does_not_end_the_watch(watched):
    folder, terminal = watched
    deadly = "return X\n\n\nimport ctypes\n\nctypes.string_at(0)\n"
    save(folder, "shape_functions.py", STUB, deadly)
    out, _ = terminal.until("Now: phi")
    assert "has ended the whole Python process" in out
    shutil.copy(SOLUTION / "shape_functions.py", folder / "shape_functions.py")
    out, _ = terminal.until("Now: deformation_gradient")
    assert out.count("ok  ") == 3
    os.kill(terminal.process.pid, signal.SIGINT)
    terminal.until("Watching has ended")
    assert terminal.process.wait(10) == 0


def test_an_endless_loop_ends_at_its_deadline_and_workers_are_renewed(tmp_path, monkeypatch):
    from muslin.student import checking

    folder = tmp_path / "cloth"
    workspace.start("cloth", folder)
    shutil.copy(SOLUTION / "shape_functions.py", folder / "shape_functions.py")
    found = workspace.find(folder)
    monkeypatch.setattr(checking, "RENEWED_AFTER", 1)
    with checking.Checker() as checker:
        for _ in range(2):
            (report,) = checker.check(found, ["phi"])
            assert report.status == checking.GREEN
            before = checker._worker
            checker.warm()
            assert checker._worker is not before
        save(folder, "kinetic_energy.py", STUB, "x = area\n    while x > 0:\n        x += 1.0\n    return x")
        hurried = replace(
            found, table=replace(found.table, grading=replace(found.table.grading, deadline=8.0))
        )
        reports = list(checker.check(hurried, ["mass_block", "phi"]))
    assert "has not come to an end in 8 seconds" in reports[0].message
    assert reports[1].status == checking.GREEN


def test_a_new_save_stops_a_check_that_runs_and_begins_again(tmp_path):
    from muslin.student import watching, workspace

    workspace.start("cloth", tmp_path / "w")
    said = []
    session = watching.Watch(workspace.find(tmp_path / "w"), said.append)
    try:
        session._look()
        session.keys = {"phi": session.workspace.key("phi", session.texts)}
        file = tmp_path / "w" / "shape_functions.py"
        endless = file.read_text().replace(
            "    raise NotImplementedError", "    while True:\n        pass\n    return X", 1
        )
        file.write_text(endless)
        session._look()
        file.write_text(
            endless.replace("    while True:\n        pass\n", "")
        )  # saved again before the check begins
        session._check(["phi"])
        assert session.left == ["phi"]
        assert any("Saved again" in line for line in said)
        session.step()
        assert session.left == []
        assert any("FAIL phi" in line for line in said)
    finally:
        session.checker.close()


def test_a_stray_key_runs_nothing(tmp_path, monkeypatch):
    from muslin.student import watching, workspace

    workspace.start("cloth", tmp_path / "w")
    said, ran = [], []
    session = watching.Watch(workspace.find(tmp_path / "w"), said.append)
    monkeypatch.setattr(session, "_run", lambda: ran.append(True))
    for key in "rxrlr":
        assert session.press(key)
    assert ran == []
    assert session.press("r")
    assert ran == [True]
