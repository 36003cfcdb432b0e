"""Normal numbers by the ziggurat: of the distribution that they are said to be of, and told by their place alone."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy import stats

from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.philox import bits_at, fill_blocks
from softhand.numerics.ziggurat import _DENSITY, _WIDTHS, LAYERS, TAIL, three_normals

PARTS = 500
INDICES = range(-200, 800)


def blocks(seed: int, stream: int, first: int, index: int, parts: int = PARTS) -> AnyArray:
    """Words of `fill_blocks`."""
    words = np.zeros((4, parts), np.uint32)
    fill_blocks(words, seed, stream, first, index)
    return words


def numbers_of(seed: int, stream: int, index: int, parts: int = PARTS) -> Array:
    """Of parts 0, 1, ..., shape (parts, 3)."""
    words = blocks(seed, stream, 0, index, parts)
    return np.array([three_normals(words, t, seed, stream, t, index) for t in range(parts)])


@cache
def many() -> Array:
    """Shape (indices, parts, 3)."""
    return np.array([numbers_of(7, 1000, index) for index in INDICES])


def test_all_blocks_at_once_are_those_of_each_part() -> None:
    """The same 128 bits, for large and negative places, from any first part on."""
    for seed, stream, first, index in ((0, 0, 0, 0), (5, 1000, 17, -3), (10**9, 2**32 - 1, 2**32 - 9, 2**40)):
        words = blocks(seed, stream, first, index, 8).astype(object)
        for t in range(8):
            high, low = bits_at(seed, stream, first + t, index)
            assert [(int(a) << 32) | int(b) for a, b in (words[:2, t], words[2:, t])] == [int(high), int(low)]


def test_the_layers_have_one_area_and_end_at_the_top() -> None:
    """256 of them, with the tail they are the area below the density from 0 on."""
    area = _WIDTHS[1:-1] * np.diff(_DENSITY[1:])
    np.testing.assert_allclose(area, _WIDTHS[0] * _DENSITY[1], rtol=1e-9)
    assert len(area) == LAYERS - 1 and _WIDTHS[1] == TAIL and _DENSITY[-1] == 1.0
    tail = np.sqrt(2.0 * np.pi) * stats.norm.sf(TAIL)
    assert TAIL * _DENSITY[1] + tail == pytest.approx(_WIDTHS[0] * _DENSITY[1], rel=1e-12)


def test_the_numbers_are_normal() -> None:
    """Mean, variance, skewness, kurtosis and the share beyond 2, 3 and the begin of the tail, to four deviations."""
    x = many().ravel()
    n = len(x)
    assert abs(x.mean()) < 4.0 / np.sqrt(n)
    assert abs(x.var() - 1.0) < 4.0 * np.sqrt(2.0 / n)
    assert abs(stats.skew(x)) < 4.0 * np.sqrt(6.0 / n) and abs(stats.kurtosis(x)) < 4.0 * np.sqrt(24.0 / n)
    for limit in (0.2, 1.0, 2.0, 3.0, TAIL, 4.0):
        share = 2.0 * stats.norm.sf(limit)
        for beyond in (x > limit, x < -limit):
            assert abs(beyond.mean() - 0.5 * share) < 4.0 * np.sqrt(0.5 * share / n)
    assert stats.kstest(x[::7], "norm").pvalue > 1e-3


def test_numbers_of_other_parts_indices_and_kinds_know_nothing_of_each_other() -> None:
    """No correlation of them, nor of their squares, to four deviations."""
    x = many()
    for values in (x, x**2 - 1.0):
        pairs = [(values[:, :, a], values[:, :, b]) for a, b in ((0, 1), (0, 2), (1, 2))]
        pairs += [(values[1:], values[:-1]), (values[:, 1:], values[:, :-1]), (values[:, 300:], values[:, :-300])]
        for one, other in pairs:
            found = np.mean(one * other) / np.mean(values**2)
            assert abs(found) < 4.0 / np.sqrt(one.size)


def test_a_number_is_told_by_its_place() -> None:
    """Asked for alone, in any turn and among others it is the same; another seed, stream, part, index is another."""
    whole = many()[INDICES.index(33)]
    for part in (499, 0, 250):
        alone = three_normals(blocks(7, 1000, part, 33, 1), 0, 7, 1000, part, 33)
        assert tuple(whole[part]) == alone
    assert (
        len({tuple(numbers_of(*place, 1)[0]) for place in ((7, 1000, 33), (8, 1000, 33), (7, 1001, 33), (7, 1000, 34))})
        == 4
    )
