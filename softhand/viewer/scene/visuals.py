"""What a URDF says about looks: the visual shapes of its links."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple
from xml.etree import ElementTree

import coal
import numpy as np

from softhand.model.urdf.document import read_document
from softhand.model.urdf.meshes import find_mesh
from softhand.numerics.arrays import Array
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.poses import pose_of
from softhand.viewer.scene.shapes.mesh import Mesh
from softhand.viewer.scene.shapes.solids import box, capsule, cylinder, sphere


class Source(NamedTuple):
    """A URDF that has been loaded before."""

    text: str
    folder: Path | None
    """Where it came from, for the paths of meshes."""


class Visual(NamedTuple):
    """One visual shape of a link."""

    link: str
    mesh: Mesh
    pose: Array
    """In the frame of the link, shape (4, 4)."""
    colour: Colour | None
    """None if the URDF gives none."""


class Looks:
    """The shapes of a URDF, whose text is parsed once."""

    def __init__(self, source: Source) -> None:
        self._folder = source.folder
        self._root = read_document(source.text, "the URDF")
        self._colours = {
            material.get("name"): _rgb(material)
            for material in self._root.iter("material")
            if material.find("color") is not None
        }

    def read(self, kind: Literal["visual", "collision"]) -> tuple[list[Visual], list[str]]:
        """The shapes of all links for the eye, or those for contacts, and the meshes that cannot be read."""
        visuals, unread = [], []
        for link in self._root.findall("link"):
            for element in link.findall(kind):
                geometry = element.find("geometry")
                shape = geometry[0] if geometry is not None and len(geometry) else None
                if shape is None:
                    continue
                mesh = _read_shape(shape, self._folder)
                if mesh is None:
                    unread.append(shape.get("filename", shape.tag))
                else:
                    visuals.append(Visual(link.get("name", ""), mesh, _origin(element), self._colour(element)))
        return visuals, unread

    def _colour(self, element: ElementTree.Element) -> Colour | None:
        material = element.find("material")
        return None if material is None else _rgb(material) or self._colours.get(material.get("name"))


def _read_shape(shape: ElementTree.Element, folder: Path | None) -> Mesh | None:
    if shape.tag == "box":
        return box(_numbers(shape.get("size")))
    if shape.tag == "sphere":
        return sphere(float(shape.get("radius", 0.0)))
    if shape.tag in ("cylinder", "capsule"):
        make = cylinder if shape.tag == "cylinder" else capsule
        return make(float(shape.get("radius", 0.0)), float(shape.get("length", 0.0)))
    return _read_mesh(shape, folder) if shape.tag == "mesh" else None


def _read_mesh(shape: ElementTree.Element, folder: Path | None) -> Mesh | None:
    file = find_mesh(shape.get("filename", ""), folder)
    if file is None:
        return None
    try:
        model = coal.MeshLoader().load(str(file), np.array(_numbers(shape.get("scale", "1 1 1"))))
    except (ValueError, RuntimeError):
        return None
    faces = [[triangle[k] for k in range(3)] for triangle in (model.tri_indices(i) for i in range(model.num_tris))]
    return Mesh(np.array(model.vertices(), dtype=float), np.array(faces, dtype=np.int32))


def _numbers(text: str | None) -> list[float]:
    return [float(word) for word in (text or "0 0 0").split()]


def _rgb(material: ElementTree.Element) -> Colour | None:
    element = material.find("color")
    if element is None:
        return None
    red, green, blue, *_ = _numbers(element.get("rgba", "0.7 0.7 0.7 1"))
    return red, green, blue


def _origin(element: ElementTree.Element) -> Array:
    origin = element.find("origin")
    return np.eye(4) if origin is None else pose_of(_numbers(origin.get("xyz")), _numbers(origin.get("rpy")))
