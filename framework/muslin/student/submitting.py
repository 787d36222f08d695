"""The zip to hand in: the task files, and what they answer; read back the way the grader reads it."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import source
from muslin.student.checking import Checker, Report
from muslin.student.workspace import Workspace, given_files
from muslin.tasks import MANIFEST


@dataclass(frozen=True)
class Packed:
    """The zip, and what is wrong with files in it or missing from it, in sentences."""

    path: Path
    files: tuple[str, ...]
    faults: tuple[str, ...]


def pack(workspace: Workspace, out: Path | None = None) -> Packed:
    """Write the zip, and read it back.

    Parameters
    ----------
    workspace : Workspace
    out : path, optional
        Default `<folder>-<assignment>.zip` in the workspace; an older zip of that name is replaced.

    Raises
    ------
    MuslinError
        If the zip cannot be written, or is not read back as it should be.
    """
    from muslin.grading.submission import collect

    name = paths.bare(workspace.table.name)
    label = workspace.folder.resolve().name
    path = out or workspace.folder / (f"{name}.zip" if label == name else f"{label}-{name}.zip")
    if path.exists() and not zipfile.is_zipfile(path):
        raise MuslinError(
            f"{paths.shown(path)} is there already and is not a zip.", "Name another with --out."
        )
    contents = {
        file: (workspace.folder / file).read_bytes()
        for file in workspace.table.files
        if (workspace.folder / file).is_file()
    }
    if not contents:
        raise MuslinError("There is no task file to hand in.")
    manifest = given_files(workspace.table.name)[
        MANIFEST
    ]  # which assignment it is, and whose where that matters
    beside = path.with_name(path.name + ".new")
    try:
        with zipfile.ZipFile(beside, "w", zipfile.ZIP_DEFLATED) as archive:
            for file, content in {
                **contents,
                MANIFEST: manifest,
            }.items():  # no dates: the same work is the same zip
                archive.writestr(zipfile.ZipInfo(file, (2000, 1, 1, 0, 0, 0)), content)
        beside.replace(path)
    except OSError as error:
        raise MuslinError(
            f"{paths.shown(path)} cannot be written: {error.strerror}.", "Name another place with --out."
        ) from None
    handed = collect(path, workspace.table)
    wrong = [file for file, content in contents.items() if handed.files.get(file) != content]
    faults = [
        (why if file in why else f"{file}: {why}").rstrip(".") for file, why in handed.refused.items()
    ]  # each is told as a sentence
    faults += [
        f"{file} is not in the zip as it is in the folder" for file in wrong if file not in handed.refused
    ]
    for file, content in handed.files.items():
        try:
            source.Source(source.decoded(content, file), file)
        except MuslinError as error:
            faults.append(error.message.split("\n")[0].rstrip("."))
    return Packed(path, tuple(handed.files), tuple(faults))


def examined(workspace: Workspace, packed: Packed) -> Iterator[Report]:
    """What the check says of what is in the zip, unpacked into a folder of its own."""
    with TemporaryDirectory() as name, Checker() as checker:
        folder = Path(name).resolve()
        with zipfile.ZipFile(packed.path) as archive:
            for file in packed.files:
                (folder / file).write_bytes(archive.read(file))
        if packed.files:
            unpacked = replace(workspace, folder=folder, started=False)
            for report in checker.check(unpacked, list(workspace.table.tasks)):
                yield replace(report, message=report.message.replace(f"{folder}{os.sep}", ""))
