"""The soft tips in the picture, as they deform."""

from __future__ import annotations

from collections.abc import Sequence

from softhand.tactile.tip_shape import Indentation
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import DISC, NET, Colour
from softhand.viewer.scene.poses import stretched
from softhand.viewer.scene.shapes.mesh import Mesh
from softhand.viewer.scene.shapes.solids import disc
from softhand.viewer.scene.shapes.tip_mesh import net_segments, tip_faces, tip_net, tip_surface
from softhand.viewer.scene.skeleton import Skeleton

_ABOVE = 0.03  # of the radius: how far the disc is lifted off the face, so that it does not flicker in it


class Tips(Part):
    """Each tip as it deforms, the net drawn on it, and its contact disc."""

    def __init__(self, skeleton: Skeleton, names: Sequence[str], radii: Sequence[float], colours: list[Colour]) -> None:
        self._skeleton, self._names, self._radii = skeleton, names, radii
        self.items = []
        for name, radius, colour in zip(names, radii, colours, strict=True):
            rest = Indentation(radius, radius, (0.0, 1.0), (0.0, 0.0, 0.0))
            net = Mesh(tip_net(rest), net_segments())
            self.items += [
                item(f"tips/{name}", Mesh(tip_surface(rest), tip_faces()), colour, soft=True, frame=name),
                item(f"tips/{name}_net", net, NET, soft=True, kind="lines", opacity=0.55, frame=name),
                item(f"tips/{name}_disc", disc(), DISC),
            ]

    def update(self, moment: Moment, past: Past) -> list[Update]:
        """Shapes and places; the skeleton has been moved to the moment."""
        updates = []
        distance = moment.distance
        for i, (name, radius) in enumerate(zip(self._names, self._radii, strict=True)):
            Theta, Phi = moment.contact_angles[i]
            shape = Indentation(radius, distance[i], (Theta, Phi), tuple(moment.deformation[i, 1:]))
            tip, a = self._skeleton.frame(name), shape.disc_radius
            middle = moment.contact_point[i] + _ABOVE * radius * moment.contact_normal[i]
            updates += [
                Update(tip, tip_surface(shape)),
                Update(tip, tip_net(shape)),
                Update(stretched(moment.contact_rotation[i], middle, a, radius), visible=a > 0.0),
            ]
        return updates
