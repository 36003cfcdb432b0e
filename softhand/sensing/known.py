"""What is the same at all observations of a plant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.contact.pads import Fingertip
from softhand.model.configuration import CONTINUOUS
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
    is_continuous: NDArray[np.bool_]
    object_mass: float
    object_lever: Array
    gravity: Array
    rigid: RigidTerms
    palm_joint: int
    """As in `World`."""
    palm_columns: NDArray[np.int64]
    """Joints or motors that move the palm, from the base outward."""
    taxels: Array | None
    """Where they are on each tip, unit vectors in F, shape (taxels, 3); None without."""

    @classmethod
    def of(cls, plant: Plant, pairs: int) -> Known:
        """That of a plant with so many pairs of contacts."""
        world = plant.world
        inertia: pin.Inertia = world.model.inertias[world.object_joint]
        known = cls(
            sizes_of(plant, pairs),
            plant.fingertips,
            tuple(tip.name for tip in world.tips),
            world.effort_limit.copy(),
            world.joints[:-1, 0] == CONTINUOUS,
            float(inertia.mass),
            np.array(inertia.lever),
            np.array(world.gravity),
            plant.rigid,
            world.palm_joint,
            np.array(world.columns_of(world.palm_joint), dtype=np.int64),
            None if plant.taxels is None else plant.taxels.places.copy(),
        )
        for array in (
            known.effort_limit, known.is_continuous, known.object_lever, known.gravity, known.palm_columns,
            *([] if known.taxels is None else [known.taxels]),
        ):  # fmt: skip
            array.flags.writeable = False
        return known


def sizes_of(plant: Plant, pairs: int) -> Sizes:
    """How many numbers an observation of a plant has, with so many pairs of contacts."""
    world, n = plant.world, plant.world.n_tips
    leans = plant.pads["slope_function"] != 0
    return Sizes(
        world.n_joints, world.nq, n, len(plant.supports), pairs, plant.n_taxels, plant.n_shares, plant.n_elements,
        leaning=n if leans[:n].any() else 0, leaning_supports=len(plant.supports) if leans[n:].any() else 0,
    )  # fmt: skip
