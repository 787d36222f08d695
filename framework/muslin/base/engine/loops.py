"""A loop over several indices, `for i, j in ti.ndrange(3, 3):`, as nested loops in a student's function.

The engine makes one loop of it and divides its number for every index in every pass, which costs many times what a
short body does: a 3x3 block of a tetrahedron's stiffness took nine times as long.
"""

from __future__ import annotations

import ast
import functools
from typing import Any

from muslin.base.engine import inside


def nest() -> None:
    """Have the engine nest them; called whenever it starts."""
    if not inside.has("nesting loops"):
        return
    transformer = inside.own_module("lang.ast.ast_transformer").ASTTransformer
    built = getattr(transformer.build_ndrange_for, "original", transformer.build_ndrange_for)

    @functools.wraps(built)
    def build(ctx: Any, node: ast.For) -> Any:
        loops = (
            None if getattr(ctx, "is_kernel", True) else nested(node)
        )  # a kernel's may be its parallel one
        return built(ctx, node) if loops is None else transformer.build_range_for(ctx, loops)

    build.original = built  # type: ignore[attr-defined]
    transformer.build_ndrange_for = staticmethod(build)


def nested(node: ast.For) -> ast.For | None:
    """The same passes in the same order, as loops over `range`; None where that cannot be said, or is not the same.

    A `break` ends all of them, and an index may be changed in one loop over many, so that those stay as they are.
    """
    targets = node.target.elts if isinstance(node.target, ast.Tuple) else []
    sizes = node.iter.args if isinstance(node.iter, ast.Call) else []
    bounds = [size.elts if isinstance(size, ast.Tuple) else [size] for size in sizes]
    whole = all(isinstance(b, ast.Constant) and type(b.value) is int for pair in bounds for b in pair)
    names = [target.id for target in targets if isinstance(target, ast.Name)]
    if not (1 < len(names) == len(targets) == len(bounds) and whole and all(len(b) < 3 for b in bounds)):
        return None
    if node.orelse or len(set(names)) < len(names):
        return None
    for inside_ in (part for statement in node.body for part in ast.walk(statement)):
        stored = isinstance(inside_, ast.Name) and isinstance(inside_.ctx, ast.Store) and inside_.id in names
        if stored or isinstance(inside_, ast.Break):
            return None
    body: list[ast.stmt] = node.body
    for name, pair in zip(reversed(names), reversed(bounds), strict=True):
        counted = ast.Call(ast.Name("range", ast.Load()), list(pair), [])
        loop = ast.For(ast.Name(name, ast.Store()), counted, body, [])
        body = [ast.fix_missing_locations(ast.copy_location(loop, node))]
    (outer,) = body
    return outer if isinstance(outer, ast.For) else None
