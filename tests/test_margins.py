"""Margins of closed loops, against formulas, and against runs just within and just beyond each."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from nudged import grown, rate_of
from numpy.testing import assert_allclose

import softhand
from softhand.controllers.regulation import Regulation
from softhand.margins.delay import delay_margin, delayed_step
from softhand.margins.gains import joint_margins
from softhand.margins.loop import Loop, close_loop, growth_of
from softhand.margins.period import growth_at
from softhand.margins.place import Place, find_place
from softhand.margins.search import edge, first_edge, stable_range
from softhand.margins.stability import Stability
from softhand.scenario.scenario import load_scenario

FINE = {"stepper.step": 1e-4}
"""Of runs that are to grow as the plant does, not as its steps do."""


@lru_cache(2)
def of(name: str) -> Stability:
    return softhand.stability(name, with_margins=True)


@lru_cache(1)
def holding() -> Place:
    return find_place(load_scenario("hold"))


def first_order(a: float, k: float, period: float = 0.1) -> Loop:
    """x' = a x + u with u = -k x held for a period, in the shape of a loop with one joint and nothing else."""
    A, B = np.exp(a * period), (np.exp(a * period) - 1.0) / a
    return Loop(
        period=period, A=np.array([[A]]), B=np.array([[B]]), K=np.array([[-k]]), N=np.zeros((0, 1)), states=("x",),
        state_units=("rad",), inputs=("joint",), input_units=("N m",), moving=0, remembered=0, switches=(),
        C=np.eye(1), outputs=("x",), output_units=("rad",),
    )  # fmt: skip


def test_torque_range_of_a_first_order_plant() -> None:
    """|A - B k g| < 1: g from (A - 1) / (B k) to (A + 1) / (B k), and all joints are the one joint."""
    loop = first_order(2.0, 5.0)
    A, B = loop.A[0, 0], loop.B[0, 0]
    every, joint = joint_margins(loop)
    assert_allclose(joint.factors, [(A - 1.0) / (5.0 * B), (A + 1.0) / (5.0 * B)], rtol=2e-4)
    assert every.factors == joint.factors and every.joint == "all joints" and np.isnan(every.disk)


def test_disk_margin_of_a_first_order_plant() -> None:
    """1 / max |S - 1/2| with S = (z - A) / (z - A + B k), on a circle of a million points."""
    loop = first_order(2.0, 5.0)
    z = np.exp(1j * np.linspace(0.0, np.pi, 1_000_001))
    S = (z - loop.A[0, 0]) / (z - loop.A[0, 0] + 5.0 * loop.B[0, 0])
    alpha = 1.0 / np.max(np.abs(S - 0.5))
    joint = joint_margins(loop)[1]
    assert joint.disk == pytest.approx(alpha, rel=1e-3)
    low, high = joint.factors
    assert low < 1.0001 / joint.gain and joint.gain < high  # what holds with any phase holds with none
    assert joint.phase == pytest.approx(2.0 * np.degrees(np.arctan(0.5 * joint.disk)))


def test_a_period_of_delay_of_a_first_order_plant() -> None:
    """z^2 - A z + B k = 0 with one period, z^3 - A z^2 + B k = 0 with two."""
    loop = first_order(2.0, 5.0)
    A, Bk = loop.A[0, 0], 5.0 * loop.B[0, 0]
    for periods, powers in ((0, [1.0, Bk - A]), (1, [1.0, -A, Bk]), (2, [1.0, -A, 0.0, Bk])):
        step = delayed_step(loop, holding(), periods * loop.period)
        found = np.sort_complex(np.linalg.eigvals(step).astype(complex))
        assert_allclose(found, np.sort_complex(np.roots(powers).astype(complex)), atol=1e-12)


def test_edges_are_found_from_either_side() -> None:
    """Of growth rates that are formulas; ranges that do not have 1 are the nearest."""
    assert edge(lambda x: x - 3.0, 1.0, 8.0) == pytest.approx(3.0, rel=2e-4)
    assert first_edge(lambda x: x - 3.0, [0.0, 1.0, 2.0, 4.0]) == pytest.approx(3.0, rel=2e-4)
    assert np.isnan(first_edge(lambda x: 1.0, [0.0, 1.0])) and np.isinf(first_edge(lambda x: -1.0, [0.0, 1.0]))
    assert_allclose(stable_range(lambda x: (x - 2.0) * (x - 9.0)), [2.0, 9.0], rtol=3e-4)
    assert stable_range(lambda x: -1.0) == (0.0, np.inf) and not stable_range(lambda x: np.nan).has_now
    assert str(stable_range(lambda x: x - 2.0)) == "below 2" and str(stable_range(lambda x: 1.0 - 2 * x)) == "above 0.5"


