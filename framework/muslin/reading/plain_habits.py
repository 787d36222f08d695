"""What a reader notices in a function in plain Python over NumPy arrays: what runs, and is not meant."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from muslin.reading.page import Note, Page, name_of, nodes, shown


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


def _not_called(page: Page) -> Iterator[Note]:
    """A function that was given, handed to another one where what it comes to is meant."""
    for node in nodes(page.node):
        if not (isinstance(node, ast.Call) and name_of(node.func) in page.arguments):
            continue
        for given in node.args:
            if isinstance(given, ast.Name) and given.id in page.arguments and given.id not in page.sizes:
                name = given.id
                yield page.note(
                    node, f"{name} is a function: it must be called, with brackets, as in {name}(x)."
                )


def _goes_elsewhere(page: Page) -> Iterator[Note]:
    """A step to another place than the one a function has been tried at."""
    tried: dict[str, str] = {}
    for node in nodes(page.node):
        if isinstance(node, ast.Call) and name_of(node.func) in page.arguments and len(node.args) == 1:
            place = node.args[0]
            if isinstance(place, ast.BinOp) and _steps_from(place, page):
                tried[_sorted(place)] = ast.unparse(place)
    for node in nodes(page.node):
        value = node.value if isinstance(node, ast.Assign) else None
        if isinstance(value, ast.BinOp) and tried and (given := _steps_from(value, page)):
            same_name = isinstance(node.targets[0], ast.Name) and node.targets[0].id == given  # type: ignore[attr-defined]
            if same_name and _sorted(value) not in tried:
                words = f"what is tried is {' and '.join(tried.values())}, and {given} goes elsewhere: "
                words += "compare the sign and the length of the step."
                yield page.note(node, words, compiles=True)


def _steps_from(node: ast.BinOp, page: Page) -> str:
    """The argument that is an array, which something is added to or taken from; empty if it is none."""
    fits = isinstance(node.op, (ast.Add, ast.Sub)) and isinstance(node.left, ast.Name)
    return node.left.id if fits and isinstance(node.left, ast.Name) and node.left.id in page.sizes else ""


def _sorted(node: ast.AST) -> str:
    """The text of an expression, whatever the order of its sums and products."""
    if isinstance(node, ast.BinOp):
        sides = [_sorted(node.left), _sorted(node.right)]
        if isinstance(node.op, (ast.Add, ast.Mult)):
            sides.sort()
        return f"({type(node.op).__name__} {' '.join(sides)})"
    return ast.unparse(node)


def _searches(page: Page) -> Iterator[ast.While]:
    """Loops that go on according to what a given function comes to."""
    for loop in nodes(page.node):
        if isinstance(loop, ast.While) and _called(loop.test, page):
            yield loop


def _called(node: ast.AST, page: Page) -> list[ast.Call]:
    """Where functions that were given are called."""
    calls = [n for n in nodes(node) if isinstance(n, ast.Call)]
    return [n for n in calls if isinstance(n.func, ast.Name) and n.func.id in page.arguments]


def _goes_on_while_good(page: Page) -> Iterator[Note]:
    """A search for a lower value that goes on as long as it has one."""
    for loop in _searches(page):
        for test in loop.test.values if isinstance(loop.test, ast.BoolOp) else [loop.test]:
            if not isinstance(test, ast.Compare) or not isinstance(test.ops[0], (ast.Lt, ast.LtE)):
                continue
            if test.left in _called(test, page):
                words = "the loop goes on while it is low enough, and ends where it is not: a not is missing."
                yield page.note(test, words, compiles=True)


def _does_not_shorten(page: Page) -> Iterator[Note]:
    """A step that is tried again without being halved."""
    for loop in _searches(page):
        tried = {n.id for call in _called(loop.test, page) for n in nodes(call) if isinstance(n, ast.Name)}
        changes = [n for n in nodes(loop) if isinstance(n, ast.AugAssign) and name_of(n.target) in tried]
        for change in changes:
            by = change.value.value if isinstance(change.value, ast.Constant) else None
            if not isinstance(by, (int, float)):
                continue
            longer = isinstance(change.op, ast.Add)
            longer |= (isinstance(change.op, ast.Mult) and by >= 1) or (
                isinstance(change.op, ast.Div) and by <= 1
            )
            name = name_of(change.target)
            if longer:
                words = f"this does not make {name} smaller: halve it, {name} = {name} / 2."
                yield page.note(change, words, compiles=True)
            elif isinstance(change.op, ast.Sub):
                words = f"this takes {name} past zero: halve it, {name} = {name} / 2."
                yield page.note(change, words, compiles=True)


def _stops_while_far(page: Page) -> Iterator[Note]:
    """An end where something is still longer than it may be."""
    for test in nodes(page.node):
        if not (isinstance(test, ast.If) and isinstance(test.body[0], (ast.Break, ast.Return))):
            continue
        compared = test.test
        if not isinstance(compared, ast.Compare) or not isinstance(compared.ops[0], (ast.Gt, ast.GtE)):
            continue
        limit = compared.comparators[0]
        if (
            "norm" in ast.unparse(compared.left)
            and isinstance(limit, ast.Name)
            and limit.id in page.arguments
        ):
            words = f"this ends where it is longer than {limit.id}; the end is where it is shorter: <= belongs there."
            yield page.note(compared, words, compiles=True)


def _asked_once(page: Page) -> Iterator[Note]:
    """What hangs on an argument, worked out before a loop that changes the argument, and used in it."""
    for loop in page.node.body:
        if not isinstance(loop, (ast.For, ast.While)):
            continue
        stored = {n.id for n in nodes(loop) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)}
        read = {n.id for n in nodes(loop) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)}
        for line in page.node.body[: page.node.body.index(loop)]:
            if not isinstance(line, ast.Assign) or not isinstance(line.targets[0], ast.Name):
                continue
            name = line.targets[0].id
            places = {
                n.id for call in _called(line.value, page) for n in nodes(call) if isinstance(n, ast.Name)
            }
            moved = sorted(places & stored & set(page.sizes))
            if moved and name in read and name not in stored:
                words = f"this is worked out once, before the loop: {moved[0]} changes in it, and {name} does not."
                yield page.note(line, words, compiles=True)


PLAIN = (
    _in_place,
    _lets_nan_pass,
    _not_called,
    _goes_elsewhere,
    _goes_on_while_good,
    _does_not_shorten,
    _stops_while_far,
    _asked_once,
)
