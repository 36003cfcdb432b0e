"""The triangle of a QR decomposition, compiled: of many small ones the threads of a BLAS are in each other's way."""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled


def triangle(rows: Array) -> Array:
    """R of rows = Q R by Householder's reflections, at most as many rows as columns; shape (min(m, n), n)."""
    matrix = np.array(rows, order="C", dtype=float)
    m, n = matrix.shape
    reflect(matrix, np.zeros(m), np.zeros(n))
    return np.triu(matrix[: min(m, n)])


@compiled
def reflect(matrix, x, along):
    """A matrix becomes its R, in place, with anything below the diagonal.

    Args:
        matrix: shape (m, n).
        x: room, shape (m,).
        along: room, shape (n,).
    """
    m, n = matrix.shape
    for k in range(min(m, n)):
        below = 0.0
        for i in range(k + 1, m):
            x[i] = matrix[i, k]
            below += x[i] * x[i]
        if below == 0.0:
            continue
        first = matrix[k, k]
        length = math.copysign(math.sqrt(first * first + below), first)
        x[k] = first + length
        scale = 2.0 / (x[k] * x[k] + below)
        for j in range(k + 1, n):
            along[j] = 0.0
        for i in range(k, m):
            for j in range(k + 1, n):
                along[j] += x[i] * matrix[i, j]
        for j in range(k + 1, n):
            along[j] *= scale
        for i in range(k, m):
            for j in range(k + 1, n):
                matrix[i, j] -= x[i] * along[j]
        matrix[k, k] = -length
