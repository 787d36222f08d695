"""Where Muslin's own files live (in the repository, or inside an installed wheel), and what it may keep."""

from __future__ import annotations

import contextlib
import functools
import os
import stat
import sys
from pathlib import Path

from muslin.base.engine import choice
from muslin.base.errors import MuslinError, choices
from muslin.base.text import one_line

#: Folder of the package.
PACKAGE = Path(__file__).resolve().parent.parent
_REPOSITORY = PACKAGE.parent.parent
_SHIPPED = PACKAGE / "_shipped"
_PRIVATE = "muslin-cache-"

#: Environment variable that names an instructor's own folder of assignments.
COURSE = "MUSLIN_COURSE"

#: Longest path that is shown whole [characters]: the longest most systems know.
LONGEST_PATH = 4096


def in_repository() -> bool:
    """Whether this is a checkout (solutions at hand) rather than an installed wheel."""
    return (_REPOSITORY / "solutions").is_dir() and (_REPOSITORY / "pyproject.toml").is_file()


def root() -> Path:
    """Folder that holds `assignments/` and `data/`: the checkout, or the copies the wheel carries."""
    return _REPOSITORY if in_repository() else _SHIPPED


def course() -> Path | None:
    """An instructor's own folder, laid out as the checkout is; the environment variable `MUSLIN_COURSE` names it.

    Raises
    ------
    MuslinError
        If that is no folder.
    """
    if not (named := os.environ.get(COURSE)):
        return None
    folder = Path(named).expanduser().resolve()
    if not folder.is_dir():
        raise MuslinError(
            f"{COURSE} names {shown(folder)}, which is no folder.", "Make it, or correct the variable."
        )
    return folder


def bare(assignment: str) -> str:
    """Name of an assignment, without whose it is (`muslin.tasks.constants`)."""
    return assignment.partition("@")[0]


def home(assignment: str) -> Path:
    """Folder that holds an assignment: the instructor's own where it does, else Muslin's."""
    assignment, own = bare(assignment), course()
    if own is not None and any((own / part / assignment).is_dir() for part in ("solutions", "assignments")):
        return own
    return root()


def new_home() -> Path:
    """Folder that new assignments are written to: the instructor's own, else the checkout.

    Raises
    ------
    MuslinError
        If there is neither.
    """
    own = course()
    if own is None and not in_repository():
        raise MuslinError(
            "Assignments are written in a checkout of Muslin, or in a folder of your own.",
            f"Run this in the repository, or set {COURSE} to that folder.",
        )
    return own or root()


def assignments(part: str = "assignments") -> list[str]:
    """Names of all assignments that are released, or of those with `solutions`."""
    homes = dict.fromkeys([*([own] if (own := course()) else []), root()])
    return sorted({path.parent.name for home in homes for path in (home / part).glob("*/assignment.toml")})


def usual() -> str:
    """The assignment that is meant where none is named: cloth, or the only one of an instructor's own.

    Raises
    ------
    MuslinError
        If there are several of their own, or none yet.
    """
    if (own := course()) is None:
        return "cloth"
    names = sorted(path.parent.name for path in (own / "solutions").glob("*/assignment.toml"))
    if len(names) != 1:
        raise MuslinError(
            f"Which assignment? There are {len(names)} in {shown(own)}.",
            f"Name it: --assignment {'|'.join(names) or 'NAME'}.",
        )
    return names[0]


def meshes() -> Path:
    """Folder of the meshes Muslin ships."""
    return root() / "data" / "meshes"


def reference(assignment: str) -> Path:
    """Folder of an assignment's public reference data."""
    return home(assignment) / "data" / "reference" / bare(assignment)


def slips(assignment: str) -> Path:
    """Folder of what slips in an assignment's formulas make of its public reference data."""
    return home(assignment) / "data" / "slips" / bare(assignment)


def known(assignment: str) -> Path:
    """Folder of what known mistakes make of an assignment's public reference data."""
    return home(assignment) / "data" / "known" / bare(assignment)


def told(assignment: str) -> Path:
    """File of right answers that `explain` and `gradcheck` ask for beyond the public cases."""
    return known(assignment) / "told.npz"


def assignment(name: str) -> Path:
    """Folder a student receives for an assignment."""
    return home(name) / "assignments" / bare(name)


def source(name: str) -> Path:
    """Folder of an assignment's reference solution, whether there is one or not."""
    return home(name) / "solutions" / bare(name)


def solution(name: str) -> Path:
    """Folder of an assignment's reference solution; it exists where the assignment is written.

    Raises
    ------
    MuslinError
        If it is not here: an installed wheel carries no solutions.
    """
    folder = source(name)
    if not folder.is_dir():
        if written := assignments("solutions"):
            raise unknown(name, written)
        raise MuslinError(
            f"There is no reference solution for {name!r} here: solutions stay in the repository.",
            "Run this from a checkout of Muslin.",
        )
    return folder


def unknown(name: str, known: list[str]) -> MuslinError:
    """What to say of an assignment that there is not: what there is, and how one's own is found."""
    own = "" if os.environ.get(COURSE) else f" One of your own is found in the folder that {COURSE} names."
    return MuslinError(f"There is no assignment {name!r}.", choices(name, known) + own)


