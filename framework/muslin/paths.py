"""Where Muslin's own files live: in the repository, or inside an installed wheel."""

from __future__ import annotations

from pathlib import Path

from muslin.errors import MuslinError

_PACKAGE = Path(__file__).resolve().parent
_REPOSITORY = _PACKAGE.parent.parent
_SHIPPED = _PACKAGE / "_shipped"


def in_repository() -> bool:
    """Whether this is a checkout (solutions at hand) rather than an installed wheel."""
    return (_REPOSITORY / "solutions").is_dir() and (_REPOSITORY / "pyproject.toml").is_file()


def root() -> Path:
    """Folder that holds `assignments/` and `data/`: the checkout, or the copies the wheel carries."""
    return _REPOSITORY if in_repository() else _SHIPPED


def meshes() -> Path:
    """Folder of the meshes Muslin ships."""
    return root() / "data" / "meshes"


def reference(assignment: str) -> Path:
    """Folder of an assignment's public reference data."""
    return root() / "data" / "reference" / assignment


def assignment(name: str) -> Path:
    """Folder a student receives for an assignment."""
    return root() / "assignments" / name


def solution(name: str) -> Path:
    """Folder of an assignment's reference solution; it exists only in a checkout.

    Raises
    ------
    MuslinError
        If Muslin runs from an installed wheel, which carries no solutions.
    """
    folder = _REPOSITORY / "solutions" / name
    if not folder.is_dir():
        raise MuslinError(
            f"There is no reference solution for {name!r} here: solutions stay in the repository.",
            "Run this from a checkout of Muslin.",
        )
    return folder


def generator(name: str) -> Path:
    """File that says how an assignment's reference cases are drawn and what is true; cloth, built in, has none.

    It is written beside the solution; `muslin reference build` puts a copy beside the data.
    """
    folder = _REPOSITORY / "solutions" / name if in_repository() else reference(name)
    return folder / "reference.py"


def shown(path: Path | str) -> str:
    """Path as a person would write it: relative to the working folder where it lies below it."""
    path = Path(path).resolve()
    try:
        return path.relative_to(Path.cwd()).as_posix()
    except ValueError:
        return str(path)
