"""What a URDF says about looks: the visual shapes of its links."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import coal
import numpy as np
import pinocchio as pin

from softhand.model.urdf.document import read_document
from softhand.model.urdf.meshes import find_mesh
from softhand.numerics.arrays import Array
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.shapes import Mesh, box, capsule, cylinder, sphere


class Visual(NamedTuple):
    """One visual shape of a link."""

    link: str
    mesh: Mesh
    pose: Array
    """In the frame of the link, shape (4, 4)."""
    colour: Colour | None
    """None if the URDF gives none."""


def read_visuals(text: str, folder: Path | None, kind: str = "visual") -> tuple[list[Visual], list[str]]:
    """The visual shapes of all links, and the meshes that cannot be read.

    Args:
        text: a URDF that has been loaded before.
        folder: where it came from, for the paths of meshes.
        kind: "visual", or "collision" for these shapes instead.
    """
    root = read_document(text, "the URDF")
    colours = {
        material.get("name"): _rgb(material) for material in root.iter("material") if material.find("color") is not None
    }
    visuals, unread = [], []
    for link in root.findall("link"):
        for visual in link.findall(kind):
            geometry = visual.find("geometry")
            shape = geometry[0] if geometry is not None and len(geometry) else None
            if shape is None:
                continue
            mesh = _read_shape(shape, folder)
            if mesh is None:
                unread.append(shape.get("filename", shape.tag))
                continue
            material = visual.find("material")
            colour = None if material is None else _rgb(material) or colours.get(material.get("name"))
            visuals.append(Visual(link.get("name", ""), mesh, _origin(visual), colour))
    return visuals, unread


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
    pose = np.eye(4)
    origin = element.find("origin")
    if origin is not None:
        pose[:3, :3] = pin.rpy.rpyToMatrix(*_numbers(origin.get("rpy")))
        pose[:3, 3] = _numbers(origin.get("xyz"))
    return pose
