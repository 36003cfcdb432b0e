"""Internal forces as actions: how hard the fingers squeeze, while the law carries the object to its goal."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from softhand.batch.worlds import Worlds
from softhand.controllers.linear_set_point import MOVE
from softhand.envs.acting.acting import stepped
from softhand.envs.acting.set_point import SetPointActing
from softhand.numerics.arrays import AnyArray, Array

FORCE = 0.2
"""[N] of one action of 1."""
FORCES = (0.2, 12.0)
"""Lowest and highest [N]."""


class InternalForceActing(SetPointActing):
    """Each action changes the desired internal force between each pair of contacts by up to 0.2 N.

    The desired pose goes to the goal by itself, as fast as `set-point` could move it.
    """

    def __init__(self, worlds: Worlds, goals: Array, begins_open: bool) -> None:
        super().__init__(worlds, goals, False)
        self.size = worlds.sizes.pairs
        self._force = np.zeros((len(worlds.runs), self.size))
        self.limits = np.full(self.size, FORCES[1])

    def begin(self, index: int) -> None:
        """From the squeeze of the start."""
        super().begin(index)
        self._force[index] = self.worlds.wanted[index, 6 : 6 + self.size]

    def act(self, actions: Array, goes: AnyArray) -> None:
        """Change the squeeze, and go on to the goal."""
        stepped(self._force, FORCE * actions, goes, *FORCES)
        self.worlds.wanted[goes, 6 : 6 + self.size] = self._force[goes]
        start = Rotation.from_euler("xyz", self._start[:, 3:])
        turn = (Rotation.from_quat(self.goals[:, 3:]) * start.inv()).as_rotvec()
        ahead = np.hstack([self.goals[:, :3] - self._start[:, :3], turn]) - self._offset
        self.move(np.clip(ahead, -MOVE, MOVE), goes)

    def asked(self) -> Array:
        """The desired internal forces [N]."""
        return self._force
