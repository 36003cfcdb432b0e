"""What a URDF says about looks: the shapes of its links as triangles."""

from __future__ import annotations

from typing import NamedTuple

import coal
import numpy as np

from softhand.errors import ModelError
from softhand.model.shapes.mesh_file import read_mesh
from softhand.model.urdf.geometry import Geometry, Purpose
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array
from softhand.viewer.scene.palette import Colour
from softhand.viewer.scene.poses import pose
from softhand.viewer.scene.shapes.mesh import Mesh
from softhand.viewer.scene.shapes.solids import box, capsule, cylinder, sphere

_LONGEST = 100_000_000  # bytes of a mesh that is drawn
_MOST_TRIANGLES = 1_000_000
_OWN = (".dae", ".ply", ".glb", ".gltf")  # as contacts have them: coal leaves out units, or cannot read them


class Visual(NamedTuple):
    """One visual shape of a link."""

    link: str
    mesh: Mesh
    pose: Array
    """In the frame of the link, shape (4, 4)."""
    colour: Colour | None
    """None if the URDF gives none."""


def read_visuals(urdf: Urdf, purpose: Purpose = "visual") -> tuple[list[Visual], list[str]]:
    """The shapes of all links for the eye, or those for contacts, and the meshes that cannot be read."""
    visuals, unread = [], []
    for shape in urdf.geometries(purpose):
        mesh = _mesh_of(shape)
        if mesh is None:
            unread.append(shape.filename)
        else:
            visuals.append(Visual(shape.link, mesh, pose(shape.rotation, shape.position), shape.colour))
    return visuals, unread


def _mesh_of(shape: Geometry) -> Mesh | None:
    size = shape.size.tolist()
    if shape.kind == "box":
        return box(size)
    if shape.kind == "sphere":
        return sphere(*size)
    if shape.kind == "cylinder":
        return cylinder(*size)
    return capsule(*size) if shape.kind == "capsule" else _read_mesh(shape)


def _read_mesh(shape: Geometry) -> Mesh | None:
    if shape.file is None:
        return None
    if shape.file.suffix.lower() in _OWN:
        try:
            read = read_mesh(shape.file, shape.size, _MOST_TRIANGLES)
        except ModelError:
            return None
        return Mesh(read.vertices, read.triangles.astype(np.int32))
    try:
        if not 0 < shape.file.stat().st_size <= _LONGEST:
            return None
        model = coal.MeshLoader().load(str(shape.file), shape.size)
    except (OSError, ValueError, RuntimeError):
        return None
    faces = [[triangle[k] for k in range(3)] for triangle in (model.tri_indices(i) for i in range(model.num_tris))]
    return Mesh(np.array(model.vertices(), dtype=float), np.array(faces, dtype=np.int32))
