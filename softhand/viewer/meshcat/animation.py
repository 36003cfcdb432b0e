"""A recording as an animation of meshcat, which the page plays, stops and winds by itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from meshcat.animation import Animation, AnimationClip
from meshcat.commands import SetAnimation
from meshcat.path import Path

from softhand.numerics.arrays import AnyArray, Array
from softhand.recording.recording import Recording
from softhand.viewer.meshcat.objects import ANIMATION, object_of, path_of, place, put, tell
from softhand.viewer.meshcat.wire import Command
from softhand.viewer.report.packing import frames_of
from softhand.viewer.scene.item import Item, Update
from softhand.viewer.scene.poses import quaternion_of
from softhand.viewer.scene.recorded import SLIP_HOLD, RecordedScene

FRAME_RATE = 30.0  # frames a second on the page
MOST_FRAMES = 600
_MOST_SHAPES = 60  # of a soft item: each is another set of vertices
_OBJECT = "<object>"  # how meshcat calls what lies at a path


class Take:
    """A recording as objects and an animation.

    Poses, colours and visibility have a key at each frame, and the page goes straight between them. Shapes of tips,
    arcs and trails have at most 60, and the page blends them.

    Attributes:
        scene: of the recording.

    Args:
        recording: what is played.
        base: path below which all of it goes.
        speed: times real time.

    Raises:
        RecordingError: the recording lacks what a picture needs.
    """

    def __init__(self, recording: Recording, base: Path, speed: float = 1.0) -> None:
        frames = frames_of(recording, FRAME_RATE / speed, MOST_FRAMES)
        self.scene = RecordedScene(recording, slip_hold=max(SLIP_HOLD, speed / FRAME_RATE))
        frames = np.union1d(frames, self.scene.slip_begins)
        self._base = base
        self._keys = ((recording.time[frames] - recording.time[0]) * FRAME_RATE / speed).tolist()
        """Time of each frame, in frames of the page."""
        self._animation = Animation(default_framerate=FRAME_RATE)
        rows = [self.scene.frame(int(k)) for k in frames]
        self._objects: list[Command] = []
        for n, item in enumerate(self.scene.items):
            self._objects += self._film(item, [row[n] for row in rows])

    @property
    def duration(self) -> float:
        """Of the animation on the page [s]."""
        return float(self._keys[-1]) / FRAME_RATE

    def commands(self, play: bool, repetitions: float) -> Iterator[Command]:
        """The objects, then the animation.

        meshcat would keep the animation at its root and hand it to a page that opens later before the objects that it
        moves; at a path of its own it is the last that such a page gets.
        """
        yield from self._objects
        yield {
            **SetAnimation(self._animation, play=play, repetitions=repetitions).lower(),
            "path": self._base.append(ANIMATION).lower(),
        }

    def _film(self, item: Item, updates: Sequence[Update]) -> Iterator[Command]:
        """The commands for one item; its tracks go into the animation."""
        path = path_of(self._base, item)
        poses = _held([update.pose if update.visible else None for update in updates])
        colours = [update.colour or item.colour for update in updates]
        shapes = _few([item.vertices if update.vertices is None else update.vertices for update in updates])
        yield put(path, object_of(item, shapes[0][1], colours[0], [shape for _, shape in shapes[1:]]))
        yield place(path, poses[0])
        yield tell(path, "visible", bool(updates[0].visible))
        self._add_pose(path, poses)
        self._add_if_changing(path, "visible", "boolean", [bool(update.visible) for update in updates])
        self._add_if_changing(path.append(_OBJECT), "material.color", "color", [list(colour) for colour in colours])
        if len(shapes) > 1:
            self._add_shapes(path.append(_OBJECT), [k for k, _ in shapes])

    def _add_pose(self, path: Path, poses: list[Array]) -> None:
        if all(np.array_equal(pose, poses[0]) for pose in poses):
            return
        scales = [np.maximum(np.linalg.norm(pose[:3, :3], axis=0), 1e-9) for pose in poses]
        turned = [pose[:3, :3] / scale for pose, scale in zip(poses, scales, strict=True)]
        self._add(path, "position", "vector3", [pose[:3, 3].tolist() for pose in poses])
        self._add(path, "quaternion", "quaternion", [list(quaternion_of(rotation)) for rotation in turned])
        self._add_if_changing(path, "scale", "vector3", [scale.tolist() for scale in scales])

    def _add_shapes(self, path: Path, samples: list[int]) -> None:
        """Each shape grows while the one before goes; the first is that of the object itself."""
        times = [self._keys[k] for k in samples]
        for k in range(1, len(samples)):
            weights = [float(j == k) for j in range(len(samples))]
            name = f"morphTargetInfluences[{k - 1}]"
            near = [j for j in range(len(samples)) if j in (0, len(samples) - 1) or abs(j - k) <= 1]
            self._track(path, name, "number", [times[j] for j in near], [weights[j] for j in near])

    def _add_if_changing(self, path: Path, name: str, kind: str, values: list[Any]) -> None:
        if any(value != values[0] for value in values):
            self._add(path, name, kind, values)

    def _add(self, path: Path, name: str, kind: str, values: list[Any]) -> None:
        self._track(path, name, kind, self._keys, values)

    def _track(self, path: Path, name: str, kind: str, times: list[float], values: list[Any]) -> None:
        clip = self._animation.clips.setdefault(path, AnimationClip(fps=FRAME_RATE))
        for time, value in zip(times, values, strict=True):
            clip.set_property(time, name, kind, value)


def _held(poses: list[Array | None]) -> list[Array]:
    """Poses with those that are seen in place of those that are not: the one before, at the start the first to come."""
    last = next((pose for pose in poses if pose is not None), np.eye(4))
    held = []
    for pose in poses:
        last = last if pose is None else pose.copy()
        held.append(last)
    return held


def _few(shapes: list[AnyArray]) -> list[tuple[int, AnyArray]]:
    """Some of the shapes over time with their places, evenly; one where all are the same."""
    if all(np.array_equal(shape, shapes[0]) for shape in shapes):
        return [(0, shapes[0])]
    places = np.unique(np.linspace(0, len(shapes) - 1, min(len(shapes), _MOST_SHAPES)).round().astype(int))
    return [(int(k), shapes[k]) for k in places]
