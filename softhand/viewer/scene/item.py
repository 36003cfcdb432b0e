"""What any drawing of a scene handles: items that stay, and one update an item for each moment."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.viewer.scene.moment import Moment, Past
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.shapes.mesh import Mesh

LAYERS: dict[str, str] = {
    "links": "Links",
    "base": "Palm and joints",
    "object": "Object",
    "table": "Table",
    "obstacles": "Obstacles",
    "tips": "Fingertips",
    "taxels": "Taxels",
    "forces": "Contact forces",
    "supports": "Support forces",
    "slip": "Slip",
    "torsion": "Torsion",
    "trails": "Trails",
    "desired": "Desired pose",
    "internal": "Internal forces",
    "stiffness": "Compliance",
}
"""Title of each layer, by its key."""


@dataclass(frozen=True)
class Item:
    """One thing in the picture.

    Attributes:
        name: "layer/part", unique.
        layer: key of `LAYERS`.
        vertices: [m], shape (n, 3), float32; those of a soft item are replaced in each frame.
        faces: triangles, shape (m, 3), or segments of `kind` "lines", shape (m, 2); int32.
        colour: red, green, blue from 0 to 1.
        opacity: 0 to 1.
        soft: whether its vertices change.
        kind: "mesh" or "lines".
        on_top: whether it is seen through all that is before it.
        frame: what carries it, the name of a link, "the object" or "the desired object": its pose is that of the frame,
            nothing else. "" for what has a pose of its own.
    """

    name: str
    layer: str
    vertices: NDArray[np.float32]
    faces: NDArray[np.int32]
    colour: Colour
    opacity: float = 1.0
    soft: bool = False
    kind: str = "mesh"
    on_top: bool = False
    frame: str = ""


OBJECT_FRAME, DESIRED_FRAME = "the object", "the desired object"


class Update(NamedTuple):
    """One item at one moment."""

    pose: Array | None = None
    """From the item's vertices to the world, with its scale, shape (4, 4); None: as they are."""
    vertices: Array | None = None
    """Of a soft item [m], shape (n, 3)."""
    colour: Colour | None = None
    """None: that of the item."""
    visible: bool = True


class Part(ABC):
    """One kind of thing in the picture: its items, and what becomes of them at a moment."""

    items: list[Item]

    @abstractmethod
    def update(self, moment: Moment, past: Past) -> list[Update]:
        """One update an item, in their order."""


def item(name: str, mesh: Mesh, colour: Colour, **looks: Any) -> Item:
    """An item of the layer that its name starts with; `looks` are further fields of `Item`."""
    layer = name.partition("/")[0]
    return Item(name, layer, mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32), colour, **looks)