def misconceptions(assignment: str) -> Path:
    """Folder of an assignment's suite of right and wrong answers, whether there is one or not."""
    return home(assignment) / "tests" / "misconceptions" / bare(assignment)


#: What an assignment's own files are about: what students may read, and what they must not.
KNOWLEDGE = ("practice", "judge")


def knowledge(name: str) -> list[tuple[str, Path]]:
    """The files in which an assignment says what is known of its tasks, each with the part it belongs to.

    Parts are "practice", "judge", and "reference" for an instructor's one file `reference.py`. What is secret comes
    last. Beside a solution all of it is there; a wheel carries `practice`, and `judge` only where one grades with it.
    """
    where = {part: source(name) / part for part in KNOWLEDGE}
    if not source(name).is_dir():
        where = {part: home(name) / part / bare(name) for part in KNOWLEDGE}
    found = [(part, path) for part, folder in where.items() for path in sorted(folder.glob("*.py"))]
    found = [(part, path) for part, path in found if path.name != "reference.py"]
    return found + [("reference", generator(name))] * generator(name).is_file()


def generator(name: str) -> Path:
    """An instructor's one file on how cases are drawn and what is true: beside the solution."""
    written = (home(name) / "solutions").is_dir()
    folder = source(name) if written else home(name) / "judge" / bare(name)
    return folder / "reference.py"


def secrets() -> list[Path]:
    """Folders that hold answers, or compute them: of every assignment, wherever it lies."""
    homes = dict.fromkeys([*([own] if (own := course()) else []), root()])
    parts = ("solutions", "judge", "practice", "data/reference", "data/slips", "data/known", "tests")
    return [home / part for home in homes for part in parts]


def shown(path: Path | str) -> str:
    """Path as a person would write it: relative to the working folder where it lies below it."""
    path = Path(path).resolve()
    try:
        written = path.relative_to(Path.cwd()).as_posix()
    except ValueError:
        written = str(path)
    return one_line(written, LONGEST_PATH)


# --- caches: what can always be made again -------------------------------------------------------------------


def cache(*parts: str) -> Path:
    """A folder for what can be made again, such as compiled kernels; it is there and can be written.

    Parameters
    ----------
    *parts : str
        Folders below the user's cache: `cache("muslin", "grading")`.

    Returns
    -------
    Path
        Below `$XDG_CACHE_HOME` or else `~/.cache`, as long as it can be written there. Where it cannot (no home,
        another user's home, a read-only disk), below a temporary folder that is this user's alone.
    """
    return _cache_home(parts).joinpath(*parts)


def find_caches() -> None:
    """See to it that the engine, once it is imported, finds a place for its kernels that can be written.

    Taichi aborts on import if it knows no home, and at exit, after all work is done, if it cannot write there.
    It would also ask a server for its newest version once a day; Muslin asks for nothing.
    """
    environment = os.environ
    environment.setdefault("TI_SKIP_VERSION_CHECK", "ON")
    for engine in choice.ENGINES.values():
        name = engine.variable("OFFLINE_CACHE_FILE_PATH")
        if (chosen := environment.get(name)) and not can_write(Path(chosen)):
            del environment[name]
    home = environment.get("HOME")
    taken = environment.get("XDG_CACHE_HOME") or (f"{home}/.cache" if home else "")
    below = choice.kernels_below_a_cache()
    if sys.platform != "win32" and not (taken and can_write(Path(taken, *below))):
        environment["XDG_CACHE_HOME"] = str(_cache_home(below))


def can_write(folder: Path) -> bool:
    """Whether files can be written to a folder, which is made if it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _cache_home(below: tuple[str, ...]) -> Path:
    usual = [Path(given) for given in [os.environ.get("XDG_CACHE_HOME")] if given]
    with contextlib.suppress(RuntimeError):  # no HOME, and a user without an entry
        usual.append(Path.home() / ".cache")
    return next((home for home in usual if can_write(home.joinpath(*below))), None) or _private_folder()


def is_private(folder: Path) -> bool:
    """Whether a folder is below the temporary one that stands in for a home."""
    return any(above.name.startswith(_PRIVATE) for above in folder.parents)


@functools.cache
def _private_folder() -> Path:
    """A folder in the temporary one that no other user can read, write or have put there."""
    import atexit
    import shutil
    import tempfile

    user = os.getuid() if hasattr(os, "getuid") else os.getpid()
    try:
        folder = Path(tempfile.gettempdir()) / f"{_PRIVATE}{user}"
        try:
            folder.mkdir(mode=0o700)
        except FileExistsError:
            found = folder.lstat()
            mine = not hasattr(os, "getuid") or (found.st_uid == user and not found.st_mode & 0o077)
            if not (stat.S_ISDIR(found.st_mode) and mine):  # somebody else's: take one nobody can guess
                folder = Path(tempfile.mkdtemp(prefix=_PRIVATE))
                atexit.register(shutil.rmtree, folder, ignore_errors=True)
        return folder
    except OSError:  # nowhere at all
        return Path("/nonexistent" if os.name == "posix" else "C:/nonexistent")
