"""The scene of a grasp: what any picture of it shows, as plain arrays.

    scene = recorded_scene(recording)
    for update, item in zip(scene.frame(k), scene.items): ...

A scene has items that stay and gives one `Update` an item for each moment. Nothing here knows a renderer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.errors import ScenarioError
from softhand.observation import contact_pairs
from softhand.plant import Plant
from softhand.recording import Recording
from softhand.scenario_file import resolve_path
from softhand.viewer import palette
from softhand.viewer.bodies import DesiredPose, Hand, Object
from softhand.viewer.contacts import Forces, InternalForces, Tips, Torsion, Trails
from softhand.viewer.item import LAYERS, Colour, Item, Part, Update
from softhand.viewer.moment import Moment, check_viewable, recorded_moment
from softhand.viewer.skeleton import Skeleton
from softhand.viewer.visuals import read_visuals

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Array = NDArray[np.float64]


class Bounds(NamedTuple):
    """A sphere around all that is seen, and from where to look at it."""

    centre: Array
    """[m], shape (3,)."""
    radius: float
    """[m]"""
    azimuth: float
    """Of the camera about the world's z axis, from x towards y [rad]: where the fewest fingers are in the way."""


class Entry(NamedTuple):
    """A line of the legend: text with one colour, or with the colours of a ramp from its start to its end."""

    text: str
    colours: tuple[Colour, ...]
    layer: str
    ends: tuple[str, str] = ("", "")
    """What the start and the end of a ramp stand for."""


@dataclass(frozen=True)
class Cast:
    """Whom a scene shows: the URDFs as text, where they came from, and the tips.

    Attributes:
        hand_urdf: text of the hand's URDF.
        object_urdf: text of the object's URDF.
        tips: names of the tip frames.
        radii: of the undeformed tips [m].
        hand_folder: where the hand's meshes are looked for.
        object_folder: likewise.
    """

    hand_urdf: str
    object_urdf: str
    tips: tuple[str, ...]
    radii: tuple[float, ...]
    hand_folder: Path | None = None
    object_folder: Path | None = None


class Scales(NamedTuple):
    """Largest magnitudes that the picture has room for."""

    force: float
    """[N]"""
    torsion: float
    """[N m]"""
    internal_force: float
    """[N]"""


class Scene:
    """A grasp to be drawn.

    Attributes:
        layers: title of each layer by its key.
        items: everything in the picture.
        legend: what the colours mean.
        unread: meshes of the URDFs that could not be read; they are left out.
    """

    layers = LAYERS

    def __init__(self, cast: Cast, scales: Scales) -> None:
        unit = max(cast.radii)
        skeleton = Skeleton(cast.hand_urdf, Path("the hand's URDF"))
        looks, self.unread = read_visuals(cast.hand_urdf, cast.hand_folder)
        body, unread = read_visuals(cast.object_urdf, cast.object_folder)
        self.unread += unread
        tips = list(cast.tips)
        colours = [next((v.colour for v in looks if v.link == tip and v.colour), palette.TIP) for tip in tips]
        self._trails = Trails(tips, unit)
        self._parts: list[Part] = [
            Hand(skeleton, looks, tips, unit),
            Object(body, unit),
            Tips(skeleton, tips, cast.radii, colours),
            Forces(tips, unit, 3.2 * unit / scales.force),
            Torsion(tips, unit, 1.5 * np.pi / scales.torsion),
            self._trails,
            DesiredPose(body, unit),
            InternalForces(contact_pairs(len(tips)), unit, scales.internal_force),
        ]
        self.items: list[Item] = [item for part in self._parts for item in part.items]
        self.legend = _legend(scales)

    def draw(self, moment: Moment, path: Array) -> list[Update]:
        """One update an item, in the order of `items`.

        Args:
            moment: what to show.
            path: contact points so far in the object frame [m], shape (samples, nc, 3).
        """
        self._trails.path = path
        return [update for part in self._parts for update in part.update(moment)]

    def extent(self, moments: Sequence[Moment]) -> Bounds:
        """A sphere around what is seen at these moments."""
        cloud = np.concatenate([points for moment in moments for points in self._places(moment)])
        centre = 0.5 * (cloud.min(axis=0) + cloud.max(axis=0))
        radius = float(np.linalg.norm(cloud - centre, axis=1).max())
        return Bounds(centre, radius, _open_side(moments[0]))

    def _places(self, moment: Moment) -> Iterator[Array]:
        """Vertices in the world of what has a body."""
        updates = self.draw(moment, np.zeros((0, len(moment.distance), 3)))
        for item, update in zip(self.items, updates, strict=True):
            if item.layer in ("links", "base", "object", "tips", "desired"):
                vertices = item.vertices if update.vertices is None else update.vertices
                pose = np.eye(4) if update.pose is None else update.pose
                yield vertices @ pose[:3, :3].T + pose[:3, 3]