def test_a_small_motion_grows_as_fast_as_its_mode() -> None:
    """Target A asked to stay, with fine steps: 5.24 1/s by the loop and in the run."""
    scenario = load_scenario("target-a", {"reference": {"kind": "hold"}, **FINE})
    rate = softhand.stability(scenario).modes[0].growth
    assert rate == pytest.approx(5.24, abs=0.005)
    assert rate_of(grown(scenario, 1.2), 1e-3, 0.1) == pytest.approx(rate, rel=0.005)


@pytest.mark.slow
def test_torques_may_be_as_late_as_the_delay_margin_says() -> None:
    """In tenths of a period: the last below the margin dies out, the first beyond grows, both at the rate told."""
    values = {"controller.period": 1e-3, "control_period": 1e-4, **FINE}
    place = find_place(load_scenario("hold", values))
    loop = close_loop(place)
    margin = delay_margin(loop, place)
    assert margin == pytest.approx(of("hold").margins.delay, rel=1e-3) and 1.4e-3 < margin < 1.5e-3
    for tenths, word in ((13, "dies out"), (17, "grows")):
        scenario = load_scenario("hold", {**values, "actuation.delay": 1e-4 * tenths})
        told = growth_of(delayed_step(loop, place, 1e-4 * tenths), 1e-3)
        measured = rate_of(grown(scenario, 0.8), 1e-4, 0.2)
        assert (measured > 0.0) == (word == "grows") == (1e-4 * tenths > margin)
        assert measured == pytest.approx(told, rel=0.1, abs=0.1)
        assert close_loop(find_place(scenario)).growth == pytest.approx(told, rel=1e-5)


def test_torques_may_be_held_as_long_as_the_longest_period_says() -> None:
    """Two per cent below it dies out, two beyond it grows, at the rates told."""
    longest = of("hold").margins.period
    for period, grows in ((0.98 * longest, False), (1.02 * longest, True)):
        values = {"control_period": period, "stepper.step": period / 10, "duration": 100 * period}
        scenario = load_scenario("hold", values)
        told = growth_at(holding(), period)
        measured = rate_of(grown(scenario, 0.6), period, 0.1)
        assert (measured > 0.0) == grows and measured == pytest.approx(told, rel=0.15)


def test_a_gain_may_be_as_large_as_its_margin_says() -> None:
    """K_N of `hold`: two hundredths below dies out, above grows."""
    (margin,) = (one for one in of("hold").margins.gains if one.name == "K_N")
    assert margin.factors.low == 0.0 and margin.value == 1.0
    for factor, grows in ((0.98 * margin.factors.high, False), (1.02 * margin.factors.high, True)):
        scenario = load_scenario("hold", {"controller.K_N": factor, **FINE})
        told = softhand.stability(scenario).held_growth
        measured = rate_of(grown(scenario, 1.0), 1e-3, 0.2)
        assert (told > 0.0) == (measured > 0.0) == grows and measured == pytest.approx(told, rel=0.1)


def test_the_torque_of_a_joint_may_be_as_large_as_its_margin_says() -> None:
    """A controller that gives one joint more than (59) does, beside what rest needs."""
    joint = of("hold").margins.joints[3]
    assert joint.joint == "finger_1_distal_flexion" and joint.factors.has_now
    place = holding()

    def with_factor(factor: float) -> float:
        return close_loop(place.with_controller(Stronger(**dict(place.controller), joint=2, factor=factor))).growth

    low, high = joint.factors
    assert with_factor(0.99 * high) < 0.0 < with_factor(1.01 * high)
    assert with_factor(1.01 * low) < 0.0 < with_factor(0.99 * low)


class Stronger(Regulation):
    """(59) with the torque of one joint multiplied, but for what it has at the start."""

    joint: int
    factor: float

    def start(self, observation: Any) -> Any:
        inner = super().start(observation)
        return inner, super().torque(observation, inner)[0].copy()

    def torque(self, observation: Any, memory: Any) -> Any:
        inner, rest = memory
        torque = super().torque(observation, inner)[0].copy()
        torque[self.joint] = rest[self.joint] + self.factor * (torque[self.joint] - rest[self.joint])
        return torque, memory


def test_an_unstable_loop_has_the_nearest_settings_that_are_stable() -> None:
    """Target A: K_N times 0.8 and less, K_v times eight and more, as the table of docs/stability.md has it."""
    margins = of("target-a").margins
    gains = {one.name: one.factors for one in margins.gains}
    assert np.isnan(margins.delay) and 1e-5 < margins.period < 2e-5
    assert 0.75 / 1.5 < gains["K_N"].high < 1.5 / 1.5 and 4.0 < gains["K_v"].low < 16.0 < gains["K_v"].high
    assert np.isnan(gains["K_O_position"]).all() and all(np.isnan(one.disk) for one in margins.joints)
    rows = dict(margins.rows())
    assert rows["controller.K_O_position times"].startswith("none from 0 to 64")
    assert rows["torques times"] == "none from 0 to 64, of any joint or all"
