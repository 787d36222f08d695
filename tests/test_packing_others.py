"""The wheel, the packs for Classroom 50 and GitHub Actions, and what is refused."""

from __future__ import annotations

import contextlib
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

import jsonschema
import pytest

from muslin.authoring import reference_data, wheel
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import views
from muslin.packing import packs

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def hidden(tmp_path_factory):
    return reference_data.build("cloth", tmp_path_factory.mktemp("h") / "hidden", "a secret", 1, hidden=True)


@pytest.fixture
def work(tmp_path):
    folder = tmp_path / "work"
    folder.mkdir()
    shutil.copy(paths.solution("cloth") / "collision.py", folder)
    return folder


# -------------------- the wheel


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    return wheel.build(tmp_path_factory.mktemp("wheel"))


def test_the_wheel_is_installed_by_pip_and_works_away_from_the_repository(built, tmp_path):
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-index", "--target", tmp_path, built],
        check=True,
    )  # fmt: skip
    code = (
        f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import muslin; from muslin import paths, tasks; "
        "print(muslin.__file__, paths.in_repository(), len(tasks.assignment('cloth').tasks))"
    )
    said = subprocess.run(
        [sys.executable, "-I", "-c", code], capture_output=True, text=True, check=True
    ).stdout
    assert said.split() == [str(tmp_path / "muslin" / "__init__.py"), "False", "17"]


@pytest.mark.skipif(find_spec("hatchling") is None, reason="hatchling is not installed")
def test_the_wheel_is_the_one_the_build_tool_makes(built, tmp_path):
    code = f"import hatchling.build; print(hatchling.build.build_wheel({str(tmp_path)!r}))"
    subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True)
    with zipfile.ZipFile(built) as ours, zipfile.ZipFile(next(tmp_path.glob("*.whl"))) as theirs:
        mine, other = (
            {n for n in archive.namelist() if ".dist-info/" not in n} for archive in (ours, theirs)
        )
        assert mine == other
        about = [
            a.read(next(n for n in a.namelist() if n.endswith("/METADATA"))).decode() for a in (ours, theirs)
        ]
    ours_need, theirs_need = ({_plain(line) for line in text.splitlines()} - {""} for text in about)
    assert ours_need == theirs_need
    assert len(ours_need) > 10


def _plain(line: str) -> str:
    """A requirement without the ways to write it; nothing for any other line of METADATA."""
    if not line.startswith(("Requires-", "Provides-Extra:", "Name:", "Version:")) or "extra ==" in line:
        return ""
    name, _, marker = line.partition(";")
    versions = re.fullmatch(r"(.*?: *[\w-]*)(.*)", name)
    sorted_versions = ",".join(sorted(versions[2].strip().split(",")))
    return re.sub(r"[\s'\"()]", "", f"{versions[1]}{sorted_versions};{marker}")


def test_everything_the_wheel_needs_is_pinned():
    """No requirement of a requirement is left to chance, as far as the pinned versions are installed here."""
    lines = (ROOT / ".ci" / "constraints.txt").read_text().splitlines()
    pinned = dict(line.lower().replace("_", "-").split("==") for line in lines if "==" in line)
    waiting, needed = ["muslin"], set()
    while waiting:
        for text in metadata.requires(waiting.pop()) or []:
            name = re.match(r"[\w.-]+", text)[0].lower().replace("_", "-")
            if "extra ==" in text or name in needed:
                continue
            needed.add(name)
            with contextlib.suppress(metadata.PackageNotFoundError):  # for another system or Python
                if metadata.version(name) == pinned.get(name):
                    waiting.append(name)
    assert needed >= {"taichi", "numpy"}
    assert needed - set(pinned) == set()


# -------------------- what is refused


