"""One task under two conventions: as its assignment asks for it, and as Muslin calls it.

A variant of an assignment may ask for gradients as columns where Muslin works with rows, for E and nu where it has mu
and lam, for a normal of the other sign. What differs is said in the manifest, as one expression for each value that is
not simply handed on, and everything else follows: `to_own` and `to_called` carry inputs from one convention to the
other, `results_own` and `results_called` results, and `as_called` makes functions that the simulator can call.

Expressions are arithmetic on names, `x.transpose()`, `x[0]` and `vec(a, b, ...)`: what Taichi, NumPy and exact numbers
read alike. Nothing else is evaluated, whoever wrote the manifest.
"""

from __future__ import annotations

import ast
import functools
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.base.errors import MuslinError

if TYPE_CHECKING:
    from muslin.tasks.loading import Functions
    from muslin.tasks.manifest import Task, Value

Arrays = dict[str, np.ndarray]
Expressions = Mapping[str, str]

#: What an expression may be made of.
GRAMMAR = (
    ast.Expression, ast.BinOp, ast.UnaryOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.USub, ast.Name, ast.Load,
    ast.Constant, ast.Subscript, ast.Call, ast.Attribute,
)  # fmt: skip


@dataclass(frozen=True)
class Wiring:
    """How Muslin calls a task's function, where it is not as the assignment asks for it.

    Attributes
    ----------
    arguments, results : tuple of Value
        As Muslin has them.
    give : mapping
        The function's arguments from Muslin's; one that is not there is Muslin's of the same name.
    take : mapping
        Muslin's results from the function's.
    back, send : mapping
        The other way: Muslin's arguments from the function's, and the function's results from Muslin's.
    """

    arguments: tuple[Value, ...]
    results: tuple[Value, ...]
    give: Expressions = field(default_factory=dict)
    take: Expressions = field(default_factory=dict)
    back: Expressions = field(default_factory=dict)
    send: Expressions = field(default_factory=dict)

    def __post_init__(self) -> None:
        for text in (*self.give.values(), *self.take.values(), *self.back.values(), *self.send.values()):
            _compiled(text)


@functools.cache
def _compiled(text: str) -> Any:
    """An expression, ready to be evaluated.

    Raises
    ------
    MuslinError
        If it is not of the grammar.
    """
    wrong = MuslinError(
        f"{text[:80]!r} is not an expression that Muslin can carry a value over with.",
        "It may hold names, numbers, + - * /, x.transpose(), x[0] and vec(a, b).",
    )
    try:
        tree = ast.parse(text, mode="eval")
    except (SyntaxError, ValueError, RecursionError):
        raise wrong from None
    calls = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
    for node in ast.walk(tree):
        sound = isinstance(node, GRAMMAR) and len(text) < 200
        if isinstance(node, ast.Constant):
            sound = type(node.value) in (int, float)
        if isinstance(node, ast.Attribute):
            sound = node.attr == "transpose" and node in calls
        if isinstance(node, ast.Call):
            sound = isinstance(node.func, ast.Attribute) or getattr(node.func, "id", "") == "vec"
        if not sound:
            raise wrong
    return compile(tree, "(a manifest)", "eval")


def _worked_out(text: str, values: Mapping[str, Any]) -> Any:
    return eval(_compiled(text), {"__builtins__": {}, "vec": lambda *a: np.array(a)}, dict(values))


def one(expressions: Expressions, names: Iterable[str], values: Mapping[str, Any]) -> dict[str, Any]:
    """Values of a single sample carried over: numbers, arrays, or lists of exact numbers, which stay lists."""
    arrays = {
        name: np.array(value, dtype=object) if isinstance(value, list) else value
        for name, value in values.items()
    }
    exact = any(isinstance(value, list) for value in values.values())
    found = {}
    for name in names:
        value = _worked_out(expressions.get(name, name), arrays)
        found[name] = value.tolist() if exact and isinstance(value, np.ndarray) else value
    return found


def _batch(expressions: Expressions, wanted: tuple[Value, ...], values: Mapping[str, np.ndarray]) -> Arrays:
    found = {}
    for value in wanted:
        text = expressions.get(value.name, value.name)
        if text in values:
            found[value.name] = np.asarray(values[text])
            continue
        count = len(next(iter(values.values())))
        dtype = np.int32 if value.integer else np.float64
        rows = [_worked_out(text, {name: a[k] for name, a in values.items()}) for k in range(count)]
        found[value.name] = np.array(rows, dtype=dtype).reshape(count, *value.shape)
    return found


def to_own(task: Task, called: Mapping[str, np.ndarray]) -> Arrays:
    """Inputs (b, ...) of a task's function, from those that Muslin has."""
    return dict(called) if task.called is None else _batch(task.called.give, task.inputs, called)


