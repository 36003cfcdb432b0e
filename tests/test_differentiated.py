"""Derivatives of followed kernels, as machine code."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softhand.numerics.compiled import compiled
from softhand.numerics.differentiated import Ways, Writer, addresses
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
    y[5] = 0.0


def _codes(x, y):
    layouts = Layouts()
    followed = Followed(every_function, (x, y), (), frozenset(), {}, layouts)
    writer = Writer(followed.sums, Ways((), (), ()))
    return layouts, writer


def _call(code, words, tape):
    import ctypes

    function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)(code)
    return function(words.ctypes.data, tape.ctypes.data)


@pytest.fixture(scope="module")
def point():
    return np.array([0.6, 0.9, 0.8])


def test_the_recording_is_the_kernel_and_refuses_another_way(point):
    x, y, wanted = point.copy(), np.ones(6), np.ones(6)
    every_function(point, wanted)
    layouts, writer = _codes(x, y)
    tape, words = np.zeros(len(writer.taped)), np.array(addresses(writer.memories, layouts.places))
    code = loaded(assembled(writer.recording()))
    assert _call(code, words, tape) == 1
    np.testing.assert_allclose(y, wanted, rtol=1e-15)
    x[0], y[:] = 0.75, 1.0  # the branch on x > 0.7 goes the other way
    assert _call(code, words, tape) == 0
    assert np.all(y == 1.0)


@pytest.mark.parametrize("lanes", [1, 3])
def test_tangent_and_adjoint_are_those_of_differences(point, lanes):
    x, y = point.copy(), np.ones(6)
    layouts, writer = _codes(x, y)
    tape, words = np.zeros(len(writer.taped)), np.array(addresses(writer.memories, layouts.places))
    assert _call(loaded(assembled(writer.recording())), words, tape) == 1

    def at(position):
        found = np.ones(6)
        every_function(position, found)
        return found

    jacobian = np.empty((6, 3))
    for k in range(3):
        wide, narrow = ((at(point + h * np.eye(3)[k]) - at(point - h * np.eye(3)[k])) / (2 * h) for h in (2e-3, 1e-3))
        jacobian[:, k] = (4 * narrow - wide) / 3
    direction = np.random.default_rng(0).normal(size=(3, lanes))
    dots = [np.zeros((array.size, lanes)) for array in layouts.memories]
    dots[layouts.number_of(x)[0]][:] = direction
    both = np.concatenate([words, addresses(writer.memories, [array.ctypes.data for array in dots])])
    _call(loaded(assembled(writer.tangent(lanes))), both, tape)
    found = dots[layouts.number_of(y)[0]]
    np.testing.assert_allclose(found, jacobian @ direction, rtol=1e-9, atol=1e-10)
    bars = [np.zeros(array.size) for array in layouts.memories]
    bars[layouts.number_of(y)[0]][:] = weights = np.arange(1.0, 7.0)
    both = np.concatenate([words, addresses(writer.memories, [array.ctypes.data for array in bars])])
    _call(loaded(assembled(writer.adjoint())), both, tape)
    np.testing.assert_allclose(bars[layouts.number_of(x)[0]] @ direction, weights @ found, rtol=1e-12)
    assert bars[layouts.number_of(y)[0]][4] == 5.0  # what is added to keeps its adjoint
    assert bars[layouts.number_of(y)[0]][5] == 0.0  # what is overwritten has none
