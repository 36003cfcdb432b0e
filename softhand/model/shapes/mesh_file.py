"""STL and OBJ files, read with all digits that they have."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softhand.errors import ModelError
from softhand.numerics.arrays import Array

Triangles = NDArray[np.int64]

_LONGEST = 100_000_000  # bytes
_LARGEST = 10.0  # [m]
_HEADER, _RECORD = 84, np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


@dataclass(frozen=True)
class Mesh:
    """Triangles as they are in a file."""

    vertices: Array
    """[m], shape (n, 3)."""
    triangles: Triangles
    """Counter-clockwise as seen from outside, shape (m, 3)."""
    name: str
    """Of the file, for messages."""


def read_mesh(file: Path, scale: Array) -> Mesh:
    """The triangles of an STL or OBJ file.

    Args:
        file: of the mesh; its suffix tells the format.
        scale: along each axis, as in the URDF, shape (3,).

    Raises:
        ModelError: it cannot be read, has no triangles, numbers that are none, or a size that no object has.
    """
    formats = {".stl": _read_stl, ".obj": _read_obj}
    if file.suffix.lower() not in formats:
        raise refused(file.name, f"has the format '{file.suffix}'", "convert it to .stl or .obj")
    try:
        with file.open("rb") as stream:
            data = stream.read(_LONGEST + 1)
        if len(data) > _LONGEST:
            raise refused(file.name, f"is longer than {_LONGEST // 1_000_000} MB", "simplify it, its hull is enough")
        vertices, triangles = formats[file.suffix.lower()](data)
    except (OSError, ValueError, IndexError) as error:
        raise refused(file.name, f"cannot be read: {error}", "export it again as STL or OBJ") from error
    if not len(triangles):
        raise refused(file.name, "has no triangles", "export the surface of a solid")
    used, index = np.unique(triangles, return_inverse=True)
    vertices, triangles = vertices[used] * scale, index.reshape(-1, 3)
    if not np.isfinite(vertices).all():
        raise refused(file.name, "has a vertex that is NaN or infinite", "export it again")
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if not 0.0 < size < _LARGEST:
        raise refused(
            file.name, f"is {size:.3g} m large",
            f'an object has less than {_LARGEST:g} m; if the mesh is in millimetres, write scale="0.001 0.001 0.001"',
        )  # fmt: skip
    return Mesh(vertices, triangles[:, ::-1] if np.prod(scale) < 0.0 else triangles, file.name)


def refused(name: str, what: str, remedy: str) -> ModelError:
    """The error for a mesh."""
    return ModelError(f"mesh {name} {what}; {remedy}.", file=name)


def _read_stl(data: bytes) -> tuple[Array, Triangles]:
    count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    if len(data) == _HEADER + _RECORD.itemsize * count:
        corners = np.frombuffer(data, _RECORD, offset=_HEADER)["corners"].astype(np.float64)
    elif data.lstrip()[:5].lower() == b"solid":
        rows = [line.split() for line in data.split(b"\n")]
        corners = np.array([[float(word) for word in row[1:]] for row in rows if row[:1] == [b"vertex"]], dtype=float)
    else:
        raise ValueError(
            f"neither a text nor a binary STL, which would have {_HEADER} + 50 n bytes; it has {len(data)}"
        )
    if corners.size % 9 or (corners.size and corners.shape[-1] != 3):
        raise ValueError("not three vertices of three numbers to each triangle")
    vertices, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def _read_obj(data: bytes) -> tuple[Array, Triangles]:
    vertices: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for number, line in enumerate(data.replace(b"\\\n", b" ").split(b"\n"), start=1):
        words = line.split()
        if words[:1] == [b"v"]:
            vertices.append([float(word) for word in words[1:4]])
            if len(words) < 4:
                raise ValueError(f"line {number} has a vertex of fewer than three numbers")
        elif words[:1] == [b"f"]:
            corners = [int(word.split(b"/")[0]) for word in words[1:]]
            places = [corner - 1 if corner > 0 else len(vertices) + corner for corner in corners]
            if len(places) < 3 or not all(0 <= place < len(vertices) for place in places):
                raise ValueError(
                    f"line {number} has a face with fewer than three vertices or with one that is not there"
                )
            triangles += [(places[0], places[k], places[k + 1]) for k in range(1, len(places) - 1)]
    return np.array(vertices, dtype=float).reshape(-1, 3), np.array(triangles, dtype=np.int64).reshape(-1, 3)
