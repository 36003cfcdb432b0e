"""The scene of a grasp: what any picture of it shows, as plain arrays.

    scene = recorded_scene(recording)
    for update, item in zip(scene.frame(k), scene.items): ...

A scene has items that stay and gives one `Update` an item for each moment. Nothing here knows a renderer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import upright
from softhand.viewer.scene import palette
from softhand.viewer.scene.bodies import DesiredPose, Hand, Object, Plane, Table
from softhand.viewer.scene.camera import Bounds, open_side, sphere_around
from softhand.viewer.scene.contacts import Forces, InternalForces, Slips, Supports, Tips, Torsion, Trails
from softhand.viewer.scene.item import LAYERS, Item, Part, Update
from softhand.viewer.scene.legend import make_legend
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.scales import Scales
from softhand.viewer.scene.shapes import ellipsoid
from softhand.viewer.scene.skeleton import Skeleton
from softhand.viewer.scene.visuals import read_visuals


@dataclass(frozen=True)
class Cast:
    """Whom a scene shows: the URDFs as text, where they came from, and the tips.

    Attributes:
        hand_urdf: text of the hand's URDF.
        object_urdf: text of the object's URDF.
        tips: names of the tip frames.
        radii: of the undeformed tips [m].
        gravity: in the world [m/s^2]; without any, z is up.
        hand_folder: where the hand's meshes are looked for.
        object_folder: likewise.
        table: the table under the object, if any, and a point over which its middle lies [m], shape (3,).
        ellipsoid: semi-axes, if the object is one in the place of what its URDF says [m].
        supports: names of the supports.
        slip_hold: how long the mark of a slip stays [s]; None if tips cannot slip.
    """

    hand_urdf: str
    object_urdf: str
    tips: tuple[str, ...]
    radii: tuple[float, ...]
    gravity: tuple[float, ...] = (0.0, 0.0, -9.81)
    hand_folder: Path | None = None
    object_folder: Path | None = None
    table: tuple[Plane, Array] | None = None
    ellipsoid: tuple[float, ...] | None = None
    supports: tuple[str, ...] = ()
    slip_hold: float | None = None


class Scene:
    """A grasp to be drawn.

    Attributes:
        layers: title of each layer with anything in it, by its key.
        items: everything in the picture.
        legend: what the colours mean.
        unread: meshes of the URDFs that could not be read; they are left out.
    """

    def __init__(self, cast: Cast, scales: Scales) -> None:
        unit = max(cast.radii)
        self._upright = upright(cast.gravity)
        skeleton = self._skeleton = Skeleton(cast.hand_urdf, Path("the hand's URDF"))
        looks, self.unread = read_visuals(cast.hand_urdf, cast.hand_folder)
        body, unread = read_visuals(cast.object_urdf, cast.object_folder)
        touched, _ = read_visuals(cast.object_urdf, cast.object_folder, "collision")
        if cast.ellipsoid is not None:
            colour = next((visual.colour for visual in body), None)
            body = [shape._replace(mesh=ellipsoid(cast.ellipsoid), colour=colour) for shape in touched]
        body = body or touched
        self.unread += unread
        tips = list(cast.tips)
        colours = [
            next((v.colour for v in looks if v.colour and _is_rigid_tip(skeleton, v.link, tip)), palette.TIP)
            for tip in tips
        ]
        self._trails = Trails(tips, unit)
        self._slips = Slips(tips if cast.slip_hold else [], unit, cast.slip_hold or 0.0)
        self._parts: list[Part] = [
            Hand(skeleton, looks, tips, unit),
            Object(body, unit),
            Tips(skeleton, tips, cast.radii, colours),
            Forces(tips, unit, 3.2 * unit / scales.force),
            Supports(cast.supports, unit, 2.0 * unit / scales.support_force),
            self._slips,
            Torsion(tips, unit, 1.5 * np.pi / scales.torsion),
            self._trails,
            DesiredPose(body, unit),
            InternalForces(contact_pairs(len(tips)), unit, scales.internal_force),
        ]
        if cast.table is not None:
            self._parts.insert(0, Table(*cast.table, unit))
        self.items: list[Item] = [item for part in self._parts for item in part.items]
        used = {item.layer for item in self.items}
        self.layers = {key: title for key, title in LAYERS.items() if key in used}
        self.legend = [entry for entry in make_legend(scales, cast.slip_hold) if entry.layer in used]

    def draw(self, moment: Moment, past: Past) -> list[Update]:
        """One update an item, in the order of `items`.

        Args:
            moment: what to show.
            past: what has been before.
        """
        self._skeleton.move(moment.joint_position)
        self._trails.path, self._slips.since = past
        return [update for part in self._parts for update in part.update(moment)]

    def extent(self, moments: Sequence[Moment]) -> Bounds:
        """A sphere around what is seen at these moments."""
        places = [place for moment in moments for place in self._places(moment)]
        return Bounds(
            sphere_around([points for _, points in places]),
            sphere_around([points for layer, points in places if layer in ("object", "tips")]),
            open_side(moments[0], self._skeleton.base, self._upright),
            self._upright,
        )

    def _places(self, moment: Moment) -> Iterator[tuple[str, Array]]:
        """Layer, and vertices in the world, of what has a body."""
        updates = self.draw(moment, Past.none(len(moment.distance)))
        for item, update in zip(self.items, updates, strict=True):
            if item.layer in ("links", "base", "object", "tips", "desired", "table"):
                vertices = item.vertices if update.vertices is None else update.vertices
                pose = np.eye(4) if update.pose is None else update.pose
                yield item.layer, vertices @ pose[:3, :3].T + pose[:3, 3]


def _is_rigid_tip(skeleton: Skeleton, link: str, tip: str) -> bool:
    """Whether the soft tip stands in the place of a link of the URDF."""
    return skeleton.coincide(link, tip) or skeleton.seat(link, tip) is not None