def to_called(task: Task, own: Mapping[str, np.ndarray]) -> Arrays:
    """Inputs (b, ...) as Muslin has them, from those of a task's function."""
    return dict(own) if task.called is None else _batch(task.called.back, task.called.arguments, own)


def case_called(task: Task, own: Mapping[str, Any]) -> dict[str, Any]:
    """Inputs of one case as Muslin has them."""
    names = [value.name for value in task.called.arguments] if task.called is not None else ()
    return one(task.called.back, names, own) if task.called is not None else dict(own)


def results_own(task: Task, called: Iterable[np.ndarray]) -> tuple[np.ndarray, ...]:
    """Results (b, ...) of a task's function, from those Muslin has."""
    if task.called is None:
        return tuple(called)
    values = dict(zip((value.name for value in task.called.results), called, strict=True))
    return tuple(_batch(task.called.send, task.results, values).values())


def results_called(task: Task, own: Iterable[np.ndarray]) -> tuple[np.ndarray, ...]:
    """Results (b, ...) as Muslin has them, from those of a task's function."""
    if task.called is None:
        return tuple(own)
    values = dict(zip((value.name for value in task.results), own, strict=True))
    return tuple(_batch(task.called.take, task.called.results, values).values())


def asked(table: Mapping[str, Task], ask: Callable[..., Any]) -> Callable[..., Any]:
    """One who is asked (task, inputs as the function takes them) -> results, asked as Muslin would."""

    def by_muslin(name: str, inputs: Mapping[str, np.ndarray]) -> tuple[np.ndarray, ...]:
        return results_called(table[name], ask(name, to_own(table[name], inputs)))

    return by_muslin


# --- functions -----------------------------------------------------------------------------------------------


def as_called(functions: Functions) -> Functions:
    """A folder's functions as Muslin calls them: themselves, or Taichi functions around them."""
    from muslin.tasks.loading import Functions

    table = functions.assignment
    if all(task.called is None for task in table.tasks.values()):
        return functions
    tasks = {name: _plain(task) for name, task in table.tasks.items()}
    found = {name: _around(functions[name], task) for name, task in table.tasks.items()}
    return Functions(functions.folder, replace(table, tasks=tasks), found)


def _plain(task: Task) -> Task:
    """A task as Muslin calls it."""
    if task.called is None:
        return task
    return replace(task, arguments=task.called.arguments, results=task.called.results, called=None)


def _around(function: Callable[..., Any], task: Task) -> Callable[..., Any]:
    from muslin.tasks.batch import kept
    from muslin.tasks.loading import failure_of

    if task.called is None or failure_of(function) is not None:
        return function
    made: Callable[..., Any] = kept(function, "as called", lambda: _make(function, task, task.called))
    return made


def _make(function: Callable[..., Any], task: Task, wiring: Any) -> Callable[..., Any]:
    """A Taichi function with Muslin's arguments and results that calls one with the task's."""
    from muslin.base import runtime
    from muslin.reading.source import remember

    ti = runtime.start()
    given = [_in_taichi(wiring.give.get(value.name, value.name)) for value in task.arguments]
    results = ", ".join(f"own_{value.name}" for value in task.results)
    own = {value.name: f"own_{value.name}" for value in task.results}
    taken = [_in_taichi(wiring.take.get(value.name, value.name), own) for value in wiring.results]
    text = (
        f"def {task.name}({', '.join(value.name for value in wiring.arguments)}):\n"
        f"    {results} = function({', '.join(given)})\n"
        f"    return {', '.join(taken)}\n"
    )
    filename = f"<muslin calls {task.name}: {id(function)}>"
    remember(filename, text)
    scope: dict[str, Any] = {"ti": ti, "function": function}
    exec(compile(text, filename, "exec", dont_inherit=True), scope)
    made: Callable[..., Any] = ti.func(scope[task.name])
    made.task, made.written = _plain(task), function  # type: ignore[attr-defined]
    return made


class _Taichi(ast.NodeTransformer):
    def __init__(self, names: Mapping[str, str]):
        self.names = names

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Name(self.names.get(node.id, node.id), node.ctx)

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if not isinstance(node.func, ast.Name):
            return self.generic_visit(node)
        entries = [self.visit(argument) for argument in node.args]
        return ast.Call(ast.parse("ti.Vector", mode="eval").body, [ast.List(entries, ast.Load())], [])


def _in_taichi(text: str, names: Mapping[str, str] | None = None) -> str:
    """An expression in Taichi's words, names exchanged."""
    _compiled(text)
    tree = _Taichi(names or {}).visit(ast.parse(text, mode="eval"))
    return ast.unparse(ast.fix_missing_locations(tree))
