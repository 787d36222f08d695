"""Names that do not exist: NumPy's in a Taichi function, methods vectors lack, variables nobody has given a value."""

from __future__ import annotations

import ast
import builtins
import importlib
import re
from collections.abc import Callable, Iterator
from typing import Any

from muslin.reading import vocabulary
from muslin.reading.page import Note, Page, is_taichi, name_of, nodes
from muslin.reading.vocabulary import GREEK, INSTEAD

#: What Muslin gives for students to import.
GIVEN = ("diag", "svd", "dsvd", "split", "tangents")


def _numpy(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        called = node.func if isinstance(node, ast.Call) else None
        if called is None or not page.foreign(name_of(called)):
            continue
        name = called.attr if isinstance(called, ast.Attribute) else name_of(called)
        alike = f"ti.{name}" if hasattr(vocabulary.taichi(), name) else ""
        instead = alike or INSTEAD.get(name, "a plain formula")
        yield page.note(node, f"NumPy and math do not run inside a Taichi function; write {instead}.")


def _missing(page: Page) -> Iterator[Note]:
    """Names that a module, or a vector or matrix, does not have."""
    for node in nodes(page.node):
        if not isinstance(node, ast.Attribute):
            continue
        base = _module(page, node.value)
        if base is not None:
            if not hasattr(base, node.attr):
                yield page.note(node, _no_such(ast.unparse(node.value), node.attr, dir(base)))
        elif not _is_module(page, node.value) and node.attr not in vocabulary.parts():
            yield page.note(node, _no_method(node.attr))


def _module(page: Page, node: ast.expr) -> Any:
    """Taichi, or what a chain of dots finds in it (ti, ti.math, ti.Matrix); None for everything else."""
    if isinstance(node, ast.Attribute):
        base = _module(page, node.value)
        return getattr(base, node.attr, None) if base is not None else None
    if isinstance(node, ast.Name) and node.id not in page.arguments:
        origin = page.modules.get(node.id, "")
        if origin == "taichi":
            return vocabulary.taichi()
        if origin.startswith("taichi."):
            try:
                return importlib.import_module(vocabulary.taichi().__name__ + origin.removeprefix("taichi"))
            except ImportError:
                return None
    return None


def _is_module(page: Page, node: ast.expr) -> bool:
    """Whether a chain of dots begins with something imported, so that it is no vector."""
    while isinstance(node, ast.Attribute):
        node = node.value
    if not isinstance(node, ast.Name):
        return isinstance(node, ast.Constant)
    imported = node.id in page.modules or node.id in ("np", "numpy", "math", "ti", "taichi")
    return node.id not in page.arguments and (imported or node.id in page.known)


def _no_such(module: str, name: str, names: list[str]) -> str:
    alike = vocabulary.near(name, (n for n in names if not n.startswith("_")))
    close = module.endswith(("Matrix", "Vector")) and alike.startswith(name)  # col and cols
    instead = f"{module}.{alike}" if alike and (close or name not in INSTEAD) else INSTEAD.get(name, "")
    return f"{module} has no {name}" + (f"; write {instead}." if instead else ".")


def _no_method(name: str) -> str:
    instead = INSTEAD.get(name, "")
    if not instead and (alike := vocabulary.near(name, vocabulary.methods())):
        instead = f"v.{alike}()"
    if instead:
        return f"vectors and matrices have no {name}; write {instead}."
    return f"vectors and matrices have no {name}; their components are v[0], v[1], v[2]."


def _scopes(page: Page) -> tuple[dict[str, list[tuple[int, ...]]], list[tuple[ast.Name, tuple[int, ...]]]]:
    """Where names get values and where they are used: paths of the branches and loops they stand in."""
    born: dict[str, list[tuple[int, ...]]] = {}
    used: list[tuple[ast.Name, tuple[int, ...]]] = []

    def visit(node: ast.AST, path: tuple[int, ...]) -> None:
        if isinstance(node, ast.Name):
            if isinstance(node.ctx, ast.Load):
                used.append((node, path))
            else:
                born.setdefault(node.id, []).append(path)
            return
        if isinstance(node, ast.comprehension):
            for name in ast.walk(node.target):
                if isinstance(name, ast.Name):
                    born.setdefault(name.id, []).append(())
        if isinstance(node, (ast.FunctionDef, ast.Lambda)) and node is not page.node:
            names = [a.arg for a in node.args.args]
            names += [node.name] if isinstance(node, ast.FunctionDef) else []
            for one in names:
                born.setdefault(one, []).append(())
        if isinstance(node, (ast.Import, ast.ImportFrom)):
            for alias in node.names:
                born.setdefault((alias.asname or alias.name).split(".")[0], []).append(())
        for field, value in ast.iter_fields(node):
            inner = path
            if isinstance(node, (ast.If, ast.For, ast.While)) and field in ("body", "orelse", "target"):
                head = node.iter if isinstance(node, ast.For) else node.test
                if not is_taichi(head, "static"):
                    inner = (*path, node.lineno * 2 + (field == "orelse"))
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    visit(child, inner)

    for statement in page.node.body:
        visit(statement, ())
    return born, used


def _undefined(page: Page) -> Iterator[Note]:
    """Names nobody gives a value, and names that have one in a branch only."""
    if "*" in page.modules:
        return
    born, used = _scopes(page)
    told: set[str] = set()
    everywhere = page.arguments | page.known | set(dir(builtins))
    for name, path in used:
        if name.id in told or name.id in everywhere:
            continue
        places = born.get(name.id)
        if places is None:
            if name.id not in ("np", "numpy", "math"):
                yield page.note(name, _unknown(page, name.id, set(born)))
                told.add(name.id)
        elif not any(path[: len(place)] == place for place in places):
            line = min(place[-1] // 2 for place in places)
            yield page.note(
                name,
                f"{name.id} gets its value inside the if or loop of line {line}, and is unknown after it; give it a "
                "value before.",
            )
            told.add(name.id)


def _unknown(page: Page, name: str, born: set[str]) -> str:
    own = page.arguments | born
    plain = "".join(GREEK.get(letter, letter) for letter in name)
    if name in ("ti", "taichi"):
        return f"{name} is not known in this file; write import taichi as ti at its top."
    if plain != name and plain in own | page.known:
        return f"{name} is not known here; write {plain}."
    alike = vocabulary.near(name, own)
    if alike.lower() == name.lower() and name not in INSTEAD:
        return f"{name} is not known here; did you mean {alike}?"
    indexed = re.fullmatch(r"([A-Za-z]\w*?)_?(\d)(\d)?", name)
    if indexed is not None and indexed[1] in own:
        entry = f"{indexed[1]}[{indexed[2]}{', ' + indexed[3] if indexed[3] else ''}]"
        return f"{name} is not known here; an entry is {entry}."
    if name in GIVEN:
        return (
            f"{name} is given, and must be imported; write from muslin.given import {name} at the file's top."
        )
    if name in INSTEAD and (not alike or len(name) == 1):
        return f"{name} is not known here; write {INSTEAD[name]}."
    if not alike and callable(getattr(vocabulary.taichi(), name, None)):
        return f"{name} is not known here; write ti.{name}."
    if name == "end":
        return "Python has no end; a block ends where lines begin further left. Delete the line."
    if name == "self":
        return "self belongs to classes; the arguments have names of their own here."
    if alike:
        return f"{name} is not known here; did you mean {alike}?"
    known = ", ".join(argument.arg for argument in page.node.args.args)
    return f"nothing here gives {name} a value; known are the arguments {known}, and what you compute before."


NAMES: tuple[Callable[[Page], Iterator[Note]], ...] = (_numpy, _undefined, _missing)
