"""The controller `least-squeeze`: against the cone program, against a constant squeeze, in both loops."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hands import Array
from numpy.testing import assert_allclose

import softhand
from softhand.contact.records import CONTACT
from softhand.controllers.barrier import Limits, squeeze_by_barrier
from softhand.controllers.least_squeeze import LeastSqueeze
from softhand.holding.held import Held, held_there, limit_use, look
from softhand.holding.loads import loads_of
from softhand.holding.program import Program, Terms
from softhand.recording.recording import Recording

DAMPED = {"name": "kelvin-voigt", "radial": 1.0, "tangential": 1.0, "torsional": 1e-4}
PUSH = np.array([1.7, 1.7, 0.0])  # [N]
STAIRS, GROWS, BEGINS = 40, 2.0, 0.5  # [1], [s], [s]


def growing_push() -> list[dict[str, Any]]:
    """A force that grows in 2 s from 0.5 s on, and stays."""
    step = GROWS / STAIRS
    return [
        {"force": (PUSH * (k + 1) / STAIRS).tolist(), "start": BEGINS + k * step,
         "duration": step if k + 1 < STAIRS else 10.0}
        for k in range(STAIRS)
    ]  # fmt: skip


def scenario(**values: Any) -> softhand.Scenario:
    """The grasp of target-a at rest, of damped tips that can slip."""
    return softhand.load_scenario("target-a").replace(
        {"fingertip.contact": "coulomb", "fingertip.damping": DAMPED, "reference": {"kind": "hold"}, "duration": 3.2,
         **values}
    )  # fmt: skip


@cache
def pushed(name: str) -> Recording:
    return softhand.simulate(scenario(controller={"name": name}, push=growing_push()))


def total(recording: Recording) -> Any:
    """Sum of the normal forces [N]."""
    return recording.contact_force[:, :, 2].sum(axis=1)


def test_it_holds_a_growing_push_at_which_a_constant_squeeze_slips_and_squeezes_less() -> None:
    """The same scenario, push and reference: f_N = (4, 4, 3) N slips, the least that holds does not, a third less."""
    constant, least = pushed("regulation"), pushed("least-squeeze")
    assert constant.slip_travel[-1].max() > 2e-4
    assert least.slip_travel[-1].max() == 0.0
    assert np.mean(total(least)) < 0.7 * np.mean(total(constant))
    assert total(least)[-1] > total(least)[500] + 4.0  # it answers the push


def test_the_margin_is_kept_but_for_the_way_to_it() -> None:
    """30 % at rest under the push; never less than 10 % while it grows."""
    least = pushed("least-squeeze")
    assert np.max(least.limit_surface_use[-1]) < 0.71
    assert np.max(least.limit_surface_use) < 0.9


def barrier(held: Held, load: Array, margin: float, touch: float, most: float = 60.0) -> Array:
    """What the kernel finds for contact forces without squeeze, no torsion."""
    nc = len(held.friction)
    contacts, wanted = np.zeros(nc, CONTACT), np.empty(held.basis.shape[1])
    contacts["lever"], contacts["curve"] = held.lever, held.curve
    limits = Limits((1.0 - margin) * held.friction, held.effort, np.array([touch, most]))
    torque = held.hand_weight @ held.gravity
    start = np.zeros(len(wanted))
    squeeze_by_barrier(limits, contacts, held.basis, load, np.zeros(nc), held.hand_force, torque, start, wanted)
    return wanted


@pytest.mark.parametrize("name", ["target-a", "ball", "pinch", "gripper"])
def test_the_barrier_finds_the_least_of_the_cone_program(name: str) -> None:
    """Of random loads: the sum of normal forces is that of Clarabel, above it by no more than the barrier's gap."""
    held, rng, found = held_there(look(softhand.load_scenario(name))), np.random.default_rng(4), 0
    nc, n = len(held.friction), len(held.effort)
    gap = (2.0 * nc + nc + 2.0 + 2.0 * n) / 300.0
    for _ in range(20):
        push = rng.normal(0.0, 1.0, 3) if nc > 2 else np.zeros(3)  # two tips cannot turn it about their line
        loads = loads_of(held, wrenches=[[*push, 0.0, 0.0, 0.0]])
        least = Program(held, loads, Terms(use=0.7, touch=0.3, torsion=False)).least()
        if least is None:
            continue
        found += 1
        load = np.linalg.pinv(held.force_map, rcond=1e-9) @ loads.wrenches[0]
        force = load + held.basis @ barrier(held, load, 0.3, 0.3)
        total = np.sum(force[2::3])
        assert np.sum(least.force[0, 2::3]) - 1e-5 < total < np.sum(least.force[0, 2::3]) + gap
        assert np.max(limit_use(held, force, np.zeros(nc))) < 0.7 + 1e-4
    assert found > 10


def test_where_nothing_holds_it_is_a_little_beyond_the_limits() -> None:
    """At a friction of a fiftieth no squeeze below `most` holds: the answer is finite, and as hard as `most` allows."""
    held = held_there(look(softhand.load_scenario("pinch"))).with_friction(0.02)
    load = np.linalg.pinv(held.force_map, rcond=1e-9) @ loads_of(held).wrenches[0]
    force = load + held.basis @ barrier(held, load, 0.3, 0.3, most=20.0)
    assert 19.0 < np.sum(force[2::3]) < 22.0


@pytest.mark.parametrize("margin", [0.2, 0.5])
def test_at_rest_a_tip_uses_all_but_the_margin(margin: float) -> None:
    """The tip that limits the squeeze is at 1 - margin, within a hundredth."""
    asked = scenario(controller={"name": "least-squeeze", "margin": margin}, duration=3.0)
    recording = softhand.simulate(asked)
    assert 1.0 - margin - 0.02 < np.max(recording.limit_surface_use[-1]) < 1.0 - margin + 0.01


def test_both_loops_agree() -> None:
    """The compiled loop runs the same formula."""
    asked = scenario(controller={"name": "least-squeeze"}, duration=0.3)
    runs = softhand.rollout(asked, [{"mass": 0.2}], variables=("internal_force",), every=0.1, threads=1)
    recording = softhand.simulate(asked)
    assert runs.compiled[0]
    assert_allclose(runs.internal_force[0, -1], recording.internal_force[-1], rtol=1e-6, atol=1e-6)


def test_two_tips_and_a_ball_are_held_with_the_margin() -> None:
    """Pinch and ball: uses below 1 - margin at rest."""
    for name in ("pinch", "ball"):
        asked = softhand.load_scenario(name).replace({"controller": {"name": "least-squeeze"}, "duration": 2.0,
                                                       "reference": {"kind": "hold"}})  # fmt: skip
        recording = softhand.simulate(asked)
        assert np.max(recording.limit_surface_use[-1]) < 0.71


def test_settings_are_checked() -> None:
    """A margin of 1 leaves nothing."""
    with pytest.raises(softhand.ScenarioError, match=r"controller\.margin"):
        softhand.build(scenario(controller={"name": "least-squeeze", "margin": 1.0}))
    assert LeastSqueeze(margin=0.0).margin == 0.0
