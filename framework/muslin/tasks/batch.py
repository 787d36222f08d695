"""The one bridge between numpy and a Taichi function: `evaluate(function, name=array, ...) -> array`.

Tests, the checker and the reference data all cross here. The function runs once per sample in a small kernel
of its own, so an edit recompiles that kernel and nothing else.
"""

from __future__ import annotations

import inspect
import itertools
from collections.abc import Callable
from typing import Any

import numpy as np

from muslin.base import engine, handed, runtime
from muslin.base.errors import MuslinError
from muslin.reading.compile_errors import LIST, explained, misshapen
from muslin.reading.source import remember
from muslin.tasks import Task, alone, form, kind_of, plain, usable

_counter = itertools.count()


def evaluate(function: Callable[..., Any], *, results: tuple[str, ...] | None = None, **arrays: Any) -> Any:
    """Evaluate a function on a batch of samples.

    Parameters
    ----------
    function : taichi function
        A task function of `muslin.load`, a given function, or any `@ti.func` on scalars, vectors and matrices. A task
        in plain Python is called once per sample.
    results : tuple of str, optional
        Kinds of what the function returns (see `muslin.tasks.form`); known for task and given functions.
    **arrays : array_like, (b, ...)
        One array per argument, by name. An argument without the leading axis is used for every sample.

    Returns
    -------
    ndarray, (b, ...) or tuple of ndarray
        A tuple where the function returns several values.

    Raises
    ------
    NotImplementedYet
        If the function is still the stub.
    StudentCodeError
        If it cannot be compiled, or does not return what its task says.
    MuslinError
        If an argument is missing, unknown, or has the wrong shape.
    """
    usable(function)
    if not callable(function):
        raise MuslinError(f"{handed.short(function)} is not a function to evaluate.")
    arrays = {name: handed.real(f"Argument {name}", array) for name, array in arrays.items()}
    task: Task | None = getattr(function, "task", None)
    if task is not None and task.in_python:
        return plain.evaluate(function, task, arrays)
    names = kept(function, "names", lambda: tuple(inspect.signature(function).parameters))
    title = task.name if task else getattr(function, "__name__", "function")
    if set(arrays) != set(names):
        raise MuslinError(f"{title} takes ({', '.join(names)}), not ({', '.join(arrays)}).")
    if results is None:
        results = tuple(value.kind for value in task.results) if task else _given(function)[1]
    if results is None:
        raise MuslinError(f"What {title} returns is not known.", 'Say it: evaluate(..., results=("vec3",)).')
    if task:
        kinds = tuple(value.kind for value in task.arguments)
    else:
        known = _given(function)[0]
        kinds = known or tuple(_kind(title, name, arrays[name]) for name in names)
    inputs, batch = _batched(title, names, kinds, [arrays[name] for name in names])
    outputs = [_empty(kind, batch) for kind in results]
    if batch == 0:
        return outputs[0] if len(outputs) == 1 else tuple(outputs)
    runtime.start()
    kernel = kept(function, (kinds, results), lambda: _make_kernel(function, title, kinds, results))
    with alone.in_kernels(function):
        run(kernel, function, *inputs, *outputs)
    return outputs[0] if len(outputs) == 1 else tuple(outputs)


def run(kernel: Callable[..., None], function: Callable[..., Any], *arguments: Any) -> None:
    """Launch a kernel around a student function; what goes wrong inside becomes a `StudentCodeError`.

    Raises
    ------
    StudentCodeError
        With the message of Taichi's compiler, and the line of the student's own file where it names one.
    """
    try:
        runtime.call(kernel, *arguments)
    except MuslinError:
        raise
    except (Exception, SystemExit) as error:
        raise explained(error, getattr(function, "written", function)) from None


def _given(function: Callable[..., Any]) -> tuple[tuple[str, ...] | None, tuple[str, ...] | None]:
    """Kinds of the arguments and results of a given function; (None, None) for any other."""
    from muslin import given

    return (
        given.KINDS.get(getattr(function, "__name__", ""), (None, None))
        if _is_given(function)
        else (None, None)
    )


def _is_given(function: Callable[..., Any]) -> bool:
    return getattr(function, "__module__", None) == "muslin.given"


def _kind(title: str, name: str, array: np.ndarray) -> str:
    """Kind of an argument of an unlisted function, read off its array."""
    integer = array.dtype.kind in "iub"
    for shape in (
        array.shape,
        array.shape[1:],
    ):  # one sample for all, or a batch; a matrix before many vectors
        small = all(size <= 4 for size in shape) and (len(shape) < 2 or shape[0] == shape[1])
        if len(shape) <= 2 and small and (kind := kind_of(shape, integer and not shape)):
            return kind
    raise MuslinError(
        f"{title}: {name} has shape {array.shape}; no scalar, vector or matrix looks like that."
    )


