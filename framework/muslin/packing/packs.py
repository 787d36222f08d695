"""`pack`: everything a platform needs to grade in one folder, or everything a student needs to work."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from muslin import tasks
from muslin.authoring import lint, release, wheel
from muslin.authoring.reference_data import PROVENANCE
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.packing.grading import HIDDEN, SETTINGS
from muslin.student import workspace

#: The versions Muslin is tested with, and their name in a pack.
PINNED, CONSTRAINTS = ".ci/constraints.txt", "constraints.txt"

#: What students install from, and the extras in it.
REQUIREMENTS, STUDENTS_EXTRAS = "requirements.txt", "fast,view"

#: In a README, of a workspace that is not in the pack: everybody has constants of their own.
NOT_YET_MADE = ("cd @assignment@\n", "muslin start @assignment@ --student YOUR-LOGIN\ncd @assignment@\n")


@dataclass(frozen=True)
class Platform:
    """How a pack for a platform is laid out.

    Attributes
    ----------
    places : mapping
        Where each template goes; it may name the assignment. "." is where wheel, versions and settings go.
    programs : tuple of str
        Files that may be executed.
    archive : str
        Name of the zip everything goes into; empty for a plain folder.
    why_not_secret : str
        Why students can read this pack, so that it must not hold hidden data; empty if they cannot.
    grades : bool
        Whether it grades, and so needs what is true; else it is for students, and has a workspace in its stead.
    """

    places: Mapping[str, str]
    programs: tuple[str, ...] = ()
    archive: str = ""
    why_not_secret: str = ""
    grades: bool = True


PLATFORMS: Mapping[str, Platform] = {
    "gradescope": Platform(
        places={
            "setup.sh": "setup.sh",
            "run_autograder": "run_autograder",
            "README.md": "README.md",
            ".": "",
        },
        programs=("setup.sh", "run_autograder"),
        archive="autograder.zip",
    ),
    "classroom50": Platform(
        places={
            "autograder.py": "autograders/@assignment@/autograder.py",
            "runtime.json": "runtime.json",
            "README.md": "README.md",
            ".": "autograders/@assignment@",
        },
        why_not_secret="Classroom 50 publishes its autograders on the web and runs them in students' repositories",
    ),
    "actions": Platform(
        places={
            "grade.yml": ".github/workflows/grade.yml",
            "Containerfile": ".muslin/Containerfile",
            "README.md": "README.md",
            ".": ".muslin",
        },
        why_not_secret="the workflow runs in students' own repositories",
    ),
    "students": Platform(
        places={"README.md": "README.md", ".": ""},
        archive="@assignment@-students.zip",
        why_not_secret="it is what students get",
        grades=False,
    ),
}


def pack(
    platform: str, assignment: str = "cloth", hidden: Path | str | None = None, out: Path | str | None = None
) -> list[Path]:
    """Write a pack.

    Parameters
    ----------
    platform : str
        One of `PLATFORMS`.
    assignment : str
    hidden : path, optional
        Hidden reference data, from `muslin reference build --hidden`.
    out : path, optional
        Folder to write to; default `packs/<assignment>-<platform>`.

    Returns
    -------
    list of Path
        The files written.

    Raises
    ------
    MuslinError
        If students could read the hidden data or an answer in the pack, what is released is not what the solution
        gives, or it cannot be written.
    """
    if platform not in PLATFORMS:
        raise MuslinError(f"There is no pack for {platform!r}.", f"There is: {', '.join(PLATFORMS)}.")
    layout, table = PLATFORMS[platform], tasks.assignment(assignment)
    if hidden is not None and layout.why_not_secret:
        raise MuslinError(
            f"Hidden data cannot be in this pack: {layout.why_not_secret}.",
            "Leave --hidden out; grade with it on Gradescope or on your own machine: muslin grade --hidden DIR.",
        )
    if found := [finding for name in _with_answers(assignment) for finding in lint.given_away(name)]:
        raise MuslinError(f"The pack would give something away: {found[0]}.", "Run: muslin lint")
    for name in _with_answers(assignment):  # what is released says nothing but what the solution gives
        if stale := release.out_of_step(name):
            raise MuslinError(
                f"{stale[0].rstrip('.')}.", f"Nothing was packed. See all with: muslin release {name} --check"
            )
    files = _files(platform, table.name)
    if hidden is not None:
        files |= _hidden(Path(hidden), assignment)
    folder = Path(out) if out is not None else Path("packs") / f"{assignment}-{platform}"
    archive = layout.archive.replace("@assignment@", assignment)
    contents = {archive: b"", "README.md": files["README.md"]} if archive else files
    written = []
    try:
        for inside, data in contents.items():
            path = folder / inside
            path.parent.mkdir(parents=True, exist_ok=True)
            if inside == archive:
                path.touch(mode=0o600)  # it may hold a secret
                path.chmod(0o600)
                wheel.write_zip(path, files, layout.programs)
            else:
                path.write_bytes(data)
            written.append(path)
    except OSError as error:
        raise MuslinError(f"{paths.shown(folder)} cannot be written: {error.strerror}.") from None
    return written


def _files(platform: str, assignment: str) -> dict[str, bytes]:
    """Everything in a pack but hidden data, by its path inside."""
    layout = PLATFORMS[platform]
    templates = resources.files("muslin.packing") / "templates" / platform
    files: dict[str, bytes] = {}
    for name, place in layout.places.items():
        if name != ".":
            text = (templates / name).read_text(encoding="utf-8")
            text = text.replace("@title@", tasks.assignment(assignment).title)
            if tasks.assignment(assignment).constants:
                text = text.replace(*NOT_YET_MADE)
            files[place.replace("@assignment@", assignment)] = text.replace(
                "@assignment@", assignment
            ).encode()
    shared = layout.places["."].replace("@assignment@", assignment)
    with tempfile.TemporaryDirectory() as scratch:
        built = wheel.build(Path(scratch), layout.grades, assignment)
        ours = {built.name: built.read_bytes(), CONSTRAINTS: (paths.root() / PINNED).read_bytes()}
        if layout.grades:
            ours[SETTINGS] = (json.dumps({"assignment": assignment}) + "\n").encode()
        else:
            ours[REQUIREMENTS] = f"-c {CONSTRAINTS}\n./{built.name}[{STUDENTS_EXTRAS}]\n".encode()
            if not tasks.assignment(assignment).constants:  # else everybody makes their own
                ours |= _workspace(Path(scratch) / "workspace", assignment)
    return files | {f"{shared}/{name}".lstrip("/"): data for name, data in ours.items()}


def _workspace(folder: Path, assignment: str) -> dict[str, bytes]:
    """The folder in which students work, as `muslin start` makes it."""
    workspace.start(assignment, folder)
    found = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {f"{assignment}/{path.relative_to(folder).as_posix()}": path.read_bytes() for path in found}


def _with_answers(assignment: str) -> list[str]:
    """Assignments whose answers a pack must not hold: the wheel carries them all, not only the one that is packed."""
    return sorted({assignment, *paths.assignments("solutions")})


def _hidden(folder: Path, assignment: str) -> dict[str, bytes]:
    """The files of hidden data, complete and of this assignment."""
    from muslin.authoring import reference_data

    if folder.resolve() == paths.reference(assignment).resolve():
        raise MuslinError(
            "Those are the public data.",
            "Make hidden ones: muslin reference build --hidden --seed ... --out DIR",
        )
    report = reference_data.verify(assignment, folder, regenerate=False)
    if not report.ok:
        raise MuslinError(f"{paths.shown(folder)} cannot be used: {report.problems[0]}", "Build it again.")
    record = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
    if record["assignment"] != assignment:
        raise MuslinError(f"{paths.shown(folder)} holds data of {record['assignment']!r}.")
    return {f"{HIDDEN}/{name}": (folder / name).read_bytes() for name in (PROVENANCE, *record["files"])}
