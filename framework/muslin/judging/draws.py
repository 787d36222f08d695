"""A stream of random inputs that is the same on every machine, as exact numbers.

Inputs are drawn with Python's `random.Random`, whose stream is guaranteed, and worked out in mpmath before they are
rounded: every machine draws the same bytes.
"""

from __future__ import annotations

import random
from typing import Any

from muslin.judging.exact import Matrix, Vector, cross, exact, norm, precise, rounded, times, transpose


class Draw(random.Random):
    """A stream of random inputs, as mpf, that is the same on every machine."""

    def between(self, low: float, high: float) -> Any:
        """A number between two others."""
        return precise().mpf(low + (high - low) * self.random())

    def decades(self, low: int, high: int) -> Any:
        """A number between 10^low and 10^high, spread evenly over the decades."""
        return precise().mpf(10) ** self.between(low, high)

    def vector(self, size: float = 1.0) -> Vector:
        """A vec3 with entries between -size and size."""
        return [self.between(-size, size) for _ in range(3)]

    def matrix(self, size: float = 1.0) -> Matrix:
        """A mat3 with entries between -size and size."""
        return [self.vector(size) for _ in range(3)]

    def direction(self) -> Vector:
        """A unit vector."""
        while True:
            v = self.vector()
            if 0.2 < norm(v) < 1:
                return times(1 / norm(v), v)

    def rotation(self) -> Matrix:
        """A rotation: a frame from two directions."""
        while True:
            a, b = self.direction(), self.direction()
            c = cross(a, b)
            if norm(c) > 0.3:
                c = times(1 / norm(c), c)
                return transpose([a, cross(c, a), c])

    def material(self) -> tuple[Any, Any]:
        """Lamé parameters (mu, lam), never near each other, so that swapping them shows."""
        mu = self.decades(2, 5)
        return mu, mu * self.choice((self.between(0.1, 0.7), self.between(1.5, 8)))


def float64(values: Any) -> Any:
    """Rounded to float64, kept as exact numbers."""
    return exact(rounded(values))


def coarse(value: Any, quantum: float) -> Any:
    """Nearest multiple of a power of two: sums of such numbers are exact in float64."""
    return precise().floor(value / quantum + precise().mpf(0.5)) * quantum
