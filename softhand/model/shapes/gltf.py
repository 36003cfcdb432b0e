"""glTF 2.0 files, .glb and .gltf: their triangles, with all nodes at their places."""

from __future__ import annotations

import base64
import binascii
import json
from pathlib import Path
from typing import Any

import numpy as np

from softhand.files import read_regular
from softhand.model.shapes.pieces import Pieces, Triangles, check_count, fans, strips
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import cross_matrix

_LONGEST_JSON, _LONGEST = 16_000_000, 100_000_000  # bytes
_TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_MOST_NODES, _DEEPEST = 4_000, 64
_JSON, _BIN = 0x4E4F534A, 0x004E4942


def read_gltf(data: bytes, most: int, folder: Path) -> tuple[Array, Triangles]:
    """Vertices [m] and triangles of the scene, along the axes of the file.

    glTF says that y is up. In a URDF its coordinates are taken as they stand, as by other readers of URDFs.

    Args:
        data: the file.
        most: triangles that are read.
        folder: of the file, where its buffers may lie beside it.

    Raises:
        ValueError: it is none, needs an extension for its vertices, or has too many triangles.
    """
    try:
        text, binary = _chunks(data) if data[:4] == b"glTF" else (data, b"")
        if len(text) > _LONGEST_JSON:
            raise ValueError(f"its JSON is longer than {_LONGEST_JSON} bytes")
        return _Reader(json.loads(text), binary, folder, most).read()
    except (KeyError, TypeError, IndexError, AttributeError, OverflowError, RecursionError) as error:
        raise ValueError(f"it is no sound glTF: {type(error).__name__} {str(error)[:60]}") from error


