"""The shape of an object from the collision shape of its URDF."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any

import pinocchio as pin

from softhand.errors import ModelError
from softhand.model.shapes.box import Box
from softhand.model.shapes.cylinder import Cylinder
from softhand.model.shapes.ellipsoid import Ellipsoid
from softhand.model.shapes.mesh import as_polyhedron
from softhand.model.shapes.mesh_file import read_mesh
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.shape import Shape
from softhand.model.shapes.sphere import Sphere
from softhand.model.shapes.union import MOST_PARTS, Off, Part, Union
from softhand.model.urdf.geometry import Geometry
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

KINDS = ("box", "sphere", "cylinder", "mesh")


def read_shape(
    urdf: Urdf,
    body: pin.Model,
    ellipsoid: tuple[float, float, float] | None = None,
    hull: bool = False,
    cut: float | None = None,
) -> Shape:
    """The shape of an object.

    Args:
        urdf: of the object.
        body: its Pinocchio model, one free-flyer joint.
        ellipsoid: semi-axes of an ellipsoid that replaces the shape of the URDF at its place [m].
        hull: take the convex hull of a mesh.
        cut: threshold of `decomposed.decompose`, by which meshes are cut that are not convex; None: they are refused.

    Several collision shapes are the parts of one solid, their union.

    Raises:
        ModelError: there is no collision shape, or one is none that can be held.
        SofthandError: what cuts meshes is not installed.
    """
    found = urdf.geometries("collision")
    kinds = [geometry.kind for geometry in found]
    if not found or not set(kinds) <= set(KINDS):
        raise ModelError(
            f"{urdf.file}: an object needs a collision shape, or several that are its parts, each a "
            f"<{'>, <'.join(KINDS)}>; found: {', '.join(kinds) or 'none'}.",
            file=str(urdf.file),
        )
    places = [_place(geometry, body) for geometry in found]
    if ellipsoid is not None:
        if len(found) > 1:
            raise ModelError(
                f"{urdf.file}: object.ellipsoid stands in the place of one collision shape, and this object has "
                f"{len(found)}; leave it out, or give the URDF one.",
                file=str(urdf.file),
            )
        return Ellipsoid(*places[0], ellipsoid)
    try:
        if len(found) == 1 and (cut is None or kinds[0] != "mesh"):
            return _make(found[0], *places[0], hull)
        return _union(found, places, hull, cut)
    except ModelError as error:
        raise ModelError(f"{urdf.file}: {error}", file=str(urdf.file)) from error


def _union(found: list[Geometry], places: list[tuple[Array, Array]], hull: bool, cut: float | None) -> Shape:
    """The shapes as one; a mesh that is convex and alone is itself.

    Raises:
        ModelError: they are too many, or there is one that cannot be a part.
    """
    parts, names, off = list[Part](), list[str](), list[Off]()
    for k, (geometry, place) in enumerate(zip(found, places, strict=True), 1):
        if geometry.kind == "mesh" and cut is not None:
            cut_parts, how_far = _cut_mesh(geometry, *place, cut)
            some: tuple[Part, ...] = cut_parts
            off.append(how_far)
        else:
            some = (_part(geometry, *place, hull),)
        parts += some
        names += [f"part {len(names) + j} ({geometry.kind}{f' {k}' if len(found) > 1 < len(some) else ''})"
                  for j in range(1, len(some) + 1)]  # fmt: skip
    if len(parts) == 1:
        return parts[0]
    if len(parts) > MOST_PARTS:
        raise ModelError(
            f"the object has {len(parts)} parts, and at most {MOST_PARTS} make one solid; put some together.", file=""
        )
    furthest = Off(max(one.inside for one in off), max(one.outside for one in off)) if off else None
    return Union.of(tuple(parts), tuple(names), furthest)


def _place(geometry: Geometry, body: pin.Model) -> tuple[Array, Array]:
    """Axes and origin of a shape in the object frame."""
    link = body.frames[body.getFrameId(geometry.link, pin.FrameType.BODY)].placement
    place = link * pin.SE3(geometry.rotation, geometry.position)
    return place.rotation.copy(), place.translation.copy()


def _part(geometry: Geometry, rotation: Array, centre: Array, hull: bool) -> Part:
    if geometry.kind == "box":
        return Polyhedron.of_box(rotation, centre, 0.5 * geometry.size)
    made = _make(geometry, rotation, centre, hull)
    assert isinstance(made, Part)
    return made


def _make(geometry: Geometry, rotation: Array, centre: Array, hull: bool) -> Shape:
    if geometry.kind == "box":
        return Box(rotation, centre, 0.5 * geometry.size)
    if geometry.kind == "sphere":
        return Sphere(rotation, centre, float(geometry.size[0]))
    if geometry.kind == "cylinder":
        radius, length = geometry.size.tolist()
        return Cylinder(rotation, centre, radius, 0.5 * length)
    return _of_mesh(_file_of(geometry), geometry.size, rotation, centre, hull)


def _cut_mesh(geometry: Geometry, rotation: Array, centre: Array, cut: float) -> tuple[tuple[Polyhedron, ...], Off]:
    """The convex parts of a mesh file, made now or before from a file with the very same bytes."""
    from softhand.model.shapes.decomposed import decompose

    file = _file_of(geometry)
    made: tuple[tuple[Polyhedron, ...], Off] = _once(
        file, (geometry.size, rotation, centre), cut,
        lambda: decompose(read_mesh(file, geometry.size), rotation, centre, cut),
    )  # fmt: skip
    return made


def _file_of(geometry: Geometry) -> Path:
    if geometry.file is None:
        raise ModelError(f'filename="{geometry.filename}": there is no such mesh.', file=geometry.filename)
    return geometry.file


_KEPT = 8
_kept: OrderedDict[tuple[Any, ...], Any] = OrderedDict()


def _of_mesh(file: Path, scale: Array, rotation: Array, centre: Array, hull: bool) -> Polyhedron:
    """The polyhedron of a mesh file, made now or before from a file with the very same bytes; it is never changed."""
    made: Polyhedron = _once(
        file, (scale, rotation, centre), hull, lambda: as_polyhedron(read_mesh(file, scale), rotation, centre, hull)
    )
    return made


def _once(file: Path, place: tuple[Array, ...], how: Any, make: Callable[[], Any]) -> Any:
    """What is made of a mesh file, or what was made of one with the very same bytes."""
    key = file.name, *(array.tobytes() for array in place), type(how), how
    digest = _digest(file)
    made = _kept.get((digest, key))
    if made is None:
        made = make()
        if digest is not None and digest == _digest(file):  # not written to in between
            _kept[digest, key] = made
        while len(_kept) > _KEPT:
            _kept.popitem(last=False)
    return made


def _digest(file: Path) -> bytes | None:
    """Of what is in a file; None if more than that counts, or if it cannot be read, which is told elsewhere."""
    if file.suffix.lower() == ".gltf":  # its buffers may lie beside it
        return None
    try:
        return sha256(file.read_bytes()).digest()
    except OSError:
        return None
