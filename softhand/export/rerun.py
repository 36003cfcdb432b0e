"""A recording as a file of Rerun's viewer: the scene as meshes and arrows, every array as curves, events as a log."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from softhand.export.frames import WORLD, Frames, Thing
from softhand.numerics.arrays import Array
from softhand.recording.events import find_events
from softhand.recording.recorded import scenario_of
from softhand.recording.recording import Recording
from softhand.recording.variables import COMPONENTS, VARIABLES
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.poses import quaternion_of

_TIMELINE = "time"
_SHOWN = ("contact_force", "deformation", "internal_force", "friction_use", "joint_torque")  # as curves, at first


def write(recording: Recording, path: Path, rate: float, picture: bool, progress: Callable[[float], None]) -> None:
    """Write the file; see `export.writing.write_rrd`."""
    frames = Frames(recording, rate) if picture else None
    stream = rr.RecordingStream("softhand", recording_id=None)
    stream.save(path, default_blueprint=_layout(recording))
    try:
        stream.send_recording_name(scenario_of(recording).title)
        stream.log("scenario", rr.TextDocument(recording.scenario), static=True)
        _log_numbers(stream, recording)
        _log_events(stream, recording)
        if frames:
            _log_still(stream, frames)
            for k in frames.samples.tolist():
                stream.set_time(_TIMELINE, duration=float(recording.time[k]))
                _log_moment(stream, *frames.moment(k))
                progress((k + 1) / len(recording))
        stream.flush()
    finally:
        stream.disconnect()


def _log_numbers(stream: Any, recording: Recording) -> None:
    """A path a variable, with a curve a number."""
    times = [rr.TimeColumn(_TIMELINE, duration=recording.time)]
    for name, array in recording.variables.items():
        if name == "time":
            continue
        dims = VARIABLES[name].dims[1:]
        names = [" ".join(cell) for cell in product(*(COMPONENTS.get(dim) or recording.labels[dim] for dim in dims))]
        flat = np.asarray(array, float).reshape(len(array), -1)
        if flat.shape[1]:
            stream.log(f"run/{name}", rr.SeriesLines(names=names), static=True)
            stream.send_columns(f"run/{name}", times, rr.Scalars.columns(scalars=flat))


def _log_events(stream: Any, recording: Recording) -> None:
    for event in find_events(recording):
        stream.set_time(_TIMELINE, duration=event.time)
        stream.log("events", rr.TextLog(" ".join(filter(None, (event.kind, event.finger, event.text)))))


def _log_still(stream: Any, frames: Frames) -> None:
    stream.log(WORLD, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for thing in frames.still():
        stream.log(_path(thing), _shape(thing), static=True)


def _log_moment(stream: Any, poses: dict[str, Array], things: list[Thing]) -> None:
    for name, pose in poses.items():
        quaternion = rr.Quaternion(xyzw=quaternion_of(pose[:3, :3]))
        stream.log(f"{WORLD}/{name}", rr.Transform3D(translation=pose[:3, 3], quaternion=quaternion))
    for thing in things:
        stream.log(_path(thing), _shape(thing) if thing.visible else rr.Clear(recursive=False))


def _path(thing: Thing) -> str:
    """Below the frame that carries it."""
    frame = "" if thing.frame == WORLD else f"/{thing.frame}"
    return f"{WORLD}{frame}/{thing.item.name.replace(' ', '_')}"


def _shape(thing: Thing) -> Any:
    item, colour = thing.item, _colour(thing.colour, thing.item.opacity)
    if thing.arrow:
        arrow = thing.arrow
        reach = (arrow.shaft[0] + arrow.head[0]) * arrow.axes[:, 2]
        return rr.Arrows3D(origins=[arrow.start], vectors=[reach], radii=[arrow.shaft[1]], colors=[colour])
    if item.kind == "lines":
        return rr.LineStrips3D(thing.vertices[item.faces], colors=[colour])
    normals = _normals(thing.vertices, item.faces)
    return rr.Mesh3D(
        vertex_positions=thing.vertices, triangle_indices=item.faces, vertex_normals=normals, albedo_factor=colour
    )


def _normals(vertices: Array, faces: Any) -> Array:
    """Of each vertex, the mean of the triangles around it by their areas."""
    corners = vertices[faces]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = np.zeros(vertices.shape)
    for k in range(3):
        np.add.at(normals, faces[:, k], across)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return normals


def _colour(colour: Colour, opacity: float) -> list[int]:
    return [round(255 * part) for part in (*colour, opacity)]


def _layout(recording: Recording) -> Any:
    curves = [
        rrb.TimeSeriesView(origin=f"run/{name}", name=name.replace("_", " "))
        for name in _SHOWN
        if name in recording.variables
    ]
    beside = rrb.Vertical(*curves, rrb.TextLogView(origin="events", name="events"))
    return rrb.Blueprint(rrb.Horizontal(rrb.Spatial3DView(origin=WORLD, name="scene"), beside), collapse_panels=True)
