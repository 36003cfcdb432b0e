"""A recording as an MCAP file, and back."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from foxglove_schemas_protobuf.JointState_pb2 import JointState
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.timestamp_pb2 import Timestamp
from mcap_protobuf.writer import Writer

from softhand.export.mcap.numbers import PREFIX, fill, message_types
from softhand.export.mcap.picture import Picture
from softhand.recording.events import Event, find_events
from softhand.recording.recording import Recording
from softhand.recording.variables import VARIABLES

METADATA = "softhand"
TEXTS = {"scenario": "scenario.toml", "hand_urdf": "hand.urdf", "object_urdf": "object.urdf"}
"""Attachments, by the field of a recording."""
_JOINT = {"joint_position": "position", "joint_velocity": "velocity", "joint_torque": "effort"}
_NEWS = ("phase", "touch", "lift-off", "slip ends")  # events that are nobody's fault


def write(recording: Recording, path: Path, rate: float, picture: bool, progress: Callable[[float], None]) -> None:
    """Write the file; see `export.writing.write_mcap`."""
    scene = Picture(recording, rate) if picture else None
    with path.open("wb") as file, Writer(file) as writer:
        writer.add_metadata(METADATA, _metadata(recording))
        for field, name in TEXTS.items():
            writer.add_attachment(0, 0, name, "text/plain", getattr(recording, field).encode())
        numbers = _Numbers(recording)
        events = find_events(recording)
        for k, time in enumerate(recording.time.tolist()):
            stamp, ticks = stamp_of(time)
            messages = [*_events(events, time, stamp), *numbers.at(k, stamp)]
            if scene and k == 0:
                messages += scene.still(stamp)
            if scene and k in scene.samples:
                messages += scene.moment(k, stamp)
                progress((k + 1) / len(recording))
            for topic, message in messages:
                writer.write_message(topic, message, log_time=ticks, publish_time=ticks)
    progress(1.0)


def stamp_of(time: float) -> tuple[Any, int]:
    """A time [s] as a timestamp, and in nanoseconds; the number itself is in the topic `/run/time`."""
    ticks = max(round(1e9 * time), 0)
    return Timestamp(seconds=ticks // 10**9, nanos=ticks % 10**9), ticks


class _Numbers:
    """All arrays of a recording, sample by sample."""

    def __init__(self, recording: Recording) -> None:
        self._types = message_types(list(recording.variables), recording.labels)
        self._columns = {name: array.tolist() for name, array in recording.variables.items()}
        self._joints = recording.labels.get("joint", ())

    def at(self, k: int, stamp: Any) -> Iterator[tuple[str, Any]]:
        """Topics and messages of sample k."""
        for name, kind in self._types.items():
            yield PREFIX + name, fill(kind(), self._columns[name][k])
        known = {field: self._columns[name][k] for name, field in _JOINT.items() if name in self._columns}
        if known:
            states = [
                JointState(name=joint, **{field: values[j] for field, values in known.items()})
                for j, joint in enumerate(self._joints)
            ]
            yield "/joint_states", JointStates(timestamp=stamp, joints=states)


def _events(events: list[Event], time: float, stamp: Any) -> Iterator[tuple[str, Any]]:
    """Those up to a time, which are taken off the list."""
    while events and events[0].time <= time:
        event = events.pop(0)
        level = Log.Level.INFO if event.kind in _NEWS else Log.Level.WARNING
        text = f"{event.kind}: {event.text}" if event.text else event.kind
        yield "/events", Log(timestamp=stamp, level=level, name=event.finger, message=text)


def _metadata(recording: Recording) -> dict[str, str]:
    return {
        "version": recording.version,
        "complete": json.dumps(recording.complete),
        "reason": recording.reason,
        "stop_time": json.dumps(recording.stop_time),
        "labels": json.dumps(recording.labels),
        "attributes": json.dumps(recording.attributes),
        "units": json.dumps({name: VARIABLES[name].units for name in recording.variables}),
        "meaning": json.dumps({name: VARIABLES[name].long_name for name in recording.variables}),
    }
