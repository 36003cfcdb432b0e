"""Three-vectors and 3 x 3 matrices as tuples of plain numbers, which compiled code keeps in registers.

A matrix is nine numbers, row by row.
"""

from __future__ import annotations

import math

from softhand.numerics.compiled import compiled


@compiled
def dot(a, b):
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def length(a):
    """|a|"""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@compiled
def moved(a, step, b):
    """a + step b, of vectors."""
    return a[0] + step * b[0], a[1] + step * b[1], a[2] + step * b[2]


@compiled
def times_number(number, a):
    """number a"""
    return number * a[0], number * a[1], number * a[2]


@compiled
def times(A, b):
    """A b"""
    return (
        A[0] * b[0] + A[1] * b[1] + A[2] * b[2],
        A[3] * b[0] + A[4] * b[1] + A[5] * b[2],
        A[6] * b[0] + A[7] * b[1] + A[8] * b[2],
    )


@compiled
def transposed_times(A, b):
    """A^T b"""
    return (
        A[0] * b[0] + A[3] * b[1] + A[6] * b[2],
        A[1] * b[0] + A[4] * b[1] + A[7] * b[2],
        A[2] * b[0] + A[5] * b[1] + A[8] * b[2],
    )


@compiled
def diagonal(a):
    """The matrix with a on its diagonal."""
    return a[0], 0.0, 0.0, 0.0, a[1], 0.0, 0.0, 0.0, a[2]


@compiled
def with_diagonal(A, a):
    """A + diag(a)"""
    return A[0] + a[0], A[1], A[2], A[3], A[4] + a[1], A[5], A[6], A[7], A[8] + a[2]


@compiled
def one_and_product(share, A, B):
    """1 + share A B"""
    a, b, c = times(A, (B[0], B[3], B[6])), times(A, (B[1], B[4], B[7])), times(A, (B[2], B[5], B[8]))
    return (
        1.0 + share * a[0], share * b[0], share * c[0],
        share * a[1], 1.0 + share * b[1], share * c[1],
        share * a[2], share * b[2], 1.0 + share * c[2],
    )  # fmt: skip


@compiled
def solved(A, b):
    """A^-1 b, by the adjugate; not finite where A is singular."""
    p, q, r = A[4] * A[8] - A[5] * A[7], A[5] * A[6] - A[3] * A[8], A[3] * A[7] - A[4] * A[6]
    share = 1.0 / (A[0] * p + A[1] * q + A[2] * r)
    return (
        share * (p * b[0] + (A[2] * A[7] - A[1] * A[8]) * b[1] + (A[1] * A[5] - A[2] * A[4]) * b[2]),
        share * (q * b[0] + (A[0] * A[8] - A[2] * A[6]) * b[1] + (A[2] * A[3] - A[0] * A[5]) * b[2]),
        share * (r * b[0] + (A[1] * A[6] - A[0] * A[7]) * b[1] + (A[0] * A[4] - A[1] * A[3]) * b[2]),
    )
