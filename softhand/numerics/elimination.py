"""A few linear equations in kernels, by elimination."""

from __future__ import annotations

from softhand.numerics.compiled import compiled

SINGULAR = 1e-10
"""A pivot below this share of the largest coefficient counts as zero."""


@compiled
def eliminate(A, b, n):
    """b = A^-1 b of the first n rows and columns, with the largest pivot of each column; A is lost.

    Args:
        A: shape (n, n) or more.
        b: shape (n,) or more.
        n: how many equations.

    Returns:
        False if A is singular; b is then lost.
    """
    largest = 0.0
    for i in range(n):
        for j in range(n):
            largest = max(largest, abs(A[i, j]))
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        if not abs(A[best, k]) > SINGULAR * largest:
            return False
        for j in range(k, n):
            A[k, j], A[best, j] = A[best, j], A[k, j]
        b[k], b[best] = b[best], b[k]
        for i in range(k + 1, n):
            share = A[i, k] / A[k, k]
            for j in range(k, n):
                A[i, j] -= share * A[k, j]
            b[i] -= share * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= A[k, j] * b[j]
        b[k] /= A[k, k]
    return True
