"""Items of a scene as objects of meshcat."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from meshcat.commands import Delete, SetObject, SetProperty, SetTransform
from meshcat.geometry import (
    Geometry,
    LineBasicMaterial,
    LineSegments,
    Mesh,
    MeshBasicMaterial,
    MeshPhongMaterial,
    Object,
    pack_numpy_array,
)
from meshcat.path import Path

from softhand.numerics.arrays import AnyArray, Array
from softhand.viewer.meshcat.wire import Command
from softhand.viewer.scene.item import Item
from softhand.viewer.scene.palette import Colour

_OPAQUE_FROM = 0.3  # what is fainter does not hide what lies behind it


ANIMATION = "animation"  # beside the layers


class Shape(Geometry):
    """Triangles or segments, and the other shapes that an animation gives them.

    Args:
        vertices: [m], shape (n, 3).
        faces: shape (m, 3) or (m, 2).
        others: further positions of all vertices, each of shape (n, 3).
    """

    def __init__(self, vertices: AnyArray, faces: AnyArray, others: Sequence[AnyArray] = ()) -> None:
        super().__init__()
        self._vertices, self._faces, self._others = vertices, faces, others

    def lower(self, object_data: Any) -> dict[str, Any]:
        """As three.js reads it."""
        data = {
            "attributes": {"position": _packed(self._vertices)},
            "index": pack_numpy_array(self._faces.astype(np.uint32).ravel()),
        }
        if self._others:
            data["morphAttributes"] = {"position": [_packed(other) for other in self._others]}
        return {"uuid": self.uuid, "type": "BufferGeometry", "data": data}


def _packed(vertices: AnyArray) -> Any:
    return pack_numpy_array(np.asarray(vertices, np.float32).T)


def object_of(item: Item, vertices: AnyArray, colour: Colour, others: Sequence[AnyArray] = ()) -> Object:
    """What meshcat draws of an item."""
    red, green, blue = (round(255 * part) for part in colour)
    looks: dict[str, Any] = {"color": red << 16 | green << 8 | blue, "opacity": item.opacity}
    looks |= {"depthTest": not item.on_top, "depthWrite": item.opacity > _OPAQUE_FROM and not item.on_top}
    if others:
        looks["flatShading"] = True  # normals are those of the shape at the moment
    if item.on_top:
        looks["transparent"] = True  # drawn after what is not
    shape = Shape(vertices, item.faces, others)
    if item.kind == "lines":
        return LineSegments(shape, LineBasicMaterial(**looks))
    return Mesh(shape, (MeshBasicMaterial if item.on_top else MeshPhongMaterial)(**looks))


def put(path: Path, thing: Object) -> Command:
    """Put an object at a path, in the place of the one before."""
    command: Command = SetObject(thing, path=path).lower()
    return command


def place(path: Path, pose: Array) -> Command:
    """Pose of all below a path, shape (4, 4)."""
    command: Command = SetTransform(np.asarray(pose, float), path).lower()
    return command


def tell(path: Path, name: str, value: Any) -> Command:
    """Set a property of a path, such as `visible`."""
    command: Command = SetProperty(name, value, path).lower()
    return command


def remove(path: Path) -> Command:
    """Remove all below a path."""
    command: Command = Delete(path).lower()
    return command


def path_of(base: Path, item: Item) -> Path:
    """Where an item is: in a folder for its layer."""
    return base.append(item.name.replace(" ", "_"))
