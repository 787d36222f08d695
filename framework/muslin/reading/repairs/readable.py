"""What is asked of a text before changes are tried: whether it is of a size that people write, and where it bends."""

from __future__ import annotations

import ast

#: Longest text that is read, longest line, deepest brackets and indentation [characters].
LONGEST, WIDEST, DEEPEST, INDENTED = 30_000, 2_000, 40, 80


def ordinary(text: str) -> bool:
    """Whether a text is of a size that people write: a parser may be brought down by others."""
    if len(text) > LONGEST:
        return False
    depth = deepest = 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        deepest = max(deepest, depth)
    lines = text.splitlines()
    widest = max(map(len, lines), default=0)
    indented = max((len(line) - len(line.lstrip()) for line in lines), default=0)
    return deepest <= DEEPEST and widest <= WIDEST and indented <= INDENTED


def bent(function: ast.FunctionDef) -> set[int]:
    """Nodes on which something hangs that a small change may not show: a condition, a larger or smaller of two."""
    tests: list[ast.AST] = []
    for node in ast.walk(function):
        if isinstance(node, (ast.If, ast.IfExp)):
            tests.append(node.test)
        elif isinstance(node, (ast.Compare, ast.FloorDiv)):
            tests.append(node)
        elif isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
            if name in ("max", "min", "abs", "cast", "int", "select", "floor"):
                tests.append(node)
    names: set[str] = set()
    while True:
        before = len(names)
        names |= {n.id for test in tests for n in ast.walk(test) if isinstance(n, ast.Name)}
        for node in ast.walk(function):
            if isinstance(node, (ast.Assign, ast.AugAssign)):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                within = {id(n) for t in targets for s in _indices(t) for n in ast.walk(s)}
                inside = (n for t in targets for n in ast.walk(t) if id(n) not in within)
                given = {n.id for n in inside if isinstance(n, ast.Name)}
                if given & names and node.value not in tests:
                    tests.append(node.value)
        if len(names) == before:
            return {id(n) for test in tests for n in ast.walk(test)}


def _indices(target: ast.expr) -> list[ast.expr]:
    """What stands in square brackets in a target."""
    return [n.slice for n in ast.walk(target) if isinstance(n, ast.Subscript)]