def _batched(
    title: str, names: tuple[str, ...], kinds: tuple[str, ...], arrays: list[np.ndarray]
) -> tuple[list[np.ndarray], int]:
    sizes = {}
    for name, kind, array in zip(names, kinds, arrays, strict=True):
        shape, _ = form(kind)
        if array.ndim == len(shape) + 1:
            sizes[name] = len(array)
        if array.ndim not in (len(shape), len(shape) + 1) or array.shape[array.ndim - len(shape) :] != shape:
            expected = f"(b, {', '.join(map(str, shape))})" if shape else "(b,)"
            raise MuslinError(f"{title}: {name} is a {kind} and needs shape {expected}, not {array.shape}.")
    if len(set(sizes.values())) > 1:
        raise MuslinError(f"{title}: the arguments have different numbers of samples: {sizes}.")
    batch = next(iter(sizes.values()), 1)
    inputs = []
    for kind, array in zip(kinds, arrays, strict=True):
        shape, is_int = form(kind)
        dtype = np.int32 if is_int else np.float64
        # Functions get their arguments by value, so that what need not be converted need not be copied.
        inputs.append(np.ascontiguousarray(np.broadcast_to(array, (batch, *shape)), dtype=dtype))
    return inputs, batch


def _empty(kind: str, batch: int) -> np.ndarray:
    shape, is_int = form(kind)
    return np.zeros((batch, *shape), dtype=np.int32 if is_int else np.float64)


def kept(function: Callable[..., Any], key: Any, make: Callable[[], Any]) -> Any:
    """Make something of a function once: the kernel around it is kept with it."""
    store = inspect.unwrap(function).__dict__.setdefault("_muslin_kept", {})
    if key not in store:
        store[key] = make()
    return store[key]


def _make_kernel(
    function: Callable[..., Any], title: str, kinds: tuple[str, ...], results: tuple[str, ...]
) -> Callable[..., None]:
    ti = runtime.start()
    inputs = [f"a{k}" for k in range(len(kinds))]
    outputs = [f"r{k}" for k in range(len(results))]
    values = [f"value{k}" for k in range(len(results))]
    annotated = [
        f"{name}: type_of({kind!r})" for name, kind in zip(inputs + outputs, kinds + results, strict=True)
    ]
    checks = "".join(f"        ti.static(check({value}, {k}))\n" for k, value in enumerate(values))
    writes = "".join(f"        {out}[sample] = {value}\n" for out, value in zip(outputs, values, strict=True))
    source = (
        f"def batch({', '.join(annotated)}):\n"
        f"    for sample in range({inputs[0]}.shape[0]):\n"
        f"        {', '.join(values)} = function({', '.join(f'{name}[sample]' for name in inputs)})\n"
        f"{checks}{writes}"
    )

    def check(value: Any, k: int) -> bool:
        shape, _ = form(results[k])
        got = _shape(value)
        if got != shape:
            raise misshapen(function, title, k, _describe(got), _describe(shape))
        return True

    scope = {"ti": ti, "function": function, "check": check, "type_of": array_type}
    filename = f"<muslin batch {next(_counter)}: {title}>"
    remember(filename, source)
    exec(compile(source, filename, "exec", dont_inherit=True), scope)
    return ti.kernel(scope["batch"])


def _shape(value: Any) -> tuple[int, ...] | None:
    """Shape of a value inside a kernel under compilation; None for a list."""
    if isinstance(value, (int, float)):
        return ()
    if isinstance(value, (list, tuple)):
        return None
    if hasattr(value, "is_tensor"):
        return tuple(value.get_shape()) if value.is_tensor() else ()
    return tuple(getattr(value, "shape", ()) or ())


def _describe(shape: tuple[int, ...] | None) -> str:
    if shape is None:
        return LIST
    if not shape:
        return "a number"
    return f"a vector of {shape[0]}" if len(shape) == 1 else f"a {shape[0]}x{shape[1]} matrix"


def array_type(kind: str) -> Any:
    """Taichi's annotation of a batch of values of some kind."""
    ti = engine.load()
    shape, is_int = form(kind)
    dtype = scalar = ti.i32 if is_int else runtime.real()
    if len(shape) == 1:
        dtype = ti.types.vector(shape[0], scalar)
    elif len(shape) == 2:
        dtype = ti.types.matrix(*shape, scalar)
    return ti.types.ndarray(dtype=dtype, ndim=1)
