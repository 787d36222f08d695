"""How two steps or points compare, and how a part of a step is written."""

from __future__ import annotations

import numpy as np

#: What is rounding, relative.
ROUNDING = 1e-9


def same(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two arrays agree up to rounding."""
    size = np.abs(a).max() + np.abs(b).max()
    return bool(a.shape == b.shape and np.isfinite(size) and np.abs(a - b).max() <= 1e-12 * size)


def near(a: np.ndarray, b: np.ndarray) -> bool:
    return bool(np.abs(a - b).max() <= ROUNDING * (np.abs(a).max() + np.abs(b).max()))


def multiple(a: np.ndarray, b: np.ndarray) -> float | None:
    """The s of a = s b, if there is one."""
    if not np.isfinite(a).all() or not b @ b:
        return None
    s = float(a @ b / (b @ b))
    return s if s and near(a, s * b) else None


def along(a: np.ndarray, b: np.ndarray) -> bool:
    return multiple(a, b) is not None


def part(s: float) -> str:
    """A part of the step as one writes it before d."""
    return "" if s == 1 else f"{s:.4g} "


def to(s: float) -> str:
    """A point on the way."""
    return f"x {'-' if s < 0 else '+'} {part(abs(s))}d"


def falls(share: float) -> str:
    """How far the objective falls, in words."""
    if share == -np.inf:
        return "is infinite"
    if share <= 0:
        return "is higher than at x"
    return f"falls by {share:.2g} of what the slope promises, and 1e-4 is asked"
