"""Every column of the four reference trajectories, by every stepper, through the scenario that ships."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hands import COLUMNS, STEPPERS, Array, deviations, read_reference, run_reference

STEP = {"semi-implicit-euler": 2.5e-4}
"""Steps that are not 1 ms [s]."""

DEGREE = float(np.radians(1.0))

POSE: dict[tuple[str, str], tuple[float, float]] = {
    ("midpoint", "minimum-jerk"): (0.5e-6, 0.0005 * DEGREE),
    ("midpoint", "step"): (0.3e-3, 0.8 * DEGREE),
    ("rk4", "minimum-jerk"): (1e-6, 0.001 * DEGREE),
    ("rk4", "step"): (60e-6, 0.25 * DEGREE),
    ("adaptive", "minimum-jerk"): (0.5e-6, 0.002 * DEGREE),
    ("adaptive", "step"): (0.5e-6, 0.002 * DEGREE),
    ("semi-implicit-euler", "minimum-jerk"): (20e-6, 0.02 * DEGREE),
    ("semi-implicit-euler", "step"): (0.2e-3, 1.8 * DEGREE),
}
"""How near the object has to stay to the reference: position [m] and each of roll, pitch, yaw [rad]."""

GROUPS = [name for name in COLUMNS if name not in ("position [m]", "orientation [rad]")]

BOUNDS: dict[tuple[str, str], tuple[float, ...]] = {
    # internal force, compression, deformation angles, Phi, force, torsion, joints, torques, friction ratio
    ("midpoint", "minimum-jerk"): (3.4e-5, 4.3e-9, 8e-6, 8e-6, 2.1e-4, 1.1e-7, 1.3e-5, 9e-6, 1.1e-5),
    ("midpoint", "step"): (4.5, 6.7e-4, 0.2, 0.011, 16.0, 5.6e-3, 0.0127, 0.28, 0.84),
    ("rk4", "minimum-jerk"): (2.6e-4, 2.2e-8, 1.5e-5, 1.8e-5, 1.8e-3, 5.1e-7, 1.9e-5, 1.2e-5, 1.3e-4),
    ("rk4", "step"): (1.4, 1.35e-4, 0.062, 4.5e-3, 7.6, 2.1e-3, 4.2e-3, 0.056, 0.74),
    ("adaptive", "minimum-jerk"): (1.2e-9, 7.5e-13, 1.5e-10, 7.9e-10, 1.2e-8, 3.6e-12, 9e-10, 1.8e-10, 4e-10),
    ("adaptive", "step"): (3.2e-4, 1.9e-8, 1.5e-5, 5.5e-7, 1.8e-3, 5.5e-7, 6.6e-7, 1.3e-5, 1.4e-4),
    ("semi-implicit-euler", "minimum-jerk"): (4.4e-4, 1.3e-7, 2.8e-4, 4.8e-4, 9e-3, 7.2e-6, 4.3e-4, 5.6e-4, 1.1e-4),
    ("semi-implicit-euler", "step"): (1.3, 1.8e-4, 0.048, 0.037, 4.2, 1.8e-3, 9.3e-3, 0.075, 0.37),
}
"""Largest deviations of the other columns, in the order of `GROUPS`, SI units, half as much again as was found.

`step` excites the lightly damped contact modes at t = 0: within the first 0.1 s a step of 1 ms resolves their phase
badly, which is what the large figures for forces are.
"""

COMPENSATION = [pytest.param(True, id="compensated"), pytest.param(False, id="uncompensated")]


@cache
def found(stepper: str, kind: str, compensation: bool) -> dict[str, float]:
    """Deviations of a run from its reference, by group of columns."""
    columns = run_reference(stepper, kind, compensation, STEP.get(stepper, 1e-3))
    return deviations(columns, read_reference(kind, compensation))


def test_every_stepper_is_compared() -> None:
    """Each stepper that ships has its bounds here, for both references."""
    assert set(POSE) == set(BOUNDS) == {(name, kind) for name in STEPPERS for kind in ("minimum-jerk", "step")}


def test_every_column_is_compared() -> None:
    """No column of the reference files but the time is left out, and each has a row every 10 ms for 2 s."""
    compared = {name for names in COLUMNS.values() for name in names}
    for kind in ("minimum-jerk", "step"):
        for compensation in (True, False):
            columns = read_reference(kind, compensation)
            assert set(columns) == compared | {"t_s"}
            np.testing.assert_allclose(columns["t_s"], np.linspace(0.0, 2.0, 201), atol=1e-12)


@pytest.mark.parametrize("compensation", COMPENSATION)
@pytest.mark.parametrize(("stepper", "kind"), list(POSE))
def test_object_follows_the_reference(stepper: str, kind: str, compensation: bool) -> None:
    """Over 2 s the object stays as near to the independent implementation as the stepper is meant to be."""
    deviation, (position, angle) = found(stepper, kind, compensation), POSE[stepper, kind]
    assert deviation["position [m]"] <= position
    assert deviation["orientation [rad]"] <= angle


@pytest.mark.parametrize("compensation", COMPENSATION)
@pytest.mark.parametrize(("stepper", "kind"), list(BOUNDS))
def test_all_other_columns_follow_the_reference(stepper: str, kind: str, compensation: bool) -> None:
    """Over 2 s forces, deformations, angles, joints, torques and friction stay within their bounds."""
    deviation = found(stepper, kind, compensation)
    bounds = dict(zip(GROUPS, BOUNDS[stepper, kind], strict=True))
    excess = {group: (deviation[group], bound) for group, bound in bounds.items() if not deviation[group] <= bound}
    assert not excess, "found and allowed"


def final_error(columns: dict[str, Array]) -> tuple[float, float]:
    """Largest error of a coordinate [m] and of an angle [rad] against target A at the end."""
    target = np.array([-0.010, 0.030, 0.127, *np.radians([-15.0, 15.0, 15.0])])
    names = COLUMNS["position [m]"] + COLUMNS["orientation [rad]"]
    error = np.abs(np.array([columns[name][-1] for name in names]) - target)
    return float(np.max(error[:3])), float(np.max(error[3:]))


def test_compensated_run_reaches_the_target() -> None:
    """With torsion compensation the error at the end is below 0.01 mm and 0.06 deg."""
    distance, angle = final_error(run_reference("midpoint", "minimum-jerk", True))
    assert distance < 0.01e-3
    assert angle < 0.06 * DEGREE


def test_uncompensated_run_keeps_a_steady_error() -> None:
    """Without torsion compensation an error of about 0.5 mm and 1.1 deg remains."""
    distance, angle = final_error(run_reference("midpoint", "minimum-jerk", False))
    assert distance == pytest.approx(0.5e-3, rel=0.2)
    assert angle == pytest.approx(1.1 * DEGREE, rel=0.1)
