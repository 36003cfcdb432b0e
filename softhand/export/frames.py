"""What a log shows of a scene: frames that move, things that they carry, things that move by themselves."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import AnyArray, Array
from softhand.recording.recording import Recording
from softhand.viewer.report.packing import frames_of
from softhand.viewer.scene.item import DESIRED_FRAME, OBJECT_FRAME, Item, Update
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.poses import pose, pose_of, to_world
from softhand.viewer.scene.recorded import SLIP_HOLD, RecordedScene

WORLD = "world"
_HEADED = ("forces", "supports")  # layers of arrows: pairs of items, a shaft and a head
_MOST = 100_000


class Arrow(NamedTuple):
    """An arrow in the world [m]."""

    start: Array
    axes: Array
    """Its columns: two across, the third along it; unit vectors, shape (3, 3)."""
    shaft: tuple[float, float]
    """Length and radius [m]."""
    head: tuple[float, float]


class Thing(NamedTuple):
    """What an item shows at a moment."""

    item: Item
    frame: str
    """In which its vertices are."""
    vertices: AnyArray
    colour: Colour
    visible: bool
    arrow: Arrow | None


class Frames:
    """The pictures of a recording.

    Attributes:
        samples: that are drawn.
        scene: of the recording.
        object, desired: names of the frames of the object and of where it is wanted.

    Args:
        recording: what is shown.
        rate: pictures a second.

    Raises:
        RecordingError: the recording lacks what a picture needs.
    """

    def __init__(self, recording: Recording, rate: float) -> None:
        self.scene = scene = RecordedScene(recording, slip_hold=max(SLIP_HOLD, 1.0 / rate))
        self.samples = np.union1d(frames_of(recording, rate, _MOST), scene.slip_begins)
        taken = {*scene.skeleton.links, *map(contact_frame, recording.labels["contact"]), WORLD}
        self.object, self.desired = _fresh("object", taken), _fresh("object_desired", taken)
        self._recording = recording
        self._names = {OBJECT_FRAME: self.object, DESIRED_FRAME: self.desired}

    def still(self) -> Iterator[Thing]:
        """What never changes in its frame."""
        updates = self.scene.frame(0)
        yield from (self._thing(item, update) for item, update in self._paired(updates) if _is_still(item))

    def moment(self, k: int) -> tuple[dict[str, Array], list[Thing]]:
        """Poses of all frames in the world at a sample, of shape (4, 4), and what is drawn anew at each moment."""
        updates = self.scene.frame(k)
        return self._poses(k), list(self._moving(updates))

    def _moving(self, updates: list[Update]) -> Iterator[Thing]:
        pairs = [(item, update) for item, update in self._paired(updates) if not _is_still(item)]
        heads = {item.name[:-4]: update for item, update in pairs if item.layer in _HEADED and item.name[-4:] == "head"}
        for item, update in pairs:
            if item.layer not in _HEADED:
                yield self._thing(item, update)
            elif item.name.endswith("shaft"):
                arrow = _arrow(update, heads[item.name[:-5]]) if update.visible else None
                yield self._thing(item, update)._replace(arrow=arrow)

    def _poses(self, k: int) -> dict[str, Array]:
        recording, skeleton = self._recording, self.scene.skeleton
        found = {name: skeleton.frame(name) for name in skeleton.links if name != WORLD}
        found[self.object] = pose_of(recording.object_position[k], recording.object_rpy[k])
        found[self.desired] = pose_of(recording.object_position_desired[k], recording.object_rpy_desired[k])
        for i, tip in enumerate(recording.labels["contact"]):
            found[contact_frame(tip)] = pose(recording.contact_rotation[k, i], recording.contact_point[k, i])
        return found

    def _paired(self, updates: list[Update]) -> Iterator[tuple[Item, Update]]:
        return zip(self.scene.items, updates, strict=True)

    def _thing(self, item: Item, update: Update) -> Thing:
        vertices = item.vertices if update.vertices is None else update.vertices
        frame = self._names.get(item.frame, item.frame)
        if not frame:
            frame, vertices = WORLD, to_world(vertices, np.eye(4) if update.pose is None else update.pose)
        return Thing(item, frame, vertices, update.colour or item.colour, bool(update.visible), None)


def contact_frame(tip: str) -> str:
    """Name of the frame of a contact, C_F."""
    return f"{tip}/contact"


def _is_still(item: Item) -> bool:
    return (bool(item.frame) and not item.soft) or item.layer in ("table", "obstacles", "base")


def _fresh(name: str, taken: set[str]) -> str:
    while name in taken:
        name += "_"
    return name


def _arrow(shaft: Update, head: Update) -> Arrow:
    assert shaft.pose is not None and head.pose is not None
    (thin, _, long), (wide, _, tip) = (np.linalg.norm(update.pose[:3, :3], axis=0) for update in (shaft, head))  # type: ignore[index]
    axes = shaft.pose[:3, :3] / np.array([thin, thin, max(long, 1e-12)])
    return Arrow(shaft.pose[:3, 3], axes, (float(long), float(thin)), (float(tip), float(wide)))
