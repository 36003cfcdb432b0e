"""Taxels on the tips, in colours of what they feel."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.tactile.pattern import spacing
from softhand.tactile.tip_shape import Indentation, deformed
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import UNFELT, pressure_colours
from softhand.viewer.scene.shapes.mesh import Faces, Mesh
from softhand.viewer.scene.skeleton import Skeleton

BANDS = (0.02, 0.15, 0.3, 0.5, 0.75)
"""From which share of the largest force each colour is."""
_SIDES = 6
_LARGE, _SMALL = 0.46, 0.14  # radius of a dot over the spacing: one that feels, one that does not
_ABOVE = 1.012  # of the surface, over the net


class Taxels(Part):
    """A dot for each taxel: small and dark if it feels nothing, else large, in the colour of its normal force.

    An item has one colour, so there is one for each band of force; a dot of another band has no size in it.

    Args:
        skeleton: of the hand.
        names: of the tip frames.
        radii: of the tips [m].
        places: of the taxels, unit vectors in F, shape (taxels, 3).
        most: force of the last colour and above [N].
    """

    def __init__(
        self, skeleton: Skeleton, names: Sequence[str], radii: Sequence[float], places: Array, most: float
    ) -> None:
        self._skeleton, self._names, self._radii, self._most = skeleton, names, radii, most
        self._count = len(places)
        self._rings = [_rings(places, share * spacing(self._count)) for share in (_SMALL, _LARGE)]
        self.items = []
        for name, radius in zip(names, radii, strict=True):
            mesh = Mesh(radius * np.repeat(places, _SIDES, axis=0), _faces(self._count))
            for k, colour in enumerate((UNFELT, *pressure_colours(len(BANDS)))):
                looks = {"soft": True, "frame": name, "on_top": k > 0}
                self.items.append(item(f"taxels/{name}_{k}", mesh, colour, **looks))

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """Dots in their bands."""
        updates, distance = [], moment.distance
        for i, (name, radius) in enumerate(zip(self._names, self._radii, strict=True)):
            Theta, Phi = moment.contact_angles[i]
            shape = Indentation(radius, distance[i], (Theta, Phi), tuple(moment.deformation[i, 1:]))
            band = band_of(moment.tactile_normal_force[i], self._most)
            small, large = (_ABOVE * deformed(shape, ring).reshape(self._count, _SIDES, 3) for ring in self._rings)
            for k in range(len(BANDS) + 1):
                dots = large if k else small
                there = (band == k)[:, None, None]
                vertices = np.where(there, dots, dots.mean(axis=1, keepdims=True))
                updates.append(Update(self._skeleton.frame(name), vertices.reshape(-1, 3), visible=bool(there.any())))
        return updates


def band_of(force: Array, most: float) -> NDArray[np.int64]:
    """Band of each force: 0 for none, else which of `BANDS`, counted from 1.

    Args:
        force: [N].
        most: what the shares are of [N].
    """
    return np.searchsorted(np.array(BANDS) * most, np.abs(force), side="right")


def _rings(places: Array, radius: float) -> Array:
    """Corners of a dot about each place, unit vectors, shape (taxels * sides, 3)."""
    along = np.cross(places, np.eye(3)[np.argmin(np.abs(places), axis=1)])
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    across, angle = np.cross(places, along), np.arange(_SIDES) * 2.0 * np.pi / _SIDES
    corners = places[:, None] + radius * (
        np.cos(angle)[None, :, None] * along[:, None] + np.sin(angle)[None, :, None] * across[:, None]
    )
    corners[..., 0] = np.maximum(corners[..., 0], 0.0)
    flat: Array = (corners / np.linalg.norm(corners, axis=2, keepdims=True)).reshape(-1, 3)
    return flat


def _faces(count: int) -> Faces:
    fan = np.array([[0, k, k + 1] for k in range(1, _SIDES - 1)])
    return (fan[None] + _SIDES * np.arange(count)[:, None, None]).reshape(-1, 3).astype(np.int32)
