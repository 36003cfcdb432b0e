"""The object in the picture, and where it is wanted."""

from __future__ import annotations

from softhand.viewer.scene.item import DESIRED_FRAME, OBJECT_FRAME, Item, Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import DESIRED, OBJECT, Colour, darker
from softhand.viewer.scene.shapes.edges import feature_edges
from softhand.viewer.scene.shapes.mesh import moved
from softhand.viewer.scene.visuals import Visual


class Object(Part):
    """The object, to be seen through, with its edges."""

    def __init__(self, visuals: list[Visual], unit: float) -> None:
        self.items = []
        for k, visual in enumerate(visuals):
            colour = visual.colour or OBJECT
            self.items.append(
                item(f"object/body_{k}", moved(visual.mesh, visual.pose), colour, opacity=0.16, frame=OBJECT_FRAME)
            )
            self.items += _edges(f"object/edges_{k}", visual, 0.035 * unit, darker(colour), OBJECT_FRAME)

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """Its pose."""
        return [Update(moment.object_pose)] * len(self.items)


class DesiredPose(Part):
    """A ghost of the object where it is wanted."""

    def __init__(self, visuals: list[Visual], unit: float) -> None:
        self.items = []
        for k, visual in enumerate(visuals):
            self.items.append(
                item(f"desired/body_{k}", moved(visual.mesh, visual.pose), DESIRED, opacity=0.05, frame=DESIRED_FRAME)
            )
            self.items += _edges(f"desired/edges_{k}", visual, 0.03 * unit, DESIRED, DESIRED_FRAME, opacity=0.75)

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """The desired pose."""
        return [Update(moment.desired_pose)] * len(self.items)


def _edges(name: str, visual: Visual, radius: float, colour: Colour, frame: str, opacity: float = 1.0) -> list[Item]:
    """The edges as bars of a radius [m]; nothing for a smooth shape."""
    edges = moved(feature_edges(visual.mesh, radius), visual.pose)
    return [item(name, edges, colour, opacity=opacity, frame=frame)] if len(edges.faces) else []
