"""Mesh files, read with all digits that they have: STL and OBJ, and the formats that have a file each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from softhand.errors import ModelError
from softhand.files import read_regular
from softhand.model.shapes.collada import read_collada
from softhand.model.shapes.gltf import read_gltf
from softhand.model.shapes.pieces import MOST_TRIANGLES, Triangles, check_count
from softhand.model.shapes.ply import read_ply
from softhand.numerics.arrays import Array

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


FORMATS = (".stl", ".obj", ".dae", ".ply", ".glb", ".gltf")
"""Suffixes of the formats that are read."""


def read_mesh(file: Path, scale: Array, most: int = MOST_TRIANGLES) -> Mesh:
    """The triangles of a mesh file, along its axes; the unit that a COLLADA file has is applied.

    Args:
        file: of the mesh; its suffix tells the format, one of `FORMATS`.
        scale: along each axis, as in the URDF, shape (3,).
        most: triangles that are read.

    Raises:
        ModelError: it cannot be read, has no triangles, numbers that are none, or a size that no object has.
    """
    suffix, again = file.suffix.lower(), "export it again as STL or OBJ"
    if suffix not in FORMATS:
        raise refused(
            file.name, f"has the format '{file.suffix}'",
            f"convert it to one of {', '.join(FORMATS)}",
        )  # fmt: skip
    try:
        data = read_regular(file, _LONGEST)
    except ValueError as error:
        raise refused(file.name, str(error), again) from error
    except OSError as error:
        raise refused(file.name, f"cannot be read: {error}", "make it readable") from error
    try:
        with np.errstate(all="ignore"):  # what is no number is told below
            vertices, triangles = _read(suffix, data, most, file.parent)
    except (ValueError, IndexError) as error:
        raise refused(file.name, f"cannot be read: {error}", f"simplify it, or {again}") from error
    if not len(triangles):
        raise refused(file.name, "has no triangles", "export the surface of a solid")
    used, index = np.unique(triangles, return_inverse=True)
    with np.errstate(all="ignore"):
        vertices, triangles = vertices[used] * scale, index.reshape(-1, 3)
        size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if not np.isfinite(vertices).all():
        raise refused(file.name, "has a vertex that is NaN or infinite", "export it again")
    if not 0.0 < size < _LARGEST:
        raise refused(
            file.name, f"is {size:.3g} m large",
            f'an object has less than {_LARGEST:g} m; if the mesh is in millimetres, write scale="0.001 0.001 0.001"',
        )  # fmt: skip
    return Mesh(vertices, triangles[:, ::-1] if np.prod(scale) < 0.0 else triangles, file.name)


def _read(suffix: str, data: bytes, most: int, folder: Path) -> tuple[Array, Triangles]:
    match suffix:
        case ".stl":
            return _read_stl(data, most)
        case ".obj":
            return _read_obj(data, most)
        case ".dae":
            return read_collada(data, most)
        case ".ply":
            return read_ply(data, most)
        case _:
            return read_gltf(data, most, folder)


def refused(name: str, what: str, remedy: str) -> ModelError:
    """The error for a mesh."""
    return ModelError(f"mesh {name} {what}; {remedy}.", file=name)


def _read_stl(data: bytes, most: int) -> tuple[Array, Triangles]:
    count = int.from_bytes(data[_HEADER - 4 : _HEADER], "little")
    if len(data) == _HEADER + _RECORD.itemsize * count:
        check_count(count, most)
        corners = np.frombuffer(data, _RECORD, offset=_HEADER)["corners"].astype(np.float64).reshape(-1, 3)
    elif data.lstrip()[:5].lower() == b"solid":
        check_count(data.count(b"vertex") // 3, most)
        rows = (line.split() for line in data.split(b"\n"))
        corners = _points(row[1:] for row in rows if row[:1] == [b"vertex"])
    else:
        raise ValueError(
            f"neither a text nor a binary STL, which would have {_HEADER} + 50 n bytes; it has {len(data)}"
        )
    if len(corners) % 3:
        raise ValueError("not three vertices of three numbers to each triangle")
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    return vertices, index.reshape(-1, 3)


def _read_obj(data: bytes, most: int) -> tuple[Array, Triangles]:
    check_count(data.count(b"\nf"), most)
    check_count(data.count(b"\nv ") // 3, most, "vertices without triangles")
    points: list[list[bytes]] = []
    triangles: list[tuple[int, int, int]] = []
    for number, line in enumerate(data.replace(b"\\\n", b" ").split(b"\n"), start=1):
        words = line.split()
        if words[:1] == [b"v"]:
            if len(words) < 4:
                raise ValueError(f"line {number} has a vertex of fewer than three numbers")
            points.append(words[1:4])
        elif words[:1] == [b"f"]:
            corners = [int(word.split(b"/")[0]) for word in words[1:]]
            places = [corner - 1 if corner > 0 else len(points) + corner for corner in corners]
            if len(places) < 3 or not all(0 <= place < len(points) for place in places):
                raise ValueError(
                    f"line {number} has a face with fewer than three vertices or with one that is not there"
                )
            triangles += [(places[0], places[k], places[k + 1]) for k in range(1, len(places) - 1)]
            check_count(len(triangles), most)
    return _points(points), np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _points(rows: Iterable[list[bytes]]) -> Array:
    """Vertices of three numbers each, shape (n, 3)."""

    def numbers() -> Iterator[float]:
        for row in rows:
            if len(row) != 3:
                raise ValueError(f"a vertex of {len(row)} numbers, three are needed: {b' '.join(row)[:60]!r}")
            yield from map(float, row)

    return np.fromiter(numbers(), dtype=float).reshape(-1, 3)