class RecordedScene(Scene):
    """The scene of a recording.

    Attributes:
        times: of the samples [s], shape (samples,).
        bounds: a sphere around everything over the whole run.

    Raises:
        RecordingError: the recording lacks what a picture needs.
    """

    def __init__(self, recording: Recording) -> None:
        check_viewable(recording)
        cast, moments = _cast_of(recording), [recorded_moment(recording, k) for k in range(len(recording))]
        super().__init__(cast, _scales(moments, 1.0, cast.radii))
        self.times = recording.time
        self._moments = moments
        self._path = np.array([moment.contact_on_object for moment in moments])
        self.bounds = self.extent(moments[:: max(len(moments) // 25, 1)])

    def frame(self, k: int) -> list[Update]:
        """Sample k: one update an item, in the order of `items`."""
        k = range(len(self.times))[k]
        return self.draw(self._moments[k], self._path[: k + 1])

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
        tuple(map(float, plant.pads["radius"])),
        world.hand_urdf.parent,
        world.object_urdf.parent,
    )
    return Scene(cast, _scales([first], 1.5, cast.radii))


def _cast_of(recording: Recording) -> Cast:
    first = recorded_moment(recording, 0)
    return Cast(
        recording.hand_urdf,
        recording.object_urdf,
        recording.labels["contact"],
        tuple(map(float, first.distance + first.deformation[:, 0])),  # r = R + dr
        _folder_of(recording, "hand"),
        _folder_of(recording, "object"),
    )


def _folder_of(recording: Recording, section: str) -> Path | None:
    """Where the URDF of a section of the recorded scenario lay, if that can be told."""
    try:
        return resolve_path(tomllib.loads(recording.scenario)[section]["urdf"]).parent
    except (tomllib.TOMLDecodeError, KeyError, TypeError, AttributeError, ScenarioError):
        return None


def _scales(moments: Sequence[Moment], headroom: float, radii: Sequence[float]) -> Scales:
    def largest(values: list[Array], least: float) -> float:
        finite = [np.abs(value[np.isfinite(value)]).max(initial=0.0) for value in values]
        return headroom * max(*finite, least)

    force = largest([np.linalg.norm(moment.contact_force[:, :3], axis=1) for moment in moments], 1e-3)
    return Scales(
        force,
        largest([moment.contact_force[:, 3] for moment in moments], 0.1 * force * max(radii)),
        largest([moment.internal_force for moment in moments], 1e-3),
    )


def _open_side(moment: Moment) -> float:
    """Azimuth [rad] a little beside the middle of the widest gap between the fingers, seen from above."""
    reach = moment.tip_position - moment.object_pose[:3, 3]
    azimuths = np.sort(np.arctan2(reach[:, 1], reach[:, 0]))
    gaps = np.diff(np.append(azimuths, azimuths[0] + 2.0 * np.pi))
    widest = int(np.argmax(np.round(gaps, 3)))
    return float(azimuths[widest] + 0.36 * gaps[widest])


def _legend(scales: Scales) -> list[Entry]:
    """What the colours mean, and how large the largest of each kind is."""
    return [
        Entry(
            f"Force on the object, longest {scales.force:.2g} N; colour: friction use |f_t| / (μ f_z)",
            (*palette.RAMP, palette.SLIPPING),
            "forces",
            ("0", "1 and above"),
        ),
        Entry(f"Torsion on the object, longest arc {1e3 * scales.torsion:.2g} N mm", (palette.TORSION,), "torsion"),
        Entry(f"Internal force, thickest {scales.internal_force:.2g} N", (palette.INTERNAL,), "internal"),
        Entry("Contact disc, radius √(r² − R²)", (palette.DISC,), "tips"),
        Entry("Where the contact has been", (palette.TRAIL,), "trails"),
        Entry("Where the object is wanted", (palette.DESIRED,), "desired"),
    ]
