"""Where Taichi is not Python: lists, whole numbers, branches, loops.

Some of these compile and only make the answer wrong (a variable born as a whole number, a changed argument), so
no compiler will ever complain.
"""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator

from muslin.reading.page import Note, Page, assignments, is_taichi, name_of, nodes, used


def whole(node: ast.expr) -> bool:
    """Whether an expression is made of whole numbers only."""
    if isinstance(node, ast.Constant):
        return type(node.value) is int
    if isinstance(node, ast.UnaryOp):
        return whole(node.operand)
    if isinstance(node, ast.BinOp):
        return not isinstance(node.op, ast.Div) and whole(node.left) and whole(node.right)
    if isinstance(node, (ast.List, ast.Tuple)):
        return bool(node.elts) and all(map(whole, node.elts))
    if is_taichi(node, "Vector", "Matrix"):
        assert isinstance(node, ast.Call)
        return len(node.args) == 1 and whole(node.args[0])
    return False


def is_int(node: ast.expr) -> bool:
    """Whether an argument says that entries are whole numbers."""
    return ast.unparse(node) in ("int", "ti.i32", "ti.i64")


def _born_whole(node: ast.expr) -> bool:
    """Whether a variable that gets this first is one of whole numbers."""
    return whole(node) or (
        isinstance(node, ast.Call) and any(map(is_int, node.args)) and not is_taichi(node, "cast")
    )


def _lists(page: Page) -> Iterator[Note]:
    born = {
        target.id: statement
        for statement, target, value in assignments(page.node)
        if isinstance(target, ast.Name) and isinstance(value, (ast.List, ast.ListComp))
    }
    for node in nodes(page.node):
        sides = [node.left, node.right] if isinstance(node, ast.BinOp) else []
        sides += [node.value] if isinstance(node, ast.Return) and node.value and len(page.asked) < 2 else []
        sides += (
            [node.func.value] if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) else []
        )
        for side in sides:
            if isinstance(side, ast.Name) and side.id in born:
                yield page.note(
                    born[side.id], f"a Python list is not a vector; write {side.id} = ti.Vector([...])."
                )
            elif isinstance(side, ast.List):
                yield page.note(side, "a Python list is not a vector; write ti.Vector([...]).")


def _whole_numbers(page: Page) -> Iterator[Note]:
    first: dict[str, tuple[ast.stmt, ast.expr]] = {}
    seen: set[str] = set()
    for statement, target, value in sorted(assignments(page.node), key=lambda found: found[0].lineno):
        name = name_of(target)
        if isinstance(target, ast.Name) and name not in seen and not isinstance(statement, ast.AugAssign):
            first[name] = statement, value
            seen.add(name)
        elif name in first and _born_whole(first[name][1]) and not whole(value):
            statement_born, born = first.pop(name)
            yield page.note(
                statement_born,
                f"{name} is born as a whole number, so what it gets in line {statement.lineno} is cut off; "
                f"write {'0.0 for 0' if whole(born) else 'float for int'}.",
                compiles=True,
            )


