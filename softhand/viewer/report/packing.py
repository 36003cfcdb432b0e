"""A scene over time as plain data for a page: what does not change is said once, what changes once a frame."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from softhand.numerics.arrays import AnyArray
from softhand.plots.quantities import finger_name
from softhand.recording.recording import Recording
from softhand.viewer.report.store import Data, Store
from softhand.viewer.scene.item import Item, Update
from softhand.viewer.scene.recorded import SLIP_HOLD, RecordedScene
from softhand.viewer.scene.scales import Scales

_STEPS = 4095  # from the mean of a soft item to its farthest vertex: about a micrometre for a fingertip


def frames_of(recording: Recording, rate: float, most: int) -> AnyArray:
    """Samples to be drawn, nearest to `rate` a second and at most `most`; the first and the last are among them."""
    time = recording.time
    count = min(round(rate * float(time[-1] - time[0])) + 1, most, len(time))
    wanted = np.linspace(time[0], time[-1], max(count, 1))
    after = np.clip(np.searchsorted(time, wanted), 1, max(len(time) - 1, 1))
    nearest = np.where(wanted - time[after - 1] <= time[np.minimum(after, len(time) - 1)] - wanted, after - 1, after)
    return np.unique(np.minimum(nearest, len(time) - 1))


def pack_film(
    store: Store, recording: Recording, scales: Scales, rate: float, most: int, progress: Callable[[float], None]
) -> Data:
    """The 3-D film of a run.

    Args:
        store: where its arrays are put.
        recording: with at least one sample.
        scales: of all runs that are shown side by side.
        rate: frames a second of simulated time.
        most: frames at most.
        progress: is told after each frame what is done, 0 to 1.

    Raises:
        RecordingError: the recording lacks what a picture needs.
    """
    scene = RecordedScene(recording, scales, max(SLIP_HOLD, 1.0 / rate))  # at a low rate no slip falls between pictures
    frames = np.union1d(frames_of(recording, rate, most), scene.slip_begins)
    updates: list[Sequence[Update]] = []
    for done, k in enumerate(frames):
        updates.append(scene.frame(int(k)))
        progress((done + 1) / len(frames))
    return {
        "times": store.add(recording.time[frames], "f4"),
        "bounds": scene.bounds.plain(),
        "gravity": scene.has_gravity,
        "fingers": [{"tip": tip, "text": finger_name(tip)} for tip in scene.tips],
        "layers": [{"key": key, "title": title, "shown": True} for key, title in scene.layers.items()],
        "legend": [
            {"text": e.text, "colors": e.colours, "layer": e.layer, "ends": e.ends, "ring": e.ring}
            for e in scene.legend
        ],
        "items": [_pack_item(store, item, [row[n] for row in updates]) for n, item in enumerate(scene.items)],
    }


def _pack_item(store: Store, item: Item, updates: Sequence[Update]) -> Data:
    packed: Data = {
        "name": item.name,
        "layer": item.layer,
        "kind": item.kind,
        "color": item.colour,
        "opacity": float(item.opacity),
        "on_top": item.on_top,
        "vertices": store.add(item.vertices, "f4"),
        "faces": store.add(item.faces, "i4"),
    }
    poses = [update.pose for update in updates]
    if any(pose is not None for pose in poses):
        rows = np.array([(np.eye(4) if pose is None else pose)[:3] for pose in poses])
        packed["poses"] = store.add(rows[:1] if np.all(rows == rows[0]) else rows, "f4")
    if item.soft:
        packed |= _pack_shapes(
            store, [item.vertices if update.vertices is None else update.vertices for update in updates]
        )
    if any(update.colour is not None for update in updates):
        colours = np.array([item.colour if update.colour is None else update.colour for update in updates])
        packed["colors"] = store.add(np.rint(255.0 * colours), "u1")
    visible = [update.visible for update in updates]
    if not all(visible):
        packed["visible"] = store.add(np.array(visible), "u1")
    return packed


def _pack_shapes(store: Store, shapes: Sequence[AnyArray]) -> Data:
    """Vertices of a soft item: their mean, and each coordinate over time as steps from frame to frame.

    Small numbers in the order in which they are alike: that is what deflates well.
    """
    vertices = np.array(shapes, dtype=np.float64)
    middle = vertices.mean(axis=0).astype(np.float32)
    away = (vertices - middle).reshape(len(vertices), -1)
    step = max(float(np.abs(away).max(initial=0.0)) / _STEPS, 1e-12)
    steps = np.diff(np.rint(away / step), axis=0, prepend=0.0)
    return {"vertices": store.add(middle, "f4"), "shapes": store.add(steps.T, "i2"), "scale": step}
