"""Rates of the contact coordinates are those of their differences, in stick and in slip; recordings have no jumps."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softhand.controllers.controller import Controller
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.simulation.simulation import Simulation
from softhand.steppers.adaptive import Adaptive
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.rk4 import RungeKutta4
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler
from softhand.steppers.stepper import Stepper
from softhand.validation.every_law import LAWS as EVERY_LAW
from softhand.validation.every_law import name_of
from softhand.validation.rigs import BOTTOM, IMMOVABLE, RADIUS, Body, Carriage, make_rig, make_world, tip

LAWS = {name_of(law): law for law in EVERY_LAW}
DEPTH = 1.5e-3  # [m]


class Idle(Controller):
    """No torque."""

    def torque(self, observation, memory):
        """Zero."""
        return np.zeros(len(observation.joint_position)), memory


def dragged(law: Law, stepper: Stepper, duration: float = 0.06, spin: float = 8.0, **options: object) -> Recording:
    """A face that is dragged askew over a tip, rolls and spins on it: sticks at first, then slips in all three ways."""
    leaning = Carriage("Z", rpy=(0.3, -0.5 * math.pi + 0.5, 0.7))
    body = Body(IMMOVABLE, size=(0.2, 0.2, 0.06))
    world = make_world([leaning, Carriage("Z", (5.0, 0.0, 0.0))], body, np.zeros(3))
    tips = [tip(world, BOTTOM, law, friction=0.3, **options) for _ in range(2)]  # type: ignore[arg-type]
    rig = make_rig(world, tips, (0.004, -0.003, RADIUS - DEPTH + 0.03))
    rig.velocity[:] = 0.05, 0.03, 0.0, 0.6, -0.8, spin
    still = resting(Goal(np.zeros(6), (0.0,)))
    return Simulation(rig.plant, rig.state, Idle(), stepper, still, duration, stepper.step).run()


def off(run: Recording, slips: bool) -> tuple[Array, Array]:
    """Largest error of the rate of each coordinate of the first tip against that of its change, and the largest rate.

    Over samples where it slips before and after, or does not. The change is that of the last step, whose mean slip is
    what the rate after it has; without slip the mean of the rates before and after it is more precise.
    """
    eta, rate = run.contact_coordinates[:, 0], run.contact_coordinates_rate[:, 0]
    changes = np.diff(eta, axis=0) / np.diff(run.time)[:, None]
    slipping = run.is_slipping[:, 0] != 0
    chosen = (slipping[1:] == slips) & (slipping[:-1] == slips)
    assert np.count_nonzero(chosen) >= 2
    rates = rate[1:] if slips else 0.5 * (rate[1:] + rate[:-1])
    return np.max(np.abs(rates - changes)[chosen], axis=0), np.max(np.abs(changes), axis=0)


@pytest.mark.parametrize("name", list(LAWS))
def test_rates_are_those_of_the_differences(name: str) -> None:
    """In stick and in slip, where slip takes from theta, phi and psi if the law is polar.

    Without the slip they would be off by all of it: by up to 7 rad/s here.
    """
    errors = []
    for step in (1e-3, 2.5e-4):
        run = dragged(LAWS[name], Midpoint(step=step))
        error, largest = off(run, slips=True)
        errors.append(np.max(error / largest))
        assert np.max(off(run, slips=False)[0] / largest) < 1e-3
    assert errors[1] < 0.02
    assert errors[1] < 0.4 * errors[0]


@pytest.mark.parametrize(
    "stepper",
    [RungeKutta4(step=2.5e-4), Adaptive(step=2.5e-4), SemiImplicitEuler(step=2.5e-4)],
    ids=lambda s: type(s).__name__,
)
@pytest.mark.parametrize("damped", [False, True])
def test_so_they_are_with_every_stepper_and_with_dashpots(stepper: Stepper, damped: bool) -> None:
    """The paper's law, whose coordinates have all of the slip."""
    damping = {"damping": KelvinVoigt(radial=1.0, tangential=1.0, torsional=1e-4)} if damped else {}
    error, largest = off(dragged(LAWS["Nakashima"], stepper, **damping), slips=True)
    assert np.max(error / largest) < 0.02


def test_the_rate_of_the_deformation_is_that_of_its_change() -> None:
    """In steady slip the stored angles stand still, however fast the face goes by."""
    run = dragged(LAWS["Nakashima"], Midpoint(step=2.5e-4))
    assert run.is_slipping[-1, 0]
    last = np.diff(run.deformation[-2:, 0, 1:], axis=0)[0] / 2.5e-4
    gone = np.diff(run.contact_coordinates[-2:, 0, [0, 1, 4]], axis=0)[0] / 2.5e-4
    assert np.max(np.abs(last)) < 0.5 and np.max(np.abs(gone)) > 5.0


def test_a_recording_goes_on_beyond_a_turn() -> None:
    """A face that spins twice round on a tip: psi goes on without a jump, an observation stays within one turn."""
    run = dragged(LAWS["Radial"], Midpoint(step=1e-3), duration=0.2, spin=70.0)
    psi = run.contact_coordinates[:, 0, 4]
    assert np.max(np.abs(np.diff(psi))) < 0.2
    assert abs(psi[-1] - psi[0]) == pytest.approx(14.0, abs=1.0)
    assert abs(psi[0]) <= math.pi
