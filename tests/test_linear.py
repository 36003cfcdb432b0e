"""Envelope Cholesky and least-norm solutions against NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from softhand.numerics.linear import factor, least_norm, solve

Array = NDArray[np.float64]


def arrow(fingers: int, joints: int) -> list[int]:
    """Envelope of equal fingers and a free object: blocks, then six full rows."""
    return [joints * finger for finger in range(fingers) for _ in range(joints)] + [0] * 6


ENVELOPES = {
    "one": [0],
    "diagonal": list(range(7)),
    "two fingers": arrow(2, 3),
    "three fingers": arrow(3, 3),
    "four fingers": arrow(4, 4),
    "uneven fingers": [0, 0, 2, 3, 3, 3, 3, 0, 0, 0, 0, 0, 0],
    "wrist": [0] * 16,
    "ragged": [0, 1, 0, 2, 4, 3, 6, 1, 8, 0],
}


@pytest.fixture(params=list(ENVELOPES))
def first(request: pytest.FixtureRequest) -> NDArray[np.int64]:
    """First column of each row, for several shapes of hand."""
    return np.array(ENVELOPES[request.param], dtype=np.int64)


def random_spd(first: NDArray[np.int64], rng: np.random.Generator) -> Array:
    """A symmetric positive definite matrix that is zero outside the envelope."""
    n = len(first)
    L = np.tril(rng.normal(size=(n, n)))
    for i, start in enumerate(first):
        L[i, :start] = 0.0
    L[np.diag_indices(n)] = rng.uniform(0.5, 2.0, n)
    return L @ L.T


def envelope_only(A: Array, first: NDArray[np.int64]) -> Array:
    """A inside the lower envelope, NaN elsewhere."""
    kept = np.full_like(A, np.nan)
    for i, start in enumerate(first):
        kept[i, start : i + 1] = A[i, start : i + 1]
    return kept


def test_factor_is_the_cholesky_factor(first: NDArray[np.int64], rng: np.random.Generator) -> None:
    """`factor` gives NumPy's Cholesky factor, its diagonal inverted, and leaves all outside the envelope alone."""
    A = random_spd(first, rng)
    L = envelope_only(A, first)
    assert factor(L, first) == -1
    np.fill_diagonal(L, 1.0 / np.diag(L))
    np.testing.assert_allclose(L, envelope_only(np.linalg.cholesky(A), first), rtol=1e-9, atol=1e-12)


def test_solve_is_the_solution(first: NDArray[np.int64], rng: np.random.Generator) -> None:
    """`factor` and `solve` give the solution of A x = b, reading the envelope alone."""
    A, b = random_spd(first, rng), rng.normal(size=len(first))
    L, x = envelope_only(A, first), b.copy()
    factor(L, first)
    solve(L, first, x)
    np.testing.assert_allclose(A @ x, b, rtol=1e-9, atol=1e-9 * np.linalg.cond(A) ** 0.5)
    np.testing.assert_allclose(x, np.linalg.solve(A, b), rtol=1e-14 * np.linalg.cond(A) + 1e-12)


@pytest.mark.parametrize("pivot", [-1.0, 0.0, np.nan])
def test_row_that_is_not_positive_definite_is_reported(first: NDArray[np.int64], pivot: float) -> None:
    """`factor` returns the first row at which the matrix fails to be positive definite."""
    for row in range(len(first)):
        A = np.eye(len(first))
        A[row, row] = pivot
        A[-1, -1] = pivot
        assert factor(A, first) == row


def test_indefinite_matrix_is_reported_although_its_diagonal_is_positive() -> None:
    """A positive diagonal does not hide an indefinite matrix."""
    A = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.9, 0.9, 1.0]])
    assert factor(A, np.array([0, 1, 0])) == 2


SHAPES = [(6, 9), (6, 12), (9, 3), (12, 6), (5, 5), (6, 6), (1, 4), (4, 1), (1, 1)]


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_least_norm_of_full_rank_is_the_pseudoinverse(shape: tuple[int, int], rng: np.random.Generator) -> None:
    """A^+ b of wide, tall and square matrices of full rank is NumPy's."""
    A, b = rng.normal(size=shape), rng.normal(size=shape[0])
    x = np.full(shape[1], np.nan)
    least_norm(A, False, b, x)
    expected = np.linalg.pinv(A) @ b
    tolerance = 1e-14 * np.linalg.cond(A) ** 2 + 1e-12
    np.testing.assert_allclose(x, expected, rtol=0.0, atol=tolerance * np.linalg.norm(expected))


@pytest.mark.parametrize("rank", [1, 2, 4])
@pytest.mark.parametrize("shape", [(6, 9), (6, 6), (9, 6), (5, 12)], ids=str)
def test_least_norm_of_a_deficient_matrix_is_the_pseudoinverse(
    shape: tuple[int, int], rank: int, rng: np.random.Generator
) -> None:
    """A^+ b is NumPy's also where A has a lower rank, and where b cannot be reached."""
    A = rng.normal(size=(shape[0], rank)) @ rng.normal(size=(rank, shape[1]))
    b = rng.normal(size=shape[0])
    x = np.full(shape[1], np.nan)
    least_norm(A, False, b, x)
    expected = np.linalg.pinv(A, rcond=1e-10) @ b
    np.testing.assert_allclose(x, expected, rtol=0.0, atol=1e-8 * np.linalg.norm(expected))


def test_least_norm_of_zero_is_zero() -> None:
    """The pseudoinverse of zero is zero, not NaN."""
    x = np.full(4, np.nan)
    least_norm(np.zeros((3, 4)), False, np.ones(3), x)
    np.testing.assert_array_equal(x, 0.0)


@pytest.mark.parametrize("shape", SHAPES, ids=str)
def test_least_norm_of_the_transpose_is_its_pseudoinverse(shape: tuple[int, int], rng: np.random.Generator) -> None:
    """(A^T)^+ b of wide, tall and square matrices is NumPy's, without a transposed copy."""
    A, b = rng.normal(size=shape), rng.normal(size=shape[1])
    x = np.full(shape[0], np.nan)
    least_norm(A, True, b, x)
    expected = np.linalg.pinv(A.T) @ b
    tolerance = 1e-14 * np.linalg.cond(A) ** 2 + 1e-12
    np.testing.assert_allclose(x, expected, rtol=0.0, atol=tolerance * np.linalg.norm(expected))