def _integer_division(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        if isinstance(node, ast.BinOp) and isinstance(node.op, ast.FloorDiv):
            yield page.note(node, "// cuts off the fraction (1 // 2 is 0); write /.", compiles=True)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "int":
            yield page.note(node, "int cuts off the fraction; leave it out.", compiles=True)
        elif isinstance(node, ast.Call) and is_taichi(node, "cast") and len(node.args) > 1:
            truth = isinstance(node.args[0], (ast.Compare, ast.BoolOp))
            if not truth and is_int(node.args[1]):
                yield page.note(node, "this cuts off the fraction; leave the cast out.", compiles=True)


def _counts(page: Page) -> Iterator[Note]:
    loops = [
        n
        for n in nodes(page.node)
        if isinstance(n, ast.Call) and ast.unparse(n.func) in ("range", "ti.ndrange")
    ]
    counted = {id(inner) for loop in loops for inner in ast.walk(loop)}
    for node in nodes(page.node):
        if not isinstance(node, ast.Call) or len(node.args) != 1 or id(node) in counted:
            continue
        if isinstance(node.func, ast.Name) and node.func.id == "len":
            vector = ast.unparse(node.args[0])
            words = f"len({vector}) is how many entries {vector} has; its length is {vector}.norm()."
            yield page.note(node, words, compiles=True)


def _single_precision(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        if isinstance(node, ast.Attribute) and node.attr in ("f32", "f16", "float32", "float16"):
            yield page.note(
                node,
                "keeps seven digits where sixteen are asked; leave it out, or write float.",
                compiles=True,
            )


def _returns(page: Page) -> Iterator[Note]:
    for branch in nodes(page.node):
        if isinstance(branch, (ast.If, ast.For, ast.While)):
            if isinstance(branch, ast.If) and is_taichi(branch.test, "static"):
                continue
            if isinstance(branch, ast.For) and is_taichi(branch.iter, "static"):
                continue
            for node in ast.walk(branch):
                if isinstance(node, ast.Return):
                    yield page.note(
                        node,
                        "no return inside an if or a loop; give y a value before, change it inside, and end "
                        "with return y.",
                    )


def _undecorated(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            helper = page.functions.get(node.func.id)
            if helper is not None and not helper.decorator_list:
                yield page.note(
                    node, f"write @ti.func on the line above def {helper.name} (line {helper.lineno})."
                )


def _changed_arguments(page: Page) -> Iterator[Note]:
    for statement, target, _ in assignments(page.node):
        targets = target.elts if isinstance(target, ast.Tuple) else [target]
        for one in targets:
            if (name := name_of(one)) in page.arguments:
                yield page.note(
                    statement,
                    f"from here on {name} is not the argument {name} any more; make a new variable.",
                    compiles=True,
                )


def _recursion(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        called = node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else ""
        if page.node.name in used(page.functions, called):
            yield page.note(node, f"{page.node.name} calls itself, and Taichi cannot; write a loop.")


def _loops(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        if not isinstance(node, ast.For):
            continue
        over = node.iter
        if isinstance(over, ast.Call) and is_taichi(over, "static") and len(over.args) == 1:
            over = over.args[0]
        plain = isinstance(over, ast.Call) and isinstance(over.func, ast.Name) and over.func.id == "range"
        if plain or (is_taichi(over, "ndrange", "grouped", "range")):
            continue
        if over is not node.iter and isinstance(over, (ast.List, ast.Tuple, ast.Call)):
            continue  # ti.static over a list of numbers, enumerate, zip
        yield Note(
            node.lineno,
            f"for {ast.unparse(node.target)} in {ast.unparse(node.iter)}",
            "Taichi loops over numbers, not over vectors, matrices or lists; write for k in ti.static(range(3)) "
            "and take v[k] or A[k, :].",
        )


def _double_index(page: Page) -> Iterator[Note]:
    for node in nodes(page.node):
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Subscript):
            yield page.note(node, "an entry of a matrix is A[i, j], a row A[i, :].")


def _unpacked(page: Page) -> Iterator[Note]:
    """A vector taken apart into fewer or more names than it has components."""
    for statement, target, value in assignments(page.node):
        size = page.sizes.get(value.id) if isinstance(value, ast.Name) else None
        if size is not None and isinstance(target, ast.Tuple) and len(target.elts) != size:
            name = name_of(value)
            yield page.note(
                statement,
                f"{name} is unpacked into {len(target.elts)} names and has {size} components; write "
                f"{name}[0], {name}[1], ..., or give every component a name.",
                fatal=True,
            )


def _never_used(page: Page) -> Iterator[Note]:
    """A variable that gets a value and is not used, beside one that differs from it in capitals only."""
    names = [node for node in nodes(page.node) if isinstance(node, ast.Name)]
    used_names = {node.id for node in names if isinstance(node.ctx, ast.Load)} | set(page.arguments)
    for node in names:
        alike = sorted(other for other in used_names if other.lower() == node.id.lower())
        if isinstance(node.ctx, ast.Store) and node.id not in used_names and alike:
            yield page.note(
                node, f"{node.id} gets a value and is never used: did you mean {alike[0]}?", compiles=True
            )


def _no_method(page: Page) -> Iterator[Note]:
    """A component, or several, called like a method: m.t(), which is another library's transpose."""
    for node in nodes(page.node):
        called = node.func if isinstance(node, ast.Call) else None
        if not isinstance(called, ast.Attribute) or name_of(called.value) in page.known:
            continue  # a class or a module of one's own may have one
        if called.attr in ("t", "T", "H"):
            transposed = f"{ast.unparse(called.value)}.transpose()"
            yield page.note(
                node, f"vectors and matrices have no method {called.attr}; write {transposed}.", fatal=True
            )


TRAPS: tuple[Callable[[Page], Iterator[Note]], ...] = (
    _lists,
    _whole_numbers,
    _integer_division,
    _counts,
    _single_precision,
    _returns,
    _undecorated,
    _changed_arguments,
    _recursion,
    _loops,
    _double_index,
    _unpacked,
    _never_used,
    _no_method,
)