def _chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the first binary chunk of a .glb."""
    at, found = 12, dict[int, bytes]()
    while at + 8 <= len(data):
        size, kind = (int.from_bytes(data[at + k : at + k + 4], "little") for k in (0, 4))
        if at + 8 + size > len(data):
            raise ValueError("it is cut off")
        found.setdefault(kind, data[at + 8 : at + 8 + size])
        at += 8 + size
    if _JSON not in found:
        raise ValueError("it has no chunk of JSON")
    return found[_JSON], found.get(_BIN, b"")


class _Reader:
    def __init__(self, document: Any, binary: bytes, folder: Path, most: int) -> None:
        self._document, self._binary, self._folder = document, binary, folder
        self._pieces, self._visited = Pieces(most), 0
        self._most = most
        self._meshes: dict[int, list[tuple[Array, Triangles]]] = {}
        self._buffers: dict[int, bytes] = {}
        self._read_bytes = 0

    def read(self) -> tuple[Array, Triangles]:
        document = self._document
        if not str(document["asset"]["version"]).startswith("2"):
            raise ValueError(f"it is glTF {str(document['asset']['version'])[:10]}, and 2.0 is read")
        packed = [name for name in document.get("extensionsRequired", []) if "compression" in str(name)]
        if packed:
            raise ValueError(f"its vertices are compressed ({str(packed[0])[:40]})")
        nodes = document.get("nodes", [])
        scenes = document.get("scenes", [])
        if scenes:
            roots = scenes[document.get("scene", 0)].get("nodes", [])
        else:
            children = {child for node in nodes for child in node.get("children", [])}
            roots = [k for k in range(len(nodes)) if k not in children]
        for root in roots:
            self._walk(root, np.eye(4), 0)
        return self._pieces.all()

    def _walk(self, index: int, above: Array, depth: int) -> None:
        self._visited += 1
        if self._visited > _MOST_NODES or depth > _DEEPEST:
            raise ValueError(f"it has more than {_MOST_NODES} nodes, or they are nested too deeply")
        node = self._document["nodes"][_index(index)]
        place = above @ _place(node)
        if "mesh" in node:
            for vertices, triangles in self._mesh(_index(node["mesh"])):
                self._pieces.add(vertices, triangles, place)
        for child in node.get("children", []):
            self._walk(child, place, depth + 1)

    def _mesh(self, index: int) -> list[tuple[Array, Triangles]]:
        if index not in self._meshes:
            found = map(self._primitive, self._document["meshes"][index]["primitives"])
            self._meshes[index] = [one for one in found if one is not None]
        return self._meshes[index]

    def _primitive(self, primitive: Any) -> tuple[Array, Triangles] | None:
        """Vertices and triangles; None for points and lines."""
        mode = primitive.get("mode", 4)
        if mode not in (4, 5, 6):
            return None
        vertices = self._accessor(primitive["attributes"]["POSITION"], 3)
        if "indices" in primitive:
            corners = self._accessor(primitive["indices"], 1)[:, 0].astype(np.int64)
        else:
            corners = np.arange(len(vertices))
        n = len(corners)
        if mode == 4:
            return vertices, corners[: n - n % 3].reshape(-1, 3)
        return vertices, corners[strips([n], self._most) if mode == 5 else fans(np.array([n]), self._most)]

    def _accessor(self, index: int, width: int) -> Array:
        """The numbers of an accessor, shape (n, width)."""
        accessor = self._document["accessors"][_index(index)]
        if "sparse" in accessor or "bufferView" not in accessor:
            raise ValueError("it has sparse accessors, which are not read")
        if accessor["type"] != {1: "SCALAR", 3: "VEC3"}[width]:
            raise ValueError("its vertices or triangles have another type than glTF gives them")
        view = self._document["bufferViews"][_index(accessor["bufferView"])]
        kind = np.dtype(_TYPES[accessor["componentType"]])
        count, start = _index(accessor["count"]), _index(accessor.get("byteOffset", 0))
        check_count(count // 3, self._most, "vertices without triangles")
        stride = _index(view.get("byteStride", 0)) or width * kind.itemsize
        buffer, begin = self._buffer(_index(view["buffer"])), _index(view.get("byteOffset", 0))
        block = memoryview(buffer)[begin : begin + _index(view["byteLength"])]
        if count and start + stride * (count - 1) + width * kind.itemsize > len(block):
            raise ValueError("it has numbers that lie beyond its buffer")
        table = (
            np.ndarray((count, width), kind, block, start, (stride, kind.itemsize)) if count else np.zeros((0, width))
        )
        numbers = table.astype(float)
        if accessor.get("normalized") is True and kind.kind != "f":
            numbers = np.maximum(numbers / np.iinfo(kind).max, -1.0)
        return numbers

    def _buffer(self, index: int) -> bytes:
        if index not in self._buffers:
            self._buffers[index] = self._load(self._document["buffers"][index])
            self._read_bytes += len(self._buffers[index])
            if self._read_bytes > _LONGEST:
                raise ValueError(f"its buffers are longer than {_LONGEST} bytes")
        return self._buffers[index]

    def _load(self, buffer: Any) -> bytes:
        uri = buffer.get("uri")
        if uri is None:
            return self._binary
        if uri.startswith("data:"):
            try:
                return base64.b64decode(uri.partition(",")[2], validate=True)
            except binascii.Error as error:
                raise ValueError(f"its buffer is no base64: {error}") from error
        name = Path(uri)
        if ":" in uri or name.is_absolute() or ".." in name.parts:
            raise ValueError(f"its buffer {uri[:60]!r} does not lie beside it")
        try:
            return read_regular(self._folder / name, _LONGEST)
        except OSError as error:
            raise ValueError(f"its buffer {uri[:60]!r} cannot be read: {error}") from error


def _index(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < 1 << 40:
        raise ValueError(f"it has {str(value)[:20]!r} where a place or a count must be")
    return value


def _place(node: Any) -> Array:
    if "matrix" in node:
        return np.array(node["matrix"], dtype=float).reshape(4, 4).T
    place = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0.0, 0.0, 0.0, 1.0)), dtype=float)
    place[:3, :3] = _turn(x, y, z, w) * np.array(node.get("scale", (1.0, 1.0, 1.0)), dtype=float)
    place[:3, 3] = np.array(node.get("translation", (0.0, 0.0, 0.0)), dtype=float)
    return place


def _turn(x: float, y: float, z: float, w: float) -> Array:
    """The rotation of a quaternion of any length."""
    v, square = np.array([x, y, z]), x * x + y * y + z * z + w * w
    if not 0.0 < square < float("inf"):
        raise ValueError("it has a rotation that is none")
    return np.eye(3) + 2.0 / square * (w * cross_matrix(v) + np.outer(v, v) - v @ v * np.eye(3))
