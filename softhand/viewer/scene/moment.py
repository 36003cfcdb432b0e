"""One instant of a grasp, as the scene needs it, and what a picture shows of the time before."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import Array


@dataclass(frozen=True)
class Moment:
    """Copies of what there is to see at one time. SI units, world axes; nc contacts, ns supports."""

    time: float
    joint_position: Array
    object_pose: Array
    """Shape (4, 4)."""
    desired_pose: Array
    tip_position: Array
    contact_point: Array
    contact_rotation: Array
    contact_force: Array
    contact_angles: Array
    deformation: Array
    friction_use: Array
    internal_force: Array
    support_point: Array
    """Shape (ns, 3)."""
    support_force: Array
    """As recorded, on the base of each support, but in the world [N], shape (ns, 3)."""
    tactile_normal_force: Array = field(default_factory=lambda: np.zeros((0, 0)))
    """Of the taxels [N], shape (nc, taxels)."""

    @property
    def distance(self) -> Array:
        """R of each contact, from the centre of the flat face to the object's face [m], shape (nc,)."""
        reach = self.contact_point - self.tip_position
        distance: Array = np.einsum("ik,ik->i", reach, self.contact_normal)
        return distance

    @property
    def contact_normal(self) -> Array:
        """Out of each tip into the object, unit vectors, shape (nc, 3)."""
        return self.contact_rotation[:, :, 2]

    @property
    def contact_on_object(self) -> Array:
        """Contact points in the object frame [m], shape (nc, 3)."""
        return (self.contact_point - self.object_pose[:3, 3]) @ self.object_pose[:3, :3]


CONTACT_FIELDS = (
    "tip_position", "contact_point", "contact_rotation", "contact_force", "contact_angles", "deformation",
    "friction_use", "internal_force",
)  # fmt: skip
"""Of a `Moment`, those that recordings and observations have by the same names."""


class Past(NamedTuple):
    """What a picture shows of the time before its moment."""

    path: Array
    """Contact points so far in the object frame [m], the last one now, shape (samples, nc, 3)."""
    since_slip: Array
    """Time since each tip slipped, 0 while it slips, infinite if it did not [s], shape (nc,)."""

    @classmethod
    def none(cls, contacts: int) -> Past:
        """Of a picture without any."""
        return cls(np.zeros((0, contacts, 3)), np.full(contacts, np.inf))


def forces_in_world(rotation: Array, force: Array) -> Array:
    """Forces [N] of contacts in world axes, shape (n, 3), from contact frames, shape (n, 3, 3) and (n, 3 or more)."""
    turned: Array = np.einsum("nij,nj->ni", rotation, force[:, :3])
    return turned
