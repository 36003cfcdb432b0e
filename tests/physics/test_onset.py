"""Experiments of `softhand.validation.onset` against their exact answers, and the quadrature they are judged by."""

import numpy as np
import pytest

from softhand.validation import onset
from softhand.validation.check import Experiment
from softhand.validation.pressures import Pressure, columns, lever, limit_curve, power
from softhand.validation.rigs import RADIUS

PRESSURES = {"columns 0.1 mm": columns(1e-4, RADIUS), "columns 3 mm": columns(3e-3, RADIUS), "Hertz": power(2.0)}


@pytest.mark.parametrize("pressure", PRESSURES.values(), ids=PRESSURES)
def test_the_exact_limit_is_normal_to_the_slip_on_it(pressure: Pressure) -> None:
    """Friction takes the most power: along the curve (f_t, tau) changes at right angles to (d, 1), the motion."""
    share = np.linspace(0.0, 0.9, 101)
    curve, d = limit_curve(pressure, np.tan(0.5 * np.pi * share)), np.tan(0.5 * np.pi * 0.5 * (share[1:] + share[:-1]))
    change = np.diff(curve, axis=0)
    power_change = change[:, 0] * d + change[:, 1]
    assert np.all(change[:, 0] > 0.0) and np.all(change[:, 1] < 0.0)
    assert np.max(np.abs(power_change) / np.hypot(change[:, 0] * d, change[:, 1])) < 0.02
    assert curve[0] == pytest.approx([0.0, lever(pressure)], abs=1e-9)
    assert limit_curve(pressure, [1e6])[0] == pytest.approx([1.0, 0.0], abs=1e-5)


def test_known_levers() -> None:
    """8/15 of columns under a light touch, 3 pi / 16 of Hertz, 2/3 of an even pressure."""
    assert lever(columns(1e-9, RADIUS)) == pytest.approx(8.0 / 15.0, rel=1e-6)
    assert lever(power(2.0)) == pytest.approx(3.0 * np.pi / 16.0, rel=1e-6)
    assert lever(lambda x: np.ones_like(x)) == pytest.approx(2.0 / 3.0, rel=1e-9)


@pytest.mark.parametrize("experiment", onset.EXPERIMENTS, ids=lambda experiment: experiment.__name__)
def test_exact(experiment: Experiment) -> None:
    """Every number that the experiment measures is within its tolerance."""
    checks = list(experiment())
    assert checks
    assert [check for check in checks if not check.passed] == []
