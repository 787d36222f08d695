"""Muslin as a wheel, of the checkout it runs from: what it holds is what `pyproject.toml` says.

The wheel is pure Python, so it is a zip with a few lines about it; it is written here, and not by a build tool,
so that packing needs no network and gives the same bytes every time.
"""

from __future__ import annotations

import base64
import hashlib
import sys
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.base.version import __version__
from muslin.judging import measured

#: Never part of a wheel.
_LEFT_OUT = ("__pycache__", ".DS_Store")


def contents(judges: bool = False, assignment: str | None = None) -> dict[str, Path]:
    """Every file of the wheel, by its path inside.

    Parameters
    ----------
    judges : bool
        Whether what only graders may know goes in, too: how cases are drawn, and what is true of them.
    assignment : str, optional
        An instructor's own, of which what students may know goes in.

    Raises
    ------
    MuslinError
        If Muslin does not run from a checkout.
    """
    root, target = _checkout(), _project()["tool"]["hatch"]["build"]["targets"]["wheel"]
    sources = {package.rsplit("/", 1)[-1]: root / package for package in target["packages"]}
    sources |= {inside: root / source for source, inside in target["force-include"].items()}
    for name in paths.assignments("solutions") if judges else filter(None, [assignment]):
        sources |= _of_assignment(name, judges)
    found: dict[str, Path] = {}
    for inside, source in sources.items():
        for path in sorted(source.rglob("*")) if source.is_dir() else [source]:
            if path.is_file() and not set(_LEFT_OUT) & set(path.parts) and path.suffix != ".pyc":
                found["/".join([inside, *path.relative_to(source).parts])] = path
    return found


def build(folder: Path, judges: bool = False, assignment: str | None = None) -> Path:
    """Write the wheel.

    Parameters
    ----------
    folder : Path
    judges, assignment
        As for `contents`.

    Returns
    -------
    Path
        `<folder>/muslin-<version>-py3-none-any.whl`.
    """
    project = _project()["project"]
    name = f"{project['name']}-{__version__}"
    files = {inside: path.read_bytes() for inside, path in contents(judges, assignment).items()}
    files |= {f"{name}.dist-info/{file}": text.encode() for file, text in _about(project).items()}
    record = [f"{inside},sha256={_digest(data)},{len(data)}" for inside, data in files.items()]
    record.append(f"{name}.dist-info/RECORD,,")
    files[f"{name}.dist-info/RECORD"] = ("\n".join(record) + "\n").encode()
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}-py3-none-any.whl"
    write_zip(path, files)
    return path


def _of_assignment(name: str, judges: bool) -> dict[str, Path]:
    """All that a grader, or a student, needs of an assignment, wherever it is written, by its path inside.

    Raises
    ------
    MuslinError
        If a student would measure answers otherwise than the grader.
    """
    if absent := measured.lacking(name, tasks.assignment(name).tasks):
        raise MuslinError(
            f"The public data of {name} are older than terms_{absent[0]}: "
            "on students' machines right answers could fail.",
            f"Run: muslin reference build {name}",
        )
    folders = {
        "assignments": paths.assignment(name),
        "data/reference": paths.reference(name),
        "data/slips": paths.slips(name),
        "data/known": paths.known(name),
    }
    found = {f"muslin/_shipped/{part}/{name}": folder for part, folder in folders.items() if folder.is_dir()}
    for part, path in paths.knowledge(name):
        place = "practice" if part == "practice" else "judge"
        if judges or place == "practice":
            found[f"muslin/_shipped/{place}/{name}/{path.name}"] = path
    return found


def write_zip(path: Path | IO[bytes], files: Mapping[str, bytes], programs: tuple[str, ...] = ()) -> None:
    """Write a zip whose bytes depend on its files only; `programs` may be executed."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for inside, data in files.items():
            entry = zipfile.ZipInfo(inside)
            entry.create_system = 3
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o100755 if inside in programs else 0o100644) << 16
            archive.writestr(entry, data)


def _checkout() -> Path:
    if not paths.in_repository():
        raise MuslinError("Packing needs a checkout of Muslin.", "Run this in the repository.")
    return paths.root()


def _project() -> dict[str, Any]:
    return read_toml(_checkout() / "pyproject.toml")


def read_toml(path: Path) -> dict[str, Any]:
    """A TOML file, whatever Python this is."""
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    return tomllib.loads(path.read_text(encoding="utf-8"))


def _about(project: Mapping[str, Any]) -> dict[str, str]:
    """The files of `.dist-info` but RECORD."""
    scripts = [f"{name} = {target}" for name, target in project["scripts"].items()]
    licences = {name: (_checkout() / name).read_text(encoding="utf-8") for name in project["license-files"]}
    return {
        **{f"licenses/{name}": text for name, text in licences.items()},
        "METADATA": "\n".join([*_metadata(project), ""]),
        "WHEEL": "Wheel-Version: 1.0\nGenerator: muslin\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
        "entry_points.txt": "\n".join(["[console_scripts]", *scripts, ""]),
    }


def _metadata(project: Mapping[str, Any]) -> Iterator[str]:
    yield "Metadata-Version: 2.4"
    yield f"Name: {project['name']}"
    yield f"Version: {__version__}"
    yield f"Summary: {project['description']}"
    yield f"License-Expression: {project['license']}"
    yield from (f"License-File: {name}" for name in project["license-files"])
    yield f"Requires-Python: {project['requires-python']}"
    yield from (f"Requires-Dist: {needed}" for needed in project["dependencies"])
    for extra, wanted in project["optional-dependencies"].items():
        yield f"Provides-Extra: {extra}"
        for needed in wanted:
            name, _, marker = needed.partition(";")
            condition = f"({marker.strip()}) and " if marker else ""
            yield f"Requires-Dist: {name.strip()} ; {condition}extra == '{extra}'"


def _digest(data: bytes) -> str:
    return base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
