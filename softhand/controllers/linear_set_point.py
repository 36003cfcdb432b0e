"""A linear policy as a controller: what was learned in an environment, for runs, films and comparisons."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, NamedTuple

import numpy as np
from pydantic import field_validator
from scipy.spatial.transform import Rotation

from softhand.controllers.blocks import (
    add_internal_forces,
    add_pose_spring,
    add_torsion,
    feed_back_internal_forces,
    hold_joints,
    pose_error,
    push_contacts,
    share_wrench,
    take_off_torsion,
    turn_error,
)
from softhand.controllers.controller import Controller
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import set_rotation, set_rpy, turn_rotation
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain, Vector

SHAPE = 6, 18
"""Moves and features of a policy."""
MOVE = np.array([1e-3, 1e-3, 1e-3, 0.01, 0.01, 0.01])
"""Largest move of a set point in one action [m, rad]."""
FARTHEST = np.array([0.05, 0.05, 0.05, 0.6, 0.6, 0.6])
"""Of a set point from the start [m, rad]."""

SCALE = np.array([0.01] * 3 + [0.17] * 3 + [0.01] * 3 + [0.17] * 3 + [0.1] * 3 + [1.0] * 3)
"""Of the features [m, rad, m, rad, m/s, rad/s]."""


def features(observation: Mapping[str, Array]) -> Array:
    """What a policy is told: how far the goal is, how far the set point is, how the object moves; divided by `SCALE`.

    Args:
        observation: of `ReorientBox` or `HoldBox` with the action `set-point`, of one world or of many.

    Returns:
        Shape (..., 18): missing position and turn, position and turn of the set point from the object, twist; all in
        axes of the base.
    """
    seen, now, goal = (observation[name] for name in ("observation", "achieved_goal", "desired_goal"))
    turn = Rotation.from_quat(goal[..., 3:]) * Rotation.from_quat(now[..., 3:]).inv()
    joints = (seen.shape[-1] - 12) // 2
    twist, ahead = seen[..., 2 * joints : 2 * joints + 6], seen[..., 2 * joints + 6 :]
    return np.concatenate([goal[..., :3] - now[..., :3], turn.as_rotvec(), ahead, twist], axis=-1) / SCALE


class LinearSetPoint(Controller):
    """A learned policy over the law of the paper: each 10 ms the set point of (59) moves by what a matrix says.

        move = clip(W phi, -1, 1) (1 mm, 10 mrad)

    phi are the `features`: missing position and turn to the desired pose of the reference, then to the set point, twist
    of the object. From the set point on it is `regulation`. A matrix does the same here and in the environment.
    """

    weights: Vector
    """W, row by row: 6 moves by 18 features [1]."""
    hold: int = 10
    """Calls for which a move is held."""
    K_O_position: Gain = 100.0
    """As in `regulation` [N/m]."""
    K_O_orientation: Gain = 0.3
    """As in `regulation` [N m/rad]."""
    K_v: Gain = 0.03
    """As in `regulation` [N m s/rad or N s/m]."""
    K_N: Gain = 1.0
    """As in `regulation` [1]."""

    shape: ClassVar[tuple[int, int]] = SHAPE
    """Of the matrix: moves, features."""

    @field_validator("weights")
    @classmethod
    def _is_a_matrix(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(value) != SHAPE[0] * SHAPE[1]:
            raise ValueError(f"got {len(value)} numbers; give {SHAPE[0] * SHAPE[1]}, {SHAPE[0]} rows of {SHAPE[1]}.")
        return value

    @field_validator("hold")
    @classmethod
    def _is_some(cls, value: int) -> int:
        if value < 1:
            raise ValueError(f"got {value}; give a whole number, at least 1.")
        return value

    @staticmethod
    def actions(weights: Array, observation: Mapping[str, Array]) -> Array:
        """The same in an environment: actions from -1 to 1.

        Args:
            weights: one matrix, shape (6, 18), or one for each world, shape (worlds, 6, 18).
            observation: as `features` takes it.
        """
        return np.clip(np.einsum("...ij,...j->...i", weights, features(observation)), -1.0, 1.0)

    @property
    def formula(self) -> Any:  # type: ignore[override]
        """The law of the class."""
        return linear_set_point

    def constants(self, observation: Observation) -> Matrix:
        """The matrix and the gains."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        return Matrix(
            np.array(self.weights).reshape(SHAPE) / SCALE,
            MOVE.copy(),
            FARTHEST.copy(),
            float(self.hold),
            pose_diagonal("K_O", self.K_O_position, self.K_O_orientation),
            diagonal("K_v", self.K_v, n),
            diagonal("K_N", self.K_N, pairs),
        )

    def start(self, observation: Observation) -> Any:
        """No call so far, no offset, the pose of the start, the set point there."""
        start = np.concatenate([observation.object_position, observation.object_rpy])
        return np.concatenate([[0.0], np.zeros(6), start, start])


