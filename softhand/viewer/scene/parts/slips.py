"""The marks of slip in the picture."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import SLIP, paler
from softhand.viewer.scene.poses import pose
from softhand.viewer.scene.shapes.mesh import Mesh, merged
from softhand.viewer.scene.shapes.rings import ring_tube

_DASHES, _DASH = 8, 0.5  # of the ring: how many, and [rad] along each
_ROWS, _SIDES = 7, 8  # of vertices in a dash


class Slips(Part):
    """A broken ring around each contact that slips, seen through all else; it pales and goes a while after the slip."""

    def __init__(self, names: Sequence[str], unit: float, hold: float) -> None:
        self._hold = hold
        self.items = [item(f"slip/{name}", _broken_ring(unit), SLIP, on_top=True) for name in names]

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """In the plane of the contact, around the tip."""
        updates = []
        for i in range(len(self.items)):
            since = past.since_slip[i]
            is_shown = bool(since <= self._hold)
            colour = paler(SLIP, 0.6 * since / self._hold if is_shown else 0.0)
            updates.append(Update(pose(moment.contact_rotation[i], moment.contact_point[i]), None, colour, is_shown))
        return updates


def _broken_ring(unit: float) -> Mesh:
    """Dashes along a circle about z, a little outside of the tip."""
    thick = 0.13 * unit * np.array([0.0, *np.ones(_ROWS), 0.0])  # closed at both ends
    dash = np.array([0.0, *np.linspace(0.0, _DASH, _ROWS), _DASH])
    starts = np.linspace(0.0, 2.0 * np.pi, _DASHES, endpoint=False)
    return merged([ring_tube(1.28 * unit, start + dash, thick, _SIDES) for start in starts])
