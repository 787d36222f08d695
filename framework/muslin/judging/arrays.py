"""What mistakes are written with: batches of vectors and matrices, (b, ...)."""

from __future__ import annotations

from typing import Any

import numpy as np


def transposed(matrix: np.ndarray) -> np.ndarray:
    """Each matrix transposed."""
    return np.swapaxes(matrix, 1, 2)


def unit(vectors: np.ndarray) -> np.ndarray:
    """Each vector (or each row) made of length one."""
    return vectors / np.sqrt(np.sum(vectors**2, axis=-1, keepdims=True))


def lengths(array: np.ndarray) -> np.ndarray:
    """Euclidean lengths of each sample, (b,)."""
    return np.sqrt(np.sum(np.reshape(array, (len(array), -1)) ** 2, axis=1))


def dot_column(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot product of each pair of vectors, as a column (b, 1)."""
    return np.sum(a * b, axis=1, keepdims=True)


def outer(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A b^T of each pair of vectors."""
    return a[:, :, None] * b[:, None, :]


def diag(p: np.ndarray) -> np.ndarray:
    """The diagonal matrix of each vector."""
    return p[:, :, None] * np.eye(p.shape[1])


def long(array: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """A number per case, (b,), ready to be multiplied with vectors or matrices."""
    return array.reshape(-1, *[1] * (vectors.ndim - 1))


def replaced(array: np.ndarray, component: int, values: np.ndarray) -> np.ndarray:
    """Vectors with one component replaced."""
    array = array.copy()
    array[:, component] = values
    return array


def completed(first: np.ndarray, second: np.ndarray, total: Any) -> np.ndarray:
    """Entries or rows 1 and 2, and a zeroth that makes the sum right."""
    return np.stack([total - first - second, first, second], axis=1)
