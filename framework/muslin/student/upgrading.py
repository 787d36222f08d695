"""A newer release of the assignment, merged around what the student wrote.

Every file is merged three ways: as it was given (`.muslin/given/`), as it is now, as it is given today. In a
task file the pieces are the module's docstring, its imports, and each function's head, docstring, words of the
stub ("# Your code here: ...") and body. A piece the student left alone becomes today's; the body of a function
that is no longer the stub is never touched, nor are functions and imports of the student's own. What cannot be
merged is left, and said.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.reading import source
from muslin.reading.source import Function, Source
from muslin.student.workspace import Workspace, checksum, description, given_files, reference_sum
from muslin.tasks import is_stub


@dataclass
class Merge:
    """A merged file: its text, what was brought, and what was left, in sentences."""

    text: str
    brought: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)


def merge(base: str, mine: str, new: str) -> Merge:
    """Merge a task file.

    Parameters
    ----------
    base, mine, new : str
        As it was given, as the student has it, as it is given today.

    Returns
    -------
    Merge

    Raises
    ------
    MuslinError
        If a text is not Python.
    """
    was, now, to = Source(base), Source(mine), Source(new)
    done = Merge(mine)
    edits: list[tuple[range, str]] = []  # (lines of mine, what to put there)
    for name, wanted in to.functions.items():
        if name in now.functions:
            edits += _function(was, now, to, name, done)
        elif name in was.functions:
            done.left.append(f"{name} is not in your file any more")
        else:
            done.brought.append(f"{name} is new")
            end = len(now.lines)
            edits.append((range(end, end), f"\n\n{to.piece(wanted.lines)}"))
    for name in was.functions.keys() - to.functions.keys():
        if name in now.functions:
            done.left.append(f"{name} is not asked for any more; delete it if you like")
    edits += _module(was, now, to, done)
    lines = list(now.lines)
    if lines and not lines[-1].endswith("\n"):
        lines[-1] += "\n"
    for where, text in sorted(edits, key=lambda edit: (edit[0].start, edit[0].stop), reverse=True):
        lines[where.start : where.stop] = [text] if text else []
    done.text = "".join(lines)
    _require_same_work(now, Source(done.text))
    return done


def _function(was: Source, now: Source, to: Source, name: str, done: Merge) -> Iterator[tuple[range, str]]:
    """Edits of one function that is in the student's file and in today's."""
    mine, wanted = now.functions[name], to.functions[name]
    given = was.functions.get(name)
    if given is None:
        done.left.append(f"{name}: you have a function of that name; it was left as it is")
        return
    if now.piece(mine.lines) == to.piece(wanted.lines):
        return
    if now.piece(mine.lines) == was.piece(given.lines):
        done.brought.append(f"{name}: function as given")
        yield mine.lines, to.piece(wanted.lines)
        return
    for part in ("head", "docstring"):
        before, here, after = (
            s.piece(getattr(f, part)) for s, f in ((was, given), (now, mine), (to, wanted))
        )
        if after in (before, here):
            continue
        if here == before:
            done.brought.append(f"{name}: {'first line' if part == 'head' else 'docstring'}")
            yield getattr(mine, part), after
            if given.arguments != wanted.arguments:
                done.left.append(
                    f"{name}: its arguments are now ({', '.join(wanted.arguments)}); fix its body yourself"
                )
        else:
            done.left.append(f"{name}: you changed its {part}, and so has the new release; yours was kept")
    yield from _words(was, now, to, (given, mine, wanted), done)


def _words(
    was: Source, now: Source, to: Source, functions: tuple[Function, Function, Function], done: Merge
) -> Iterator[tuple[range, str]]:
    """Edits of the stub's comment, where it still stands word for word in the student's body."""
    given, mine, wanted = functions
    before, after = _comment(was, given), _comment(to, wanted)
    if not before or not after or before == after:
        if is_stub(mine.node) and was.piece(given.body) != to.piece(wanted.body) and before == after:
            done.left.append(f"{mine.name}: the stub's body is new; yours was kept")
        return
    length = len(before)
    for start in range(mine.body.start, mine.body.stop - length + 1):
        if now.lines[start : start + length] == before:
            done.brought.append(f"{mine.name}: what to do")
            yield range(start, start + length), "".join(after)
            return


def _comment(text: Source, function: Function) -> list[str]:
    """Lines of the comment a stub's body begins with."""
    lines = []
    for k in function.body:
        if not text.lines[k].lstrip().startswith("#"):
            break
        lines.append(text.lines[k])
    return lines


