"""The scene of a recording as messages of Foxglove: transforms, entities, poses, point clouds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import groupby
from typing import Any

from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from foxglove_schemas_protobuf.PosesInFrame_pb2 import PosesInFrame

from softhand.export.frames import WORLD, Frames, Thing, contact_frame
from softhand.export.mcap.shapes import point_cloud, pose_message, scene_update, transform_parts
from softhand.recording.recording import Recording

Messages = Iterator[tuple[str, Any]]
"""Topic and message."""


class Picture:
    """The scene, sample by sample.

    A topic has one layer, and each of its messages the whole layer: a player that is wound shows the last message of
    each topic.

    Attributes:
        samples: that have a picture.

    Raises:
        RecordingError: the recording lacks what a picture needs.
    """

    def __init__(self, recording: Recording, rate: float) -> None:
        self._frames = Frames(recording, rate)
        self._tips = recording.labels["contact"]
        self.samples = {int(k) for k in self._frames.samples}

    def still(self, stamp: Any) -> Messages:
        """What stays in its frame, once."""
        yield from _layers(self._frames.still(), stamp)

    def moment(self, k: int, stamp: Any) -> Messages:
        """What is seen at sample k."""
        poses, things = self._frames.moment(k)
        transforms = [
            FrameTransform(timestamp=stamp, parent_frame_id=WORLD, child_frame_id=name, **transform_parts(pose))
            for name, pose in poses.items()
        ]
        yield "/tf", FrameTransforms(transforms=transforms)
        for topic, name in (("/object/pose", self._frames.object), ("/object/pose_desired", self._frames.desired)):
            yield topic, PoseInFrame(timestamp=stamp, frame_id=WORLD, pose=pose_message(poses[name]))
        contacts = [pose_message(poses[contact_frame(tip)]) for tip in self._tips]
        yield "/contacts", PosesInFrame(timestamp=stamp, frame_id=WORLD, poses=contacts)
        yield from _layers(things, stamp)
        for thing in things:
            if thing.item.layer == "tips" and thing.item.soft and thing.item.kind == "mesh":
                yield f"/{thing.item.name}", point_cloud(thing, stamp)


def _layers(things: Iterable[Thing], stamp: Any) -> Messages:
    by_layer = sorted(things, key=lambda thing: thing.item.layer)
    for layer, members in groupby(by_layer, key=lambda thing: thing.item.layer):
        yield f"/scene/{layer}", scene_update(members, stamp)
