"""From a solution to what a student receives: `release` writes it, `out_of_step` says what no longer agrees.

A solution marks what a student is to write::

    # begin solution: what to do, in words
    return 6 * 7
    # end solution

Inside a function such a region becomes the words and `raise NotImplementedError`; at module level (helpers,
imports only the answer needs) it vanishes. The handout `README.md` may hold these markers, each on a line of
its own::

    <!-- tasks -->                        the task table
    <!-- signature: NAME -->              arguments and results of a task, with shapes and units
    <!-- picture: NAME.png | caption -->  that picture, if it is in pictures/; nothing otherwise
    <!-- note: for authors -->            nothing

Experiments, `experiments/*.py` and their `README.md`, are given as they are.

What comes out depends only on what is in `solutions/<name>/`.
"""

from __future__ import annotations

import importlib.util
from pathlib import Path

from muslin.authoring.handout import PICTURES, handout
from muslin.authoring.leaks import leaks
from muslin.authoring.page import PAGES, origin, page
from muslin.authoring.regions import HANDOUT, read, stubs, without_regions
from muslin.base import paths
from muslin.base.errors import MuslinError, choices
from muslin.reading import syntax
from muslin.tasks import EXPERIMENTS, MANIFEST, read_assignment

PICTURE_TYPES = (".gif", ".jpg", ".png", ".svg", ".webp")


def release(name: str, out: Path | str | None = None) -> list[Path]:
    """Turn `solutions/<name>/` into what a student receives.

    Parameters
    ----------
    name : str
        The assignment.
    out : path, optional
        Folder to write to; default `assignments/<name>/`. Files in it that the release does not write are
        left alone (`out_of_step` names them).

    Returns
    -------
    list of Path
        The files written, sorted.

    Raises
    ------
    MuslinError
        If a marker is malformed, a task has no region, or an answer would be given away; nothing is written.
    """
    source = paths.solution(name)
    files = rendered(source)
    _require_needs(source)
    given_away = list(leaks(source, files))
    if given_away:
        what = given_away[0].rstrip(".")
        raise MuslinError(f"The release would give an answer away: {what}.", "Say it in other words.")
    folder = Path(out) if out is not None else paths.assignment(name)
    written = []
    for relative, content in files.items():
        path = folder / relative
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        except OSError as error:
            raise MuslinError(f"{paths.shown(path)} cannot be written: {error.strerror}.") from None
        written.append(path)
    return written


def _require_needs(source: Path) -> None:
    known = read_assignment(source).tasks
    for task in known.values():
        for need in task.needs:
            if need not in known:
                what = f"{paths.shown(source / MANIFEST)}, {task.name}: it needs {need!r}, which is no task."
                raise MuslinError(what, choices(need, known))


def left_over(name: str) -> list[Path]:
    """Files of `assignments/<name>/` to which nothing in the solution leads any more."""
    expected, folder = rendered(paths.solution(name)), paths.assignment(name)
    there = (path for path in sorted(folder.rglob("*")) if path.is_file() and "__pycache__" not in path.parts)
    return [path for path in there if path.relative_to(folder).as_posix() not in {*expected, *PAGES.values()}]


def out_of_step(name: str) -> list[str]:
    """Say how `assignments/<name>/` differs from what `release` would write, and which answers it gives away.

    Parameters
    ----------
    name : str
        The assignment.

    Returns
    -------
    list of str
        One sentence per finding, with file and, where there is one, line; empty if all is well.
    """
    source, folder = paths.solution(name), paths.assignment(name)
    expected = rendered(source)
    present = {
        path.relative_to(folder).as_posix(): path.read_bytes()
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    }
    fix = f"run: muslin release {name}"
    findings, sources = [], {name: made_from for made_from, name in PAGES.items()}
    folders = {relative.split("/")[0] for relative in expected}
    for relative in sorted(expected.keys() | {_within(relative, folders) for relative in present}):
        where = paths.shown(folder / relative)
        handout_of = sources.get(relative, "")
        if handout_of in expected and relative in present:
            if present[relative].split(b"\n")[0].decode() != origin(expected[handout_of].decode("utf-8")):
                findings.append(f"{where}: not made from {handout_of}; {fix}{_first_install()}")
        elif relative not in expected:
            findings.append(f"{where} is superfluous: nothing in the solution leads to it; delete it")
        elif relative not in present:
            findings.append(f"{where} is missing; {fix}")
        elif (line := _first_difference(present[relative], expected[relative])) is not None:
            at = f", line {line}" if line else ""
            findings.append(f"{where}{at}: stale or edited by hand; change the solution and {fix}")
    findings += [f"{paths.shown(folder)}/{leak}" for leak in leaks(source, present)]
    return findings


def _first_install() -> str:
    """What must be installed before a handout's page can be made; empty if nothing."""
    missing = [name for name in ("markdown", "latex2mathml") if importlib.util.find_spec(name) is None]
    return ', after: pip install "muslin[authoring]"' if missing else ""


def rendered(source: Path) -> dict[str, bytes]:
    """Every file of the release of one solution folder, by relative path.

    Parameters
    ----------
    source : Path
        A folder such as `solutions/cloth`.

    Returns
    -------
    dict
        Relative path to content, sorted by path.
    """
    table = read_assignment(source)
    texts = {file: stubs(source / file, table) for file in table.files}
    texts |= {name: read(source / name) for name in table.given}
    given = [path for path in (source / EXPERIMENTS).glob("*") if path.suffix in (".py", ".md")]
    texts |= {f"{EXPERIMENTS}/{path.name}": read(path) for path in given}
    texts[MANIFEST] = without_regions(read(source / MANIFEST), source / MANIFEST)
    pictures = {
        f"{PICTURES}/{path.name}": path.read_bytes()
        for path in (source / PICTURES).glob("*")
        if path.suffix.lower() in PICTURE_TYPES
    }
    if (source / HANDOUT).is_file():
        texts[HANDOUT] = handout(source / HANDOUT, table, pictures)
    for relative, name in PAGES.items():
        if relative in texts and (made := page(texts[relative], table.title, relative)):
            texts[name] = made
    contents = {relative: text.encode("utf-8") for relative, text in texts.items()} | pictures
    return dict(sorted(contents.items()))


def _within(relative: str, folders: set[str]) -> str:
    """The file itself, or the folder that holds it where the release has no such folder at all."""
    top, slash, _ = relative.partition("/")
    return top if slash and top not in folders else relative


def _first_difference(present: bytes, expected: bytes) -> int | None:
    """Line of the first difference (0 where lines mean nothing), or None if there is none."""
    try:
        have, want = (syntax.bare_lines(content.decode("utf-8")) for content in (present, expected))
    except UnicodeDecodeError:
        return None if present == expected else 0
    if have == want:
        return None
    same = next((k for k, pair in enumerate(zip(have, want, strict=False)) if pair[0] != pair[1]), None)
    return min(len(have), len(want)) + 1 if same is None else same + 1
