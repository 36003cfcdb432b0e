"""A scene below one path of meshcat: each moment as the commands that change the picture of the one before."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from meshcat.path import Path

from softhand.numerics.arrays import AnyArray, Array
from softhand.viewer.meshcat.objects import object_of, path_of, place, put, tell
from softhand.viewer.meshcat.wire import Command
from softhand.viewer.scene.item import Item, Update
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.scene import Scene

_MOVED = 5e-6  # [m] that a vertex of a soft item moves before it is sent again: less than can be seen


class _Shown(NamedTuple):
    """What meshcat shows of an item."""

    pose: Array
    vertices: AnyArray
    colour: Colour
    visible: bool


class Drawing:
    """Draws moments of a scene, each over the one before.

    What does not change is not sent again. A colour and a change of visibility come with the object anew, for a server
    keeps each property that it is told, and hands all of them to a page that opens later.

    Args:
        scene: what is drawn.
        base: path below which all of it goes.
    """

    def __init__(self, scene: Scene, base: Path) -> None:
        self._items = [(item, path_of(base, item)) for item in scene.items]
        self._shown: dict[str, _Shown] = {}

    def draw(self, updates: list[Update]) -> Iterator[Command]:
        """The commands that bring the picture to a moment."""
        for (item, path), update in zip(self._items, updates, strict=True):
            yield from self._change(item, path, update)

    def _change(self, item: Item, path: Path, update: Update) -> Iterator[Command]:
        before = self._shown.get(item.name)
        if not update.visible:
            if before and before.visible:
                self._shown[item.name] = before._replace(visible=False)
                yield tell(path, "visible", False)
            return
        pose = np.eye(4) if update.pose is None else update.pose
        colour = update.colour or item.colour
        vertices = item.vertices if update.vertices is None else update.vertices
        returns = before is not None and not before.visible
        if before is None or returns or colour != before.colour or _has_moved(vertices, before.vertices):
            yield put(path, object_of(item, vertices, colour))
        else:
            vertices = before.vertices
        self._shown[item.name] = _Shown(pose.copy(), vertices, colour, True)
        if returns:
            yield tell(path, "visible", True)
        if before is None or not np.array_equal(pose, before.pose):
            yield place(path, pose)


def _has_moved(vertices: AnyArray, before: AnyArray) -> bool:
    return vertices is not before and bool(np.abs(vertices - before).max() > _MOVED)
