"""Fingertips of a bare hand as functions of its motors: centre of each ball, the way out of it, and their slopes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pinocchio as pin

from softhand.model.coupling import read_coupling
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

RESERVE = 0.05
"""Share of its range that a motor keeps from its limits."""


class TipOnBody(NamedTuple):
    """A soft tip on a body of the hand, all in the frame of the joint that moves it."""

    joint: int
    """Index in the model; 0 for the base."""
    centre: Array
    """Of the ball [m], shape (3,)."""
    out: Array
    """Out of the tip, a unit vector, shape (3,)."""
    radius: float
    """[m]"""
    points: Array = np.empty((0, 3))
    """Of the shapes of the body [m], shape (points, 3)."""

    def overhang(self, way: Array) -> float:
        """How far the body reaches beyond the ball [m], along a unit vector of its frame."""
        if not len(self.points):
            return 0.0
        return float(np.max(self.points @ way) - self.centre @ way - self.radius)


class Tips(NamedTuple):
    """All tips at one posture."""

    centres: Array
    """In the frame of the root [m], shape (tips, 3)."""
    out: Array
    """Unit vectors, shape (tips, 3)."""
    centre_slopes: Array
    """By the motors, shape (tips, 3, n)."""
    out_slopes: Array
    """Shape (tips, 3, n)."""
    axes: Array
    """Of the bodies that carry the tips, shape (tips, 3, 3)."""


class Fingers:
    """A hand without tips and object, moved by its motors.

    Attributes:
        lower: limits of the motors [rad or m], endless ones at -pi, shape (n,).
        upper: likewise.
        rest: where motors stay that nothing asks for: at zero, or where zero is out of range amid it.
        n: count of the motors.
    """

    def __init__(self, hand: Urdf, model: pin.Model) -> None:
        """Read what moves what.

        Raises:
            ScenarioError: joints that follow others leave a motor no range.
        """
        self.hand, self.model, self._data = hand, model, model.createData()
        coupling = read_coupling(hand, model, None, 1.0)
        joints = list(model.joints)[1:]
        if coupling is None:
            self.names: tuple[str, ...] = tuple(model.names)[1:]
            self.S, self._offset = np.eye(len(joints)), np.zeros(len(joints))
            limits = np.array([
                (-math.inf, math.inf) if joint.nq == 2
                else (model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q])
                for joint in joints
            ]).reshape(-1, 2).T  # fmt: skip
        else:
            self.names, self.S, self._offset, limits = coupling.motors, coupling.S, coupling.offset, coupling.limits
        self.is_coupled = coupling is not None
        self.lower, self.upper = np.maximum(limits[0], -math.pi), np.minimum(limits[1], math.pi)
        self.n = len(self.lower)
        reserve = RESERVE * (self.upper - self.lower)
        self.low, self.high = self.lower + reserve, self.upper - reserve
        within = (self.lower <= 0.0) & (self.upper >= 0.0)
        self.rest = np.where(within, np.clip(0.0, self.low, self.high), 0.5 * (self.lower + self.upper))

    def movers(self, joint: int) -> np.ndarray:
        """Which motors move the body of a joint, shape (n,)."""
        moved = np.zeros(len(self._offset), bool)
        for index in list(self.model.supports[joint])[1:]:
            moved[index - 1] = True
        return np.asarray(np.any(self.S[moved] != 0.0, axis=0))

    def configuration(self, motors: Array) -> Array:
        """q of Pinocchio of motor positions."""
        angles = self.S @ motors + self._offset
        q = pin.neutral(self.model)
        for k, joint in enumerate(list(self.model.joints)[1:]):
            if joint.nq == 2:
                q[joint.idx_q : joint.idx_q + 2] = math.cos(angles[k]), math.sin(angles[k])
            else:
                q[joint.idx_q] = angles[k]
        return q

    def at(self, motors: Array, tips: Sequence[TipOnBody], with_slopes: bool = True) -> Tips:
        """Where tips are."""
        model, data = self.model, self._data
        q = self.configuration(motors)
        if with_slopes:
            pin.computeJointJacobians(model, data, q)
        else:
            pin.forwardKinematics(model, data, q)
        count = len(tips)
        centres, out = np.empty((count, 3)), np.empty((count, 3))
        axes = np.empty((count, 3, 3))
        of_centres, of_out = np.zeros((count, 3, self.n)), np.zeros((count, 3, self.n))
        for i, tip in enumerate(tips):
            pose = data.oMi[tip.joint]
            axes[i] = pose.rotation
            centres[i], out[i] = pose.translation + pose.rotation @ tip.centre, pose.rotation @ tip.out
            if with_slopes and tip.joint:
                columns = [model.joints[index].idx_v for index in list(model.supports[tip.joint])[1:]]
                rows = [index - 1 for index in list(model.supports[tip.joint])[1:]]
                J, S = data.J[:, columns], self.S[rows]
                of_centres[i] = (J[:3] - pin.skew(centres[i]) @ J[3:]) @ S
                of_out[i] = -pin.skew(out[i]) @ J[3:] @ S
        return Tips(centres, out, of_centres, of_out, axes)
