"""Small dense linear algebra for the kernels: no allocation, no LAPACK call."""

from __future__ import annotations

import math

import numpy as np

from softhand.compiled import compiled

SINGULAR = 1e-6
"""Singular values below this share of the largest count as zero."""


@compiled
def factor(A, first):
    """Cholesky factor of a symmetric positive definite matrix inside its envelope, in place.

    Row i of the lower triangle is zero left of column `first[i]`, and so is row i of the factor. With the joints of
    the hand first and the object last, the envelope of a hand is an arrow and the work grows with the fingers, not
    with their cube.

    Args:
        A: the lower triangle on entry, the factor L on return (A = L L^T), with 1 / L_ii on the diagonal, which `solve`
            wants, shape (n, n).
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
            A[i, j] = value * A[j, j]
        pivot = A[i, i]
        for k in range(start, i):
            pivot -= A[i, k] * A[i, k]
        if not pivot > 0.0:
            return i
        A[i, i] = 1.0 / math.sqrt(pivot)
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
        b[i] = value * L[i, i]
    for i in range(n - 1, -1, -1):
        b[i] *= L[i, i]
        for k in range(first[i], i):
            b[k] -= L[i, k] * b[i]


@compiled
def least_norm(A, transposed, b, x):
    """x = A^+ b, or (A^T)^+ b: the shortest of the vectors that leave the smallest residual.

    By a Cholesky factor of A A^T or A^T A, whichever is smaller; by its eigenvectors where that is singular, which is
    the case for the grasp map of two point contacts.

    Args:
        A: shape (m, n).
        transposed: whether A^T is meant.
        b: shape (m,), or (n,) if transposed.
        x: result, shape (n,), or (m,) if transposed.
    """
    m, n = A.shape
    by_rows = m <= n
    size = min(m, n)
    gram, y = np.empty((size, size)), np.empty(size)
    _gram(A, by_rows, gram)
    if transposed == by_rows:
        _times(A, not by_rows, b, y)
    else:
        for i in range(size):
            y[i] = b[i]
    if _factor_well(gram):
        _substitute(gram, y)
    else:
        _gram(A, by_rows, gram)
        _solve_semidefinite(gram, y)
    if transposed == by_rows:
        for i in range(size):
            x[i] = y[i]
    else:
        _times(A, by_rows, y, x)


@compiled
def _times(A, transposed, b, y):
    """y = A b, or A^T b."""
    m, n = A.shape
    for i in range(y.shape[0]):
        y[i] = 0.0
    for i in range(m):
        for j in range(n):
            if transposed:
                y[j] += A[i, j] * b[i]
            else:
                y[i] += A[i, j] * b[j]


@compiled
def _gram(A, by_rows, gram):
    """A A^T, or A^T A if not by rows."""
    m, n = A.shape
    for i in range(gram.shape[0]):
        for j in range(i + 1):
            value = 0.0
            if by_rows:
                for k in range(n):
                    value += A[i, k] * A[j, k]
            else:
                for k in range(m):
                    value += A[k, i] * A[k, j]
            gram[i, j] = value
            gram[j, i] = value


@compiled
def _factor_well(A):
    """Cholesky factor in place, reciprocals on the diagonal; False if A is singular or nearly so."""
    smallest, largest = math.inf, 0.0
    for i in range(A.shape[0]):
        for j in range(i):
            value = A[i, j]
            for k in range(j):
                value -= A[i, k] * A[j, k]
            A[i, j] = value * A[j, j]
        pivot = A[i, i]
        for k in range(i):
            pivot -= A[i, k] * A[i, k]
        smallest, largest = min(smallest, pivot), max(largest, pivot)
        if not smallest > SINGULAR * SINGULAR * largest:
            return False
        A[i, i] = 1.0 / math.sqrt(pivot)
    return True


@compiled
def _substitute(L, y):
    """y = (L L^T)^-1 y, L from `_factor_well`."""
    n = L.shape[0]
    for i in range(n):
        value = y[i]
        for k in range(i):
            value -= L[i, k] * y[k]
        y[i] = value * L[i, i]
    for i in range(n - 1, -1, -1):
        y[i] *= L[i, i]
        for k in range(i):
            y[k] -= L[i, k] * y[i]


@compiled
def _solve_semidefinite(S, y):
    """y = S^+ y for a symmetric positive semidefinite S, shape (n, n), which is lost."""
    n = S.shape[0]
    vectors, x = np.empty((n, n)), np.zeros(n)
    diagonalize(S, vectors)
    largest = 0.0
    for k in range(n):
        largest = max(largest, S[k, k])
    for k in range(n):
        if S[k, k] > SINGULAR * SINGULAR * largest:
            weight = 0.0
            for i in range(n):
                weight += vectors[i, k] * y[i]
            for i in range(n):
                x[i] += vectors[i, k] * weight / S[k, k]
    for i in range(n):
        y[i] = x[i]


@compiled
def diagonalize(S, vectors):
    """Cyclic Jacobi rotations: S becomes the diagonal of its eigenvalues, the columns of `vectors` its eigenvectors.

    Compiles in a tenth of the time of numpy's eigh, which a controller needs at a singular grasp only.
    """
    n = S.shape[0]
    for i in range(n):
        for j in range(n):
            vectors[i, j] = 1.0 if i == j else 0.0
    for _ in range(50):
        off, scale = 0.0, 0.0
        for p in range(n):
            scale += S[p, p] * S[p, p]
            for q in range(p):
                off += S[p, q] * S[p, q]
        if off <= 1e-32 * scale:
            break
        for p in range(n - 1):
            for q in range(p + 1, n):
                if S[p, q] != 0.0:
                    _rotate(S, vectors, p, q)


@compiled
def _rotate(S, vectors, p, q):
    """One Jacobi rotation: makes S[p, q] zero."""
    ratio = 0.5 * (S[q, q] - S[p, p]) / S[p, q]
    t = 1.0 / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
    if ratio < 0.0:
        t = -t
    c = 1.0 / math.sqrt(t * t + 1.0)
    s = t * c
    for k in range(S.shape[0]):
        a, b = S[k, p], S[k, q]
        S[k, p], S[k, q] = c * a - s * b, s * a + c * b
        a, b = vectors[k, p], vectors[k, q]
        vectors[k, p], vectors[k, q] = c * a - s * b, s * a + c * b
    for k in range(S.shape[0]):
        a, b = S[p, k], S[q, k]
        S[p, k], S[q, k] = c * a - s * b, s * a + c * b
    S[p, q], S[q, p] = 0.0, 0.0
