"""Launching a kernel many times on the same arrays, for little more than the work it does.

The engine looks at every argument again in every call: about 10 microseconds per array, ten times the cost of the
launch itself. A `Launch` binds a kernel to its arrays once, where the engine has the parts for it; where they are
missing it calls the kernel the ordinary way.

Arrays are NumPy's, of doubles, wherever kernels run: `runtime.call` takes them to single precision and back.
"""

from collections.abc import Callable
from typing import Any

from muslin.base import runtime
from muslin.base.engine import binding, inside

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
        self._program: Any = None
        self._run: Callable[[], None] | None = None

    def __call__(self) -> None:
        """Run the kernel on what the arrays hold now."""
        if not runtime.plain():
            runtime.call(self.kernel, *self.arguments)
            return
        program = inside.program()
        if self._run is None or program is not self._program:
            self._program, self._run = program, binding.bound_again(self.kernel, self.arguments, program)
            if self._run is None:
                self.kernel(*self.arguments)  # compiles, and complains of what does not fit
                self._run = binding.bound(self.kernel, self.arguments)
                return
        self._run()


def once(kernel: Callable[..., None], *arguments: Any) -> None:
    """Run a kernel on arrays that it has not seen before, and will not again.

    From the second time on that is a third of an ordinary call: arguments of the same kinds need no other code.
    """
    Launch(kernel, *arguments)()
