"""A scene as messages for the live page: once what there is, then one message a frame."""

from __future__ import annotations

import base64
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.recording.recorded import RecordedScenario
from softhand.viewer.live.readings import describe_fingers
from softhand.viewer.scene.camera import Bounds
from softhand.viewer.scene.item import Item, Update
from softhand.viewer.scene.scene import Scene

_NUMBERS = 16  # of an item in a frame: three rows of its pose, colour, visible


class Words(NamedTuple):
    """What the page says of a run."""

    title: str
    subtitle: str = ""
    message: str = ""
    """What is wrong with it, if anything is."""

    @classmethod
    def of(cls, scenario: RecordedScenario, message: str = "") -> Words:
        """From what the run was made of."""
        return cls(scenario.title, scenario.settings_line, message)


def describe(
    scene: Scene,
    bounds: Bounds,
    words: Words,
    duration: float | None,
    speed: float = 1.0,
    curves: tuple[Array, Array] | None = None,
) -> dict[str, Any]:
    """All that the page needs before the first frame, as plain data.

    Args:
        scene: what is shown.
        bounds: what the camera shall fit.
        words: beside the picture.
        duration: of a replay [s], which can be stopped and wound; None for a run that goes on.
        speed: of a replay, times real time.
        curves: of a replay, times [s] of shape (samples,) and readings at them; a run that goes on has them in its
            frames.
    """
    return {
        **words._asdict(),
        "duration": duration,
        "speed": speed,
        "curves": None if curves is None else [_pack(np.asarray(part, "<f4")) for part in curves],
        "fingers": describe_fingers(scene.tips),
        "gravity": scene.has_gravity,
        "bounds": bounds.plain(),
        "layers": [{"key": key, "title": name, "shown": True} for key, name in scene.layers.items()],
        "legend": [
            {
                "text": e.text,
                "colors": [_css(c) for c in e.colours],
                "ends": list(e.ends),
                "layer": e.layer,
                "ring": e.ring,
            }
            for e in scene.legend
        ],
        "times": _pack(np.zeros(1, np.float32)),
        "items": [_describe_item(item) for item in scene.items],
    }


def encode(scene: Scene, time: float, updates: list[Update], numbers: Array) -> bytes:
    """One frame: little-endian float32: the time [s], 16 numbers an item, vertices of all soft items, the readings."""
    head = np.zeros((len(updates), _NUMBERS), "<f4")
    parts = [np.array([time], "<f4"), head.reshape(-1)]
    for row, item, update in zip(head, scene.items, updates, strict=True):
        pose = np.eye(4) if update.pose is None else update.pose
        row[:12] = pose[:3].reshape(-1)
        row[12:15] = update.colour or item.colour
        row[15] = update.visible
        if item.soft:
            vertices = item.vertices if update.vertices is None else update.vertices
            parts.append(np.asarray(vertices, "<f4").reshape(-1))
    return np.concatenate([*parts, np.asarray(numbers, "<f4")]).tobytes()


def _describe_item(item: Item) -> dict[str, Any]:
    return {
        "name": item.name,
        "layer": item.layer,
        "kind": item.kind,
        "color": list(item.colour),
        "opacity": item.opacity,
        "on_top": item.on_top,
        "soft": item.soft,
        "vertices": _pack(item.vertices),
        "faces": _pack(item.faces),
    }


def _pack(array: NDArray[Any]) -> dict[str, str]:
    """Numbers as base64 of little-endian bytes, with their type."""
    return {"type": array.dtype.str[1:], "data": base64.b64encode(np.ascontiguousarray(array).tobytes()).decode()}


def _css(colour: tuple[float, float, float]) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour)
