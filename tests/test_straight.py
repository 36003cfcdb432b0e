"""Straight code is its kernel: the same numbers, or it leaves the work to the kernel."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from softhand import load_scenario
from softhand.assembly.resolve import resolve
from softhand.batch.asked import Asked
from softhand.batch.loop import BETWEEN, LAW, RECORDED
from softhand.batch.run import CompiledRun
from softhand.numerics import straight as making
from softhand.numerics.addressed import Addressed
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.branches import seldom, spared, usually
from softhand.numerics.compiled import compiled
from softhand.numerics.layouts import Layouts
from softhand.numerics.straight import Fixed, pattern_of, straight
from softhand.simulation.keep import Keep
from softhand.steppers.kernels import BEGIN, CONTACTS, KICK, KICK_DRIFT

KEPT = ("joint_position", "object_position", "deformation", "contact_force", "joint_torque", "internal_force")


def run_of(scenario: str, duration: float = 0.1) -> CompiledRun:
    """A run that keeps every sample."""
    setup = resolve(load_scenario(scenario, {"duration": duration}))
    period = setup.scenario.control_period
    return CompiledRun(setup, Keep.of(KEPT, period, period), Asked())


@pytest.mark.parametrize("scenario", ["target-a", "target-b", "gripper", "ball", "allegro-box"])
def test_runs_are_the_same_with_and_without(scenario: str) -> None:
    """Along a reference, for tips of the paper's law and others, against faces, boxes and curved objects."""
    run, plain = run_of(scenario), run_of(scenario)
    plain.mechanics.straight[:], plain.plan.straight[:] = 0, 0
    with_code, without = run.go(lambda: False).variables, plain.go(lambda: False).variables
    assert len(with_code["time"]) > 50
    for name in KEPT:
        size = np.abs(without[name]).max()
        assert_allclose(with_code[name], without[name], rtol=0.0, atol=1e-10 * max(size, 1e-3), err_msg=name)


def test_all_of_a_period_is_straight() -> None:
    """Steps, observation and law of the paper's hand; fingers share code, and so do their contacts."""
    run = run_of("target-a")
    steps, loop = run.mechanics.straight[:, 0], run.plan.straight[:, 0]
    assert steps[[KICK_DRIFT, BEGIN, KICK]].all() and loop[[RECORDED, BETWEEN, LAW]].all()
    contacts, branches = steps[CONTACTS : CONTACTS + 3], steps[CONTACTS + 3 :]
    assert contacts.all() and len(set(contacts)) == 1
    assert branches.all() and len(branches) == 4 and len(set(branches)) == 2  # three fingers, and the object


def test_code_is_found_again_on_disk(monkeypatch: pytest.MonkeyPatch) -> None:
    """A second process need not make it."""
    run = run_of("target-a")
    monkeypatch.setattr(making, "_codes", {})
    monkeypatch.setattr(making, "Traced", None)
    assert run_of("target-a").mechanics.straight[:, 0].all() and run is not None


class Pair(NamedTuple):
    """Two vectors."""

    x: Array
    y: Array


@compiled
def _mixed(table, pair, factor, out):
    """Branches of each kind, a loop over what is fixed, a square root of what may be negative."""
    for k in range(table.shape[0]):
        if table[k] < 0:
            continue
        value = factor * pair.x[table[k]]
        if seldom(value > 10.0):
            value = 10.0
        if not usually(pair.y[k] >= 0.0):
            value = -value
        if not spared(pair.y[k] == 0.0):
            value += math.sqrt(abs(pair.y[k]))
        out[k] = max(value, -1.0)


@compiled
def _unknown(x, out):
    out[0] = 1.0 if x[0] > 0.0 else 2.0


@compiled
def _counts(settings, out):
    out[0] = settings[0]
    settings[0] += 1.0


@compiled
def _scaled(row, first, x, out):
    out[first] = row[0] * x[first] + row[1]


def call(code: Addressed) -> bool:
    """What the code says."""
    import ctypes

    function = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_void_p, ctypes.c_void_p)(code.code)
    return bool(function(code.place, code.place))


def code_of(function: Any, *arguments: Any, fixed: tuple[AnyArray, ...] = ()) -> Addressed | None:
    """Of one instance."""
    return straight(function, [arguments], Fixed(fixed, fixed), Layouts())[0]


@pytest.mark.parametrize(("x", "y", "done"), [(0.5, 4.0, True), (7.0, 4.0, False), (0.5, -4.0, False)])
def test_what_is_off_the_way_is_left_to_the_kernel(x: float, y: float, done: bool) -> None:
    """Then nothing is changed."""
    table, pair = np.array([1, -1, 0]), Pair(np.array([x, 2.0]), np.array([0.0, 0.0, y]))
    out, expected = np.full(3, 7.0), np.full(3, 7.0)
    _mixed(table, pair, 1.5, expected)
    code = code_of(_mixed, table, pair, 1.5, out, fixed=(table,))
    assert code is not None and call(code) == done
    assert_allclose(out, expected if done else 7.0, rtol=1e-15)


def test_no_code_where_only_the_run_knows_the_way() -> None:
    """A branch that says nothing, and a number of the structure that changes."""
    settings = np.array([0.0])
    assert code_of(_unknown, np.ones(1), np.zeros(1)) is None
    assert code_of(_counts, settings, np.zeros(1), fixed=(settings,)) is None
    code = code_of(_counts, settings, out := np.zeros(1))
    assert code is not None and call(code) and call(code) and out[0] == 1.0 and settings[0] == 2.0


def test_instances_share_code_if_they_shall() -> None:
    """A zero that is not in all rows of a group is a number like others."""
    rows, x, out = np.array([[2.0, 0.0], [3.0, 1.5], [4.0, 0.0]]), np.array([1.0, 2.0, 3.0]), np.zeros(3)
    instances = [(rows[k], k, x, out) for k in range(3)]
    patterns = pattern_of(rows, [[0, 1, 2]]), pattern_of(rows)
    for pattern, count in zip(patterns, (1, 2), strict=True):
        fixed = Fixed(tuple(row[0] for row in instances), tuple(pattern))
        codes = straight(_scaled, instances, fixed, Layouts())
        assert all(code is not None and call(code) for code in codes)
        assert len({code.code for code in codes if code is not None}) == count
        assert_allclose(out, [2.0, 7.5, 12.0])
        out[:] = 0.0
