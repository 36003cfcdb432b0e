"""The forces in the picture: of tips and of supports as arrows, internal ones as lines between the contacts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import INTERNAL, RAMP, SUPPORT, Colour, use_colour
from softhand.viewer.scene.poses import axes_along, stretched
from softhand.viewer.scene.shapes.solids import arrow, lathe

_TABLE = "table "  # how names of supports on the table begin; their base is the table


class Forces(Part):
    """An arrow for the force on the object at each contact, coloured by friction use."""

    def __init__(self, names: Sequence[str], unit: float, metres_per_newton: float) -> None:
        shaft, head = arrow()
        self._unit, self._scale = unit, metres_per_newton
        self.items = []
        for name in names:
            self.items += [item(f"forces/{name}_shaft", shaft, RAMP[0]), item(f"forces/{name}_head", head, RAMP[0])]

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """From the contact point into the object."""
        updates = []
        for i in range(len(moment.contact_force)):
            reach = self._scale * moment.contact_rotation[i] @ moment.contact_force[i, :3]
            updates += _arrow_to(moment.contact_point[i], reach, self._unit, use_colour(moment.friction_use[i]))
        return updates


class Supports(Part):
    """A thin arrow for the force of each support: of table or obstacle on what meets it, else on the support's base."""

    def __init__(self, names: Sequence[str], obstacles: Sequence[str], unit: float, metres_per_newton: float) -> None:
        shaft, head = arrow()
        self._unit = unit
        still = (_TABLE, *(f"{name} " for name in obstacles))
        self._scales = [metres_per_newton * (-1.0 if name.startswith(still) else 1.0) for name in names]
        self.items = []
        for name in names:
            self.items += [item(f"supports/{name} shaft", shaft, SUPPORT), item(f"supports/{name} head", head, SUPPORT)]

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """From where it touches."""
        updates = []
        for scale, point, force in zip(self._scales, moment.support_point, moment.support_force, strict=True):
            updates += _arrow_to(point, scale * force, 0.5 * self._unit)
        return updates


class InternalForces(Part):
    """A line between each pair of contacts, as thick as the internal force is strong."""

    def __init__(self, pairs: Sequence[tuple[int, int]], unit: float, largest: float) -> None:
        self._pairs, self._unit, self._largest = pairs, unit, largest
        bar = lathe([[1.0, 0.0], [1.0, 1.0]], 16)
        self.items = [item(f"internal/{i + 1}{j + 1}", bar, INTERNAL, opacity=0.65) for i, j in pairs]

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """From contact to contact."""
        updates = []
        for (i, j), force in zip(self._pairs, moment.internal_force, strict=True):
            start, reach = moment.contact_point[i], moment.contact_point[j] - moment.contact_point[i]
            thickness = 0.09 * self._unit * min(abs(force) / self._largest, 2.0)
            bar = stretched(axes_along(reach), start, thickness, float(np.linalg.norm(reach)))
            updates.append(Update(bar, visible=thickness > 0.0))
        return updates


def _arrow_to(start: Array, reach: Array, unit: float, colour: Colour | None = None) -> list[Update]:
    """Shaft and head of an arrow over a vector [m], as thick as the unit [m] says; no arrow for next to nothing."""
    length = float(np.linalg.norm(reach))
    is_shown = bool(length > 1e-3 * unit and np.isfinite(length))
    axes = axes_along(reach) if is_shown else np.eye(3)
    head = min(0.9 * unit, 0.5 * length)
    neck = start + (length - head) * axes[:, 2]
    return [
        Update(stretched(axes, start, 0.1 * unit, length - head), None, colour, is_shown),
        Update(stretched(axes, neck, 0.29 * unit, head), None, colour, is_shown),
    ]
