"""The shape of an object from the collision shape of its URDF."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from softhand.errors import ModelError
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.mesh import as_polyhedron
from softhand.model.shapes.mesh_file import read_mesh
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.model.urdf.document import read_document
from softhand.model.urdf.meshes import find_mesh
from softhand.numerics.arrays import Array

KINDS = ("box", "sphere", "cylinder", "mesh")


def read_shape(
    text: str, file: Path, body: pin.Model, ellipsoid: Sequence[float] | None = None, hull: bool = False
) -> Shape:
    """The shape of an object.

    Args:
        text: its URDF, which has passed all checks.
        file: where it comes from, for messages and for meshes.
        body: its Pinocchio model, one free-flyer joint.
        ellipsoid: semi-axes of an ellipsoid that replaces the shape of the URDF at its place [m].
        hull: take the convex hull of a mesh.

    Raises:
        ModelError: there is not exactly one collision shape, or it is none that can be held.
    """
    shapes = [
        (link.get("name", ""), collision)
        for link in read_document(text, file).findall("link")
        for collision in link.findall("collision")
    ]
    kinds = [collision.find("geometry")[0].tag for _, collision in shapes]  # type: ignore[index]
    if len(shapes) != 1 or kinds[0] not in KINDS:
        raise ModelError(
            f"{file}: an object needs exactly one collision shape, a <{'>, <'.join(KINDS)}>; "
            f"found: {', '.join(kinds) or 'none'}.",
            file=str(file),
        )
    link, collision = shapes[0]
    place = body.frames[body.getFrameId(link, pin.FrameType.BODY)].placement * _origin(collision)
    rotation, centre = place.rotation.copy(), place.translation.copy()
    if ellipsoid is not None:
        a, b, c = ellipsoid
        return Ellipsoid(rotation, centre, (a, b, c))
    geometry = collision.find("geometry")
    assert geometry is not None
    return _make(geometry[0], file, rotation, centre, hull)


def _make(element: ElementTree.Element, file: Path, rotation: Array, centre: Array, hull: bool) -> Shape:
    if element.tag == "box":
        return Box(rotation, centre, 0.5 * _numbers(element, "size"))
    if element.tag == "sphere":
        return Sphere(rotation, centre, float(_numbers(element, "radius")[0]))
    if element.tag == "cylinder":
        length = float(_numbers(element, "length")[0])
        return Cylinder(rotation, centre, float(_numbers(element, "radius")[0]), 0.5 * length)
    name = element.get("filename", "").strip()
    mesh = find_mesh(name, file.parent)
    if mesh is None:
        raise ModelError(f'{file}: filename="{name}": there is no such mesh.', file=str(file))
    try:
        return as_polyhedron(read_mesh(mesh, _numbers(element, "scale", "1 1 1")), rotation, centre, hull)
    except ModelError as error:
        raise ModelError(f"{file}: {error}", file=str(file)) from error


def _origin(collision: ElementTree.Element) -> pin.SE3:
    origin = collision.find("origin")
    if origin is None:
        return pin.SE3.Identity()
    return pin.SE3(pin.rpy.rpyToMatrix(*_numbers(origin, "rpy", "0 0 0")), _numbers(origin, "xyz", "0 0 0"))


def _numbers(element: ElementTree.Element, name: str, default: str = "") -> Array:
    return np.array([float(word) for word in element.get(name, default).split()])
