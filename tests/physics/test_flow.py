"""Experiments of `softhand.validation.flow` against their exact answers."""

import pytest

from softhand.laws.radial import Radial
from softhand.validation import flow
from softhand.validation.check import Experiment
from softhand.validation.rigs import RADIUS
from softhand.validation.sliding import STEPPERS


@pytest.mark.parametrize("experiment", flow.EXPERIMENTS, ids=lambda experiment: experiment.__name__)
def test_exact(experiment: Experiment) -> None:
    """Every number that the experiment measures is within its tolerance."""
    checks = list(experiment())
    assert checks
    assert [check for check in checks if not check.passed] == []


@pytest.mark.parametrize("limit", ["ellipse", "exact"])
@pytest.mark.parametrize("stepper", STEPPERS)
def test_the_puck_goes_and_turns_as_far_with_every_stepper(stepper: str, limit: str) -> None:
    """31.0 mm and 13.33 rad on the ellipse, 32.0 mm and 14.49 rad on the exact limit, within 1 %."""
    way, turn, *_ = flow.slid_puck(Radial(radius=RADIUS), 5e-4, limit, STEPPERS[stepper](step=2.5e-4))
    exact = {"ellipse": (31.0e-3, 13.33), "exact": (32.0e-3, 14.49)}[limit]
    assert (way, turn) == pytest.approx(exact, rel=0.01)
