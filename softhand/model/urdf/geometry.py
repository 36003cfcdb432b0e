"""The shapes of the links: kind, size, place and colour."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Literal, NamedTuple
from xml.etree import ElementTree

import numpy as np

from softhand.model.urdf.document import Element
from softhand.model.urdf.meshes import find_mesh
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of

Purpose = Literal["visual", "collision"]
"""For the eye, or for contacts."""

_SIZES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}


class Geometry(NamedTuple):
    """One shape of a link."""

    link: str
    kind: str
    """`box`, `sphere`, `cylinder`, `capsule` or `mesh`."""
    size: Array
    """Edges of a box, radius of a sphere, radius and length [m]; the scale of a mesh along each axis."""
    rotation: Array
    """Axes of the shape in the frame of the link, shape (3, 3)."""
    position: Array
    """Its origin there [m], shape (3,)."""
    filename: str
    """Of a mesh, as the URDF has it."""
    file: Path | None
    """Of a mesh, if it is there."""
    colour: tuple[float, float, float] | None
    """Red, green, blue from 0 to 1, if the URDF gives any."""


def read_geometries(root: Element, folder: Path | None, purpose: Purpose) -> list[Geometry]:
    """The shapes of a URDF that has passed all checks, link by link.

    Args:
        root: its root element.
        folder: from which its meshes are looked for.
        purpose: which shapes.
    """
    materials = [*root.findall("material"), *root.findall("link/visual/material")]  # one elsewhere is not checked
    colours = {material.get("name"): _rgb(material) for material in materials if len(material)}
    return [shape for link in root.iterfind("link") for shape in geometries_of(link, folder, purpose, colours)]


def geometries_of(
    link: ElementTree.Element,
    folder: Path | None,
    purpose: Purpose,
    colours: Mapping[str | None, tuple[float, float, float] | None] = MappingProxyType({}),
) -> Iterator[Geometry]:
    """The shapes of one link.

    Args:
        link: its element.
        folder: from which its meshes are looked for.
        purpose: which shapes.
        colours: of materials, by name.
    """
    for element in link.iterfind(purpose):
        shape, material = element.find("geometry/*"), element.find("material")
        if shape is None:
            continue
        colour = None if material is None else _rgb(material) or colours.get(material.get("name"))
        name = shape.get("filename", "").strip()
        size = np.concatenate([_numbers(shape, word) for word in _SIZES.get(shape.tag, ())] or [_scale(shape)])
        file = find_mesh(name, folder) if name else None
        yield Geometry(link.get("name", ""), shape.tag, size, *_place(element), name, file, colour)


def _place(element: ElementTree.Element) -> tuple[Array, Array]:
    origin = element.find("origin")
    if origin is None:
        return np.eye(3), np.zeros(3)
    return rotation_of(_numbers(origin, "rpy", "0 0 0")), _numbers(origin, "xyz", "0 0 0")


def _scale(shape: ElementTree.Element) -> Array:
    return _numbers(shape, "scale", "1 1 1")


def _rgb(material: ElementTree.Element) -> tuple[float, float, float] | None:
    element = material.find("color")
    if element is None:
        return None
    red, green, blue, *_ = _numbers(element, "rgba", "0.7 0.7 0.7 1").tolist()
    return red, green, blue


def _numbers(element: ElementTree.Element, name: str, default: str = "") -> Array:
    return np.array([float(word) for word in element.get(name, default).split()])
