"""The Gradescope pack, run in a box laid out like Gradescope's container."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import subprocess
import zipfile
from pathlib import Path

import jsonschema
import pytest
from gradescope_box import STUDENT, Box, missing

from muslin import tasks
from muslin.authoring import reference_data
from muslin.base import paths
from muslin.grading import views
from muslin.packing import packs

SECRET = "correct horse battery staple"
TABLE = tasks.assignment("cloth")

needs_box = pytest.mark.skipif(bool(missing()), reason=f"no Gradescope-like box: {missing()}")


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pack")
    hidden = reference_data.build("cloth", folder / "hidden", SECRET, 2, hidden=True)
    return packs.pack("gradescope", "cloth", hidden, folder)[0]


@pytest.fixture(scope="module")
def box(archive, tmp_path_factory):
    box = Box(tmp_path_factory.mktemp("box"), archive)
    box.hand_in(None)
    return box


@pytest.fixture
def work(tmp_path):
    """One file of the solution: enough to grade, and quick."""
    folder = tmp_path / "submission"
    folder.mkdir()
    shutil.copy(paths.solution("cloth") / "collision.py", folder)
    return folder


def graded(box, source, **options) -> dict:
    done = box.grade(source, **options)
    assert done.returncode == 0, done.stderr
    result = json.loads(box.results.read_text())
    jsonschema.validate(result, views.schema("gradescope"))
    assert [test["name"].split(":")[0] for test in result["tests"]][: len(TABLE.tasks)] == list(TABLE.tasks)
    assert SECRET not in json.dumps(result)
    assert result["score"] == sum(test["score"] for test in result["tests"])
    assert sorted(path.name for path in (box.autograder / "results").iterdir()) == ["results.json"]
    return result


# -------------------- what is in the pack


def test_the_pack_holds_muslin_its_versions_and_the_hidden_data_and_no_solution(archive):
    with zipfile.ZipFile(archive) as pack:
        names = pack.namelist()
        mode = {info.filename: info.external_attr >> 16 & 0o777 for info in pack.infolist()}
        with zipfile.ZipFile(pack.open(next(name for name in names if name.endswith(".whl")))) as wheel:
            inside = wheel.namelist()
    assert {"setup.sh", "run_autograder", "constraints.txt", "hidden/provenance.json"} <= set(names)
    assert sum(name.startswith("hidden/") for name in names) == len(TABLE.tasks) + 1
    assert mode["run_autograder"] == mode["setup.sh"] == 0o755
    assert archive.stat().st_mode & 0o077 == 0
    assert not [name for name in inside if "solutions" in name or "hidden" in name or "tests/" in name]
    assert {f"muslin/_shipped/assignments/cloth/{file}" for file in TABLE.files} <= set(inside)


def test_packing_twice_gives_the_same_bytes(archive, tmp_path):
    again = packs.pack("gradescope", "cloth", archive.parent / "hidden", tmp_path)[0]
    assert again.read_bytes() == archive.read_bytes()


@pytest.mark.parametrize("script", ["setup.sh", "run_autograder"])
def test_the_scripts_are_sound_and_name_no_registry(archive, tmp_path, script):
    with zipfile.ZipFile(archive) as pack:
        text = pack.read(script).decode()
    assert "@" not in text.replace('"$@"', "")
    assert "http" not in text
    (tmp_path / script).write_text(text)
    assert subprocess.run(["bash", "-n", tmp_path / script]).returncode == 0


# -------------------- in the box


@needs_box
def test_a_submission_is_graded_as_a_user_of_its_own(box, work):
    result = graded(box, work)
    assert result["score"] == 10
    assert result["extra_data"]["safety"] == "uid"
    assert "2 per task from the instructor" in result["output"]
    assert "Not secret" not in result["output"]


@needs_box
def test_the_student_user_reads_python_and_muslin_but_no_secret(box, work):
    graded(box, work)
    student = ("setpriv", f"--reuid={STUDENT}", f"--regid={STUDENT}", "--clear-groups")
    assert (
        box.run(*student, "/opt/muslin/bin/python", "-I", "-c", "import muslin.tasks.batch").returncode == 0
    )
    for secret in (
        "source/hidden/provenance.json",
        "source/hidden/phi.npz",
        "source/muslin.json",
        "results/results.json",
        "submission_metadata.json",
    ):
        assert (box.autograder / secret).exists()
        read = box.run(*student, "cat", f"/autograder/{secret}")
        assert read.returncode != 0
        assert "Permission denied" in read.stderr
    assert box.run(*student, "touch", "/autograder/results/results.json").returncode != 0


@needs_box
@pytest.mark.parametrize("kind", ["missing", "empty", "other files"])
def test_without_task_files_there_are_no_points_but_a_result(box, tmp_path, kind):
    folder = tmp_path / "nothing"
    folder.mkdir()
    if kind == "other files":
        (folder / "essay.pdf").write_bytes(b"%PDF")
    result = graded(box, None if kind == "missing" else folder)
    assert result["score"] == 0
    assert "missing" in result["tests"][0]["output"]


@needs_box
def test_a_hostile_submission_gets_no_secret_and_writes_no_result(box, work):
    """It looks for what it may not see, prints what it finds, and writes a result of its own."""
    spy = """
