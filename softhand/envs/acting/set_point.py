"""Set points of the object's pose as actions: the reference of the law that holds the object is moved."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from softhand.batch.worlds import Worlds
from softhand.controllers.linear_set_point import FARTHEST, MOVE
from softhand.envs.acting.acting import Acting, stepped
from softhand.numerics.arrays import AnyArray, Array

OPEN, SQUEEZE = 5e-4, 0.1
"""[m] and [N] of one action of 1."""
_OPENINGS, _SQUEEZES = (-0.004, 0.02), (0.0, 10.0)
_CARRIES = (0.3, 3.0)  # [N] mean squeeze from which on the fingers carry some, and all, of the weight


class SetPointActing(Acting):
    """Each action moves the desired pose by up to 1 mm and 0.01 rad along and about the axes of the base.

    Where the fingers start open there are two numbers more: by how much the desired opening of the fingers changes, up
    to 0.5 mm, and the desired squeeze, up to 0.1 N between each pair. The fingers carry the weight once they squeeze:
    some of it from 0.3 N on, all of it from 3 N on.
    """

    holds = True

    def __init__(self, worlds: Worlds, goals: Array, begins_open: bool) -> None:
        super().__init__(worlds, goals, begins_open)
        count, self.size = len(worlds.runs), 8 if begins_open else 6
        self._start = np.zeros((count, 6))
        self._offset, self._grip = np.zeros((count, 6)), np.zeros((count, 2))
        self.limits = np.array([10.0, 10.0, 10.0, 4.0, 4.0, 4.0, 0.02, 10.0])[: self.size]

    def begin(self, index: int) -> None:
        """From where the start is."""
        wanted = self.worlds.wanted[index]
        pairs = self.worlds.sizes.pairs
        self._start[index], self._offset[index] = wanted[:6], 0.0
        self._grip[index] = wanted[6 + pairs], 0.0
        if self.begins_open:
            wanted[7 + pairs] = 0.0

    def act(self, actions: Array, goes: AnyArray) -> None:
        """Move what is asked for."""
        self.move(MOVE * actions[:, :6], goes)
        if not self.begins_open:
            return
        pairs, wanted = self.worlds.sizes.pairs, self.worlds.wanted
        lowest, highest = zip(_OPENINGS, _SQUEEZES, strict=True)
        stepped(self._grip, np.array([OPEN, SQUEEZE]) * actions[:, 6:], goes, np.array(lowest), np.array(highest))
        squeeze = self._grip[goes, 1]
        wanted[goes, 6 : 6 + pairs] = squeeze[:, None]
        wanted[goes, 6 + pairs] = self._grip[goes, 0]
        wanted[goes, 7 + pairs] = np.clip((squeeze - _CARRIES[0]) / (_CARRIES[1] - _CARRIES[0]), 0.0, 1.0)

    def move(self, change: Array, goes: AnyArray) -> None:
        """Move the desired pose [m, rad], shape (worlds, 6)."""
        stepped(self._offset, change, goes, -FARTHEST, FARTHEST)
        wanted = self.worlds.wanted
        wanted[goes, :3] = (self._start + self._offset)[goes, :3]
        start = Rotation.from_euler("xyz", self._start[goes, 3:])
        wanted[goes, 3:6] = (Rotation.from_rotvec(self._offset[goes, 3:]) * start).as_euler("xyz")

    def asked(self) -> Array:
        """How far the set point is off the object: position [m], rotation vector [rad]; opening [m], squeeze [N]."""
        wanted, pose = self.worlds.wanted, self.worlds.seen["configuration"][:, -7:]
        turn = Rotation.from_euler("xyz", wanted[:, 3:6]) * Rotation.from_quat(pose[:, 3:]).inv()
        ahead = np.hstack([wanted[:, :3] - pose[:, :3], turn.as_rotvec()])
        return np.hstack([ahead, self._grip]) if self.begins_open else ahead
