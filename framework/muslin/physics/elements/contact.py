"""The student's collision functions, ready to be called in every step."""

from typing import Any

import numpy as np

from muslin.base.launch import Launch, is_small
from muslin.physics.elements.contact_kernels import detection, response
from muslin.tasks import usable
from muslin.tasks.batch import kept, run


class Detection:
    """`sphere_contact` on some of at most n vertices.

    Parameters
    ----------
    function : taichi function
    n : int
    """

    def __init__(self, function: Any, n: int):
        self.function = usable(function)
        self._count, self._r = np.zeros(1, np.int32), np.zeros(1)
        self._x, self._c, self._normal = (np.zeros((n, 3)) for _ in range(3))
        self._hit = np.zeros(n, np.int32)
        serial = is_small(n, 20)
        kernel = kept(function, ("detection", serial), lambda: detection(function, serial))
        arrays = (self._count, self._x, self._c, self._r, self._hit, self._normal)
        self._launch = Launch(kernel, *arrays)

    def __call__(self, x: np.ndarray, center: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
        """(hit (k,), normal (k, 3)) of positions (k, 3) and centres (k, 3); the next call writes over them."""
        k = len(x)
        self._count[0], self._r[0] = k, radius
        self._x[:k], self._c[:k] = x, center
        run(self._launch, self.function)
        return self._hit[:k], self._normal[:k]


class Response:
    """`filter_velocity` on some of at most n vertices.

    Parameters
    ----------
    function : taichi function
    n : int
    """

    def __init__(self, function: Any, n: int):
        self.function = usable(function)
        self._count = np.zeros(1, np.int32)
        self._v, self._normal, self._out = (np.zeros((n, 3)) for _ in range(3))
        serial = is_small(n, 10)
        kernel = kept(function, ("response", serial), lambda: response(function, serial))
        self._launch = Launch(kernel, self._count, self._v, self._normal, self._out)

    def __call__(self, v: np.ndarray, normal: np.ndarray) -> np.ndarray:
        """Filtered velocities (k, 3); the next call writes over them."""
        k = len(v)
        self._count[0] = k
        self._v[:k], self._normal[:k] = v, normal
        run(self._launch, self.function)
        return self._out[:k]
