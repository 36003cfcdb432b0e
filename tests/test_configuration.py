"""Moving configurations: against Pinocchio, and rates against differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hands import Array, Task, numerical_jacobian

from softhand.model.configuration import coordinate_rate, integrate, normalize
from softhand.numerics.spatial import rotation_of

ANGLES = [0.0, 1e-9, 1e-6, 0.99e-4, 1.01e-4, 1e-3, 0.1, 1.0, 3.0, 6.0]
"""Turned by the step [rad]; the series for small angles ends at 1e-4."""


def random_configuration(task: Task, rng: np.random.Generator) -> Array:
    """Any joint angles and any object pose."""
    model = task.world.model
    return pin.integrate(model, pin.neutral(model), rng.normal(0.0, 1.5, model.nv))


@pytest.mark.parametrize("angle", ANGLES)
def test_integrate_is_pinocchios(task: Task, angle: float, rng: np.random.Generator) -> None:
    """`integrate` is Pinocchio's, for revolute, continuous and free-flyer joints, for small and large angles."""
    model = task.world.model
    q, v, time = random_configuration(task, rng), rng.normal(0.0, 1.0, model.nv), 0.37
    v[-3:] *= angle / time / np.linalg.norm(v[-3:])
    v[:-6] *= angle / time
    out = np.full(model.nq, np.nan)
    integrate(task.world.joints, q, v, time, out)
    expected = pin.integrate(model, q, time * v)
    if expected[-4:] @ out[-4:] < 0.0:
        expected[-4:] *= -1.0
    np.testing.assert_allclose(out, expected, rtol=0.0, atol=1e-14 if angle < 1e-4 else 3e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-6, 0.3, 6.0])
def test_integrate_may_write_to_its_input(task: Task, angle: float, rng: np.random.Generator) -> None:
    """`integrate` gives the same when the result overwrites q."""
    model = task.world.model
    q, v = random_configuration(task, rng), angle * rng.normal(0.0, 1.0, model.nv)
    expected = np.empty(model.nq)
    integrate(task.world.joints, q, v, 1.0, expected)
    integrate(task.world.joints, q, v, 1.0, q)
    np.testing.assert_array_equal(q, expected)


def test_integrate_there_and_back_is_no_move(task: Task, rng: np.random.Generator) -> None:
    """Moving with v and then with -v returns to the start."""
    q, v = random_configuration(task, rng), rng.normal(0.0, 2.0, task.world.model.nv)
    out = np.empty_like(q)
    integrate(task.world.joints, q, v, 0.7, out)
    integrate(task.world.joints, out, v, -0.7, out)
    np.testing.assert_allclose(out, q, rtol=0.0, atol=1e-13)


def test_coordinate_rate_is_the_derivative_of_integrate(task: Task, rng: np.random.Generator) -> None:
    """`coordinate_rate` agrees with differences of `integrate`, quaternion and (cos, sin) included."""
    model, joints = task.world.model, task.world.joints
    q, v = random_configuration(task, rng), rng.normal(0.0, 2.0, model.nv)

    def moved(time: Array) -> Array:
        out = np.empty(model.nq)
        integrate(joints, q, v, time[0], out)
        return out

    rate = np.full(model.nq, np.nan)
    coordinate_rate(joints, q, v, rate)
    np.testing.assert_allclose(rate, numerical_jacobian(moved, 1, 1e-5)[:, 0], rtol=0.0, atol=1e-8)


def test_normalize_brings_lengths_to_one(task: Task, rng: np.random.Generator) -> None:
    """`normalize` scales quaternions and (cos, sin) pairs to length one and leaves the rest alone."""
    model, joints = task.world.model, task.world.joints
    q = random_configuration(task, rng)
    stretched = q.copy()
    for _, i, j in joints:
        width = {1: 1, 2: 2, 7: 4}[int(model.joints[int(np.flatnonzero(joints[:, 2] == j)[0]) + 1].nq)]
        if width > 1:
            start = i + 3 if width == 4 else i
            stretched[start : start + width] *= rng.uniform(0.5, 2.0)
    assert np.max(np.abs(stretched - q)) > 1e-3
    normalize(joints, stretched)
    np.testing.assert_allclose(stretched, q, rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("rpy", [(0.3, -0.4, 2.9), (-3.0, 1.5, 0.1), (0.0, 0.0, 0.0), (2.0, -1.2, -2.0)])
def test_rotation_of_turns_about_z_then_y_then_x(rpy: tuple[float, float, float]) -> None:
    """`rotation_of` is R_z(yaw) R_y(pitch) R_x(roll)."""
    roll, pitch, yaw = (pin.AngleAxis(angle, axis).matrix() for angle, axis in zip(rpy, np.eye(3), strict=True))
    np.testing.assert_allclose(rotation_of(rpy), yaw @ pitch @ roll, rtol=0.0, atol=1e-15)
