"""What a reader notices in a function in plain Python over NumPy arrays: what runs, and is not meant."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from muslin.reading.page import Note, Page, nodes, shown


def _in_place(page: Page) -> Iterator[Note]:
    """Changes of an argument that whoever gave it sees, too."""
    own: set[str] = set()  # names given a value of their own on the way
    for node in sorted(
        nodes(page.node), key=lambda n: (getattr(n, "lineno", 0), getattr(n, "col_offset", 0))
    ):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                if isinstance(target, ast.Name):
                    own.add(target.id)
                elif isinstance(target, ast.Subscript) and _is_given(target.value, page, own):
                    name = shown(target.value)
                    words = f"this changes the caller's {name}, too; begin with {name} = {name}.copy()."
                    yield page.note(node, words, compiles=True)
        elif isinstance(node, ast.AugAssign) and _is_given(node.target, page, own):
            name = shown(node.target)
            words = f"this changes the caller's {name} in place; make a new one: {name} = {name} + ..."
            yield page.note(node, words, compiles=True)


def _is_given(node: ast.AST, page: Page, own: set[str]) -> bool:
    return isinstance(node, ast.Name) and node.id in page.sizes and node.id not in own


def _lets_nan_pass(page: Page) -> Iterator[Note]:
    """Loops that go on while a function's value is too large: NaN is not."""
    for loop in nodes(page.node):
        for test in nodes(loop.test) if isinstance(loop, ast.While) else ():
            if not (isinstance(test, ast.Compare) and isinstance(test.ops[0], (ast.Gt, ast.GtE))):
                continue
            called = test.left.func if isinstance(test.left, ast.Call) else None
            if isinstance(called, ast.Name) and called.id in page.arguments:
                words = "NaN is not greater than anything, and passes; ask while not ... <= ... instead."
                yield page.note(test, words, compiles=True)


PLAIN = (_in_place, _lets_nan_pass)
