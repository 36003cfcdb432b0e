"""Derivatives of followed kernels by elimination: each against differences, by the way, and in lanes."""

from __future__ import annotations

import ctypes
import math

import numpy as np
import pytest

from softhand.numerics.compiled import compiled
from softhand.numerics.eliminated import Eliminated
from softhand.numerics.followed import Followed
from softhand.numerics.layouts import Layouts
from softhand.numerics.llvm_text import assembled, loaded


@compiled
def every_function(x, y):
    """Each function that kernels use, on numbers where it has a derivative."""
    a, b, c = x[0], x[1], x[2]
    y[0] = math.sin(a) * math.cos(b) + math.tan(c) - math.exp(-a) / (1.0 + b * b)
    y[1] = math.atan2(a, b) + math.sqrt(b) * math.log(c) + math.expm1(a * c)
    y[2] = math.acos(0.5 * a) + math.atanh(0.3 * b) + abs(a - 2.0) * math.copysign(b, -c)
    y[3] = max(a, b) * min(b, c) + a**3 + math.hypot(a, c)
    for k in range(3):
        if x[k] > 0.7:
            y[4] += x[k] * y[k]
    y[5] = b


POINTS = np.array([[0.6, 0.9, 0.8], [0.5, 0.95, 0.75], [0.4, 0.72, 0.9], [0.1, 0.8, 0.71]])
"""All take one way."""


def values(x: np.ndarray) -> np.ndarray:
    found = np.ones(6)
    every_function(x, found)
    return found


def jacobian(x: np.ndarray) -> np.ndarray:
    columns = []
    for k in range(3):
        wide, narrow = ((values(x + h * np.eye(3)[k]) - values(x - h * np.eye(3)[k])) / (2 * h) for h in (2e-3, 1e-3))
        columns.append((4 * narrow - wide) / 3)
    return np.column_stack(columns)


def found_in(points: np.ndarray) -> tuple[int, np.ndarray, np.ndarray]:
    """Lanes that take the way of the first point; Jacobian and y[1] - y[2] of each."""
    lanes, x, y = len(points), points[0].copy(), np.ones(6)
    layouts = Layouts()
    followed = Followed(every_function, (x, y), (), frozenset(), {}, layouts)
    memory, (first, second) = followed.sums.memory, (layouts.number_of(array)[0] for array in (x, y))
    wanted = [memory[second, 8 * k] for k in range(6)]
    made = Eliminated(followed.sums, {(first, 8 * k) for k in range(3)}, wanted, [wanted[1] - wanted[2]], lanes)
    words = np.array([points[:, begin // 8] if memory == first else np.ones(lanes) for memory, begin in made.read])
    numbers = np.full((len(made.entries) + 1, lanes), np.nan)
    function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)(loaded(assembled(made.text)))
    mask = function(words.ctypes.data, numbers.ctypes.data)
    J = np.zeros((lanes, 6, 3))
    for (row, (_, begin)), number in zip(made.entries, numbers, strict=False):
        J[:, row, begin // 8] = number
    return mask, J, numbers[-1]


@pytest.mark.parametrize("lanes", [1, 2, 4])
def test_the_jacobian_is_that_of_differences_in_each_lane(lanes: int) -> None:
    mask, J, value = found_in(POINTS[:lanes])
    assert mask == (1 << lanes) - 1
    for point, own, one in zip(POINTS, J, value, strict=False):
        np.testing.assert_allclose(own, jacobian(point), rtol=1e-8, atol=1e-9)
        assert one == pytest.approx(values(point)[1] - values(point)[2], rel=1e-14)


def test_only_what_depends_is_written() -> None:
    """y[5] is x[1]: one derivative, and that is 1."""
    _, J, _ = found_in(POINTS[:1])
    assert J[0, 5].tolist() == [0.0, 1.0, 0.0]


def test_lanes_that_take_another_way_are_told() -> None:
    """x[0] > 0.7 in the third lane alone: the others are what they were."""
    points = POINTS.copy()
    points[2, 0] = 0.75
    mask, J, _ = found_in(points)
    assert mask == 0b1011
    for lane in (0, 1, 3):
        np.testing.assert_allclose(J[lane], jacobian(points[lane]), rtol=1e-8, atol=1e-9)