def _module(was: Source, now: Source, to: Source, done: Merge) -> Iterator[tuple[range, str]]:
    """Edits of the first comment, the module's docstring, imports and other given statements."""
    first = [s.lines[0] if s.lines and s.lines[0].startswith("#") else "" for s in (was, now, to)]
    if first[0] == first[1] != first[2] and first[1]:
        yield range(0, 1), first[2]
    spans = [_docstring(s) for s in (was, now, to)]
    texts = [s.piece(span) for s, span in zip((was, now, to), spans, strict=True)]
    if texts[2] not in texts[:2]:
        if texts[0] == texts[1]:
            done.brought.append("what the file says about itself")
            yield spans[1], texts[2]
        else:
            done.left.append("you changed what the file says about itself; yours was kept")
    old, here, today = ({_named(node): node for node in _statements(s)} for s in (was, now, to))
    last = max((n.end_lineno or 0 for n in source.imports(now.tree)), default=spans[1].stop)
    for key, node in today.items():
        text = to.piece(_span(node))
        if key in here:
            mine = now.piece(_span(here[key]))
            given = was.piece(_span(old[key])) if key in old else mine
            if mine == given and mine != text and key in old:
                done.brought.append(key)
                yield _span(here[key]), text
            elif text not in (mine, given):
                done.left.append(f"you changed {key}, and so has the new release; yours was kept")
        elif key not in old:
            done.brought.append(key)
            blank = "\n" if to.lines[node.lineno - 2].strip() == "" else ""
            yield range(last, last), blank + text


def _statements(text: Source) -> list[ast.stmt]:
    """Imports and assignments at the top level."""
    return [n for n in text.tree.body if isinstance(n, (ast.Import, ast.ImportFrom, ast.Assign))]


def _named(node: ast.stmt) -> str:
    """What a statement is known by: `import taichi`, `from muslin.given`, `LIMIT = ...`."""
    if isinstance(node, ast.Import):
        return f"import {', '.join(alias.name for alias in node.names)}"
    if isinstance(node, ast.ImportFrom):
        return f"from {node.module} import {', '.join(alias.name for alias in node.names)}"
    assert isinstance(node, ast.Assign)
    return f"{ast.unparse(node.targets[0])} = ..."


def _span(node: ast.stmt) -> range:
    return range(node.lineno - 1, node.end_lineno or node.lineno)


def _docstring(text: Source) -> range:
    """Lines of the module's docstring."""
    if ast.get_docstring(text.tree) is None:
        start = 1 if text.lines and text.lines[0].startswith("#") else 0
        return range(start, start)
    return _span(text.tree.body[0])


def _require_same_work(before: Source, after: Source) -> None:
    """What the student wrote is all there: every body that was not the stub, every function."""
    for name, function in before.functions.items():
        merged = after.functions.get(name)
        if merged is None or (
            not is_stub(function.node)
            and source.without_docstring(merged.node) != source.without_docstring(function.node)
        ):
            raise MuslinError(f"{name} would be changed.")


# ------------------------------------------------------------------------------------------ the workspace


@dataclass(frozen=True)
class Upgrade:
    """What an upgrade brings or leaves: one sentence each; `changed` are tasks with new public cases."""

    old: str
    new: str
    brought: tuple[str, ...]
    left: tuple[str, ...]
    changed: tuple[str, ...]
    backup: Path | None


def upgrade(workspace: Workspace, really: bool = True) -> Upgrade:
    """Bring a workspace to the version of the assignment that is installed.

    Parameters
    ----------
    workspace : Workspace
    really : bool
        Write; otherwise only say what would be done.

    Raises
    ------
    MuslinError
        If the folder was not made by `muslin start`.
    """
    if not workspace.started:
        raise MuslinError(
            f"{paths.shown(workspace.folder)} was not made by muslin start, so nobody knows what was given.",
            "Start a new folder and copy your functions into it.",
        )
    about, name = workspace.described(), workspace.table.name
    given_then, today = about.get("files", {}), given_files(name)
    plan = [_planned(workspace, file, content, given_then.get(file)) for file, content in today.items()]
    plan += [_dropped(workspace, file) for file in sorted(given_then.keys() - today.keys())]
    backup = _applied(workspace, plan, today) if really else None
    known = about.get("reference", {})
    return Upgrade(
        str(about.get("version", "")),
        workspace.table.version,
        tuple(what for step in plan for what in step.brought),
        tuple(what for step in plan for what in step.left),
        tuple(t for t in workspace.table.tasks if known.get(t) and known[t] != reference_sum(name, t)),
        backup,
    )


