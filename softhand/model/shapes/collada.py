"""COLLADA files: their triangles in metres, with all nodes at their places."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from softhand.model.shapes.pieces import Pieces, Triangles, fans, strips
from softhand.numerics.arrays import Array

_MOVES = ("matrix", "translate", "rotate", "scale", "skew", "lookat")
_LONGEST = 50_000_000  # bytes
_MOST_ELEMENTS, _MOST_NODES, _DEEPEST = 200_000, 4_000, 64


def read_collada(data: bytes, most: int) -> tuple[Array, Triangles]:
    """Vertices [m] and triangles of the scene, along the axes of the file.

    The unit of the file counts and its up_axis does not: URDFs are written for coordinates as they stand in the file,
    as RViz, MoveIt and Gazebo take them, whatever axis it says is up.

    Args:
        data: the file.
        most: triangles that are read.

    Raises:
        ValueError: it is none, has a document type, or too many triangles.
    """
    if len(data) > _LONGEST:
        raise ValueError(f"it is longer than {_LONGEST} bytes")
    try:
        return _Reader(_parse(data), most).read()
    except (KeyError, TypeError, IndexError, AttributeError, OverflowError) as error:
        raise ValueError(f"it is no sound COLLADA: {type(error).__name__} {str(error)[:60]}") from error


def _parse(data: bytes) -> ElementTree.Element:
    """Elements with their texts and without namespaces; nothing is expanded or loaded from elsewhere."""
    builder, parser = ElementTree.TreeBuilder(), expat.ParserCreate()
    parser.buffer_text, parser.buffer_size = True, 1 << 20
    depth = count = 0

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal depth, count
        depth, count = depth + 1, count + 1
        if depth > _DEEPEST or count > _MOST_ELEMENTS:
            raise ValueError(f"it has more than {_MOST_ELEMENTS} elements, or they are nested too deeply")
        builder.start(tag.rpartition(":")[2], attributes)

    def end(tag: str) -> None:
        nonlocal depth
        depth -= 1
        builder.end(tag.rpartition(":")[2])

    def doctype(*_: Any) -> None:
        raise ValueError("it has a <!DOCTYPE>, whose entities can expand without end or read other files")

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = builder.data, doctype
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ValueError(f"it is not XML: {error}") from error
    return builder.close()


class _Reader:
    def __init__(self, root: ElementTree.Element, most: int) -> None:
        if root.tag != "COLLADA":
            raise ValueError(f"its root element is <{root.tag[:20]}>, not <COLLADA>")
        self._root, self._most = root, most
        self._pieces, self._visited = Pieces(most), 0
        self._by_id = {element.get("id"): element for element in root.iter() if element.get("id")}
        self._meshes: dict[str, list[tuple[Array, Triangles]]] = {}

    def read(self) -> tuple[Array, Triangles]:
        unit = self._root.find("asset/unit")
        metre = float(unit.get("meter", "1")) if unit is not None else 1.0
        if not (math.isfinite(metre) and metre > 0.0):
            raise ValueError(f"its unit is {metre:g} m")
        place = np.diag([metre, metre, metre, 1.0])
        scene = self._root.find("scene/instance_visual_scene")
        if scene is None:
            for geometry in self._root.iterfind("library_geometries/geometry"):
                self._add(geometry.get("id", ""), place)
        else:
            for node in self._target(scene).iterfind("node"):
                self._walk(node, place, 0)
        return self._pieces.all()

    def _target(self, element: ElementTree.Element) -> ElementTree.Element:
        url = element.get("url", "")
        if not url.startswith("#") or url[1:] not in self._by_id:
            raise ValueError(f"<{element.tag}> names {url[:60]!r}, which is not in the file")
        return self._by_id[url[1:]]

    def _walk(self, node: ElementTree.Element, above: Array, depth: int) -> None:
        self._visited += 1
        if self._visited > _MOST_NODES or depth > _DEEPEST:
            raise ValueError(f"it has more than {_MOST_NODES} nodes, or they are nested too deeply")
        place = above
        for element in node:
            if element.tag in _MOVES:
                place = place @ _transform(element)
        for element in node:
            if element.tag == "instance_geometry":
                self._add(self._target(element).get("id", ""), place)
            elif element.tag == "instance_node":
                self._walk(self._target(element), place, depth + 1)
            elif element.tag == "node":
                self._walk(element, place, depth + 1)

    def _add(self, name: str, place: Array) -> None:
        if name not in self._meshes:
            self._meshes[name] = list(self._triangles(self._by_id[name]))
        for vertices, triangles in self._meshes[name]:
            self._pieces.add(vertices, triangles, place)

    def _triangles(self, geometry: ElementTree.Element) -> Iterator[tuple[Array, Triangles]]:
        mesh = geometry.find("mesh")
        for primitive in mesh if mesh is not None else ():
            if primitive.tag not in ("triangles", "polylist", "polygons", "tristrips", "trifans"):
                continue
            inputs = [(one.get("semantic"), int(one.get("offset", "0")), one) for one in primitive.iterfind("input")]
            offset, vertices = next((offset, one) for semantic, offset, one in inputs if semantic == "VERTEX")
            stride = 1 + max(offset for _, offset, _ in inputs)
            parts = [_whole(part.text) for part in primitive.iterfind("p")]
            if not 0 <= offset < stride <= 64 or any(len(part) % stride for part in parts):
                raise ValueError(f"the numbers of a <{primitive.tag}> are no multiple of {stride}")
            corners = [part[offset::stride] for part in parts]
            yield self._positions(vertices), self._corners(primitive, corners)

    def _corners(self, primitive: ElementTree.Element, corners: list[Triangles]) -> Triangles:
        flat = np.concatenate([np.zeros(0, dtype=np.int64), *corners])
        sizes = [len(part) for part in corners]
        if primitive.tag == "triangles":
            if len(flat) % 3:
                raise ValueError("its <triangles> have not three vertices each")
            return flat.reshape(-1, 3)
        if primitive.tag == "tristrips":
            return flat[strips(sizes, self._most)]
        if primitive.tag == "polylist":
            counts = _whole(primitive.findtext("vcount"))
            if (len(counts) and not 0 <= counts.min() <= counts.max() <= len(flat)) or counts.sum() != len(flat):
                raise ValueError("the <vcount> of a <polylist> does not fit its <p>")
        else:
            counts = np.array(sizes, dtype=np.int64)
        return flat[fans(counts, self._most)]

    def _positions(self, entry: ElementTree.Element) -> Array:
        """The vertices that the <input> of a primitive names."""
        vertices = self._by_id[entry.get("source", "")[1:]]
        inputs = {one.get("semantic"): one for one in vertices.iterfind("input")}
        source = self._by_id[inputs["POSITION"].get("source", "")[1:]]
        numbers = _floats(source.findtext("float_array"))
        accessor = source.find("technique_common/accessor")
        start, stride = (
            (0, 3)
            if accessor is None
            else (int(accessor.get(word, d)) for word, d in (("offset", "0"), ("stride", "3")))
        )
        if not (0 <= start <= len(numbers) and 3 <= stride <= 64):
            raise ValueError(f"its vertices have a stride of {stride} numbers from {start}")
        numbers = numbers[start:]
        return numbers[: len(numbers) // stride * stride].reshape(-1, stride)[:, :3]


def _transform(element: ElementTree.Element) -> Array:
    """The matrix of an element that moves a node."""
    place = np.eye(4)
    if element.tag == "matrix":
        return _floats(element.text).reshape(4, 4)
    if element.tag == "translate":
        place[:3, 3] = _floats(element.text)
    elif element.tag == "scale":
        place[[0, 1, 2], [0, 1, 2]] = _floats(element.text)
    elif element.tag == "rotate":
        *axis, degrees = _floats(element.text)
        place[:3, :3] = _about(np.array(axis), math.radians(degrees))
    else:
        raise ValueError(f"it has a <{element.tag}>, which is not read")
    return place


def _about(axis: Array, angle: float) -> Array:
    length = float(np.linalg.norm(axis))
    if not length > 0.0:
        return np.eye(3)
    x, y, z = axis / length
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + math.sin(angle) * K + (1.0 - math.cos(angle)) * (K @ K)


def _floats(text: str | None) -> Array:
    return _numbers(text, np.dtype(np.float64))


def _whole(text: str | None) -> Triangles:
    return _numbers(text, np.dtype(np.int64))


def _numbers(text: str | None, kind: np.dtype) -> Any:
    if text is None or not text.strip():
        return np.zeros(0, kind)
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)  # for a text that has something else in it
        try:
            return np.fromstring(text, kind, sep=" ")
        except (DeprecationWarning, ValueError) as error:
            raise ValueError("it has a text where numbers must be") from error
