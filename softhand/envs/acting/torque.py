"""Joint torques as actions."""

from __future__ import annotations

import numpy as np

from softhand.batch.worlds import Worlds
from softhand.envs.acting.acting import Acting
from softhand.envs.acting.commanded import Commanded
from softhand.numerics.arrays import AnyArray, Array

TORQUE = 0.1
"""[N m], or [N] of a joint that slides, for an action of 1 of the kind `torque`; of `plain-torque` it is the limit."""


class TorqueActing(Acting):
    """tau = N_F + tau_0 + 0.1 N m times the action - K_d q'; tau_0 are the torques that hold the object at rest."""

    law = Commanded(K_d=0.03)

    def __init__(self, worlds: Worlds, goals: Array, begins_open: bool) -> None:
        super().__init__(worlds, goals, begins_open)
        run = worlds.runs[0]
        self.size = worlds.sizes.n
        self._scale = self.scale(run.observation.effort_limit)
        self._base, self._now = np.zeros((len(worlds.runs), self.size)), np.zeros((len(worlds.runs), self.size))
        self.limits = np.ones(self.size)

    @staticmethod
    def scale(effort_limit: Array) -> Array:
        """What an action of 1 is [N m or N], shape (n,)."""
        return np.minimum(TORQUE, effort_limit)

    @staticmethod
    def commands(joints: int) -> int:
        """Torques alone."""
        return joints

    def begin(self, index: int) -> None:
        """Take tau_0."""
        self._base[index], self._now[index] = holding(self.worlds, index), 0.0
        self.worlds.commands[index] = self._base[index]

    def act(self, actions: Array, goes: AnyArray) -> None:
        """Hold these torques."""
        self._now[goes] = actions[goes]
        self.worlds.commands[goes] = (self._base + self._scale * actions)[goes]

    def asked(self) -> Array:
        """The last action."""
        return self._now


class PlainTorqueActing(TorqueActing):
    """tau = effort limit times the action, and nothing else."""

    law = Commanded(gravity=0.0, K_d=0.0)

    @staticmethod
    def scale(effort_limit: Array) -> Array:
        """The effort limits."""
        return effort_limit.copy()

    def begin(self, index: int) -> None:
        """From no torque."""
        self._now[index] = 0.0


class JointActing(TorqueActing):
    """Joint set points on springs: each action moves them by up to 0.02 rad, or 2 mm of a joint that slides.

    tau = N_F + tau_0 + K_p (q_told - q) - K_d q', with tau_0 as above.
    """

    law = Commanded(K_p=3.0, K_d=0.08)
    _FARTHEST = 0.5  # from the start

    @staticmethod
    def commands(joints: int) -> int:
        """Torques and positions."""
        return 2 * joints

    @staticmethod
    def scale(effort_limit: Array) -> Array:
        """Of one action [rad or m]."""
        return np.full(effort_limit.shape, 0.02)

    def begin(self, index: int) -> None:
        """From the joint positions of the start."""
        n, law = self.size, self.worlds.runs[index].law
        assert law is not None
        self._now[index] = 0.0
        self._base[index] = law.memory[n : 2 * n]
        self.worlds.commands[index, :n], self.worlds.commands[index, n:] = (
            holding(self.worlds, index),
            self._base[index],
        )

    def act(self, actions: Array, goes: AnyArray) -> None:
        """Move the set points."""
        self._now[goes] = np.clip((self._now + self._scale * actions)[goes], -self._FARTHEST, self._FARTHEST)
        self.worlds.commands[goes, self.size :] = (self._base + self._now)[goes]


def holding(worlds: Worlds, index: int) -> Array:
    """J_CF^T C_F, what the joints of a world do at its start beside holding the hand itself [N m or N], shape (n,).

    The moments of the tips, where their laws have any, are in it.
    """
    seen = worlds.runs[index].observation
    force, torsion = seen.contact_force[:, :3].ravel(), seen.contact_force[:, 3]
    held: Array = seen.hand_force_jacobian.T @ force + seen.hand_torsion_jacobian.T @ torsion
    return held - worlds.runs[index].plant.moment_force()[: len(held)]
