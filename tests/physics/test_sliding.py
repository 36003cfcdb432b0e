"""Experiments of `softhand.validation.sliding` against their exact answers."""

import pytest

from softhand.validation import sliding
from softhand.validation.check import Experiment
from softhand.validation.rigs import MU, G

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
