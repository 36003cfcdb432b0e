"""Meshes of objects: what is read, what is refused and how, and what becomes of the triangles."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hands import HAND_URDF, REPOSITORY, Array, world_from
from hypothesis import given, settings
from hypothesis import strategies as st

from softhand.errors import ModelError
from softhand.model.shapes.mesh import MOST_FACES, as_polyhedron
from softhand.model.shapes.mesh_file import Mesh, read_mesh
from softhand.model.shapes.polyhedron import Polyhedron
from softhand.model.shapes.shape import fibonacci_sphere
from softhand.model.world import World

CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * [0.028, 0.018, 0.030]
SIDES = [[1, 3, 2, 0], [6, 7, 5, 4], [4, 5, 1, 0], [3, 7, 6, 2], [2, 6, 4, 0], [5, 7, 3, 1]]
TRIANGLES = np.array([triangle for a, b, c, d in SIDES for triangle in ((a, b, c), (a, c, d))])


def obj(vertices: Any, faces: Any) -> str:
    """The text of an OBJ file."""
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, dtype=float).tolist()]
    return "\n".join(lines + ["f " + " ".join(str(1 + k) for k in face) for face in faces]) + "\n"


def made(vertices: Any, triangles: Any = TRIANGLES, take_hull: bool = False) -> Polyhedron:
    mesh = Mesh(np.asarray(vertices, dtype=float), np.asarray(triangles), "shape.obj")
    return as_polyhedron(mesh, np.eye(3), np.zeros(3), take_hull)


def refusal(vertices: Any, triangles: Any = TRIANGLES) -> str:
    with pytest.raises(ModelError) as caught:
        made(vertices, triangles)
    return str(caught.value)


def refusal_of_file(file: Path) -> str:
    with pytest.raises(ModelError) as caught:
        read_mesh(file, np.ones(3))
    return str(caught.value)


def binary_stl(corners: Array) -> bytes:
    """A binary STL of triangles, shape (n, 3, 3)."""
    records = b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in corners)
    return bytes(80) + struct.pack("<I", len(corners)) + records


def text_stl(corners: Array) -> str:
    facets = [
        "facet normal 0 0 0\n outer loop\n"
        + "".join("  vertex {!r} {!r} {!r}\n".format(*corner) for corner in triangle.tolist())
        + " endloop\nendfacet\n"
        for triangle in corners
    ]
    return "solid box\n" + "".join(facets) + "endsolid box\n"


# ------------------------------------------------------------------------------------------------------------- reading


@pytest.mark.parametrize("kind", ["obj", "polygons", "slashes", "text", "binary"])
def test_a_box_is_read_from_every_format(kind: str, tmp_path: Path) -> None:
    """OBJ with triangles, with polygons, with textures and relative indices; STL as text and as bytes: six faces."""
    file = tmp_path / ("box.stl" if kind in ("text", "binary") else "box.OBJ")
    if kind == "binary":
        file.write_bytes(binary_stl(CORNERS[TRIANGLES]))
    elif kind == "text":
        file.write_text(text_stl(CORNERS[TRIANGLES]))
    elif kind == "slashes":
        faces = [" ".join(f"{k - 8}/1/{k + 1}" for k in side) for side in SIDES]
        vertices = obj(CORNERS, [])
        file.write_text("# made\nmtllib no.mtl\n" + vertices + "vn 0 0 1\n" + "".join(f"f {face}\n" for face in faces))
    else:
        file.write_text(obj(CORNERS, SIDES if kind == "polygons" else TRIANGLES))
    shape = as_polyhedron(read_mesh(file, np.ones(3)), np.eye(3), np.zeros(3))
    assert len(shape.polygons) == 6 and all(len(polygon) == 4 for polygon in shape.polygons)
    close = 1e-9 if kind == "binary" else 0.0
    np.testing.assert_allclose(np.sort(shape.vertices, axis=0), np.sort(CORNERS, axis=0), atol=close)
    np.testing.assert_allclose(np.abs(shape.normals).max(axis=1), 1.0, atol=1e-6)


def test_scale_and_mirror(tmp_path: Path) -> None:
    """A scale makes metres of millimetres; a mirrored mesh is not inside out."""
    (tmp_path / "box.obj").write_text(obj(1e3 * CORNERS + [1.0, 0.0, 0.0], SIDES))
    mesh = read_mesh(tmp_path / "box.obj", np.array([-1e-3, 1e-3, 1e-3]))
    shape = as_polyhedron(mesh, np.eye(3), np.zeros(3))
    np.testing.assert_allclose(shape.corners().max(axis=0), [0.027, 0.018, 0.030], atol=1e-15)
    np.testing.assert_allclose(shape.corners().min(axis=0), [-0.029, -0.018, -0.030], atol=1e-15)


def test_place_and_scale_of_the_urdf(tmp_path: Path) -> None:
    """The mesh lies where the origin of the collision shape and the fixed joints above it put it."""
    (tmp_path / "box.obj").write_text(obj(1e3 * CORNERS, SIDES))
    (tmp_path / "two.urdf").write_text(
        """<robot name="two"><link name="a"><inertial><mass value="0.2"/>
        <inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="0 0 0.1"/></joint>
        <link name="b"><collision><origin xyz="0.01 0 0" rpy="0 0 1.5707963267948966"/><geometry>
        <mesh filename="box.obj" scale="0.001 0.001 0.001"/></geometry></collision></link></robot>"""
    )
    corners = world_of(tmp_path / "two.urdf").shape.corners()
    np.testing.assert_allclose(corners.max(axis=0), [0.01 + 0.018, 0.028, 0.13], atol=1e-12)


def world_of(urdf: Path, **options: Any) -> World:
    return world_from(HAND_URDF, ["finger_1_tip", "finger_2_tip"], urdf, **options)


def test_coplanar_triangles_become_one_face() -> None:
    """Sides cut into many triangles with vertices in their middles and along edges: six faces of four corners again."""
    rng = np.random.default_rng(1)
    vertices, triangles = CORNERS.tolist(), TRIANGLES.tolist()
    for _ in range(200):
        a, b, c = triangles.pop(rng.integers(len(triangles)))
        weights = rng.dirichlet([2.0, 2.0, 2.0])
        vertices.append((weights @ np.array([vertices[a], vertices[b], vertices[c]])).tolist())
        new = len(vertices) - 1
        triangles += [[a, b, new], [b, c, new], [c, a, new]]
    shape = made(vertices, triangles)
    assert sorted(len(polygon) for polygon in shape.polygons) == [4] * 6
    assert len(shape.vertices) == 8


def test_polygons_are_closed_and_look_out() -> None:
    """Of a round mesh: every edge has one face on either side, normals look out, no vertex lies beyond a face."""
    shape = made(fibonacci_sphere(500) * [0.03, 0.02, 0.04], np.zeros((0, 3), dtype=int), take_hull=True)
    edges = {(int(p[k - 1]), int(p[k])) for p in shape.polygons for k in range(len(p))}
    assert len(edges) == sum(map(len, shape.polygons)) and all((b, a) in edges for a, b in edges)
    beyond = shape.vertices @ shape.normals.T - shape.offsets
    assert np.max(beyond) < 1e-15
    assert len(shape.vertices) - len(edges) // 2 + len(shape.polygons) == 2


# ------------------------------------------------------------------------------------------------------------ refusals


def notched() -> tuple[Array, Array]:
    """A box whose upper side has a pit of 10 mm."""
    top = next(side for side in SIDES if all(CORNERS[k, 2] > 0.0 for k in side))
    rest = [t for t in TRIANGLES.tolist() if not all(CORNERS[k, 2] > 0.0 for k in t)]
    return np.vstack([CORNERS, [0.0, 0.0, 0.020]]), np.array([*rest, *([top[k - 1], top[k], 8] for k in range(4))])


def test_a_hollow_mesh_is_refused_with_its_depth() -> None:
    """How deep, where, and what to do; its hull is taken when asked for."""
    text = refusal(*notched())
    assert "is not convex: its surface at (0, 0, 20) mm lies 10 mm inside its convex hull" in text
    assert "object.hull = true" in text and "object.decompose = true" in text
    assert len(made(*notched(), take_hull=True).polygons) == 6


def test_a_fold_between_hull_vertices_is_found() -> None:
    """Also where all vertices lie on the hull and only a face goes inside."""
    triangles = TRIANGLES.copy().tolist()
    a, b, c, d = SIDES[3]
    vertices = CORNERS.copy()
    vertices[[a, c]] *= 1.1  # the diagonal a-c stands out, b-d is a valley
    triangles = [t for t in triangles if set(t) not in ({a, b, c}, {a, c, d})] + [[a, b, d], [b, c, d]]
    assert "is not convex" in refusal(vertices, triangles)


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (CORNERS, TRIANGLES[:-1], "is open: 3 edges have a triangle on one side only"),
        (CORNERS, TRIANGLES[:, ::-1], "is inside out"),
        (CORNERS, np.vstack([TRIANGLES[:-1], TRIANGLES[-1:, ::-1]]), "3 edges along which triangles look to different"),
        (CORNERS * [1.0, 1.0, 1e-6], TRIANGLES, "is flat: 66.6 mm large, 6e-05 mm thick"),
        (CORNERS * [1.0, 1.0, 0.0], TRIANGLES, "is flat"),
        (CORNERS * [1.0, 0.0, 0.0], TRIANGLES, "is flat"),
    ],
    ids=["open", "inside out", "one turned", "thin", "flat", "a line"],
)
def test_bad_surfaces_are_refused(vertices: Array, triangles: Array, message: str) -> None:
    """With what is wrong, how much of it, and a remedy."""
    text = refusal(vertices, triangles)
    assert message in text and text.startswith("mesh shape.obj ") and "; " in text


def test_too_many_faces_are_refused() -> None:
    """With the limit and another way."""
    with pytest.raises(ModelError, match=f"faces, .* at most {MOST_FACES}, or use <sphere>"):
        made(0.03 * fibonacci_sphere(3000), np.zeros((0, 3), dtype=int), take_hull=True)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.fbx", b"<x/>", "has the format '.fbx'; convert it to one of .stl, .obj, .dae, .ply, .glb, .gltf"),
        ("a.stl", b"hello", "neither a text nor a binary STL"),
        ("a.stl", b"", "neither a text nor a binary STL"),
        ("a.stl", b"solid a\nendsolid a\n", "has no triangles"),
        ("a.stl", b"solid a\nvertex 0 0 0\nvertex 0 1 0\nendsolid a\n", "not three vertices of three numbers"),
        ("a.stl", b"solid a\nvertex 0 0\nvertex 0 1 0\nvertex 0 0 1\n", "cannot be read"),
        ("a.obj", b"", "has no triangles"),
        ("a.obj", b"v 0 0 x\n", "could not convert"),
        ("a.obj", b"v 0 0\nf 1 1 1\n", "line 1 has a vertex of fewer than three numbers"),
        (
            "a.obj",
            b"v 0 0 0\nf 1 2 3\n",
            "line 2 has a face with fewer than three vertices or with one that is not there",
        ),
        ("a.obj", b"v 0 0 0\nv 1 0 0\nv 0 nan 0\nf 1 2 3\n", "has a vertex that is NaN or infinite"),
        (
            "a.obj",
            b"v 0 0 0\nv 60 0 0\nv 0 60 0\nf 1 2 3\n",
            "is 84.9 m large; an object has less than 10 m; if the mesh",
        ),
        ("a.obj", b"v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n", "is 0 m large"),
    ],
)
def test_bad_files_are_refused(name: str, content: bytes, message: str, tmp_path: Path) -> None:
    """With the name of the file and what is wrong in it."""
    (tmp_path / name).write_bytes(content)
    text = refusal_of_file(tmp_path / name)
    assert text.startswith(f"mesh {name} ") and message in text


def test_the_urdf_is_named_too(tmp_path: Path) -> None:
    """A bad mesh and a shape that cannot be held are told with the URDF that asks for it."""
    text = (REPOSITORY / "urdf" / "prism.urdf").read_text()
    (tmp_path / "prism.obj").write_text(obj(*notched()))
    (tmp_path / "my.urdf").write_text(text.replace("meshes/prism.obj", "prism.obj"))
    with pytest.raises(ModelError, match=r"my\.urdf: mesh prism\.obj is not convex"):
        world_of(tmp_path / "my.urdf")
    assert len(world_of(tmp_path / "my.urdf", hull=True).faces) == 6
    (tmp_path / "my.urdf").write_text(
        text.replace('<mesh filename="meshes/prism.obj"/>', '<capsule radius="0.01" length="0.05"/>')
    )
    with pytest.raises(
        ModelError, match=r"a collision shape, or several .* a <box>, <sphere>, <cylinder>, <mesh>; found: caps"
    ):
        world_of(tmp_path / "my.urdf")


@settings(max_examples=300, deadline=None, derandomize=True)
@given(data=st.data())
def test_a_mutated_mesh_is_read_or_refused(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Text or bytes cut out of a mesh or put into it: a convex polyhedron or one ModelError, with hull or without."""
    kind = data.draw(st.sampled_from([".obj", ".stl", "binary"]))
    content = {
        ".obj": obj(CORNERS, SIDES).encode(),
        ".stl": text_stl(CORNERS[TRIANGLES]).encode(),
        "binary": binary_stl(CORNERS[TRIANGLES]),
    }[kind]
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(content)))
        end = start + data.draw(st.integers(0, 40))
        new = data.draw(
            st.sampled_from([b"", b"-", b"9", b".", b"e9", b" ", b"\n", b"nan", b"\x00\xff\x7f", b"0 0 0\n", b"1"])
        )
        content = content[:start] + new + content[end:]
    file = tmp_path_factory.mktemp("mesh") / ("a.obj" if kind == ".obj" else "a.stl")
    file.write_bytes(content)
    for take_hull in (False, True):
        try:
            shape = as_polyhedron(read_mesh(file, np.ones(3)), np.eye(3), np.zeros(3), take_hull)
        except ModelError as error:
            assert str(error).startswith("mesh a.")
            continue
        size = np.max(np.abs(shape.vertices))
        assert np.max(shape.vertices @ shape.normals.T - shape.offsets) < 1e-4 * size
        foot, normal = shape.nearest([0.1, 0.2, 0.3])
        assert np.isfinite(foot).all() and np.linalg.norm(normal) == pytest.approx(1.0)
