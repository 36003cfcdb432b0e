"""The contacts in the picture: soft tips, discs, forces, slip, torsion, trails, internal forces, supports."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.viewer.scene.item import Part, Update, item
from softhand.viewer.scene.moment import Moment
from softhand.viewer.scene.palette import (
    DISC,
    INTERNAL,
    NET,
    RAMP,
    SLIP,
    SUPPORT,
    TORSION,
    TRAIL,
    Colour,
    paler,
    use_colour,
)
from softhand.viewer.scene.shapes import Mesh, arrow, axes_along, disc, grid_faces, lathe, merged
from softhand.viewer.scene.skeleton import Skeleton
from softhand.viewer.scene.tip_shape import Indentation, net_segments, tip_faces, tip_net, tip_surface

_TRAIL_POINTS, _TRAIL_SIDES = 64, 6
_GAUGE_RINGS, _GAUGE_SIDES = 48, 8
_GAUGE_LARGEST = 1.5 * np.pi  # [rad], arc of the largest torsion
_TABLE = "table "  # how names of supports on the table begin; their base is the table
_DASHES, _DASH = 8, 0.5  # of the ring of slip: how many, and [rad] along each
_ABOVE = 0.03  # of the unit: how far flat things are lifted off the face, so that they do not flicker in it


class Tips(Part):
    """Each tip as it deforms, the net drawn on it, and its contact disc."""

    def __init__(self, skeleton: Skeleton, names: Sequence[str], radii: Sequence[float], colours: list[Colour]) -> None:
        self._skeleton, self._names, self._radii = skeleton, names, radii
        self.items = []
        for name, radius, colour in zip(names, radii, colours, strict=True):
            rest = Indentation(radius, radius, (0.0, 1.0), (0.0, 0.0, 0.0))
            net = Mesh(tip_net(rest), net_segments())
            self.items += [
                item(f"tips/{name}", Mesh(tip_surface(rest), tip_faces()), colour, soft=True),
                item(f"tips/{name}_net", net, NET, soft=True, kind="lines", opacity=0.55),
                item(f"tips/{name}_disc", disc(), DISC),
            ]

    def update(self, moment: Moment) -> list[Update]:
        """Shapes and places; the skeleton has been moved to the moment."""
        updates = []
        distance = moment.distance
        for i, (name, radius) in enumerate(zip(self._names, self._radii, strict=True)):
            Theta, Phi = moment.contact_angles[i]
            shape = Indentation(radius, distance[i], (Theta, Phi), tuple(moment.deformation[i, 1:]))
            pose = self._skeleton.frame(name)
            a = shape.disc_radius
            place = np.eye(4)
            place[:3, :3] = moment.contact_rotation[i] * [a, a, radius]
            place[:3, 3] = moment.contact_point[i] + _ABOVE * radius * moment.contact_rotation[i, :, 2]
            updates += [
                Update(pose, tip_surface(shape)),
                Update(pose, tip_net(shape)),
                Update(place, visible=a > 0.0),
            ]
        return updates


class Forces(Part):
    """An arrow for the force on the object at each contact, coloured by friction use."""

    def __init__(self, names: Sequence[str], unit: float, metres_per_newton: float) -> None:
        shaft, head = arrow()
        self._unit, self._scale = unit, metres_per_newton
        self.items = []
        for name in names:
            self.items += [item(f"forces/{name}_shaft", shaft, RAMP[0]), item(f"forces/{name}_head", head, RAMP[0])]

    def update(self, moment: Moment) -> list[Update]:
        """From the contact point into the object."""
        updates = []
        for i in range(len(moment.contact_force)):
            reach = self._scale * moment.contact_rotation[i] @ moment.contact_force[i, :3]
            updates += _arrow_to(moment.contact_point[i], reach, self._unit, use_colour(moment.friction_use[i]))
        return updates


class Supports(Part):
    """A thin arrow for the force of each support: of the table on what lies on it, else on the base of the support."""

    def __init__(self, names: Sequence[str], unit: float, metres_per_newton: float) -> None:
        shaft, head = arrow()
        self._unit = unit
        self._scales = [metres_per_newton * (-1.0 if name.startswith(_TABLE) else 1.0) for name in names]
        self.items = []
        for name in names:
            self.items += [item(f"supports/{name} shaft", shaft, SUPPORT), item(f"supports/{name} head", head, SUPPORT)]

    def update(self, moment: Moment) -> list[Update]:
        """From where it touches."""
        updates = []
        for scale, point, force in zip(self._scales, moment.support_point, moment.support_force, strict=True):
            updates += _arrow_to(point, scale * force, 0.5 * self._unit)
        return updates


class Slips(Part):
    """A broken ring around each contact that slips, seen through all else; it pales and goes a while after the slip."""

    def __init__(self, names: Sequence[str], unit: float, hold: float) -> None:
        self._hold, self._unit = hold, unit
        self.items = [item(f"slip/{name}", _broken_ring(unit), SLIP, on_top=True) for name in names]
        self.since = np.full(len(names), np.inf)
        """Time since each tip slipped [s], shape (nc,)."""

    def update(self, moment: Moment) -> list[Update]:
        """In the plane of the contact, around the tip."""
        updates = []
        for i in range(len(self.items)):
            pose, since = np.eye(4), self.since[i]
            pose[:3, :3], pose[:3, 3] = moment.contact_rotation[i], moment.contact_point[i]
            seen = bool(since <= self._hold)
            colour = paler(SLIP, 0.6 * since / self._hold if seen else 0.0)
            updates.append(Update(pose, None, colour, seen))
        return updates


class Torsion(Part):
    """A curved arrow about the normal of each contact for the moment on the object."""

    def __init__(self, names: Sequence[str], unit: float, radians_per_moment: float) -> None:
        self._unit, self._scale = unit, radians_per_moment
        gauge = Mesh(gauge_vertices(1.0, unit), _gauge_faces())
        track = lathe(_ring(1.55 * unit, 0.03 * unit), 64)
        self.items = []
        for name in names:
            self.items.append(item(f"torsion/{name}", gauge, TORSION, soft=True))
            self.items.append(item(f"torsion/{name}_track", track, TORSION, opacity=0.3))

    def update(self, moment: Moment) -> list[Update]:
        """In the plane of the face, around the tip."""
        updates = []
        for i, torsion in enumerate(moment.contact_force[:, 3]):
            pose = np.eye(4)
            pose[:3, :3] = moment.contact_rotation[i]
            pose[:3, 3] = moment.contact_point[i] - 0.1 * self._unit * moment.contact_rotation[i, :, 2]
            angle = float(np.clip(self._scale * torsion, -_GAUGE_LARGEST, _GAUGE_LARGEST))
            updates.append(Update(pose, gauge_vertices(angle, self._unit), visible=abs(angle) > 0.1))
            updates.append(Update(pose, visible=bool(moment.deformation[i, 0] > 0.0)))
        return updates


class Trails(Part):
    """Where each contact has been on the faces of the object; seen through all else, for it lies below the arrow."""

    def __init__(self, names: Sequence[str], unit: float) -> None:
        self._unit = unit
        empty = Mesh(tube(np.zeros((0, 3)), np.array([0.0, 0.0, 1.0]), 0.0), grid_faces(_TRAIL_POINTS, _TRAIL_SIDES))
        self.items = [item(f"trails/{name}", empty, TRAIL, soft=True, on_top=True) for name in names]
        self.path = np.zeros((0, len(names), 3))
        """Contact points so far in the object frame [m], the last one now, shape (samples, nc, 3)."""

    def update(self, moment: Moment) -> list[Update]:
        """A tube on the face."""
        updates = []
        to_object = moment.object_pose[:3, :3].T
        for i in range(len(self.items)):
            normal = -to_object @ moment.contact_rotation[i, :, 2]
            updates.append(Update(moment.object_pose, tube(self.path[:, i], normal, 0.04 * self._unit)))
        return updates


class InternalForces(Part):
    """A line between each pair of contacts, as thick as the internal force is strong."""

    def __init__(self, pairs: Sequence[tuple[int, int]], unit: float, largest: float) -> None:
        self._pairs, self._unit, self._largest = pairs, unit, largest
        bar = lathe([[1.0, 0.0], [1.0, 1.0]], 16)
        self.items = [item(f"internal/{i + 1}{j + 1}", bar, INTERNAL, opacity=0.65) for i, j in pairs]

    def update(self, moment: Moment) -> list[Update]:
        """From contact to contact."""
        updates = []
        for (i, j), force in zip(self._pairs, moment.internal_force, strict=True):
            start, reach = moment.contact_point[i], moment.contact_point[j] - moment.contact_point[i]
            thickness = 0.09 * self._unit * min(abs(force) / self._largest, 2.0)
            length = float(np.linalg.norm(reach))
            updates.append(Update(_placed(axes_along(reach), start, thickness, length), visible=thickness > 0.0))
        return updates


def gauge_vertices(angle: float, unit: float) -> Array:
    """A curved arrow about z from the x axis over an angle [rad], positive by the right-hand rule, shape (n, 3)."""
    ring, tube = 1.55 * unit, 0.11 * unit
    head = min(0.45, 0.6 * abs(angle))  # [rad] of the arc
    along = np.concatenate([np.linspace(0.0, abs(angle) - head, _GAUGE_RINGS - 3), [abs(angle) - head], [abs(angle)]])
    thick = np.concatenate([np.full(_GAUGE_RINGS - 3, tube), [3.0 * tube * min(1.0, head / 0.45)], [0.0]])
    along, thick = np.append(0.0, along) * np.sign(angle), np.append(0.0, thick)
    around = np.linspace(0.0, 2.0 * np.pi, _GAUGE_SIDES, endpoint=False)
    radial = np.stack([np.cos(along), np.sin(along), np.zeros_like(along)], axis=-1)
    offset = np.cos(around)[:, None] * radial[:, None] + np.sin(around)[:, None] * np.array([0.0, 0.0, 1.0])
    vertices: Array = ring * radial[:, None] + thick[:, None, None] * offset
    return vertices.reshape(-1, 3)


def tube(path: Array, normal: Array, radius: float) -> Array:
    """A tube along a path on a face, of a fixed number of vertices: a ring a point.

    Args:
        path: [m], shape (samples, 3).
        normal: of the face, unit length, shape (3,).
        radius: [m].
    """
    if not len(path):
        return np.zeros((_TRAIL_POINTS * _TRAIL_SIDES, 3))
    where = np.linspace(0.0, len(path) - 1.0, _TRAIL_POINTS)
    known = np.arange(len(path))
    points = np.stack([np.interp(where, known, path[:, k]) for k in range(3)], axis=1)
    forward = np.gradient(points, axis=0)
    length = np.linalg.norm(forward, axis=1)
    moving = length > 1e-9
    if not moving.any():
        return np.repeat(points, _TRAIL_SIDES, axis=0)
    last = np.maximum.accumulate(np.where(moving, np.arange(_TRAIL_POINTS), np.argmax(moving)))
    side = np.cross(normal, forward[last] / length[last, None])
    around = np.linspace(0.0, 2.0 * np.pi, _TRAIL_SIDES, endpoint=False)[:, None]
    vertices: Array = points[:, None] + radius * (np.cos(around) * side[:, None] + np.sin(around) * normal)
    return vertices.reshape(-1, 3)


def _broken_ring(unit: float) -> Mesh:
    """Dashes along a circle about z, a little outside of the tip."""
    rows, sides, radius, thick = 7, 8, 1.28 * unit, 0.13 * unit
    around = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    dashes = []
    for start in np.linspace(0.0, 2.0 * np.pi, _DASHES, endpoint=False):
        along = start + np.append(np.append(0.0, np.linspace(0.0, _DASH, rows)), _DASH)
        tube = thick * np.array([0.0, *np.ones(rows), 0.0])[:, None]  # closed at both ends
        radial = np.stack([np.cos(along), np.sin(along), np.zeros_like(along)], axis=-1)[:, None]
        offset = np.cos(around)[:, None] * radial + np.sin(around)[:, None] * np.array([0.0, 0.0, 1.0])
        dashes.append(Mesh((radius * radial + tube[..., None] * offset).reshape(-1, 3), grid_faces(rows + 2, sides)))
    return merged(dashes)


def _arrow_to(start: Array, reach: Array, unit: float, colour: Colour | None = None) -> list[Update]:
    """Shaft and head of an arrow over a vector [m], as thick as the unit [m] says; no arrow for next to nothing."""
    length = float(np.linalg.norm(reach))
    seen = bool(length > 1e-3 * unit and np.isfinite(length))
    axes = axes_along(reach) if seen else np.eye(3)
    head = min(0.9 * unit, 0.5 * length)
    neck = start + (length - head) * axes[:, 2]
    return [
        Update(_placed(axes, start, 0.1 * unit, length - head), None, colour, seen),
        Update(_placed(axes, neck, 0.29 * unit, head), None, colour, seen),
    ]


def _gauge_faces() -> NDArray[np.int32]:
    return grid_faces(_GAUGE_RINGS, _GAUGE_SIDES)


def _ring(radius: float, tube: float) -> Array:
    around = np.linspace(0.0, 2.0 * np.pi, 9)
    return np.stack([radius + tube * np.cos(around), tube * np.sin(around)], axis=1)


def _placed(axes: Array, origin: Array, thickness: float, length: float) -> Array:
    """A pose that stretches a shape of radius and height one along z."""
    pose = np.eye(4)
    pose[:3, :3] = axes * [thickness, thickness, length]
    pose[:3, 3] = origin
    return pose
