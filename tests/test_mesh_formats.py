"""COLLADA, PLY and glTF: read as another reader has them, in metres, and nothing else is done with a file."""

from __future__ import annotations

import base64
import json
import struct
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from softhand.errors import ModelError
from softhand.model.body import ObjectModel
from softhand.model.shapes.mesh_file import FORMATS, Mesh, read_mesh
from softhand.model.shapes.pieces import fans, strips
from softhand.viewer.scene.visuals import read_visuals

ONE = np.ones(3)
CORNERS = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.03]])
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
"""A tetrahedron with three different edges at a corner."""

DAE = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="x" meter="{meter}"/><up_axis>{up}</up_axis></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="12">0 0 0 10 0 0 0 20 0 0 0 30</float_array>
      <technique_common><accessor source="#pa" count="4" stride="3"/></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
    {primitive}
  </mesh></geometry></library_geometries>
  <library_nodes><node id="n"><instance_geometry url="#g"/></node></library_nodes>
  <library_visual_scenes><visual_scene id="s"><node>{place}<instance_geometry url="#g"/></node></visual_scene>
  </library_visual_scenes><scene><instance_visual_scene url="#s"/></scene>
</COLLADA>"""
SOURCE = '<input semantic="VERTEX" source="#v" offset="0"/>'
TRIANGLES = (
    f'<triangles count="4">{SOURCE}<input semantic="NORMAL" source="#p" offset="1"/>'
    "<p>0 0 2 0 1 0 0 1 1 1 3 1 0 2 3 2 2 2 1 3 2 3 3 3</p></triangles>"
)


def dae(meter: str = "0.001", up: str = "Z_UP", primitive: str = TRIANGLES, place: str = "") -> str:
    return DAE.format(meter=meter, up=up, primitive=primitive, place=place)


def assert_same(found: Mesh, vertices: np.ndarray, triangles: np.ndarray, close: float = 1e-9) -> None:
    """The same triangles with the same sides, in any order, their corners at the same places."""
    far, place = cKDTree(vertices).query(found.vertices)
    assert far.max() < close

    def begun(rows: np.ndarray) -> list[tuple[int, ...]]:
        return sorted(tuple(np.roll(row, -int(np.argmin(row)))) for row in rows)

    assert begun(place[found.triangles]) == begun(triangles)


def read(text: str | bytes, name: str, folder: Path, scale: np.ndarray = ONE) -> Mesh:
    file = folder / name
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_mesh(file, scale)


# ----------------------------------------------------------------------------------------------------- as others have


def solid() -> trimesh.Trimesh:
    """A body of some hundred triangles, all different."""
    found = trimesh.creation.icosphere(2, 0.03)
    found.vertices = found.vertices * [1.0, 0.7, 0.5] + [0.01, 0.02, 0.03]
    return found


def placed() -> trimesh.Scene:
    """Two bodies, turned, mirrored and scaled within one file."""
    scene = trimesh.Scene()
    turn = trimesh.transformations.euler_matrix(0.3, -0.5, 0.7)
    turn[:3, 3] = 0.1, -0.2, 0.3
    scene.add_geometry(solid(), transform=turn)
    scene.add_geometry(trimesh.creation.box([0.02, 0.03, 0.04]), transform=turn @ np.diag([2.0, -1.0, 0.5, 1.0]))
    return scene


@pytest.mark.parametrize("name", ["a.stl", "a.obj", "a.ply", "text.ply", "a.dae", "a.glb"])
def test_a_body_is_the_same_in_all_formats(name: str, tmp_path: Path) -> None:
    """What trimesh writes has all its triangles, turned as they were."""
    body = solid()
    body.export(tmp_path / name, **({"encoding": "ascii"} if name == "text.ply" else {}))
    found = read_mesh(tmp_path / name, ONE)
    assert_same(found, body.vertices, body.faces, 3e-8)


@pytest.mark.parametrize("name", ["a.glb", "b.gltf", "c.dae"])
def test_nodes_are_at_their_places(name: str, tmp_path: Path) -> None:
    """The scene of trimesh, as it places it itself; a part that is mirrored still has its triangles outward."""
    scene = placed()
    if name.endswith(".gltf"):
        for part, data in trimesh.exchange.gltf.export_gltf(scene).items():
            (tmp_path / (name if part.endswith(".gltf") else part)).write_bytes(data)
    elif name.endswith(".dae"):
        one = scene.to_geometry()
        one.export(tmp_path / name)
    else:
        scene.export(tmp_path / name)
    found, expected = read_mesh(tmp_path / name, ONE), scene.to_geometry()
    assert len(found.triangles) == len(expected.faces)
    assert_allclose(found.vertices.min(axis=0), expected.bounds[0], atol=1e-7)
    assert_allclose(found.vertices.max(axis=0), expected.bounds[1], atol=1e-7)
    a, b, c = (found.vertices[found.triangles[:, k]] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6.0
    assert_allclose(volume, solid().volume + 0.02 * 0.03 * 0.04, rtol=1e-5)


@pytest.mark.parametrize("order", ["<", ">"])
def test_ply_with_polygons_and_other_numbers(order: str, tmp_path: Path) -> None:
    """Both orders of bytes; a colour before and behind the corners, a quadrangle, another element before."""
    name = {"<": "little", ">": "big"}[order]
    header = (
        f"ply\nformat binary_{name}_endian 1.0\ncomment a\nelement camera 1\nproperty double f\nelement vertex 5\n"
        "property uchar red\nproperty double x\nproperty double y\nproperty double z\nelement face 2\n"
        "property uchar red\nproperty list uchar int vertex_indices\nproperty float q\nend_header\n"
    )
    points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1)]
    data = struct.pack(order + "d", 7.0) + b"".join(struct.pack(order + "B3d", 9, *p) for p in points)
    data += struct.pack(order + "BB4if", 1, 4, 0, 1, 2, 3, 0.5) + struct.pack(order + "BB3if", 1, 3, 0, 1, 4, 0.5)
    found = read(header.encode() + data, "a.ply", tmp_path)
    expected = np.array(points, float), np.array([[0, 1, 2], [0, 2, 3], [0, 1, 4]])
    assert_same(found, *expected)
    text = header.replace(f"binary_{name}_endian", "ascii") + "7\n" + "".join(f"9 {x} {y} {z}\n" for x, y, z in points)
    text += "1 4 0 1 2 3 0.5\n1 3 0 1 4 0.5\n"
    assert_same(read(text, "b.ply", tmp_path), *expected)


# ---------------------------------------------------------------------------------------------------- units and axes


@pytest.mark.parametrize(("meter", "size"), [("0.001", 1.0), ("0.0254", 25.4), ("1", 1000.0)])
@pytest.mark.parametrize("up", ["X_UP", "Y_UP", "Z_UP"])
def test_the_unit_of_a_file_counts_and_its_axis_does_not(meter: str, size: float, up: str, tmp_path: Path) -> None:
    """Inches are inches; coordinates stay as they stand, along the axes that they are written for."""
    found = read(dae(meter, up), "a.dae", tmp_path, 1e-3 * ONE)
    assert_same(found, 1e-3 * size * CORNERS, FACES)


def test_scale_of_the_urdf_comes_on_top(tmp_path: Path) -> None:
    """Along each axis; one that mirrors turns the triangles over."""
    found = read(dae(), "a.dae", tmp_path, np.array([1.0, 2.0, -1.0]))
    assert_allclose(found.vertices.max(axis=0) + found.vertices.min(axis=0), [0.01, 0.04, -0.03])
    a, b, c = (found.vertices[found.triangles[:, k]] for k in range(3))
    assert np.einsum("ij,ij->", a, np.cross(b, c)) > 0.0


PRIMITIVES = {
    "polylist": "<polylist count='4'>{}<vcount>3 3 3 3</vcount><p>0 2 1 0 1 3 0 3 2 1 2 3</p></polylist>",
    "polygons": "<polygons count='4'>{}<p>0 2 1</p><p>0 1 3</p><p>0 3 2</p><p>1 2 3</p></polygons>",
    "trifans": "<trifans count='2'>{}<p>0 2 1 3 2</p><p>1 2 3</p></trifans>",
    "tristrips": "<tristrips count='2'>{}<p>0 2 1 3</p><p>3 2 0</p><p>0 1 3</p></tristrips>",
}


@pytest.mark.parametrize("kind", ["polylist", "polygons", "trifans"])
def test_other_primitives_of_collada(kind: str, tmp_path: Path) -> None:
    """The same tetrahedron."""
    found = read(dae(primitive=PRIMITIVES[kind].format(SOURCE)), "a.dae", tmp_path)
    assert_same(found, CORNERS, FACES)


def test_strips_and_fans_keep_the_side() -> None:
    """Of a strip every second triangle is turned; of a fan none."""
    assert strips([4, 2, 3], 10).tolist() == [[0, 1, 2], [2, 1, 3], [6, 7, 8]]
    assert fans(np.array([4, 2, 3]), 10).tolist() == [[0, 1, 2], [0, 2, 3], [6, 7, 8]]


def test_nodes_of_collada_move_what_is_in_them(tmp_path: Path) -> None:
    """Translate, rotate, scale and matrix, in their order; a node of the library is found."""
    place = (
        "<translate>1 2 3</translate><rotate>0 0 1 90</rotate><scale>1 2 1</scale>"
        '<matrix>1 0 0 5 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_node url="#n"/>'
    )
    found = read(dae(place=place), "a.dae", tmp_path)
    assert len(found.triangles) == 8
    x, y, z = 1e3 * found.vertices.T
    assert_allclose([x.min(), x.max(), y.min(), y.max(), z.min(), z.max()], [-39, 1, 7, 17, 3, 33], atol=1e-9)


@pytest.mark.parametrize("name", ["a.dae", "a.glb", "a.ply"])
def test_an_object_is_held_and_drawn_by_such_a_mesh(name: str, tmp_path: Path) -> None:
    """Collision, inertia and picture of one file agree."""
    solid().convex_hull.export(tmp_path / name)
    mesh = f'<geometry><mesh filename="{name}"/></geometry>'
    (tmp_path / "a.urdf").write_text(
        f'<robot name="a"><link name="b"><visual>{mesh}</visual><collision>{mesh}</collision></link></robot>'
    )
    body = ObjectModel.read(tmp_path / "a.urdf", density=1000.0)
    model, shape = body.build()
    hull = solid().convex_hull
    assert_allclose(model.inertias[1].mass, 1000.0 * hull.volume, rtol=1e-5)
    assert_allclose(model.inertias[1].lever, hull.center_mass, atol=1e-7)
    expected = 1000.0 * hull.moment_inertia
    assert_allclose(model.inertias[1].inertia, expected, atol=1e-4 * np.trace(expected))
    point, _ = shape.nearest(np.array([1.0, 0.02, 0.03]))
    assert_allclose(point, [0.04, 0.02, 0.03], atol=1e-6)
    visuals, unread = read_visuals(body.urdf)
    drawn = visuals[0].mesh.vertices
    assert not unread
    assert_allclose([drawn.min(axis=0), drawn.max(axis=0)], hull.bounds, atol=1e-7)


# --------------------------------------------------------------------------------------------------- files of strangers


def glb(document: dict, binary: bytes = b"") -> bytes:
    text = json.dumps(document).encode()
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(binary), 0x004E4942) + binary
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def document(**changes: object) -> dict:
    found = {
        "asset": {"version": "2.0"},
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5121, "count": 12, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{"byteLength": 60}],
    }
    return {**found, **changes}


BINARY = CORNERS.astype("<f4").tobytes() + FACES.astype("u1").tobytes()


def test_a_glb_by_hand(tmp_path: Path) -> None:
    """And the same as .gltf, with its buffer as base64 and beside it."""
    uri = "data:application/octet-stream;base64," + base64.b64encode(BINARY).decode()
    (tmp_path / "a.bin").write_bytes(BINARY)
    for name, data in (
        ("a.glb", glb(document(), BINARY)),
        ("b.gltf", json.dumps(document(buffers=[{"byteLength": 60, "uri": uri}])).encode()),
        ("c.gltf", json.dumps(document(buffers=[{"byteLength": 60, "uri": "a.bin"}])).encode()),
    ):
        assert_same(read(data, name, tmp_path), CORNERS, FACES)


def beyond(**accessor: object) -> bytes:
    first, second = document()["accessors"]
    return glb(document(accessors=[{**first, **accessor}, second]), BINARY)


BOMB = "".join(
    f'<node id="n{k}"><instance_node url="#n{k + 1}"/><instance_node url="#n{k + 1}"/></node>' for k in range(60)
)
LONG_FACE = PRIMITIVES["polylist"].format(SOURCE).replace("3 3 3 3<", "3 3 999999999999 3<")
NO_VIEW = [{"componentType": 5126, "count": 10**12, "type": "VEC3"}] * 2
PLY = "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nend_header\n{}"
REFUSED: dict[str, tuple[str, str | bytes, str]] = {
    "document type": ("a.dae", '<!DOCTYPE a [<!ENTITY b "c">]>' + dae()[38:], "DOCTYPE"),
    "no XML": ("a.dae", "<COLLADA>", "is not XML"),
    "another root": ("a.dae", "<html/>", "its root element"),
    "a zip": ("a.dae", b"PK\x03\x04" + bytes(100), "is not XML"),
    "deep": ("a.dae", "<a>" * 5000, "nested too deeply"),
    "nodes that double": (
        "a.dae",
        dae(place='<instance_node url="#n0"/>').replace('<node id="n">', BOMB + '<node id="n60">'),
        "nodes",
    ),
    "a node in itself": (
        "a.dae",
        dae(place='<instance_node url="#n"/>').replace('<node id="n">', '<node id="n"><instance_node url="#n"/>'),
        "nodes",
    ),
    "far vertex": ("a.dae", dae(primitive=TRIANGLES.replace("2 3 3 3<", "2 3 9 3<")), "not there"),
    "far file": ("a.dae", dae().replace('url="#g"', 'url="http://127.0.0.1:1/a.dae#g"'), "not in the file"),
    "words": ("a.dae", dae().replace("0 20 0", "0 many 0"), "text where numbers"),
    "vcount": ("a.dae", dae(primitive=LONG_FACE), "vcount"),
    "unit": ("a.dae", dae("-1"), "its unit"),
    "unit of no number": ("a.dae", dae("inf"), "its unit"),
    "NaN": ("a.dae", dae().replace("0 20 0", "0 nan 0"), "NaN"),
    "compressed": ("a.glb", glb(document(extensionsRequired=["KHR_draco_mesh_compression"]), BINARY), "compressed"),
    "sparse": ("a.glb", beyond(sparse={}), "sparse"),
    "no view": ("a.glb", glb(document(accessors=NO_VIEW)), "sparse"),
    "many": ("a.glb", beyond(count=10**9), "at most"),
    "beyond": ("a.glb", beyond(count=5), "beyond its buffer"),
    "negative": ("a.glb", beyond(byteOffset=-4), "place or a count"),
    "other type": ("a.glb", beyond(type="VEC4"), "another type"),
    "nodes in a ring": ("a.glb", glb(document(nodes=[{"children": [0]}]), BINARY), "nodes"),
    "version 1": ("a.glb", glb(document(asset={"version": "1.0"}), BINARY), "2.0 is read"),
    "cut off": ("a.glb", glb(document(), BINARY)[:-30], "cut off"),
    "a list": ("a.gltf", "[" * 100_000, "no sound glTF"),
    "a file above": ("a.gltf", json.dumps(document(buffers=[{"uri": "../a.bin"}])), "beside it"),
    "a file of the system": ("a.gltf", json.dumps(document(buffers=[{"uri": "/etc/passwd"}])), "beside it"),
    "the network": ("a.gltf", json.dumps(document(buffers=[{"uri": "http://127.0.0.1:1/a"}])), "beside it"),
    "no PLY": ("a.ply", b"plx\nend_header\n", "header"),
    "endless PLY": ("a.ply", PLY.format("ascii", 99999999999, ""), "at most"),
    "short PLY": ("a.ply", PLY.format("binary_little_endian", 9, "1"), "ends before"),
    "a plane PLY": ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "x, y, z"),
    "another format": ("a.fbx", b"", ", ".join(FORMATS)),
}  # fmt: skip


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_refused(case: str, tmp_path: Path) -> None:
    """One line with the name of the file, what is wrong and what to do, at once."""
    name, data, words = REFUSED[case]
    start = time.process_time()
    with pytest.raises(ModelError) as caught:
        read(data, name, tmp_path)
    said = str(caught.value)
    assert words in said and said.startswith(f"mesh {name} ") and "\n" not in said and len(said) < 400
    assert time.process_time() - start < 1.0


def many_in_dae(count: int) -> str:
    return dae(primitive=TRIANGLES * count)


def many_in_glb(count: int) -> bytes:
    nodes = [{"mesh": 0, "children": list(range(1, count))}, *[{"mesh": 0}] * (count - 1)]
    return glb(document(nodes=nodes), BINARY)


@pytest.mark.parametrize(("name", "make", "count"), [("a.dae", many_in_dae, 5_000), ("a.glb", many_in_glb, 5_000)])
def test_what_is_there_often_is_counted(
    name: str, make: Callable[[int], str | bytes], count: int, tmp_path: Path
) -> None:
    """A few triangles, thousands of times: refused before they fill the memory."""
    assert len(read(make(3), name, tmp_path).triangles) == 12
    with pytest.raises(ModelError, match=r"at most 4000 are read|more than 4000 nodes"):
        read(make(count), name, tmp_path)
