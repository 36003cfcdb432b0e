"""PLY files, as text and binary in both orders of bytes."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from softhand.model.shapes.pieces import Pieces, Triangles, check_count, fans
from softhand.numerics.arrays import Array

_HEADER = 65536  # bytes
_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")


class _Property(NamedTuple):
    name: str
    kind: str
    """Of the number, or of each entry of a list."""
    length: str = ""
    """Kind of the length of a list; "" if it is none."""


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)


def read_ply(data: bytes, most: int) -> tuple[Array, Triangles]:
    """Vertices and triangles of a PLY file; faces of more corners become fans.

    Args:
        data: the file.
        most: triangles that are read.

    Raises:
        ValueError: it is none, or has too many.
    """
    order, elements, start = _header(data)
    body = data[start:]
    vertices, faces = np.zeros((0, 3)), (np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))
    for element in elements:
        check_count(element.count if element.name == "face" else element.count // 3, most, f"{element.name}s")
        if not order:
            rows, body = _lines(body, element.count)
            if element.name == "vertex":
                vertices = _text_vertices(element, rows)
            elif element.name == "face":
                faces = _text_faces(element, rows)
        elif element.name == "face":
            faces = _binary_faces(element, body, order, most)
        elif any(one.length for one in element.properties):
            raise ValueError(f"the element {element.name} has a list before the faces, which is not read")
        else:
            table, body = _table(element, body, order)
            if element.name == "vertex":
                vertices = np.column_stack([table[axis].astype(float) for axis in "xyz"])
        if element.name == "face":
            break
    sizes, corners = faces
    pieces = Pieces(most)
    pieces.add(vertices, corners[fans(sizes, most)], np.eye(4))
    return pieces.all()


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    end = data.find(b"end_header", 0, _HEADER)
    stop = data.find(b"\n", end) + 1
    lines = data[: max(end, 0)].decode("ascii", "replace").splitlines()
    if end < 0 or not stop or not lines or lines[0].strip() != "ply":
        raise ValueError("it has no header of a PLY file")
    order, elements = None, list[_Element]()
    for line in lines[1:]:
        words = line.split()
        match words:
            case ["format", kind, _] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", name, count] if count.isascii() and count.isdigit():
                elements.append(_Element(name, int(count)))
            case ["property", "list", size, kind, name] if elements and size in _TYPES and kind in _TYPES:
                elements[-1].properties.append(_Property(name, _TYPES[kind], _TYPES[size]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(_Property(name, _TYPES[kind]))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise ValueError(f"its header has a line that is not understood: {line[:60]!r}")
    if order is None:
        raise ValueError("its header has no format")
    for element in elements:
        names = [one.name for one in element.properties]
        plain = {one.name for one in element.properties if not one.length}
        if len(set(names)) < len(names) or (element.name == "vertex" and not {"x", "y", "z"} <= plain):
            raise ValueError(f"its {element.name} has {', '.join(names)[:60]}, and x, y, z are needed")
        if element.name == "face" and not any(_is_corners(one) for one in element.properties):
            raise ValueError("its faces have no list of vertices")
    return order, elements, stop


def _lines(body: bytes, count: int) -> tuple[list[bytes], bytes]:
    parts = body.split(b"\n", count)
    if len(parts) < count or (len(parts) == count and not parts[-1].strip()):
        raise ValueError(f"it ends after {len(parts)} of {count} lines")
    return parts[:count], parts[count] if len(parts) > count else b""


def _is_corners(one: _Property) -> bool:
    return one.name in _CORNERS and one.length[:1] in ("i", "u") and one.kind[:1] in ("i", "u")


def _text_vertices(element: _Element, rows: list[bytes]) -> Array:
    places = [[one.name for one in element.properties].index(axis) for axis in "xyz"]
    words = [row.split() for row in rows]
    if any(len(row) <= max(places) for row in words):
        raise ValueError("a vertex has fewer numbers than the header says")
    return np.array([[float(row[place]) for place in places] for row in words], dtype=float).reshape(-1, 3)


def _text_faces(element: _Element, rows: list[bytes]) -> tuple[Triangles, Triangles]:
    sizes, corners = [], list[int]()
    for row in rows:
        words, at = row.split(), 0
        for one in element.properties:
            size = int(words[at]) if one.length and at < len(words) else 0
            begin, at = at + bool(one.length), at + 1 + size
            if size < 0 or at > len(words):
                raise ValueError("a face has fewer numbers than it says")
            if _is_corners(one):
                sizes.append(size)
                corners += map(int, words[begin:at])
    return np.array(sizes, dtype=np.int64), np.array(corners, dtype=np.int64)


def _table(element: _Element, body: bytes, order: str) -> tuple[np.ndarray, bytes]:
    kind = np.dtype([(one.name, order + one.kind) for one in element.properties])
    size = kind.itemsize * element.count
    if size > len(body):
        raise ValueError(f"it ends before its {element.count} {element.name}s do")
    return np.frombuffer(body[:size], kind), body[size:]


def _binary_faces(element: _Element, body: bytes, order: str, most: int) -> tuple[Triangles, Triangles]:
    found = _triangles(element, body, order)
    if found is not None:
        return np.full(element.count, 3, dtype=np.int64), found
    sizes, parts, at, total = [], [np.zeros(0, dtype=np.int64)], 0, 0
    for _ in range(element.count):
        for one in element.properties:
            kind, size = np.dtype(order + one.kind), 1
            if one.length:
                count_kind = np.dtype(order + one.length)
                _check_end(body, at + count_kind.itemsize)
                size, at = int(np.frombuffer(body, count_kind, 1, at)[0]), at + count_kind.itemsize
            begin, at = at, at + size * kind.itemsize
            if size < 0:
                raise ValueError("a face has fewer than no vertices")
            _check_end(body, at)
            if _is_corners(one):
                total += size
                check_count(total // 3, most)
                parts.append(np.frombuffer(body, kind, size, begin).astype(np.int64))
                sizes.append(size)
    return np.array(sizes, dtype=np.int64), np.concatenate(parts)


def _triangles(element: _Element, body: bytes, order: str) -> Triangles | None:
    """The corners if each face has three of them and no other list."""
    if sum(bool(one.length) for one in element.properties) != 1:
        return None
    kinds: list[tuple[str, str] | tuple[str, str, int]] = []
    for one in element.properties:
        kinds += (
            [("size", order + one.length), ("corners", order + one.kind, 3)]
            if one.length
            else [(f"p {one.name}", order + one.kind)]
        )
    table_kind = np.dtype(kinds)
    size = table_kind.itemsize * element.count
    table = np.frombuffer(body[:size], table_kind) if size <= len(body) else None
    return None if table is None or (table["size"] != 3).any() else table["corners"].astype(np.int64).ravel()


def _check_end(body: bytes, end: int) -> None:
    if end > len(body):
        raise ValueError("it ends before its faces do")