import contextlib, glob, os
print("HIDDEN", glob.glob("/autograder/source/hidden/*"), glob.glob("/autograder/*/*"), os.getuid())
for name in ("source/hidden/provenance.json", "source/hidden/phi.npz", "submission_metadata.json"):
    with contextlib.suppress(OSError):
        print("FOUND", open("/autograder/" + name, "rb").read())
for name in ("results/results.json", "run_autograder", "source/run_autograder"):
    with contextlib.suppress(OSError):
        open("/autograder/" + name, "w").write('{"score": 100}')
        print("WROTE", name)
with contextlib.suppress(OSError):
    if os.fork() == 0:
        os.setsid()
        while True:
            with contextlib.suppress(OSError):
                open("/autograder/results/results.json", "w").write('{"score": 100}')
os.kill(os.getppid(), 9) if os.getuid() == 0 else None
"""
    with open(work / "collision.py", "a") as file:
        file.write(spy)
    os.symlink("/autograder/source/hidden/provenance.json", work / "stress.py")
    (work / "sitecustomize.py").write_text("raise SystemExit('mine')")
    (work / "muslin").mkdir()
    (work / "muslin" / "__init__.py").write_text("raise SystemExit('mine')")
    program = (box.autograder / "run_autograder").read_bytes()
    result = graded(box, work)
    told = json.dumps(result)
    assert result["score"] <= 10
    assert "HIDDEN []" in told
    assert "FOUND" not in told
    assert "WROTE" not in told
    assert (box.autograder / "run_autograder").read_bytes() == program
    assert "a link or a device" in told


@needs_box
@pytest.mark.parametrize("broken", ["Muslin does not start", "the hidden data are damaged"])
def test_when_the_autograder_itself_fails_there_still_is_a_result(box, work, broken):
    victim = {
        "Muslin does not start": next(
            box.folder.glob("opt/muslin/lib/python*/site-packages/muslin/tasks/__init__.py")
        ),
        "the hidden data are damaged": box.autograder / "source" / "hidden" / "phi.npz",
    }[broken]
    whole = victim.read_bytes()
    victim.write_bytes(b"not this")
    try:
        done = box.grade(work)
        result = json.loads(box.results.read_text())
    finally:
        victim.write_bytes(whole)
    assert done.returncode == 0
    jsonschema.validate(result, views.schema("gradescope"))
    assert result["score"] == 0
    assert "no fault of yours" in result["output"]
    assert "phi.npz" not in json.dumps(result)


# -------------------- as slow and as small as Gradescope's smallest container


@contextlib.contextmanager
def control_groups(**limits: str):
    """Control groups (version 1) with these limits; skips where they cannot be had."""
    made = []
    try:
        for name, value in limits.items():
            kind, _, key = name.partition("__")
            folder = Path("/sys/fs/cgroup") / kind / f"muslin-test-{os.getpid()}"
            folder.mkdir(exist_ok=True)
            made.append(folder)
            (folder / key.replace("__", ".")).write_text(value)
    except OSError as error:
        for folder in made:
            folder.rmdir()
        pytest.skip(f"no control groups to be had: {error}")
    try:
        yield made
    finally:
        for folder in made:
            with contextlib.suppress(OSError):
                folder.rmdir()


@needs_box
def test_half_a_processor_and_768_mb_are_enough(box):
    limits = {
        "cpu__cpu__cfs_quota_us": "50000",  # of 100,000
        "memory__memory__limit_in_bytes": str(768 << 20),
    }
    with control_groups(**limits) as groups:
        joined = " && ".join(f"echo $$ > {group}/cgroup.procs" for group in groups)
        result = graded(
            box, paths.solution("cloth"), before=("bash", "-c", f'{joined} && exec "$@"', "limited")
        )
        peak = int((groups[1] / "memory.max_usage_in_bytes").read_text()) >> 20
    print(f"{result['execution_time']:.0f} s, {peak} MB")
    assert result["score"] == 100
    assert result["execution_time"] < 500
