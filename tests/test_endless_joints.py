"""Joints that turn without end: a whole turn is no motion, for controllers and in recordings."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hands import CONTACT_POINTS, LAYOUTS, START_FORCE, make_fingertips, make_law
from numpy.testing import assert_allclose
from test_hands import needs_robots

from softhand import Controller, build
from softhand.controllers.finger_only import FingerOnly
from softhand.controllers.opposing import Opposing
from softhand.controllers.regulation import Regulation
from softhand.controllers.two_phase import TwoPhase
from softhand.model.configuration import CONTINUOUS
from softhand.plant.plant import Plant
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.sensing.observation import Observation
from softhand.simulation.simulation import Simulation
from softhand.steppers.midpoint import Midpoint


@pytest.mark.parametrize(
    ("controller", "scenario"),
    [
        pytest.param(Regulation(K_posture=0.2), "allegro-box", marks=needs_robots),
        (FingerOnly(), "target-a"),
        (Opposing(), "pinch-opposing"),
        (TwoPhase(), "pinch-two-phase"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Controller) else value,
)
def test_a_whole_turn_changes_no_torque(controller: Controller, scenario: str) -> None:
    """The torque is the same when the joints are told a turn further, and as if they were no such joints."""
    live = build(scenario).sample()
    known = replace(live.known, is_continuous=np.ones_like(live.is_continuous))
    start = Observation(known, live.block.copy())
    moved = start.copy()
    moved.joint_position[:] += np.random.default_rng(1).normal(0.0, 0.05, len(known.is_continuous))
    turned, plain = moved.copy(), Observation(live.known, moved.block.copy())
    turned.joint_position[:] += 2.0 * np.pi * np.resize([1.0, -1.0, 0.0], len(known.is_continuous))
    for observation in (moved, turned, plain):
        observation.time = start.time + 0.001
    told = [controller.torque(observation, controller.start(start))[0].copy() for observation in (turned, moved)]
    at_plain = controller.torque(plain, controller.start(Observation(live.known, start.block.copy())))[0]
    assert np.linalg.norm(at_plain - controller.torque(start, controller.start(start))[0]) > 1e-4
    assert_allclose(told[0], at_plain, rtol=0.0, atol=1e-9)
    assert_allclose(told[1], at_plain, rtol=0.0, atol=1e-12)


def test_recorded_positions_go_on_beyond_a_turn(tmp_path: Path) -> None:
    """A joint that turns freely, with the object far off, is recorded without jumps."""
    world = LAYOUTS["continuous"].load(tmp_path, gravity=(0.0, 0.0, 0.0))
    tips = [replace(tip, can_slip=True) for tip in make_fingertips(world, make_law(), CONTACT_POINTS)]
    plant = Plant(world, tips)
    state = LAYOUTS["continuous"].task(tmp_path).grasp.state.copy()
    world.object_position(state.q)[:] += 1.0
    state.v[0] = 20.0
    still = resting(Goal(np.zeros(6), START_FORCE))
    recording = Simulation(plant, state, None, Midpoint(step=1e-3), still, 0.5, 1e-3).run()
    assert plant.joints[0, 0] == CONTINUOUS
    turned, speed = recording.joint_position[:, 0], recording.joint_velocity[:, 0]
    assert abs(turned[-1] - turned[0]) > 2.0 * np.pi
    assert_allclose(np.diff(turned), 0.5e-3 * (speed[1:] + speed[:-1]), rtol=0.0, atol=1e-4)
