"""The hand in the picture: links, palm, joints."""

from __future__ import annotations

import numpy as np

from softhand.viewer.scene.item import Item, Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import JOINT, LINK, PALM, Colour
from softhand.viewer.scene.poses import along
from softhand.viewer.scene.shapes.mesh import Mesh, merged, moved, pressed_flat
from softhand.viewer.scene.shapes.solids import cylinder, sphere
from softhand.viewer.scene.skeleton import Skeleton
from softhand.viewer.scene.visuals import Visual


class Hand(Part):
    """Links and palm as the URDF draws them, or bones where it draws nothing; a pin through each joint.

    A soft tip stands for the rigid tip that the URDF draws in its place, or for what is in front of its flat face.
    """

    def __init__(self, skeleton: Skeleton, visuals: list[Visual], tips: list[str], unit: float) -> None:
        self._skeleton, self._unit = skeleton, unit
        self.items: list[Item] = []
        self._frames: list[str | int] = []
        """Link or index of the joint that carries each item."""
        shown = [visual for visual in visuals if not any(skeleton.coincide(visual.link, tip) for tip in tips)]
        self._add_links(shown, tips)
        self._add_bones({skeleton.carrier(visual.link) for visual in shown}, tips)
        self._add_pins()

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """The poses of all links; the skeleton has been moved to the moment."""
        return [
            Update(self._skeleton.joint(frame) if isinstance(frame, int) else self._skeleton.frame(frame))
            for frame in self._frames
        ]

    def _add(self, name: str, mesh: Mesh, colour: Colour, frame: str | int) -> None:
        link = self._skeleton.link_of(frame) if isinstance(frame, int) else frame
        self.items.append(item(name, mesh, colour, frame=link))
        self._frames.append(frame)

    def _add_links(self, visuals: list[Visual], tips: list[str]) -> None:
        for k, visual in enumerate(visuals):
            mesh = moved(visual.mesh, visual.pose)
            for seat in (self._skeleton.seat(visual.link, tip) for tip in tips):
                mesh = mesh if seat is None else pressed_flat(mesh, seat)
            layer, colour = _layer_of(self._skeleton.carrier(visual.link))
            self._add(f"{layer}/{visual.link}_{k}", mesh, visual.colour or colour, visual.link)

    def _add_bones(self, drawn: set[int], tips: list[str]) -> None:
        unit = self._unit
        for k, (joint, end) in enumerate(self._skeleton.bones(tips)):
            if joint not in drawn:
                layer, colour = _layer_of(joint)
                rod = moved(cylinder(0.6 * unit, float(np.linalg.norm(end))), along(end, 0.5 * end))
                self._add(f"{layer}/bone_{k}", merged([rod, sphere(0.8 * unit)]), colour, joint)

    def _add_pins(self) -> None:
        for index in range(1, self._skeleton.model.njoints):
            pin = moved(cylinder(0.32 * self._unit, 2.5 * self._unit), along(self._skeleton.axis(index)))
            self._add(f"base/joint_{self._skeleton.model.names[index]}", pin, JOINT, index)


def _layer_of(joint: int) -> tuple[str, Colour]:
    """Of what a joint carries; 0 is the base."""
    return ("base", PALM) if joint == 0 else ("links", LINK)