class Matrix(NamedTuple):
    """The settings of `LinearSetPoint`."""

    W: Array
    """By plain features [m, rad, m/s, rad/s], shape (6, 18)."""
    move: Array
    """[m, rad], shape (6,)."""
    farthest: Array
    """[m, rad], shape (6,)."""
    hold: float
    """Calls."""
    K_O: Array
    """[N/m, N m/rad], shape (6,)."""
    K_v: Array
    """[N m s/rad], shape (n,)."""
    K_N: Array
    """Shape (np,)."""


@compiled
def linear_set_point(observed, known, memory, torque):
    """The law of the class; `memory` as `start` returns it."""
    offset, start, point = memory[1:7], memory[7:13], memory[13:19]
    if memory[0] % known.hold == 0.0:
        _move(observed, known, offset, start, point)
    memory[0] += 1.0
    error, squeeze = np.empty(6), np.empty(known.K_N.shape[0])
    wrench, forces = np.empty(6), np.empty(observed.hand_force_jacobian.shape[0])
    torsion = observed.contact_force[:, 3]
    pose_error(observed.object_coordinates, observed.object_rotation, point, error)
    for k in range(6):
        wrench[k] = observed.object_gravity[k]
    add_pose_spring(known.K_O, error, observed.object_rotation, wrench)
    take_off_torsion(observed.object_torsion_jacobian, torsion, wrench)
    share_wrench(observed.object_force_jacobian, wrench, forces)
    feed_back_internal_forces(observed.internal_force, observed.internal_force_desired, known.K_N, squeeze)
    add_internal_forces(observed.internal_force_basis, squeeze, forces)
    hold_joints(observed.gravity_torque, known.K_v, observed.joint_velocity, torque)
    push_contacts(observed.hand_force_jacobian, forces, torque)
    add_torsion(observed.hand_torsion_jacobian, torsion, torque)


@compiled
def _move(observed, known, offset, start, point):
    """Ask the matrix, and move the set point."""
    phi, turned, wanted = np.empty(18), np.empty((3, 3)), np.empty((3, 3))
    position, goal = observed.object_coordinates, observed.object_coordinates_desired
    set_rotation(goal[3:6], wanted)
    turn_error(observed.object_rotation, wanted, phi[3:6])
    set_rotation(point[3:6], wanted)
    turn_error(observed.object_rotation, wanted, phi[9:12])
    for k in range(3):
        phi[k], phi[6 + k] = goal[k] - position[k], point[k] - position[k]
    for k in range(6):
        phi[12 + k] = observed.object_twist[k]
    for i in range(6):
        action = 0.0
        for j in range(18):
            action += known.W[i, j] * phi[j]
        action = min(max(action, -1.0), 1.0)
        offset[i] = min(max(offset[i] + known.move[i] * action, -known.farthest[i]), known.farthest[i])
    for k in range(3):
        point[k] = start[k] + offset[k]
    set_rotation(start[3:6], wanted)
    turn_rotation(offset[3], offset[4], offset[5], wanted, turned)
    set_rpy(turned, point[3:6])
