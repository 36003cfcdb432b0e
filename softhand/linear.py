"""Small dense linear algebra for the kernels: no allocation, no LAPACK call."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from softhand.compiled import compiled

Array = NDArray[np.float64]


@compiled
def factor(A, first):
    """Cholesky factor of a symmetric positive definite matrix inside its envelope, in place.

    Row i of the lower triangle is zero left of column `first[i]`, and so is row i of the factor. With the joints of
    the hand first and the object last, the envelope of a hand is an arrow and the work grows with the fingers, not
    with their cube.

    Args:
        A: the lower triangle on entry, the factor L on return (A = L L^T), shape (n, n).
        first: column of the first entry of each row, shape (n,).

    Returns:
        -1, or the row at which A was found not to be positive definite.
    """
    for i in range(A.shape[0]):
        start = first[i]
        for j in range(start, i):
            value = A[i, j]
            for k in range(max(start, first[j]), j):
                value -= A[i, k] * A[j, k]
            A[i, j] = value / A[j, j]
        pivot = A[i, i]
        for k in range(start, i):
            pivot -= A[i, k] * A[i, k]
        if not pivot > 0.0:
            return i
        A[i, i] = math.sqrt(pivot)
    return -1


@compiled
def solve(L, first, b):
    """Solve L L^T x = b in place, L from `factor`.

    Args:
        L: factor, shape (n, n).
        first: as in `factor`, shape (n,).
        b: right-hand side on entry, x on return, shape (n,).
    """
    n = L.shape[0]
    for i in range(n):
        value = b[i]
        for k in range(first[i], i):
            value -= L[i, k] * b[k]
        b[i] = value / L[i, i]
    for i in range(n - 1, -1, -1):
        b[i] /= L[i, i]
        for k in range(first[i], i):
            b[k] -= L[i, k] * b[i]


@compiled
def least_norm(A, b, x):
    """x = A^+ b, the shortest of the vectors that leave the smallest residual.

    By a Cholesky factor of A A^T (or A^T A, whichever is smaller); by its eigenvectors where that is singular, which is
    the case for the grasp map of two point contacts.

    Args:
        A: shape (m, n).
        b: shape (m,).
        x: result, shape (n,).
    """
    m, n = A.shape
    wide = m <= n
    size = min(m, n)
    gram = np.empty((size, size))
    y = np.empty(size)
    for i in range(size):
        for j in range(i + 1):
            value = 0.0
            if wide:
                for k in range(n):
                    value += A[i, k] * A[j, k]
            else:
                for k in range(m):
                    value += A[k, i] * A[k, j]
            gram[i, j] = value
            gram[j, i] = value
        y[i] = 0.0
        if wide:
            y[i] = b[i]
        else:
            for k in range(m):
                y[i] += A[k, i] * b[k]
    _solve_semidefinite(gram, y)
    if wide:
        for j in range(n):
            x[j] = 0.0
            for i in range(m):
                x[j] += A[i, j] * y[i]
    else:
        x[:] = y


@compiled
def _solve_semidefinite(S, y):
    """y = S^+ y for a symmetric positive semidefinite S, shape (n, n)."""
    n = S.shape[0]
    L = S.copy()
    first = np.zeros(n, np.int64)
    row = factor(L, first)
    if row < 0:
        smallest, largest = L[0, 0], L[0, 0]
        for i in range(n):
            smallest, largest = min(smallest, L[i, i]), max(largest, L[i, i])
        if smallest > 1e-6 * largest:
            solve(L, first, y)
            return
    values, vectors = np.linalg.eigh(S)
    projected = np.dot(vectors.T, y)
    for i in range(n):
        projected[i] = projected[i] / values[i] if values[i] > 1e-12 * values[n - 1] else 0.0
    y[:] = np.dot(vectors, projected)