@pytest.mark.parametrize("platform", ["classroom50", "actions"])
def test_hidden_data_are_never_packed_where_students_can_read_them(platform, hidden, tmp_path):
    with pytest.raises(MuslinError, match=r"Hidden data cannot be in this pack: .*students' .*repositories"):
        packs.pack(platform, "cloth", hidden, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_public_data_are_not_taken_for_hidden_ones(tmp_path):
    with pytest.raises(MuslinError, match="Those are the public data"):
        packs.pack("gradescope", "cloth", paths.reference("cloth"), tmp_path)


def test_damaged_hidden_data_are_not_packed(hidden, tmp_path):
    copy = shutil.copytree(hidden, tmp_path / "copy")
    (copy / "phi.npz").unlink()
    with pytest.raises(MuslinError, match=r"cannot be used: phi\.npz"):
        packs.pack("gradescope", "cloth", copy, tmp_path / "out")


def test_nothing_is_packed_that_gives_an_answer_away(tmp_path, monkeypatch):
    from muslin.authoring import lint

    found = [lint.Finding("data/notes.txt, line 1", "gives away `2 + 2`", "keep it elsewhere")]
    monkeypatch.setattr(lint, "given_away", lambda name: iter(found))
    with pytest.raises(MuslinError, match=r"give something away: data/notes\.txt"):
        packs.pack("actions", "cloth", out=tmp_path / "out")


# -------------------- Classroom 50


def test_classroom50s_autograder_leaves_a_valid_result_in_the_checkout(work, tmp_path):
    packs.pack("classroom50", "cloth", out=tmp_path / "pack")
    folder = tmp_path / "pack" / "autograders" / "cloth"
    assert json.loads((tmp_path / "pack" / "runtime.json").read_text())["python"] == "3.12"
    assert sum(path.stat().st_size for path in folder.iterdir()) < 10_000_000  # its runner fetches no more
    environment = {
        **os.environ, "MUSLIN_PYTHON": sys.executable, "CLASSROOM": "graphics", "ASSIGNMENT": "cloth",
        "OWNER": "alice", "SUBMISSION_TAG": "submit/2026-01-01T00-00-00Z-abcdef0",
        "COMMIT_URL": "https://example.org/c", "RELEASE_URL": "https://example.org/r",
    }  # fmt: skip
    (work / "muslin.py").write_text("raise SystemExit('mine')")
    subprocess.run([sys.executable, folder / "autograder.py"], cwd=work, env=environment, check=True)
    result = json.loads((work / "result.json").read_text())
    jsonschema.validate(result, views.schema("classroom50"))
    assert (result["score"], result["max-score"], result["owner"]) == (10, 100, "alice")
    assert len(result["tests"]) == 17


# -------------------- GitHub Actions


@pytest.mark.skipif(sys.platform == "win32", reason="the workflow runs on Linux")
def test_the_workflow_grades_and_writes_a_summary(work, tmp_path):
    packs.pack("actions", "cloth", out=work)
    text = (work / ".github" / "workflows" / "grade.yml").read_text()
    assert "@assignment@" not in text
    script = text.split("- name: Grade\n        run: |\n")[1].split("\n      - uses")[0]
    program = tmp_path / "muslin" / "bin" / "muslin"
    program.parent.mkdir(parents=True)
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -m muslin.cli "$@"\n')
    program.chmod(0o755)
    summary = tmp_path / "summary.md"
    environment = {**os.environ, "RUNNER_TEMP": str(tmp_path), "GITHUB_STEP_SUMMARY": str(summary)}
    subprocess.run(["bash", "-euo", "pipefail", "-c", script], cwd=work, env=environment, check=True)
    written = {path.name for path in (tmp_path / "report").iterdir()}
    assert {"record.json", "report.html", "report.txt", "junit.xml"} <= written
    assert json.loads((tmp_path / "report" / "record.json").read_text())["score"] == 10
    assert summary.read_text().startswith("```text\n")


def test_the_workflow_is_yaml_with_the_steps_it_should_have(tmp_path):
    yaml = pytest.importorskip("yaml")
    packs.pack("actions", "cloth", out=tmp_path)
    flow = yaml.safe_load((tmp_path / ".github" / "workflows" / "grade.yml").read_text())
    steps = flow["jobs"]["grade"]["steps"]
    assert [step.get("name", step.get("uses", "").split("@")[0]) for step in steps] == [
        "actions/checkout", "actions/setup-python", "Install Muslin", "Grade", "actions/upload-artifact"
    ]  # fmt: skip
    assert flow["permissions"] == {"contents": "read"}


def test_the_container_installs_what_taichi_needs(tmp_path):
    packs.pack("actions", "cloth", out=tmp_path)
    text = (tmp_path / ".muslin" / "Containerfile").read_text()
    assert "libx11-6" in text
    assert "--constraint /opt/constraints.txt" in text
