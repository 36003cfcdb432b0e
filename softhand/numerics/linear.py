"""Small dense linear algebra for the kernels: no allocation, no LAPACK call."""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled

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
        if not usually(pivot > 0.0):
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

    By a Cholesky factor of A A^T or A^T A, whichever is smaller; by one of lower rank where that is singular, which is
    the case for the grasp map of two point contacts, and for K of four contacts in a plane.

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
        substitute(gram, y)
    else:
        _gram(A, by_rows, gram)
        _solve_semidefinite(gram, y)
    if transposed == by_rows:
        for i in range(size):
            x[i] = y[i]
    else:
        _times(A, by_rows, y, x)


@compiled
def least_norm_columns(A, B, X):
    """X = A^+ B, column by column as `least_norm`.

    Args:
        A: shape (m, n).
        B: shape (m, k).
        X: result, shape (n, k).
    """
    m, n = A.shape
    by_rows = m <= n
    size = min(m, n)
    gram, well, y = np.empty((size, size)), np.empty((size, size)), np.empty(size)
    _gram(A, by_rows, gram)
    for i in range(size):
        for j in range(size):
            well[i, j] = gram[i, j]
    is_well = _factor_well(well)
    for k in range(B.shape[1]):
        if by_rows:
            for i in range(size):
                y[i] = B[i, k]
        else:
            _times(A, True, B[:, k], y)
        if is_well:
            substitute(well, y)
        else:
            _solve_semidefinite(gram, y)
        if by_rows:
            _times(A, True, y, X[:, k])
        else:
            for i in range(size):
                X[i, k] = y[i]


@compiled
def truncated_solution(A, b, share, x):
    """x = A^+ b, singular values of A below a share of the largest counted as zero.

    By the eigenvectors of A A^T or A^T A, whichever is smaller, for shares that are far above the root of the rounding.

    Args:
        A: shape (m, n).
        b: shape (m,).
        share: of the largest singular value.
        x: result, shape (n,).
    """
    m, n = A.shape
    by_rows = m <= n
    size = min(m, n)
    gram, V, y, w = np.empty((size, size)), np.empty((size, size)), np.empty(size), np.zeros(size)
    _gram(A, by_rows, gram)
    if by_rows:
        for i in range(size):
            y[i] = b[i]
    else:
        _times(A, True, b, y)
    _diagonalize(gram, V)
    largest = 0.0
    for k in range(size):
        largest = max(largest, gram[k, k])
    for k in range(size):
        if gram[k, k] > share * share * largest:
            along = 0.0
            for i in range(size):
                along += V[i, k] * y[i]
            for i in range(size):
                w[i] += V[i, k] * along / gram[k, k]
    if by_rows:
        _times(A, True, w, x)
    else:
        for i in range(size):
            x[i] = w[i]


@compiled
def _diagonalize(S, V):
    """S = V D V^T of a symmetric matrix, by turns of Jacobi; D replaces S."""
    n = S.shape[0]
    for i in range(n):
        for j in range(n):
            V[i, j] = 1.0 if i == j else 0.0
    for _ in range(30):
        off, own = 0.0, 0.0
        for i in range(n):
            own += S[i, i] * S[i, i]
            for j in range(i):
                off += S[i, j] * S[i, j]
        if not off > 1e-28 * own:
            return
        for q in range(n):
            for p in range(q):
                if S[p, q] != 0.0:
                    _turn(S, V, p, q)


@compiled
def _turn(S, V, p, q):
    """The turn in the plane of p and q that makes S_pq zero."""
    ratio = 0.5 * (S[q, q] - S[p, p]) / S[p, q]
    t = math.copysign(1.0, ratio) / (abs(ratio) + math.sqrt(ratio * ratio + 1.0))
    c = 1.0 / math.sqrt(t * t + 1.0)
    s = t * c
    for k in range(S.shape[0]):
        a, b = S[k, p], S[k, q]
        S[k, p], S[k, q] = c * a - s * b, s * a + c * b
    for k in range(S.shape[0]):
        a, b = S[p, k], S[q, k]
        S[p, k], S[q, k] = c * a - s * b, s * a + c * b
        a, b = V[k, p], V[k, q]
        V[k, p], V[k, q] = c * a - s * b, s * a + c * b
    S[p, q] = S[q, p] = 0.0


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
        if not usually(smallest > SINGULAR * SINGULAR * largest):
            return False
        A[i, i] = 1.0 / math.sqrt(pivot)
    return True


@compiled
def factor_by_columns(A):
    """As `_factor_well`, with inner loops along rows, which pays for matrices of twenty rows and more."""
    n = A.shape[0]
    column, smallest, largest = np.empty(n), math.inf, 0.0
    for j in range(n):
        pivot = A[j, j]
        smallest, largest = min(smallest, pivot), max(largest, pivot)
        if not smallest > SINGULAR * SINGULAR * largest:
            return False
        A[j, j] = 1.0 / math.sqrt(pivot)
        for i in range(j + 1, n):
            A[i, j] *= A[j, j]
            column[i] = A[i, j]
        for i in range(j + 1, n):
            share, row = A[i, j], A[i]
            for k in range(j + 1, i + 1):
                row[k] -= share * column[k]
    return True


@compiled
def substitute(L, y):
    """y = (L L^T)^-1 y, L from `_factor_well` or `factor_by_columns`."""
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
    """y = S^+ y for a symmetric positive semidefinite S, shape (n, n).

    S = L L^T with as many columns as its rank, by Cholesky with the largest pivot first; L = Q R by Gram and Schmidt;
    then S^+ = Q (R R^T)^-1 Q^T.
    """
    n = S.shape[0]
    L, pivots = np.empty((n, n)), np.empty(n)
    for i in range(n):
        pivots[i] = S[i, i]
    rank = _factor_by_pivots(S, pivots, L)
    R, x = np.empty((rank, rank)), np.empty(rank)
    for k in range(rank):
        for j in range(k + 1):
            value = 0.0
            for i in range(n):
                value += L[i, j] * L[i, k]
            R[j, k] = value
            if j == k:
                R[k, k] = math.sqrt(value)
            for i in range(n):
                L[i, k] = L[i, k] / R[k, k] if j == k else L[i, k] - value * L[i, j]
    _times(L[:, :rank], True, y, x)
    for k in range(rank - 1, -1, -1):
        for j in range(k + 1, rank):
            x[k] -= R[k, j] * x[j]
        x[k] /= R[k, k]
    for k in range(rank):
        for j in range(k):
            x[k] -= R[j, k] * x[j]
        x[k] /= R[k, k]
    _times(L[:, :rank], False, x, y)


@compiled
def _factor_by_pivots(S, pivots, L):
    """S = L L^T, the column of the largest pivot first; returns the rank. `pivots` has the diagonal, and is lost."""
    n = S.shape[0]
    first = 0.0
    for k in range(n):
        best = 0
        for i in range(n):
            if pivots[i] > pivots[best]:
                best = i
        first = max(first, pivots[best])
        if not pivots[best] > SINGULAR * SINGULAR * first:
            return k
        root = math.sqrt(pivots[best])
        for i in range(n):
            if pivots[i] < 0.0:  # has had its turn
                L[i, k] = 0.0
                continue
            value = S[i, best]
            for j in range(k):
                value -= L[i, j] * L[best, j]
            L[i, k] = value / root
            pivots[i] = max(pivots[i] - L[i, k] * L[i, k], 0.0)
        pivots[best] = -1.0
    return n
