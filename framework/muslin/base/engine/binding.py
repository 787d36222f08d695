"""A kernel bound to its arrays, by parts of an engine that are not public (see `inside`)."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from muslin.base.engine import inside
from muslin.base.engine.choice import load


def bound(kernel: Any, arguments: Sequence[Any]) -> Callable[[], None] | None:
    """Bind a kernel that has run once to its arguments.

    Parameters
    ----------
    kernel : kernel
    arguments : sequence of ndarray, int or float
        C-contiguous arrays that stay where they are.

    Returns
    -------
    function or None
        Runs the kernel on what the arrays hold; None if this engine's kernels cannot be bound.
    """
    if not inside.has("binding a kernel to its arrays"):
        return None
    try:
        primal, running = kernel._primal, inside.program()
        key = primal.ensure_compiled(*arguments)
        if load().__name__ == "taichi":
            compiled, formals = primal.compiled_kernels[key], primal.arguments
        else:
            compiled, formals = primal.materialized_kernels[key], primal.arg_metas
        inner = [
            len(getattr(getattr(formal.annotation, "dtype", None), "get_shape", tuple)())
            for formal in formals
        ]
        code = running.compile_kernel(running.config(), running.get_device_caps(), compiled)
        code = getattr(code, "compiled_kernel_data", code)
        known = compiled, code, inner, load().__name__ == "taichi"
        launch = _launch(running, known, arguments)
    except (AttributeError, TypeError, KeyError):
        return None
    if getattr(kernel, "_muslin_program", None) is not running:
        kernel._muslin_program, kernel._muslin_bound = running, {}
    kernel._muslin_bound[_kinds(arguments)] = known
    return launch


def bound_again(kernel: Any, arguments: Sequence[Any], running: Any) -> Callable[[], None] | None:
    """As `bound`, in a tenth of the time, if the kernel has been bound to arguments like these; else None.

    `running` is the program that is.
    """
    if running is None or getattr(kernel, "_muslin_program", None) is not running:
        return None
    known = kernel._muslin_bound.get(_kinds(arguments))
    return None if known is None else _launch(running, known, arguments)


def _kinds(arguments: Sequence[Any]) -> tuple[Any, ...]:
    """What a kernel's code depends on, of its arguments."""
    return tuple(
        [
            (value.dtype, value.shape[1:], value.flags.c_contiguous)
            if isinstance(value, np.ndarray)
            else type(value)
            for value in arguments
        ]
    )


def _address(array: np.ndarray) -> int:
    """Where an array's numbers are: in an eighth of the time of `array.ctypes.data`, if they may be written."""
    if array.size and array.flags.writeable:
        return ctypes.addressof(ctypes.c_char.from_buffer(array.data))
    return array.ctypes.data


def _launch(
    running: Any, known: tuple[Any, Any, list[int], bool], arguments: Sequence[Any]
) -> Callable[[], None]:
    compiled, code, inner, nested = known
    context = compiled.make_launch_context()
    array = context.set_arg_external_array_with_shape
    for k, value in enumerate(arguments):
        place = (k,) if nested else k
        if isinstance(value, np.ndarray):
            array(place, _address(value), value.nbytes, value.shape[: value.ndim - inner[k]], 0)
        elif isinstance(value, float):
            context.set_arg_float(place, value)
        else:
            context.set_arg_int(place, int(value))
    launch = running.launch_kernel
    return lambda: launch(code, context)
