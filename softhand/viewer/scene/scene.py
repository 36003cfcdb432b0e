"""The scene of a grasp: what any picture of it shows, as plain arrays.

    scene = RecordedScene(recording)
    for update, item in zip(scene.frame(k), scene.items): ...

A scene has items that stay and gives one `Update` an item for each moment. Nothing here knows a renderer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.model.coupling import CouplingTable
from softhand.model.shapes.shape import Shape
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import upright
from softhand.viewer.scene import palette
from softhand.viewer.scene.camera import Bounds, open_side, sphere_around
from softhand.viewer.scene.ellipsoids import Ellipsoids
from softhand.viewer.scene.item import LAYERS, Item, Part, Update
from softhand.viewer.scene.legend import make_legend
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.parts.forces import Forces, InternalForces, Supports
from softhand.viewer.scene.parts.hand import Hand
from softhand.viewer.scene.parts.object import DesiredPose, Object
from softhand.viewer.scene.parts.obstacles import Obstacles
from softhand.viewer.scene.parts.slips import Slips
from softhand.viewer.scene.parts.stiffness import Stiffness
from softhand.viewer.scene.parts.table import Plane, Table
from softhand.viewer.scene.parts.taxels import Taxels
from softhand.viewer.scene.parts.tips import Tips
from softhand.viewer.scene.parts.torsion import Torsion
from softhand.viewer.scene.parts.trails import Trails
from softhand.viewer.scene.poses import to_world
from softhand.viewer.scene.scales import Scales
from softhand.viewer.scene.shapes.solids import ellipsoid
from softhand.viewer.scene.skeleton import Skeleton
from softhand.viewer.scene.visuals import Visual, read_visuals

_BODIES = ("links", "base", "object", "tips", "desired", "table", "obstacles")
"""Layers that a camera has to fit."""


@dataclass(frozen=True)
class Cast:
    """Whom a scene shows.

    Attributes:
        hand: its URDF.
        object: its URDF.
        tips: names of the tip frames.
        radii: of the undeformed tips [m].
        gravity: in the world [m/s^2]; without any, z is up.
        table: the table, if any, and where the object is that it is under, as `Table` [m].
        ellipsoid: semi-axes, if the object is one in the place of what its URDF says [m].
        supports: names of the supports.
        slip_hold: how long the mark of a slip stays [s]; None if tips cannot slip.
        coupling: of the hand's joints to motors, beside what its URDF says.
        stiffness: how the object gives way, from which time on.
        obstacles: name and shape in the world of each.
        taxels: places of the taxels on each tip, unit vectors in its frame, if any.
    """

    hand: Urdf
    object: Urdf
    tips: tuple[str, ...]
    radii: tuple[float, ...]
    gravity: tuple[float, ...] = (0.0, 0.0, -9.81)
    table: tuple[Plane, Array] | None = None
    ellipsoid: tuple[float, ...] | None = None
    supports: tuple[str, ...] = ()
    slip_hold: float | None = None
    coupling: CouplingTable | None = None
    stiffness: tuple[Ellipsoids, ...] = ()
    obstacles: tuple[tuple[str, Shape], ...] = ()
    taxels: Array | None = None


class Scene:
    """A grasp to be drawn.

    Attributes:
        layers: title of each layer with anything in it, by its key.
        items: everything in the picture.
        legend: what the colours mean.
        unread: meshes of the URDFs that could not be read; they are left out.
        skeleton: of the hand, as it was drawn last.
        tips: names of the tip frames.
        has_gravity: whether anything falls; it does so downwards in the upright picture.

    Raises:
        ModelError: a URDF cannot be read.
    """

    def __init__(self, cast: Cast, scales: Scales) -> None:
        self._upright = upright(cast.gravity)
        self.tips, self.has_gravity = cast.tips, any(cast.gravity)
        self.skeleton = Skeleton(cast.hand, cast.coupling)
        self.unread: list[str] = []
        self._parts = self._make_parts(cast, scales)
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
        self.skeleton.move(moment.joint_position)
        return [update for part in self._parts for update in part.update(moment, past)]

    def extent(self, moments: Sequence[Moment]) -> Bounds:
        """Spheres around what is there to see at these moments."""
        places = [place for moment in moments for place in self._places(moment)]
        return Bounds(
            sphere_around([points for _, points in places]),
            sphere_around([points for layer, points in places if layer in ("object", "tips")]),
            open_side(moments[0], self.skeleton.base, self._upright),
            self._upright,
        )

    def _make_parts(self, cast: Cast, scales: Scales) -> list[Part]:
        unit, tips = max(cast.radii), list(cast.tips)
        hand, body = self._read(cast.hand), self._read_object(cast)
        table = [] if cast.table is None else [Table(*cast.table, unit)]
        return [
            *table,
            Obstacles(cast.obstacles, unit),
            Hand(self.skeleton, hand, tips, unit),
            Object(body, unit),
            Tips(self.skeleton, tips, cast.radii, [self._colour(hand, tip) for tip in tips]),
            *([] if cast.taxels is None else [Taxels(self.skeleton, tips, cast.radii, cast.taxels, scales.taxel)]),
            Forces(tips, unit, 3.2 * unit / scales.force),
            Supports(cast.supports, [name for name, _ in cast.obstacles], unit, 2.0 * unit / scales.support_force),
            Slips(tips if cast.slip_hold else [], unit, cast.slip_hold or 0.0),
            Torsion(tips, unit, 1.5 * np.pi / scales.torsion),
            Trails(tips, unit),
            DesiredPose(body, unit),
            InternalForces(contact_pairs(len(tips)), unit, scales.internal_force),
            Stiffness(cast.stiffness, unit),
        ]

    def _read(self, urdf: Urdf) -> list[Visual]:
        visuals, unread = read_visuals(urdf)
        self.unread += unread
        return visuals

    def _read_object(self, cast: Cast) -> list[Visual]:
        """Its looks; what can be touched of it where its URDF gives no looks, or where it is an ellipsoid."""
        body = self._read(cast.object)
        if body and cast.ellipsoid is None:
            return body
        touched, _ = read_visuals(cast.object, "collision")
        if cast.ellipsoid is None:
            return touched
        colour = next((visual.colour for visual in body), None)
        return [shape._replace(mesh=ellipsoid(cast.ellipsoid), colour=colour) for shape in touched]

    def _colour(self, looks: list[Visual], tip: str) -> palette.Colour:
        """Of a soft tip: that of the rigid link in whose place it stands, if its URDF gives one."""
        skeleton = self.skeleton
        for visual in looks:
            stands = skeleton.coincide(visual.link, tip) or skeleton.seat(visual.link, tip) is not None
            if visual.colour and stands:
                return visual.colour
        return palette.TIP

    def _places(self, moment: Moment) -> Iterator[tuple[str, Array]]:
        """Layer, and vertices in the world, of what has a body."""
        updates = self.draw(moment, Past.none(len(moment.distance)))
        for item, update in zip(self.items, updates, strict=True):
            if item.layer in _BODIES:
                vertices = item.vertices if update.vertices is None else update.vertices
                yield item.layer, to_world(vertices, np.eye(4) if update.pose is None else update.pose)
