"""Batches of vectors and matrices of three, (..., 3) and (..., 3, 3), without BLAS: the same bytes on every machine."""

from __future__ import annotations

import numpy as np

I = np.eye(3)  # noqa: E741


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A . b."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A x b."""
    (a0, a1, a2), (b0, b1, b2) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=-1)


def length(v: np.ndarray) -> np.ndarray:
    """|v|."""
    return np.sqrt(dot(v, v))


def unit(v: np.ndarray) -> np.ndarray:
    """V / |v|."""
    return v / length(v)[..., None]


def mul(A: np.ndarray, B: np.ndarray) -> np.ndarray:
    """A B."""
    return A[..., :, :1] * B[..., :1, :] + A[..., :, 1:2] * B[..., 1:2, :] + A[..., :, 2:] * B[..., 2:, :]


def apply(A: np.ndarray, v: np.ndarray) -> np.ndarray:
    """A v."""
    return A[..., 0] * v[..., :1] + A[..., 1] * v[..., 1:2] + A[..., 2] * v[..., 2:]


def transposed(A: np.ndarray) -> np.ndarray:
    """A^T."""
    return np.swapaxes(A, -1, -2)


def outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A b^T."""
    return a[..., :, None] * b[..., None, :]


def diag(v: np.ndarray) -> np.ndarray:
    """The diagonal matrix of a vector."""
    return v[..., None] * I


def det(A: np.ndarray) -> np.ndarray:
    """Determinant."""
    return dot(A[..., 0], cross(A[..., 1], A[..., 2]))


def rotation(q: np.ndarray) -> np.ndarray:
    """Rotation of a quaternion (w, x, y, z) of any length, (..., 4) -> (..., 3, 3)."""
    q = q / np.sqrt(dot(q, q) + q[..., 3] * q[..., 3])[..., None]
    w, x, y, z = np.moveaxis(q, -1, 0)
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)
