"""Symmetric banded matrices, one a channel, by their Cholesky factors L: M = L L^T.

A matrix is kept by its columns, from the diagonal down: ``columns[t, i, d]`` is the element in row
t + i, column t of channel d's.
"""

from __future__ import annotations

import numpy as np

from ..recording import FloatArray
from .compiling import njit


@njit(cache=True, error_model="numpy")
def factorise(columns: FloatArray) -> None:
    """Replace positive definite matrices, shape (T, B, D), by L.

    Example:
        >>> columns = np.array([[[4.0], [2.0]], [[5.0], [0.0]]])  # of [[4, 2], [2, 5]]
        >>> factorise(columns)
        >>> columns[..., 0]
        array([[2., 1.],
               [2., 0.]])
    """
    n_rows, n_band, n_channels = columns.shape
    scale = np.empty(n_channels)
    for t in range(n_rows):
        column = columns[t]
        for d in range(n_channels):
            scale[d] = 1.0 / np.sqrt(column[0, d])
        n = min(n_band, n_rows - t)
        for i in range(n):
            for d in range(n_channels):
                column[i, d] *= scale[d]
        for i in range(1, n):
            below = columns[t + i]
            for j in range(i, n):
                for d in range(n_channels):
                    below[j - i, d] -= column[i, d] * column[j, d]


@njit(cache=True, error_model="numpy")
def multiply(factor: FloatArray, x: FloatArray) -> FloatArray:
    """Return L x, shape (T, D).

    Example:
        >>> multiply(np.array([[[2.0]]]), np.array([[3.0]]))
        array([[6.]])
    """
    product = np.zeros_like(x)
    for t in range(factor.shape[0]):
        for i in range(min(factor.shape[1], factor.shape[0] - t)):
            for d in range(x.shape[1]):
                product[t + i, d] += factor[t, i, d] * x[t, d]
    return product


@njit(cache=True, error_model="numpy")
def solve(factor: FloatArray, x: FloatArray) -> None:
    """Replace right-hand sides, shape (T, D), by the solutions of L L^T x = rhs.

    Example:
        >>> x = np.array([[8.0]])
        >>> solve(np.array([[[2.0]]]), x)
        >>> x
        array([[2.]])
    """
    n_rows, n_band, n_channels = factor.shape
    for t in range(n_rows):
        for d in range(n_channels):
            x[t, d] /= factor[t, 0, d]
        for i in range(1, min(n_band, n_rows - t)):
            for d in range(n_channels):
                x[t + i, d] -= factor[t, i, d] * x[t, d]
    for t in range(n_rows - 1, -1, -1):
        for i in range(1, min(n_band, n_rows - t)):
            for d in range(n_channels):
                x[t, d] -= factor[t, i, d] * x[t + i, d]
        for d in range(n_channels):
            x[t, d] /= factor[t, 0, d]
