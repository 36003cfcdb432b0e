"""The scene of a grasp: what any picture of it shows, as plain arrays.

    scene = recorded_scene(recording)
    for update, item in zip(scene.frame(k), scene.items): ...

A scene has items that stay and gives one `Update` an item for each moment. Nothing here knows a renderer.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.errors import ScenarioError
from softhand.model.configuration import rotation_of, upright
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.face import Face
from softhand.observation import contact_pairs
from softhand.plant import Plant
from softhand.recording import Recording
from softhand.scenario_file import resolve_path
from softhand.viewer import palette
from softhand.viewer.bodies import DesiredPose, Hand, Object, Plane, Table
from softhand.viewer.contacts import Forces, InternalForces, Slips, Supports, Tips, Torsion, Trails
from softhand.viewer.item import LAYERS, Colour, Item, Part, Update
from softhand.viewer.moment import Moment, Past, check_viewable, recorded_moment
from softhand.viewer.shapes import ellipsoid
from softhand.viewer.skeleton import Skeleton
from softhand.viewer.visuals import read_visuals

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Array = NDArray[np.float64]

SLIP_HOLD = 0.1  # [s] that the mark of a slip stays: most slips are too short to be seen
_HEADROOM = 1.5  # of a live scene, over the forces at its start
_LIVE_LOAD = 2.0  # least room for the force of a tip, over the object's weight: fingers may be open at the start


class Sphere(NamedTuple):
    """What a camera can fit."""

    centre: Array
    """[m], shape (3,)."""
    radius: float
    """[m]"""


class Bounds(NamedTuple):
    """Spheres around what is seen, and from where to look at it."""

    whole: Sphere
    """Around everything."""
    grasp: Sphere
    """Around the object and the tips."""
    azimuth: float
    """Of the camera in the upright picture about z, from x to y [rad]: where the fewest fingers are in the way."""
    upright: Array
    """Turns the world so that gravity points down in the picture, shape (3, 3)."""

    def plain(self) -> dict[str, Any]:
        """As the pages take it."""
        whole, grasp = ({"center": sphere.centre.tolist(), "radius": sphere.radius} for sphere in self[:2])
        return {**whole, "grasp": grasp, "azimuth": self.azimuth, "upright": self.upright.ravel().tolist()}


class Entry(NamedTuple):
    """A line of the legend: text with one colour, or with the colours of a ramp from its start to its end."""

    text: str
    colours: tuple[Colour, ...]
    layer: str
    ends: tuple[str, str] = ("", "")
    """What the start and the end of a ramp stand for."""
    ring: bool = False
    """Whether it is drawn as a broken ring, and not as a patch of colour."""


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


class Scales(NamedTuple):
    """Largest magnitudes that the picture has room for."""

    force: float
    """[N]"""
    torsion: float
    """[N m]"""
    internal_force: float
    """[N]"""
    support_force: float
    """[N]"""


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
        self.legend = [entry for entry in _legend(scales, cast.slip_hold) if entry.layer in used]

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
            _sphere([points for _, points in places]),
            _sphere([points for layer, points in places if layer in ("object", "tips")]),
            _open_side(moments[0], self._skeleton.base, self._upright),
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


class RecordedScene(Scene):
    """The scene of a recording.

    Attributes:
        times: of the samples [s], shape (samples,).
        bounds: spheres around what is seen over the whole run.
        slip_begins: samples at which a mark of slip appears.

    Args:
        recording: what is shown.
        scales: of several recordings that are compared, see `shared_scales`; by default those of this one.
        slip_hold: how long the mark of a slip stays [s].

    Raises:
        RecordingError: the recording lacks what a picture needs.
    """

    def __init__(self, recording: Recording, scales: Scales | None = None, slip_hold: float = SLIP_HOLD) -> None:
        scales = scales or shared_scales([recording])
        super().__init__(_cast_of(recording, slip_hold), scales)
        self.times = recording.time
        self._recording = recording
        self._path, self._since_slip = _path_of(recording), _since_slip(recording)
        marked = self._since_slip <= slip_hold
        self.slip_begins = np.flatnonzero(np.any(marked & ~np.roll(marked, 1, axis=0), axis=1))
        some = range(0, len(recording), max(len(recording) // 25, 1))
        self.bounds = self.extent([recorded_moment(recording, k) for k in some])

    def frame(self, k: int) -> list[Update]:
        """Sample k: one update an item, in the order of `items`."""
        k = range(len(self.times))[k]
        return self.draw(recorded_moment(self._recording, k), Past(self._path[: k + 1], self._since_slip[k]))


def shared_scales(recordings: Sequence[Recording]) -> Scales:
    """The largest of each over all recordings, so that equal forces look equal.

    Raises:
        RecordingError: a recording lacks what a picture needs.
    """
    each = []
    for recording in recordings:
        check_viewable(recording)
        supports = recording.variables.get("support_force", np.zeros(3))[..., :3]
        each.append(_scales(recording.contact_force, recording.internal_force, supports, _radii_of(recording)))
    return Scales(*map(max, zip(*each, strict=True)))


def live_scene(plant: Plant, first: Moment) -> Scene:
    """The scene of a plant that runs now; its first moment sets the scales.

    Raises:
        ModelError: a URDF cannot be read.
    """
    world = plant.world
    cast = Cast(
        world.hand_text,
        world.object_text,
        tuple(tip.name for tip in world.tips),
        tuple(map(float, plant.pads["radius"][: world.n_tips])),
        tuple(map(float, world.gravity)),
        world.hand_urdf.parent,
        world.object_urdf.parent,
        next(
            (
                (Plane(support.shape.offset, support.shape.normal), first.object_pose[:3, 3])
                for support in plant.supports
                if isinstance(support.shape, Face)
            ),
            None,
        ),
        world.shape.semi_axes if isinstance(world.shape, Ellipsoid) else None,
        tuple(support.name for support in plant.supports),
        SLIP_HOLD if any(tip.can_slip for tip in plant.fingertips) else None,
    )
    weight = float(world.model.inertias[world.object_joint].mass * np.linalg.norm(world.gravity))
    tips, internal, supports = first.contact_force, first.internal_force, first.support_force
    return Scene(cast, _scales(_HEADROOM * tips, _HEADROOM * internal, _HEADROOM * supports, cast.radii, weight))


def _cast_of(recording: Recording, slip_hold: float) -> Cast:
    return Cast(
        recording.hand_urdf,
        recording.object_urdf,
        recording.labels["contact"],
        _radii_of(recording),
        tuple(_of_scenario(recording, "gravity") or (0.0, 0.0, -9.81)),
        _folder_of(recording, "hand"),
        _folder_of(recording, "object"),
        _table_of(recording),
        _object_section(recording).get("ellipsoid"),
        recording.labels.get("support", ()),
        slip_hold if _can_slip(recording) else None,
    )


def _can_slip(recording: Recording) -> bool:
    """Whether tips have a limit of friction, by the recorded scenario, or slipped."""
    if "is_slipping" not in recording.variables:
        return False
    fingertip = _of_scenario(recording, "fingertip")
    return (isinstance(fingertip, dict) and fingertip.get("contact") == "coulomb") or bool(recording.is_slipping.any())


def _since_slip(recording: Recording) -> Array:
    """Time since each tip slipped, infinite if it did not [s], shape (samples, nc)."""
    now = recording.time[:, None]
    slips = recording.variables.get("is_slipping", np.zeros((len(recording), len(recording.labels["contact"]))))
    since: Array = now - np.maximum.accumulate(np.where(slips != 0, now, -np.inf), axis=0)
    return since


def _table_of(recording: Recording) -> tuple[Plane, Array] | None:
    """The table of the recorded scenario, if it can be read and has one."""
    try:
        table = tomllib.loads(recording.scenario)["table"]
        normal = np.array(table.get("normal", (0.0, 0.0, 1.0)), dtype=float)
        return Plane(float(table["height"]), normal / np.linalg.norm(normal)), recording.object_position[0]
    except (tomllib.TOMLDecodeError, KeyError, TypeError, AttributeError, ValueError):
        return None


def _object_section(recording: Recording) -> dict[str, Any]:
    try:
        section: dict[str, Any] = tomllib.loads(recording.scenario)["object"]
        return section
    except (tomllib.TOMLDecodeError, KeyError, TypeError):
        return {}


def _radii_of(recording: Recording) -> tuple[float, ...]:
    """Of the undeformed tips [m]: r = R + dr."""
    first = recorded_moment(recording, 0)
    return tuple(map(float, first.distance + first.deformation[:, 0]))


def _folder_of(recording: Recording, section: str) -> Path | None:
    """Where the URDF of a section of the recorded scenario lay, if that can be told."""
    try:
        return resolve_path(_of_scenario(recording, section)["urdf"]).parent
    except (KeyError, TypeError, AttributeError, ScenarioError):
        return None


def _of_scenario(recording: Recording, key: str) -> Any:
    """A value at the top of the recorded scenario; None if that cannot be told."""
    try:
        return tomllib.loads(recording.scenario).get(key)
    except tomllib.TOMLDecodeError:
        return None


def _path_of(recording: Recording) -> Array:
    """Contact points in the object frame over the run [m], shape (samples, nc, 3)."""
    rotation = rotation_of(recording.object_rpy.T)  # shape (3, 3, samples)
    reach = recording.contact_point - recording.object_position[:, None]
    path: Array = np.einsum("kis,snk->sni", rotation, reach)
    return path


def _scales(
    contact_force: Array, internal_force: Array, support_force: Array, radii: Sequence[float], weight: float = 0.0
) -> Scales:
    """The largest of each, with room for a weight [N]; a torsion far below what tips bear makes no long arc."""
    least = max(_LIVE_LOAD * weight, 1e-3)
    force = _largest(np.linalg.norm(contact_force[..., :3], axis=-1), least)
    support = _largest(np.linalg.norm(support_force, axis=-1), max(weight, 1e-3))
    torsion = _largest(contact_force[..., 3], 0.1 * force * max(radii))
    return Scales(force, torsion, _largest(internal_force, least), support)


def _largest(values: Array, least: float) -> float:
    return float(np.abs(values[np.isfinite(values)]).max(initial=least))


def _sphere(places: list[Array]) -> Sphere:
    """Around points [m], each of shape (n, 3)."""
    cloud = np.concatenate(places)
    cloud = cloud[np.isfinite(cloud).all(axis=1)]
    centre = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
    return Sphere(centre, float(np.linalg.norm(cloud - centre, axis=1).max()))


def _is_rigid_tip(skeleton: Skeleton, link: str, tip: str) -> bool:
    """Whether the soft tip stands in the place of a link of the URDF."""
    return skeleton.coincide(link, tip) or skeleton.seat(link, tip) is not None


def _open_side(moment: Moment, base: Array, upright: Array) -> float:
    """Azimuth [rad] a little beside the middle of the widest gap between the fingers, seen from above.

    A palm that is beside the object, and not below it, is in the way as well.
    """
    middle = moment.object_pose[:3, 3]
    reach = ((moment.tip_position - middle) @ upright.T)[:, :2]
    palm = ((base - middle) @ upright.T)[:2]
    if np.linalg.norm(palm) > np.linalg.norm(reach, axis=1).min():
        reach = np.vstack([reach, palm])
    azimuths = np.sort(np.arctan2(reach[:, 1], reach[:, 0]))
    gaps = np.diff(np.append(azimuths, azimuths[0] + 2.0 * np.pi))
    widest = int(np.argmax(np.round(gaps, 3)))
    return float(azimuths[widest] + 0.36 * gaps[widest])


def _legend(scales: Scales, slip_hold: float | None) -> list[Entry]:
    """What the colours mean, and how large the largest of each kind is."""
    entries = [
        Entry(
            f"Force on the object, longest {scales.force:.2g}\u00a0N; colour: friction use |f_t| / (μ f_z)",
            palette.RAMP,
            "forces",
            ("0", "1"),
        ),
        Entry(
            f"Force of a support, own scale, longest {scales.support_force:.2g}\u00a0N",
            (palette.SUPPORT,),
            "supports",
        ),
        Entry(
            f"Torsion on the object, longest arc {1e3 * scales.torsion:.2g}\u00a0N\u00a0mm",
            (palette.TORSION,),
            "torsion",
        ),
        Entry(f"Internal force, thickest {scales.internal_force:.2g} N", (palette.INTERNAL,), "internal"),
        Entry("Contact disc, radius √(r² - R²)", (palette.DISC,), "tips"),
        Entry("Where the contact has been", (palette.TRAIL,), "trails"),
        Entry("Where the object is wanted", (palette.DESIRED,), "desired"),
    ]
    if slip_hold is None:
        beyond = Entry("Friction use above 1: a real tip would slip", (palette.SLIPPING,), "forces")
    else:
        beyond = Entry(f"Slipping, now or in the last {slip_hold:.2g}\u00a0s", (palette.SLIP,), "slip", ring=True)
    entries.insert(1, beyond)
    return entries
