"""Quadratic functions of numbers that must not be negative: 1/2 y^T W y + b^T y, y >= 0.

By conjugate gradients on what is positive, and steps of the projected gradient where that changes (MPRGP, Dostal and
Schoberl 2005).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np


def minimise(
    times: Callable[[np.ndarray], np.ndarray],
    b: np.ndarray,
    y: np.ndarray,
    enough: np.ndarray,
    iterations: int,
) -> np.ndarray:
    """Where the function is as good as least.

    Parameters
    ----------
    times : callable
        W p for p (c,); W symmetric and positive definite.
    b : (c,) array
    y : (c,) array
        Where to begin.
    enough : (c,) array
        How large the gradient may be, with the sign that would make y change.
    iterations : int
        Products with W at most.
    """
    norm, count, g = 0.0, 0, b

    def product(p: np.ndarray) -> np.ndarray:
        nonlocal norm, count
        Wp = times(p)
        norm, count = max(norm, float(np.sqrt((Wp @ Wp) / (p @ p)))), count + 1
        return Wp

    def go(d: np.ndarray, most: float = np.inf) -> None:
        """Along d to where the function is least, but no more than so much of it."""
        nonlocal y, g
        if d.any():
            Wd = product(d)
            part = min(most, -float(g @ d) / float(d @ Wd))
            y, g = y + part * d, g + part * Wd

    g = b + product(y) if y.any() else b.copy()
    p: np.ndarray | None = None
    while True:
        positive = y > 0
        inner = np.where(positive, g, 0.0)
        outer = np.where(positive, 0.0, np.minimum(g, 0.0))
        if count >= iterations or ((np.abs(inner) <= enough).all() and (outer >= -enough).all()):
            return y
        reduced = np.minimum(inner, y * norm) if norm else inner
        if outer @ outer > reduced @ reduced:
            go(-outer)
            p = None
            continue
        p = inner if p is None else p
        Wp = product(p)
        curved = float(p @ Wp)
        part = float(g @ p) / curved
        down = p > 0
        feasible = float((y[down] / p[down]).min()) if down.any() else np.inf
        if part <= feasible:
            y, g = y - part * p, g - part * Wp
            inner = np.where(y > 0, g, 0.0)
            p = inner - float(inner @ Wp) / curved * p
            continue
        y, g = np.maximum(y - feasible * p, 0.0), g - feasible * Wp
        inner = np.where(y > 0, g, 0.0)
        go(np.maximum(y - inner / norm, 0.0) - y, 1.0)
        p = None
