"""Gravity at the joints from what a step has at hand: poses and Jacobians of Pinocchio."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.numerics.compiled import compiled

BODY = np.dtype(
    [
        ("parent", np.int64),  # index of the joint before
        ("column", np.int64),  # first velocity of this joint
        ("width", np.int64),  # how many it has
        ("mass", np.float64),  # [kg]
        ("lever", np.float64, 3),  # centre of mass in the joint frame [m]
    ]
)
"""What each joint of a model carries."""


def list_bodies(model: pin.Model) -> NDArray[np.void]:
    """Table `BODY` of a model, one row a joint, the universe included."""
    bodies = np.zeros(model.njoints, BODY)
    for index in range(1, model.njoints):
        joint, inertia = model.joints[index], model.inertias[index]
        bodies[index] = (model.parents[index], joint.idx_v, joint.nv, inertia.mass, inertia.lever)
    return bodies


@compiled
def gravity_forces(bodies, acceleration, poses, J, moments, out):
    """out = N(q): what holds the bodies against gravity.

        N_k = -sum over the bodies b that velocity k moves of m_b g . (J_k at the centre of mass of b)

    Args:
        bodies: table `BODY`, shape (joints,).
        acceleration: g in the world frame [m/s^2], shape (3,).
        poses: `Snapshot.poses`, shape (joints, 12).
        J: `Snapshot.J`; its columns of all joints.
        moments: scratch, mass and first moment of all that a joint carries, shape (joints, 4).
        out: shape (nv,).
    """
    for b in range(bodies.shape[0]):
        body, pose = bodies[b], poses[b]
        c = body.lever
        moments[b, 0] = body.mass
        for row in range(3):
            centre = pose[9 + row] + pose[row] * c[0] + pose[3 + row] * c[1] + pose[6 + row] * c[2]
            moments[b, 1 + row] = body.mass * centre
    gx, gy, gz = acceleration[0], acceleration[1], acceleration[2]
    for b in range(bodies.shape[0] - 1, 0, -1):
        body = bodies[b]
        mass, x, y, z = moments[b, 0], moments[b, 1], moments[b, 2], moments[b, 3]
        tx, ty, tz = y * gz - z * gy, z * gx - x * gz, x * gy - y * gx
        for k in range(body.column, body.column + body.width):
            linear = gx * J[0, k] + gy * J[1, k] + gz * J[2, k]
            out[k] = -mass * linear - (tx * J[3, k] + ty * J[4, k] + tz * J[5, k])
        for k in range(4):
            moments[body.parent, k] += moments[b, k]
