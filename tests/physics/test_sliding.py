"""Experiments of `softhand.validation.sliding` against their exact answers."""

import numpy as np
import pytest

from softhand.contact.friction import spin_length
from softhand.validation import sliding
from softhand.validation.check import Experiment
from softhand.validation.rigs import MU, G


@pytest.mark.parametrize("depth", [1e-4, 1e-3, 3e-3])
def test_the_exact_limit_is_normal_to_the_slip_on_it(depth: float) -> None:
    """Friction takes the most power: along the curve (f_t, tau) changes at right angles to (d, 1), the motion."""
    count = 400
    curve, c = sliding.limit_curve(depth, count), 1.0 - depth / sliding.RADIUS
    a = sliding.RADIUS * (1.0 - c * c) ** 0.5
    tip_pad = sliding.block(depth).plant.pads[0]
    lever = spin_length(tip_pad, sliding.RADIUS - depth)
    share = (np.arange(count - 1) + 0.5) / (count - 1)
    d = a * np.tan(0.5 * np.pi * share)
    change = np.diff(curve, axis=0) * (1.0, lever)
    power = change[:, 0] * d + change[:, 1]
    assert np.all(change[:, 0] > 0.0) and np.all(change[:, 1] < 0.0)
    size = np.hypot(change[:, 0] * d, change[:, 1])
    assert np.max(np.abs(power[5:-40]) / size[5:-40]) < 0.05
    assert curve[0] == pytest.approx([0.0, 1.0], abs=1e-9) and curve[-1] == pytest.approx([1.0, 0.0], abs=1e-5)


HALVED = {"midpoint": 4.0, "rk4": 2.0, "adaptive": 2.0, "semi-implicit-euler": 2.0}
"""What half the step does to the error of the stopping distance; while it slips a block stops at an even pace."""


@pytest.mark.parametrize("name", sliding.STEPPERS)
def test_every_stepper_stops_where_friction_says(name: str) -> None:
    """v0^2 / (2 mu g); slip travel is the whole way, as the slip of a step is final at its end."""
    exact = 0.5**2 / (2.0 * MU * G)
    errors = []
    for step in (1e-3, 5e-4):
        rig, _, distance = sliding.stopped_block(sliding.STEPPERS[name](step=step))
        errors.append(abs(distance / exact - 1.0))
        assert float(rig.contact["slip_travel"]) == pytest.approx(distance, abs=1e-6)  # [m]
    assert errors[0] < (1.1e-2 if name == "semi-implicit-euler" else 3e-5)
    assert errors[0] / errors[1] > 0.9 * HALVED[name]


@pytest.mark.parametrize("experiment", sliding.EXPERIMENTS, ids=lambda experiment: experiment.__name__)
def test_exact(experiment: Experiment) -> None:
    """Every number that the experiment measures is within its tolerance."""
    checks = list(experiment())
    assert checks
    assert [check for check in checks if not check.passed] == []