@dataclass(frozen=True)
class Step:
    """What becomes of one file.

    Attributes
    ----------
    file : str
    brought, left : tuple of str
        One sentence for each thing.
    content : bytes or str, optional
        What to write.
    to : str
        Where, if not into the file itself.
    still : str, optional
        Checksum of what counts as given from now on, if not today's: the file is merged at the next upgrade.
    """

    file: str
    brought: tuple[str, ...] = ()
    left: tuple[str, ...] = ()
    content: bytes | str | None = None
    to: str = ""
    still: str | None = None


def _planned(workspace: Workspace, file: str, content: bytes, given: str | None) -> Step:
    """The step for a file that is given today; `given`: checksum of what was given then, if it was."""
    path, today = workspace.folder / file, checksum(content)
    if not path.exists():
        return Step(file, (f"{file}: {'new' if given is None else 'brought back'}",), content=content)
    mine = checksum(path.read_bytes())
    if today in (mine, given):
        return Step(file)  # up to date, or changed by the student only
    if file in workspace.table.files:
        return _merging(workspace, file, content, given)
    if mine == given:
        return Step(file, (file,), content=content)
    beside = (
        Path(file).with_name(f"{Path(file).stem}-{workspace.table.version}{Path(file).suffix}").as_posix()
    )
    told = f"{file}: you changed it, so the new one is beside it, as {beside}."
    there = (workspace.folder / beside).exists()
    return Step(file, left=(told,), content=None if there else content, to=beside)


def _merging(workspace: Workspace, file: str, content: bytes, given: str | None) -> Step:
    """The step for a task file that both the student and the release have changed."""
    text = source.read(workspace.folder / file)
    try:
        merged = merge(workspace.given(file), text, content.decode("utf-8"))
    except MuslinError as error:
        told = f"{file} was left as it is: {error} Fix it, and upgrade again."
        return Step(file, left=(told,), still=given or "")
    return Step(
        file,
        tuple(f"{file}, {what}" for what in merged.brought),
        tuple(f"{file}, {what}." for what in merged.left),
        merged.text if merged.text != text else None,
    )


def _dropped(workspace: Workspace, file: str) -> Step:
    there = (workspace.folder / file).exists()
    told = f"{file} is not part of the assignment any more; delete it if you like."
    return Step(file, left=(told,) if there else ())


def _applied(workspace: Workspace, plan: list[Step], today: dict[str, bytes]) -> Path | None:
    """Write what is planned, and what was given today; returns where the files as they were are, if any."""
    writes = {step.to or step.file: step.content for step in plan if step.content is not None}
    existing = [workspace.folder / file for file in writes if (workspace.folder / file).is_file()]
    backup = workspace.back_up(*existing, label="upgrade") if existing else None
    for file, content in writes.items():
        if isinstance(content, str):
            source.write(workspace.folder / file, content)
        else:
            _put(workspace.folder / file, content)
    still = {step.file: step.still for step in plan if step.still is not None}
    for file in workspace.table.files:
        if file not in still:
            _put(workspace.hidden / "given" / f"{file}.given", today[file])
    source.write(workspace.hidden / "workspace.json", description(workspace.table.name, still))
    return backup


def _put(path: Path, content: bytes) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    except OSError as error:
        raise MuslinError(f"{paths.shown(path)} cannot be written: {error.strerror}.") from None


def told(upgrade: Upgrade, really: bool = True) -> list[str]:
    """An upgrade in lines for people."""
    if not (upgrade.brought or upgrade.left or upgrade.changed) and upgrade.old == upgrade.new:
        return [f"This workspace is up to date ({upgrade.new})."]
    verb = "Brought" if really else "Would bring"
    head = f"{upgrade.old} -> {upgrade.new}" if upgrade.old != upgrade.new else upgrade.new
    lines = [f"{head}. What you wrote stays as it is."]
    lines += [f"  {verb.lower()}  {what}" for what in upgrade.brought]
    lines += [f"  left     {what}" for what in upgrade.left]
    if upgrade.changed:
        lines.append(f"The public cases have changed; check again: muslin check {' '.join(upgrade.changed)}")
    if upgrade.backup is not None:
        lines.append(f"The files as they were are in {paths.shown(upgrade.backup)}.")
    return lines
