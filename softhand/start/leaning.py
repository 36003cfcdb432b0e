"""Moments of the tips at a start: the wrench on the object that laws with an energy of the lean add to the forces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from softhand.contact.pads import Fingertip
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.plant.dynamics import add_contact_force, add_contact_moment
from softhand.plant.plant import Plant

TURNS = 60
"""Most of the turns in which forces and moments are brought into balance."""
_BALANCED, _NEARLY = 1e-13, 1e-9  # change in the last turn over the largest force; what rounding may leave of it


class Leant(NamedTuple):
    """What a grasp whose tips have moments asks for."""

    forces: Array
    """On the object, in the world [N], shape (nc, 3)."""
    torque: Array
    """Of the joints by moments and torsions, beside J^T f and gravity [N m, N], shape (n,)."""


class Leaning:
    """The moments of a hand that holds an object at rest; all zero where no law has any.

    Attributes:
        wrench: on the object, force [N] and moment about the object frame [N m] in the world, shape (6,).
        torque: what they and the torsions ask of the joints [N m, N], shape (n,).
        leant: forces that are in balance with them, and that torque; None where no law has a moment.
        slopes: dU/dlean of the law at each tip, before it relaxes [J], shape (nc, 2).
        change: of the wrench in the last turn, moments over the radius of a tip [N].
    """

    def __init__(self, world: World, fingertips: Sequence[Fingertip]) -> None:
        self._world, self._fingertips = world, fingertips
        self.are_any = any(tip.law.moment is not None for tip in fingertips)
        self._plant: Plant | None = None
        self.wrench, self.torque = np.zeros(6), np.zeros(world.n_joints)
        self.slopes = np.zeros((len(fingertips), 2))
        self.leant: Leant | None = None
        self.change = np.inf
        self._scale = np.repeat([1.0, 1.0 / max(tip.law.radius for tip in fingertips)], 3)

    def update(self, q: Array, z: Array, forces: Array) -> bool:
        """The moments at a grasp.

        Args:
            q: hand and object, shape (nq,).
            z: of a `State`, shape (nc, memory).
            forces: as of `contact_loads`, shape (nc, 4).

        Returns:
            Whether they are what the forces were found with.
        """
        world = self._world
        if self._plant is None:
            self._plant = Plant(world, self._fingertips)
        plant, nv = self._plant, world.nv
        plant.update(q, np.zeros(nv), z)
        by_moments, by_torsions = np.zeros(nv), np.zeros(nv)
        for k, tip in enumerate(self._fingertips):
            touch = plant.columns[k], plant.contact_columns[k]
            self.slopes[k] = plant.contacts["lean_force"][k]
            add_contact_moment(*touch, tip.damping.relaxed() * self.slopes[k], by_moments)
            add_contact_force(*touch, np.array([0.0, 0.0, 0.0, forces[k, 3]]), by_torsions)
        R, wrench, change = world.object_rotation(q), self.wrench, self.change
        self.wrench = np.concatenate([R @ by_moments[-6:-3], R @ by_moments[-3:]])
        self.torque = -(by_moments + by_torsions)[: world.n_joints]
        self.change = float(np.max(np.abs(self._scale * (self.wrench - wrench))))
        self.leant, size = Leant(forces[:, :3].copy(), self.torque), float(np.max(np.abs(forces[:, :3])))
        return self.change <= _BALANCED * size or 0.5 * change <= self.change <= _NEARLY * size
