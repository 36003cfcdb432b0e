"""The shortest solution of a few linear equations in kernels, dependent ones among them."""

from __future__ import annotations

import math

from softhand.numerics.compiled import compiled

DEPENDENT = 1e-10
"""Of an equation this share of the longest is left, or less, where it depends on the others."""


@compiled
def shortest(A, b, n, x):
    """x = A^+ b for the first n columns of A, where the equations do not contradict each other.

    By Gram and Schmidt, the longest equation that is left first: a . x = b gives x the part b a / |a|^2, and takes what
    lies along a from the others. Equations that depend on earlier ones are left out, whatever their right-hand side.

    Args:
        A: shape (m, n) or wider; lost.
        b: shape (m,); lost.
        n: how many columns.
        x: set, shape (n,) or longer.
    """
    first = 0.0
    for k in range(n):
        x[k] = 0.0
    for turn in range(min(A.shape[0], n)):
        best, most = 0, -1.0
        for i in range(A.shape[0]):
            square = 0.0
            for k in range(n):
                square += A[i, k] * A[i, k]
            if not square <= most:
                best, most = i, square
        if turn == 0:
            first = most
        if most <= DEPENDENT * DEPENDENT * first:
            break
        size = 1.0 / math.sqrt(most)
        value = b[best] * size
        for k in range(n):
            A[best, k] *= size
            x[k] += value * A[best, k]
        for i in range(A.shape[0]):
            if i == best:
                continue
            along = 0.0
            for k in range(n):
                along += A[i, k] * A[best, k]
            b[i] -= along * value
            for k in range(n):
                A[i, k] -= along * A[best, k]
        for k in range(n):
            A[best, k] = 0.0
