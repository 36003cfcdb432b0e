"""Prepared calls: the same results as plain ones, with names, from another process, and where numba has changed."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Iterator
from copy import deepcopy
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from softhand import build, load_scenario
from softhand.numerics import prepared as module
from softhand.numerics.compiled import compiled
from softhand.numerics.prepared import Prepared, prepared


class Spring(NamedTuple):
    """An inner record."""

    stiffness: NDArray[np.float64]
    rest: float


class Pair(NamedTuple):
    """A record of records."""

    left: Spring
    right: Spring


class Rig(NamedTuple):
    """Records in records, arrays of several kinds and shapes, numbers."""

    spring: Spring
    count: int
    is_on: bool
    table: NDArray[np.void]
    others: Pair


@compiled
def pull(rig, scale, at, out):
    """Something that uses every part, and writes to an array that is fixed and to one that varies."""
    total = 0.0
    for i in range(rig.count):
        for j in range(rig.spring.stiffness.shape[1]):
            total += rig.spring.stiffness[i, j] * (at[j] - rig.spring.rest)
    if rig.is_on:
        total += scale * rig.table[1].weight + rig.table[0].number
    total -= rig.others.left.stiffness[0] * rig.others.left.rest
    total -= rig.others.right.stiffness[0] * rig.others.right.rest
    rig.others.right.stiffness[1] = total
    out[0] = total
    return total


def rig() -> Rig:
    """With views that are not contiguous, and a structured array."""
    table = np.zeros(3, dtype=[("weight", np.float64), ("number", np.int64)])
    table["weight"], table["number"] = (0.5, 1.5, 2.5), (7, 8, 9)
    stiffness = np.arange(24.0).reshape(4, 6)[:, 1:4]
    others = Pair(Spring(np.array([2.0, 3.0]), 0.25), Spring(np.array([4.0, 5.0]), 0.75))
    return Rig(Spring(stiffness, -0.5), 3, True, table, others)


AT = np.array([0.1, -0.2, 0.3])


def expected(given: Rig, scale: float, at: NDArray[np.float64]) -> float:
    """The same in numpy."""
    total = np.sum(given.spring.stiffness[: given.count] @ (at - given.spring.rest))
    if given.is_on:
        total += scale * given.table[1]["weight"] + given.table[0]["number"]
    return float(total - sum(spring.stiffness[0] * spring.rest for spring in given.others))


@pytest.fixture
def plain_calls(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Where calls cannot be prepared."""
    monkeypatch.setenv("SOFTHAND_PREPARED", "0")
    module._is_understood.cache_clear()
    yield
    module._is_understood.cache_clear()


def is_plain(call: Prepared) -> bool:
    """Whether a call goes to the compiled function as it is."""
    return call.func is call.function


def check(call: Any, given: Rig) -> None:
    """What the call returns, and what it writes."""
    out = np.zeros(1)
    value = call(AT, out)
    assert value == pytest.approx(expected(given, 2.0, AT), rel=1e-14)
    assert out[0] == value == given.others.right.stiffness[1]


def test_records_in_records_come_apart_rightly() -> None:
    """Numbers, flags, structured arrays, views with gaps, records in tuples: each at its place."""
    given = rig()
    call = prepared(pull, given, 2.0, varying=(AT, np.zeros(1)))
    assert not is_plain(call)
    check(call, given)


def test_what_is_in_the_arrays_may_change() -> None:
    """They are read anew at each call, also through a view that the record has."""
    given = rig()
    call = prepared(pull, given, 2.0, varying=(AT, np.zeros(1)))
    first = call(AT, np.zeros(1))
    given.spring.stiffness[1, 2] = -3.0
    given.table["number"] = 100
    check(call, given)
    assert call(AT, np.zeros(1)) != first


def test_the_arrays_are_kept_alive() -> None:
    """Nobody else has to hold them."""
    calls = [prepared(pull, rig(), 2.0, varying=(AT, np.zeros(1))) for _ in range(50)]
    [np.full(1000, np.nan) for _ in range(50)]
    assert {call(AT, np.zeros(1)) for call in calls} == {calls[0](AT, np.zeros(1))}


def test_a_call_can_be_pickled_and_copied() -> None:
    """It goes on with arrays of its own, which had the same numbers."""
    given = rig()
    call = prepared(pull, given, 2.0, varying=(AT, np.zeros(1)))
    value = call(AT, np.zeros(1))
    for other in (pickle.loads(pickle.dumps(call)), deepcopy(call)):
        given.spring.stiffness[0, 0] += 1.0
        assert other(AT, np.zeros(1)) == value != call(AT, np.zeros(1))
        check(other, other.fixed[0])
        assert not np.shares_memory(other.fixed[0].spring.stiffness, given.spring.stiffness)


@pytest.mark.usefixtures("plain_calls")
def test_the_switch_makes_plain_calls() -> None:
    """`SOFTHAND_PREPARED=0`: the same value from the function itself; what was prepared may be pickled into it."""
    given = rig()
    call = prepared(pull, given, 2.0, varying=(AT, np.zeros(1)))
    assert is_plain(call)
    check(call, given)
    again = pickle.loads(pickle.dumps(call))
    assert is_plain(again) and again(AT, np.zeros(1)) == call(AT, np.zeros(1))


@pytest.mark.parametrize("change", ["layout", "no entry points", "no table of functions"])
def test_another_numba_gets_plain_calls(change: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where arrays or entry points are not as they are taken to be, this is found out on a small function."""
    words = module.words_of

    def other_layout(argument: Any) -> Iterator[int]:
        if isinstance(argument, np.ndarray):
            start = (0, 0, argument.size, argument.itemsize, argument.ctypes.data)
            yield from (*start, *argument.strides, *argument.shape)
        else:
            yield from words(argument)

    def no_entry(*arguments: Any) -> Any:
        raise AttributeError("'_dispatcher' object has no attribute 'entry_point'")

    if change == "layout":
        monkeypatch.setattr(module, "words_of", other_layout)
    elif change == "no entry points":
        monkeypatch.setattr(module, "_entry_point", no_entry)
    else:
        monkeypatch.setattr(module, "_entry", no_entry)
    module._is_understood.cache_clear()
    try:
        given = rig()
        call = prepared(pull, given, 2.0, varying=(AT, np.zeros(1)))
        assert is_plain(call)
        check(call, given)
    finally:
        module._is_understood.cache_clear()


def test_this_numba_is_understood() -> None:
    """Otherwise all would be slower than need be, without a word."""
    assert module._is_understood()


PROGRAM = """
import sys, numpy as np
from softhand import build, load_scenario
from softhand.numerics.prepared import _is_understood
simulation = build(load_scenario("target-a", {"duration": 0.02, "fingertip.contact": "coulomb"}))
recording = simulation.run()
assert not _is_understood()
np.savez(sys.argv[1], **recording.variables)
"""


@pytest.mark.slow
def test_a_run_is_the_same_without_prepared_calls(tmp_path: Any) -> None:
    """`SOFTHAND_PREPARED=0` for a whole process: the same bits in every variable."""
    environment = {**os.environ, "SOFTHAND_PREPARED": "0"}
    subprocess.run([sys.executable, "-c", PROGRAM, tmp_path / "run.npz"], env=environment, check=True)
    expected = build(load_scenario("target-a", {"duration": 0.02, "fingertip.contact": "coulomb"})).run()
    with np.load(tmp_path / "run.npz") as found:
        assert set(found) == set(expected.variables)
        for name, values in expected.variables.items():
            assert np.array_equal(found[name], values), name
