"""Blind manipulation: the fingertips stand for the object that they hold."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.blocks import hold_joints, push_tips, turn_error
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal
from softhand.controllers.tips import attract, cross, need_fingers, radii, strength
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import set_rotation
from softhand.numerics.triples import dot, length
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, NonNegative


class Blind(Controller):
    """Blind manipulation, in the manner of Tahara and Arimoto: a virtual object frame from the tips, no sensing.

        u_i = f_d / sum(r) sum_j J_i^T (x_j - x_i) - C_i q_i' + K_p J_i^T (x_d - x_v) / nc
              + K_o J_W,i^T log(R_vd R_v^T) + N_F,i - J_i^T m g / nc

    x_i is the centre of a flat face, J_i its Jacobian. The virtual frame has x_v = mean of x_i, r_z along
    (x_3 - x_1) x (x_2 - x_1), r_y along x_1 - x_2, r_x = r_y x r_z; these are the columns of R_v. J_W,i is the share of
    finger i in its angular velocity, so that K_p and K_o are springs of the virtual frame and the law is passive. Its
    desired pose is its pose at the start moved as the object shall be moved: the pose of the object is used once, at
    the start. The first term pulls all tips together; f_d is chosen so that at the start the mean of
    f_d |x_j - x_i| / sum(r) is that of f_Nd.
    Structure: certain; the details of the original, among them which Jacobian J_W,i is, are not. Three fingers or more.
    Tips that roll and give way move against the object: an error remains that joint sensing cannot see.
    """

    K_p: NonNegative = 200.0
    """Stiffness of the virtual position [N/m]."""
    K_o: NonNegative = 0.3
    """Stiffness of the virtual attitude [N m/rad]."""
    mass: NonNegative = 0.2
    """Mass of the object, which the fingers carry in equal parts [kg]."""
    damping: Gain = 0.005
    """Damping C of the joints [N m s/rad or N s/m], one number or one a joint."""

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return blind

    def constants(self, observation: Observation) -> Gains:
        """The gains, and what the fingers carry."""
        C = diagonal("damping", self.damping, observation.joint_position.shape[0])
        return Gains(C, self.K_p, self.K_o, -self.mass * observation.gravity)

    def start(self, observation: Observation) -> Any:
        """The virtual frame in the object at the start, and f_d / sum(r) for squeezes of 1 N."""
        need_fingers("blind", observation, 3)
        centre, axes, R = np.empty(3), np.empty((3, 3)), observation.object_rotation
        virtual_frame(observation.tip_position, centre, axes)
        per_newton = strength(observation, np.ones_like(observation.internal_force)) / radii(observation).sum()
        arm = R.T @ (centre - observation.object_position)
        return np.concatenate([[per_newton], arm, (R.T @ axes).ravel()])


class Gains(NamedTuple):
    """The settings of `Blind`."""

    C: Array
    K_p: float
    K_o: float
    lift: Array
    """What carries the object [N], shape (3,)."""


@compiled
def blind(observed, known, memory, torque):
    """The law of the class; `memory` as `start` returns it."""
    x, desired = observed.tip_position, observed.object_coordinates_desired
    nc, squeeze = x.shape[0], 0.0
    centre, moment, R = np.empty(3), np.empty(3), np.empty((3, 3))
    axes, wanted, B = np.empty((3, 3)), np.zeros((3, 3)), np.empty((3, 3, 3))
    forces = np.empty((nc, 3))
    virtual_frame(x, centre, axes)
    set_rotation(desired[3:6], R)
    for row in range(3):
        away = desired[row] - centre[row]
        for k in range(3):
            away += R[row, k] * memory[1 + k]
            for i in range(3):
                wanted[row, i] += R[row, k] * memory[4 + 3 * k + i]
        for i in range(nc):
            forces[i, row] = (known.K_p * away + known.lift[row]) / nc
    turn_error(axes, wanted, moment)
    virtual_turning(x, axes, B)
    for i in range(3):
        for k in range(3):
            forces[i, k] += known.K_o * dot(B[i, :, k], moment)
    for k in range(observed.internal_force_desired.shape[0]):
        squeeze += observed.internal_force_desired[k] / observed.internal_force_desired.shape[0]
    attract(x, memory[0] * squeeze, forces)
    hold_joints(observed.gravity_torque, known.C, observed.joint_velocity, torque)
    push_tips(observed.tip_jacobian, forces, torque)


@compiled
def virtual_frame(x, centre, axes):
    """x_v [m], shape (3,), of all tips, and axes r_x, r_y, r_z as columns, shape (3, 3), of the first three."""
    side = x[2, 0] - x[0, 0], x[2, 1] - x[0, 1], x[2, 2] - x[0, 2]
    line = x[0, 0] - x[1, 0], x[0, 1] - x[1, 1], x[0, 2] - x[1, 2]
    normal = cross(line, side)  # (x_3 - x_1) x (x_2 - x_1)
    across, along = cross(line, normal), length(line)
    for k in range(3):
        axes[k, 0] = across[k] / (along * length(normal))
        axes[k, 1], axes[k, 2] = line[k] / along, normal[k] / length(normal)
        centre[k] = 0.0
        for i in range(x.shape[0]):
            centre[k] += x[i, k] / x.shape[0]


@compiled
def virtual_turning(x, axes, B):
    """Angular velocity of the virtual frame from the velocities of the first three tips: w = sum B_i x_i'.

    Args:
        x: tip centres [m], shape (nc, 3).
        axes: of `virtual_frame`, shape (3, 3).
        B: set, [rad/s] in world axes from [m/s], shape (3, 3, 3).
    """
    side = x[2, 0] - x[0, 0], x[2, 1] - x[0, 1], x[2, 2] - x[0, 2]
    line = math.sqrt((x[0, 0] - x[1, 0]) ** 2 + (x[0, 1] - x[1, 1]) ** 2 + (x[0, 2] - x[1, 2]) ** 2)
    along, across = dot(axes[:, 1], side) / line, dot(axes[:, 0], side)
    for row in range(3):
        for k in range(3):
            # of the velocity of tip 1 less that of tip 2
            first = (axes[row, 0] * axes[k, 2] - axes[row, 2] * axes[k, 0]) / line
            # of the velocity of the line beside tip 3 less that of tip 3
            third = axes[row, 1] * axes[k, 2] / across
            B[0, row, k] = first + (1.0 + along) * third
            B[1, row, k] = -first - along * third
            B[2, row, k] = -third
