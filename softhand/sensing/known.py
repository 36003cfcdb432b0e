"""What is the same at all observations of a plant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from softhand.contact.pads import Fingertip
from softhand.model.terms import RigidTerms
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.sensing.fields import Sizes


@dataclass(frozen=True)
class Known:
    """What stays the same at all observations of a plant."""

    sizes: Sizes
    fingertips: tuple[Fingertip, ...]
    tip_names: tuple[str, ...]
    effort_limit: Array
    object_mass: float
    object_lever: Array
    gravity: Array
    rigid: RigidTerms

    @classmethod
    def of(cls, plant: Plant, pairs: int) -> Known:
        """That of a plant with so many pairs of contacts."""
        world = plant.world
        inertia: pin.Inertia = world.model.inertias[world.object_joint]
        known = cls(
            Sizes(world.n_joints, world.model.nq, world.n_tips, len(plant.supports), pairs),
            plant.fingertips,
            tuple(tip.name for tip in world.tips),
            world.effort_limit.copy(),
            float(inertia.mass),
            np.array(inertia.lever),
            np.array(world.gravity),
            plant.rigid,
        )
        for array in (known.effort_limit, known.object_lever, known.gravity):
            array.flags.writeable = False
        return known
