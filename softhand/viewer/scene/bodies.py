"""The rigid bodies in the picture: links, palm, joints, object, desired pose."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import Array
from softhand.viewer.scene.item import Item, Part, Update, item
from softhand.viewer.scene.moment import Moment
from softhand.viewer.scene.palette import DESIRED, JOINT, LINK, OBJECT, PALM, TABLE, Colour, darker
from softhand.viewer.scene.shapes import (
    Mesh,
    axes_along,
    box,
    cylinder,
    feature_edges,
    merged,
    moved,
    pressed_flat,
    sphere,
)
from softhand.viewer.scene.skeleton import Skeleton
from softhand.viewer.scene.visuals import Visual

_TABLE_SIDE = 16.0  # in units


class Plane(NamedTuple):
    """Where a table is."""

    height: float
    """Along the normal, from the origin of the base frame [m]."""
    normal: Array
    """Unit vector, shape (3,)."""


class Hand(Part):
    """Links and palm as the URDF draws them, or bones where it draws nothing; a pin through each joint.

    A soft tip stands for the rigid tip that the URDF draws in its place, or for what is in front of its flat face.
    """

    def __init__(self, skeleton: Skeleton, visuals: list[Visual], tips: list[str], unit: float) -> None:
        self._skeleton = skeleton
        self.items: list[Item] = []
        self._frames: list[str | int] = []
        shown = [visual for visual in visuals if not any(skeleton.coincide(visual.link, tip) for tip in tips)]
        for k, visual in enumerate(shown):
            mesh = moved(visual.mesh, visual.pose)
            for seat in (skeleton.seat(visual.link, tip) for tip in tips):
                mesh = mesh if seat is None else pressed_flat(mesh, seat)
            fixed = skeleton.carrier(visual.link) == 0
            layer, colour = ("base", PALM) if fixed else ("links", LINK)
            self._add(f"{layer}/{visual.link}_{k}", mesh, visual.colour or colour)
            self._frames.append(visual.link)
        self._add_bones({skeleton.carrier(visual.link) for visual in shown}, tips, unit)
        for index in range(1, skeleton.model.njoints):
            pin = moved(cylinder(0.32 * unit, 2.5 * unit), _along(skeleton.axis(index)))
            self._add(f"base/joint_{skeleton.model.names[index]}", pin, JOINT)
            self._frames.append(index)

    def _add(self, name: str, mesh: Mesh, colour: Colour) -> None:
        self.items.append(item(name, mesh, colour))

    def _add_bones(self, drawn: set[int], tips: list[str], unit: float) -> None:
        for k, (joint, end) in enumerate(self._skeleton.bones(tips)):
            if joint not in drawn:
                layer, colour = ("base", PALM) if joint == 0 else ("links", LINK)
                length = float(np.linalg.norm(end))
                pose = _along(end)
                pose[:3, 3] = 0.5 * end
                bone = merged([moved(cylinder(0.6 * unit, length), pose), sphere(0.8 * unit)])
                self._add(f"{layer}/bone_{k}", bone, colour)
                self._frames.append(joint)

    def update(self, moment: Moment) -> list[Update]:
        """The poses of all links; the skeleton has been moved to the moment."""
        return [
            Update(self._skeleton.joint(frame) if isinstance(frame, int) else self._skeleton.frame(frame))
            for frame in self._frames
        ]


class Object(Part):
    """The object, to be seen through, with its edges."""

    def __init__(self, visuals: list[Visual], unit: float) -> None:
        self.items = []
        for k, visual in enumerate(visuals):
            colour = visual.colour or OBJECT
            self.items.append(item(f"object/body_{k}", moved(visual.mesh, visual.pose), colour, opacity=0.16))
            edges = moved(feature_edges(visual.mesh, 0.035 * unit), visual.pose)
            if len(edges.faces):
                self.items.append(item(f"object/edges_{k}", edges, darker(colour)))

    def update(self, moment: Moment) -> list[Update]:
        """Its pose."""
        return [Update(moment.object_pose)] * len(self.items)


class Table(Part):
    """A slab under the object, as large as the picture needs; the table itself has no end."""

    def __init__(self, plane: Plane, under: Array, unit: float) -> None:
        thick, side = 0.6 * unit, _TABLE_SIDE * unit
        pose = _along(plane.normal)
        pose[:3, 3] = under - (plane.normal @ under - plane.height) * plane.normal
        slab = moved(box((side, side, thick)), _lifted(-0.5 * thick))
        self._pose = pose
        self.items = [
            item("table/slab", slab, TABLE, opacity=0.55),
            item("table/edges", feature_edges(slab, 0.05 * unit), darker(TABLE)),
        ]

    def update(self, moment: Moment) -> list[Update]:
        """It stays."""
        return [Update(self._pose)] * len(self.items)


class DesiredPose(Part):
    """A ghost of the object where it is wanted."""

    def __init__(self, visuals: list[Visual], unit: float) -> None:
        self.items = []
        for k, visual in enumerate(visuals):
            self.items.append(item(f"desired/body_{k}", moved(visual.mesh, visual.pose), DESIRED, opacity=0.05))
            edges = moved(feature_edges(visual.mesh, 0.03 * unit), visual.pose)
            if len(edges.faces):
                self.items.append(item(f"desired/edges_{k}", edges, DESIRED, opacity=0.75))

    def update(self, moment: Moment) -> list[Update]:
        """The desired pose."""
        return [Update(moment.desired_pose)] * len(self.items)


def _lifted(height: float) -> Array:
    pose = np.eye(4)
    pose[2, 3] = height
    return pose


def _along(direction: Array) -> Array:
    """A pose at the origin whose z axis has a direction, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3] = axes_along(direction)
    return pose
