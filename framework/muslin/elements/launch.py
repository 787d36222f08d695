"""Launching a kernel many times on the same arrays, for little more than the work it does.

Taichi looks at every argument of every call anew: about 10 microseconds per array, ten times the cost of the
launch itself. A `Launch` binds a kernel to its arrays once. It relies on parts of Taichi 1.7 that are not public;
where they are missing it calls the kernel the ordinary way.

Arrays are NumPy's, of doubles, wherever kernels run: `runtime.call` takes them to single precision and back.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from taichi.lang import impl

from muslin import runtime

#: Time of a loop [ns] below which one thread is as fast as two: waking another takes some 60 microseconds.
WORTH_WAKING = 250_000


def is_small(iterations: int, nanoseconds: float) -> bool:
    """Whether a loop of a kernel whose iterations take about so long should stay on one thread; no GPU's should."""
    return iterations * nanoseconds < WORTH_WAKING and runtime.on_cpu()


class Launch:
    """A kernel bound to its arguments; calling it runs the kernel.

    Parameters
    ----------
    kernel : taichi kernel
    *arguments : ndarray, int or float
        C-contiguous arrays that stay where they are: change their contents, not the arrays. What varies between
        calls must be in an array.
    """

    def __init__(self, kernel: Callable[..., None], *arguments: Any):
        self.kernel, self.arguments = kernel, arguments
        self._program = self._run = None

    def __call__(self) -> None:
        """Run the kernel on what the arrays hold now."""
        if not runtime.plain():
            runtime.call(self.kernel, *self.arguments)
            return
        program = impl.get_runtime().prog
        if self._run is None or program is not self._program:
            self.kernel(*self.arguments)  # compiles, and complains of what does not fit
            self._program, self._run = program, self._bound(program)
        else:
            self._run()

    def _bound(self, program: Any) -> Callable[[], None] | None:
        try:
            primal = self.kernel._primal  # type: ignore[attr-defined]
            compiled = primal.compiled_kernels[primal.ensure_compiled(*self.arguments)]
            context = compiled.make_launch_context()
            for k, (value, formal) in enumerate(zip(self.arguments, primal.arguments, strict=True)):
                if isinstance(value, np.ndarray):
                    inner = len(getattr(formal.annotation.dtype, "get_shape", tuple)())
                    shape = value.shape[: value.ndim - inner]
                    address = int(value.ctypes.data)
                    context.set_arg_external_array_with_shape((k,), address, value.nbytes, shape, 0)
                elif isinstance(value, float):
                    context.set_arg_float((k,), value)
                else:
                    context.set_arg_int((k,), int(value))
            code = program.compile_kernel(program.config(), program.get_device_caps(), compiled)
            launch = program.launch_kernel
        except (AttributeError, TypeError, KeyError):
            return None
        return lambda: launch(code, context)
