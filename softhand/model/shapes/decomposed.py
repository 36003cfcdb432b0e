"""Meshes that are not convex as unions of convex parts, cut by CoACD.

Wei, Liu, Ling, Su: Approximate convex decomposition for 3D meshes with collision-aware concavity and tree search. ACM
Transactions on Graphics 41(4), 2022. The same mesh, threshold and version of coacd give the same parts.
"""

from __future__ import annotations

import os
import tempfile
import zipfile
from collections.abc import Sequence
from contextlib import suppress
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path

import numpy as np

from softhand.errors import ModelError, SofthandError
from softhand.model.shapes.mesh import as_polyhedron, check_solid
from softhand.model.shapes.mesh_file import Mesh, Triangles
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.union import MOST_PARTS, Off, Part, Union
from softhand.numerics.arrays import Array
from softhand.numerics.kept import own_folder

THRESHOLD = 0.05
"""That of CoACD where nothing else is asked for."""

_SEED = 0
_SAMPLES = 4000  # of the surface of the mesh, beside its vertices


def decompose(
    mesh: Mesh, rotation: Array, centre: Array, threshold: float = THRESHOLD
) -> tuple[tuple[Polyhedron, ...], Off]:
    """The convex parts of a mesh, itself if it is convex, and how far they are off.

    Args:
        mesh: from `mesh_file.read_mesh`.
        rotation: axes of the mesh in the object frame, shape (3, 3).
        centre: its origin there [m], shape (3,).
        threshold: concavity at which CoACD stops to cut, 0.01 to 1; less gives more parts, that fit better.

    Raises:
        ModelError: the mesh is flat, open or inside out, or the parts are too many.
        SofthandError: coacd is not installed.
    """
    vertices, triangles = check_solid(mesh)
    with suppress(ModelError):  # it is not convex, or has too many faces for one polyhedron
        return (as_polyhedron(mesh, rotation, centre),), Off(0.0, 0.0)
    parts = tuple(
        as_polyhedron(Mesh(points, np.zeros((0, 3), np.int64), mesh.name), rotation, centre, take_hull=True)
        for points in _corners_of_parts(vertices, triangles, threshold)
    )
    if len(parts) > MOST_PARTS:
        raise ModelError(
            f"mesh {mesh.name}: cut into {len(parts)} parts, more than {MOST_PARTS}; raise object.decompose_threshold "
            f"from {threshold:g}.",
            file=mesh.name,
        )
    return parts, _off(parts, centre + vertices @ rotation.T, triangles)


def _off(parts: Sequence[Part], vertices: Array, triangles: Triangles) -> Off:
    """See `Off`; vertices in the object frame."""
    a, b, c = vertices[triangles].transpose(1, 0, 2)
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    rng = np.random.default_rng(_SEED)
    chosen = rng.choice(len(triangles), _SAMPLES, p=areas / areas.sum())
    u, v = rng.random((2, _SAMPLES, 1))
    u, v = np.where(u + v > 1.0, 1.0 - u, u), np.where(u + v > 1.0, 1.0 - v, v)
    points = np.concatenate([vertices, a[chosen] + u * (b - a)[chosen] + v * (c - a)[chosen]])
    union = Union.of(tuple(parts))
    distances = np.array([union.near(point)[6] for point in points])
    return Off(max(-float(distances.min()), 0.0), max(float(distances.max()), 0.0))


def _corners_of_parts(vertices: Array, triangles: Triangles, threshold: float) -> list[Array]:
    """The vertices of each part [m]; those of before, if the same was asked for."""
    try:
        import coacd
    except ModuleNotFoundError as error:
        raise SofthandError(
            "object.decompose needs the package 'coacd', which is not installed; install it with: pip install "
            "'softhand[decompose]'. Or give the URDF a <collision> for each convex part.",
            extra="decompose",
        ) from error
    digest = sha256(f"{version('coacd')} {threshold!r} {_SEED} {vertices.shape} ".encode())
    digest.update(vertices.tobytes() + triangles.tobytes())
    file = own_folder("decomposed") / f"{digest.hexdigest()[:32]}.npz"
    found = _read(file)
    if found is None:
        coacd.set_log_level("error")
        size = float(np.max(np.ptp(vertices, axis=0)))
        parts = coacd.run_coacd(
            coacd.Mesh(vertices / size, triangles), threshold=threshold, seed=_SEED, max_convex_hull=MOST_PARTS
        )
        found = [size * np.asarray(points, dtype=float) for points, _ in parts]
        _write(file, found)
    return found


def _read(file: Path) -> list[Array] | None:
    """What `_write` wrote; None if it is not there, or damaged."""
    try:
        with np.load(file, allow_pickle=False) as kept:
            found = [np.asarray(kept[f"arr_{k}"], dtype=float) for k in range(len(kept.files))]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None
    is_whole = all(part.ndim == 2 and part.shape[1] == 3 and np.isfinite(part).all() for part in found)
    return found if found and is_whole else None


def _write(file: Path, parts: list[Array]) -> None:
    """Keep the parts for the next time; nothing is lost where that is not possible."""
    with suppress(OSError):
        handle, draft = tempfile.mkstemp(dir=file.parent, suffix=".npz")
        with os.fdopen(handle, "wb") as target:
            np.savez_compressed(target, *parts)
        os.replace(draft, file)
