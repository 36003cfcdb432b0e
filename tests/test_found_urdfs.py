"""URDFs as they are found: impossible and missing inertias, packages, many faults of one kind."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from commands import run_command
from hands import BOX_URDF
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from softhand.assembly.plant import read_world
from softhand.errors import ModelError, ScenarioError
from softhand.model.shapes.mass import joined, solid_of
from softhand.model.urdf.composite import balanced, breaks_triangle, moments_of
from softhand.model.urdf.examination import HAND, OBJECT, examine
from softhand.model.urdf.geometry import Geometry
from softhand.model.urdf.meshes import find_mesh
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.spatial import rotation_of
from softhand.scenario.blank import blank_scenario
from softhand.scenario.packages import package_file
from softhand.scenario.scenario import load_scenario
from softhand.settings.toml import parse_toml

Array = np.ndarray
MENDED = replace(HAND, repair="balance", density=1200.0)
GOOD = 'ixx="2e-6" iyy="2e-5" izz="2e-5" ixy="0" ixz="0" iyz="0"'
BAD = 'ixx="8e-5" iyy="2.5e-5" izz="8e-5" ixy="0" ixz="-5.6e-5" iyz="0"'  # as found in the URDF of a hand that is sold
BOX = '<{}><origin xyz="0.02 0 0" rpy="0 0 0.3"/><geometry><box size="0.04 0.02 0.01"/></geometry></{}>'


def inertial(moments: str = GOOD, mass: float = 0.03) -> str:
    return f'<inertial><origin xyz="0.02 0 0"/><mass value="{mass}"/><inertia {moments}/></inertial>'


def finger_urdf(*links: str, name: str = "a") -> str:
    """Fingers of one joint on a palm, each of whose links holds what is given."""
    parts = [f'<robot name="{name}">', '<link name="palm"/>']
    for k, link in enumerate(links):
        parts.append(f'<link name="link_{k}">{link}</link>' if link else f'<link name="link_{k}"/>')
        parts.append(
            f'<joint name="joint_{k}" type="revolute"><parent link="palm"/><child link="link_{k}"/>'
            f'<origin xyz="{0.03 * k} 0 0"/><axis xyz="0 0 1"/>'
            '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
        )
    return "\n".join([*parts, "</robot>"])


def refusal(text: str, role: object = HAND, folder: Path | None = None) -> str:
    with pytest.raises(ModelError) as caught:
        Urdf.parse(text, Path("a.urdf"), role, folder)  # type: ignore[arg-type]
    return str(caught.value)


def warnings_of(urdf: Urdf) -> list[str]:
    return [str(warning) for warning in urdf.warnings]


# ------------------------------------------------------------------------------------------------- impossible inertias


def test_an_impossible_inertia_is_refused_with_its_numbers_and_the_remedy() -> None:
    """Line, link, moments, and the key."""
    said = refusal(finger_urdf(inertial(BAD), inertial()))
    assert said.startswith("a.urdf, line 3, <inertia> of link 'link_0': no body has these principal moments: 0.000136")
    assert 'set hand.repair = "balance"' in said and "\n" not in said


def test_balance_takes_the_nearest_inertia_and_tells_both() -> None:
    """The moments in the model are those of the warning; nothing else of the file changes, and no line moves."""
    text = finger_urdf(inertial(BAD), inertial())
    hand = Urdf.parse(text, Path("a.urdf"), MENDED)
    (warning,) = warnings_of(hand)
    assert warning.startswith(
        "line 3, <inertia> of link 'link_0': repair = \"balance\": its principal moments were 2.4e-05"
    )
    moments = moments_of(build_model(hand).inertias[1].inertia)
    assert ", ".join(f"{value:.4g}" for value in moments) in warning
    start, end = text.index("<inertia "), text.index("/>", text.index("<inertia ")) + 2
    assert hand.text.startswith(text[:start]) and hand.text.endswith(text[end:])
    assert hand.text.count("\n") == text.count("\n")
    again = Urdf.parse(hand.text, Path("a.urdf"), HAND)
    assert not again.warnings and again.text == hand.text


@settings(max_examples=200, deadline=None)
@given(st.lists(st.floats(-1e-3, 1e-3), min_size=6, max_size=6), st.floats(1e-6, 10.0))
def test_what_balance_makes_is_an_inertia(values: list[float], mass: float) -> None:
    """Of any numbers: positive moments that obey the triangle inequality; a second time nothing changes."""
    xx, xy, xz, yy, yz, zz = values
    found = balanced(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]), mass)
    moments = moments_of(found)
    assert moments[0] > 0.0 and not breaks_triangle(moments, 1e-12)
    assert_allclose(balanced(found, mass), found, atol=1e-12 * moments[2], rtol=0.0)


def test_nothing_possible_is_nearer(rng: np.random.Generator) -> None:
    """In the norm of tr(I) / 2 - I, against random inertias of point masses."""
    wrong = np.diag([1.0, 1.0, 3.0])
    S = 0.5 * np.trace(wrong) * np.eye(3) - wrong
    found = balanced(wrong, 1.0)
    distance = np.linalg.norm(0.5 * np.trace(found) * np.eye(3) - found - S)
    assert_allclose(distance, 0.5, rtol=1e-2)  # an eigenvalue of -1/2 becomes that of a thin body
    for _ in range(200):
        points = rng.normal(0.0, 0.7, (6, 3)) * [1.0, 1.0, 0.1]
        assert np.linalg.norm(points.T @ points / 6.0 * 2.0 - S) > 0.5


@pytest.mark.parametrize(
    "moments",
    [
        'ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"',
        'ixx="-1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"',
        'ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="9e-5" ixz="0" iyz="0"',
    ],
    ids=["a point", "negative", "indefinite"],
)
def test_balance_makes_a_model_of_any_inertia(moments: str) -> None:
    """Its mass matrix is positive definite at random configurations, its accelerations are numbers."""
    model = build_model(Urdf.parse(finger_urdf(inertial(moments), inertial()), Path("a.urdf"), MENDED))
    data = model.createData()
    for _ in range(10):
        acceleration = pin.aba(model, data, pin.randomConfiguration(model), np.ones(model.nv), np.ones(model.nv))
        assert np.isfinite(acceleration).all()


def test_where_the_element_ends_does_not_matter() -> None:
    """An inertia with an end tag, signs of the other kind in its attributes, comments behind."""
    text = finger_urdf(inertial(BAD).replace("/></inertial>", "></inertia><!-- > --></inertial>"), inertial())
    text = text.replace('name="link_0"', "name='a &gt; > b'").replace('link="link_0"', "link='a &gt; > b'")
    hand = Urdf.parse(text, Path("a.urdf"), MENDED)
    assert moments_of(build_model(hand).inertias[1].inertia)[0] > 0.0 and "<!-- > -->" in hand.text


# --------------------------------------------------------------------------------------------------- missing inertias


def test_a_link_without_mass_is_refused_with_the_remedy() -> None:
    """The key, and for an object its own."""
    assert "set hand.density, such as 1200 kg/m^3, to take both from its shapes" in refusal(
        finger_urdf(BOX.format("collision", "collision"))
    )
    assert "set object.density" in refusal('<robot name="a"><link name="b"/></robot>', OBJECT)


@pytest.mark.parametrize("kind", ["collision", "visual"])
def test_mass_and_inertia_come_from_the_shape(kind: str) -> None:
    """A box of 40 x 20 x 10 mm, 1200 kg/m^3, turned by 0.3 rad: 9.6 g and the textbook's moments."""
    hand = Urdf.parse(finger_urdf(BOX.format(kind, kind), inertial()), Path("a.urdf"), MENDED)
    found = build_model(hand).inertias[1]
    assert_allclose(found.mass, 0.0096)
    assert_allclose(found.lever, [0.02, 0.0, 0.0], atol=1e-15)
    a, b, c = 0.04**2, 0.02**2, 0.01**2
    turn = pin.rpy.rpyToMatrix(0.0, 0.0, 0.3)
    assert_allclose(found.inertia, turn @ np.diag([b + c, a + c, a + b]) @ turn.T * 0.0096 / 12.0, atol=1e-18)
    (warning,) = warnings_of(hand)
    assert f"density = 1200: from its {kind} shape, 8 cm^3, it has a mass of 0.0096 kg" in warning


def test_a_link_without_shape_becomes_a_small_ball() -> None:
    """0.63 g, told as such; an empty element gets a child."""
    hand = Urdf.parse(finger_urdf("", inertial()), Path("a.urdf"), MENDED)
    assert_allclose(build_model(hand).inertias[1].mass, 1200.0 * 4.0 / 3.0 * np.pi * 0.005**3)
    assert "a ball of 5 mm radius, as it has no shape" in warnings_of(hand)[0]


def test_a_mass_of_zero_is_replaced() -> None:
    """An <inertial> that says nothing makes room for the one from the shape."""
    nothing = '<inertial><mass value="0"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>'
    hand = Urdf.parse(finger_urdf(nothing + BOX.format("visual", "visual"), inertial()), Path("a.urdf"), MENDED)
    assert_allclose(build_model(hand).inertias[1].mass, 0.0096)
    assert hand.text.count("<inertial>") == 2


def test_masses_that_are_there_stay() -> None:
    """Neither a body with a mass nor a frame that is fixed to it gets another."""
    text = finger_urdf(inertial(), inertial())
    hand = Urdf.parse(text, Path("a.urdf"), MENDED)
    assert hand.text == text and not hand.warnings


def test_a_mesh_that_cannot_be_read_is_told_once(tmp_path: Path) -> None:
    """One error, which names the link, the mesh and what is wrong with it."""
    (tmp_path / "part.stl").write_bytes(b"no STL")
    mesh = '<collision><geometry><mesh filename="part.stl"/></geometry></collision>'
    said = refusal(finger_urdf(mesh, inertial()), MENDED, tmp_path)
    assert "'link_0': no mass, and none from its shapes: mesh part.stl cannot be read" in said and "\n" not in said


def test_a_mesh_that_was_changed_is_read_again(tmp_path: Path) -> None:
    """The mass follows its mesh, though the URDF stayed."""
    mesh = '<collision><geometry><mesh filename="part.stl"/></geometry></collision>'
    (tmp_path / "a.urdf").write_text(finger_urdf(mesh, inertial()))
    masses = []
    for size in (0.02, 0.04):
        trimesh.creation.box([size] * 3).export(tmp_path / "part.stl")
        os.utime(tmp_path / "part.stl", (size * 1e5, size * 1e5))
        masses.append(build_model(Urdf.read(tmp_path / "a.urdf", MENDED)).inertias[1].mass)
    assert_allclose(masses, [1200.0 * 0.02**3, 1200.0 * 0.04**3], rtol=1e-6)
    assert Urdf.read(tmp_path / "a.urdf", MENDED) is Urdf.read(tmp_path / "a.urdf", MENDED)


def test_an_open_mesh_is_taken_as_its_hull(tmp_path: Path) -> None:
    """A box without its lid has the mass of the box, and the warning says so; a sheet has none."""
    box = trimesh.creation.box([0.02, 0.03, 0.04])
    box.update_faces(np.arange(10))
    box.export(tmp_path / "part.stl")
    mesh = '<visual><geometry><mesh filename="part.stl"/></geometry></visual>'
    hand = Urdf.parse(finger_urdf(mesh, inertial()), Path("a.urdf"), MENDED, tmp_path)
    assert_allclose(build_model(hand).inertias[1].mass, 1200.0 * 0.02 * 0.03 * 0.04, rtol=1e-6)
    assert "from its visual shape (the hull of a mesh that is open)" in warnings_of(hand)[0]
    trimesh.Trimesh([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], [[0, 1, 2]]).export(tmp_path / "part.stl")
    assert "mesh part.stl is flat" in refusal(finger_urdf(mesh, inertial()), MENDED, tmp_path)


@pytest.mark.parametrize(
    ("kind", "size"),
    [("sphere", [0.01]), ("cylinder", [0.01, 0.05]), ("capsule", [0.01, 0.05]), ("box", [0.01, 0.02, 0.03])],
)
def test_moments_of_plain_shapes(kind: str, size: list[float], rng: np.random.Generator) -> None:
    """Against a million random points: volume to 0.5 %, spread to 1 %."""
    solid, _ = solid_of(shape_of(kind, size))
    half = np.array({"sphere": size * 3, "box": np.array(size) / 2}.get(kind, [0.01, 0.01, 0.035]))
    x = rng.uniform(-half, half, (1_000_000, 3))
    if kind == "sphere":
        inside = np.linalg.norm(x, axis=1) < size[0]
    elif kind == "box":
        inside = np.ones(len(x), dtype=bool)
    else:
        inside = (np.hypot(x[:, 0], x[:, 1]) < 0.01) & (np.abs(x[:, 2]) < 0.025)
        if kind == "capsule":
            inside |= np.linalg.norm(x - np.array([0, 0, 1]) * np.clip(x[:, 2:], -0.025, 0.025), axis=1) < 0.01
    share = np.prod(2.0 * half) / len(x)
    assert_allclose(solid.volume, share * inside.sum(), rtol=5e-3)
    assert_allclose(solid.spread, share * x[inside].T @ x[inside], atol=1e-2 * np.trace(solid.spread))


def test_two_shapes_are_one_solid() -> None:
    """Two halves of a box are the box."""
    whole, _ = solid_of(shape_of("box", [0.04, 0.02, 0.01]))
    half = [solid_of(shape_of("box", [0.02, 0.02, 0.01], [x, 0.0, 0.0]))[0] for x in (-0.01, 0.01)]
    for one, other in zip(joined(half), whole, strict=True):
        assert_allclose(one, other, atol=1e-20)


def shape_of(kind: str, size: list[float], position: list[float] | None = None, file: Path | None = None) -> Geometry:
    return Geometry("a", kind, np.array(size), np.eye(3), np.array(position or [0.0] * 3), "", file, None)


def test_a_scenario_asks_for_both(tmp_path: Path) -> None:
    """Keys of hand and object; the text that a recording keeps has the inertias."""
    box = BOX_URDF.read_text()
    start, end = box.index("<inertial>"), box.index("</inertial>") + len("</inertial>")
    (tmp_path / "box.urdf").write_text(box[:start] + box[end:])
    values = {"object.urdf": str(tmp_path / "box.urdf"), "hand.repair": "balance"}
    with pytest.raises(ModelError, match=r"set object\.density"):
        read_world(load_scenario("target-a", values))
    world = read_world(load_scenario("target-a", {**values, "object.density": 1000.0}))
    assert_allclose(world.object_mass, 1000.0 * 0.056 * 0.036 * 0.060)
    assert "<inertial>" in world.object_text
    with pytest.raises(ScenarioError, match=r"hand\.repair.*balance"):
        load_scenario("target-a", {"hand.repair": "magic"})
    with pytest.raises(ScenarioError, match=r"hand\.density"):
        load_scenario("target-a", {"hand.density": 0})


# ------------------------------------------------------------------------------------------------- many of one kind


def test_many_of_one_kind_are_one_line() -> None:
    """Ten links without mass: their count and names, and what to do, once."""
    said = refusal(finger_urdf(*[BOX.format("visual", "visual")] * 10))
    assert "\n" not in said
    assert "line 3, <link> in 10 places (link_0, link_1, link_2, link_3, link_4, link_5 and 4 more): " in said
    two = refusal(finger_urdf(*[BOX.format("visual", "visual")] * 2))
    assert two.count("\n") == 1 and "'link_1'" in two


def test_meshes_that_are_missing_are_one_line(tmp_path: Path) -> None:
    """Of a package that is not there: where it was looked for, and the remedy."""
    mesh = '<visual><geometry><mesh filename="package://nowhere/{}.stl"/></geometry></visual>'
    found = examine(finger_urdf(*[inertial() + mesh.format(k) for k in range(5)]), Path("a.urdf"), HAND, tmp_path)
    (warning,) = map(str, found.findings.warnings)
    assert "<mesh> in 5 places (link_0, link_1, link_2, link_3, link_4): the first: " in warning
    for word in (str(tmp_path), "ROS_PACKAGE_PATH (", "AMENT_PREFIX_PATH (", "put the folder that holds nowhere"):
        assert word in warning


# ------------------------------------------------------------------------------------------------------- packages


def test_packages_of_ros_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In folders of ROS_PACKAGE_PATH, one below them, as one of them, and in share/ of AMENT_PREFIX_PATH."""
    places = {
        "direct": "src/direct",
        "below": "src/stack/below",
        "itself": "elsewhere/itself",
        "ament": "install/share/ament",
    }
    for place in places.values():
        (tmp_path / place / "meshes").mkdir(parents=True)
        (tmp_path / place / "meshes" / "a.stl").write_text("")
    hand = tmp_path / "far" / "away"
    for name in places:
        assert find_mesh(f"package://{name}/meshes/a.stl", hand) is None
    monkeypatch.setenv("ROS_PACKAGE_PATH", f"{tmp_path}/nowhere:{tmp_path}/src:{tmp_path}/elsewhere/itself")
    monkeypatch.setenv("AMENT_PREFIX_PATH", f"{tmp_path}/install")
    for name, place in places.items():
        file = tmp_path / place / "meshes" / "a.stl"
        assert find_mesh(f"package://{name}/meshes/a.stl", hand) == file
        assert package_file(f"package://{name}/meshes/a.stl") == file
    assert find_mesh("package://direct/../../far", hand) is None
    with pytest.raises(ScenarioError, match=r"the package is installed in .*src/direct, but has no such file"):
        package_file("package://direct/b.stl")
    with pytest.raises(
        ScenarioError, match=rf"there is no package of that name, looked for in ROS_PACKAGE_PATH \({tmp_path}"
    ):
        package_file("package://nowhere/b.stl")


def test_packages_of_python_are_found_for_meshes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without running any of their code."""
    (tmp_path / "some_hand").mkdir()
    (tmp_path / "some_hand" / "__init__.py").write_text("raise SystemExit")
    (tmp_path / "some_hand" / "a.stl").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    assert find_mesh("package://some_hand/a.stl", Path("/nowhere")) == tmp_path / "some_hand" / "a.stl"


# ------------------------------------------------------------------------------------------------------- commands


def test_check_says_it_of_a_bare_urdf(tmp_path: Path) -> None:
    """Exit code 1, one line a kind, no traceback."""
    (tmp_path / "a.urdf").write_text(finger_urdf(*[inertial(BAD)] * 4, *[""] * 4))
    ended = run_command("check", "a.urdf", folder=tmp_path)
    assert ended.returncode == 1 and len(ended.errors.splitlines()) == 2
    assert 'hand.repair = "balance"' in ended.errors and "hand.density" in ended.errors


def test_new_writes_the_lines_that_a_hand_needs(tmp_path: Path) -> None:
    """Those and no others, told; what it writes is checked without an error of the hand."""
    text = finger_urdf(inertial(BAD), "", inertial()).replace('effort="1"', 'effort="0"')
    (tmp_path / "a.urdf").write_text(text)
    ended = run_command("new", "a.toml", "--hand", "a.urdf", folder=tmp_path)
    assert ended.returncode == 0
    written = (tmp_path / "a.toml").read_text()
    for line in ('\nrepair = "balance"', "\ndensity = 1200.0", "\neffort_limit = 1.0"):
        assert line in written and f"a.toml: hand.{line.strip()}: " in ended.stderr + ended.stdout
    (tmp_path / "b.urdf").write_text(finger_urdf(inertial(), inertial()))
    assert run_command("new", "b.toml", "--hand", "b.urdf", folder=tmp_path).returncode == 0
    assert not {"repair =", "density =", "effort_limit ="} & set((tmp_path / "b.toml").read_text().split("\n"))
    assert "repair" not in (tmp_path / "b.toml").read_text()
    (tmp_path / "c.urdf").write_text(text.replace("<axis", "<axes"))
    ended = run_command("new", "c.toml", "--hand", "c.urdf", folder=tmp_path)
    assert ended.returncode == 1 and "<axis>" in ended.errors and not (tmp_path / "c.toml").exists()


def test_frames_of_the_palm_are_no_fingertips(tmp_path: Path) -> None:
    """A frame on the base, and one on a palm that a wrist moves, are left out; one on a last link is taken."""
    text = finger_urdf(inertial(), inertial(), inertial())
    for frame, parent in (("camera", "palm"), ("middle", "link_0"), ("pad", "link_1")):
        text = text.replace(
            "</robot>",
            f'<link name="{frame}"/><joint name="{frame}_j" type="fixed"><parent link="{parent}"/>'
            f'<child link="{frame}"/></joint></robot>',
        )
    for k in (1, 2):  # on link_0, which becomes a palm
        child = f'<child link="link_{k}"/>'
        text = text.replace(f'<parent link="palm"/>{child}', f'<parent link="link_0"/>{child}')
    (tmp_path / "a.urdf").write_text(text)
    assert run_command("new", "a.toml", "--hand", "a.urdf", folder=tmp_path).returncode == 0
    table = parse_toml((tmp_path / "a.toml").read_text())
    assert [tip if isinstance(tip, str) else tip["frame"] for tip in table["hand"]["tips"]] == ["link_2", "pad"]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_tips_are_turned_to_point_away_from_their_joints(axis: str, sign: float, tmp_path: Path) -> None:
    """Whichever axis of the end it is; an end at its joint is told."""
    out = sign * np.eye(3)["xyz".index(axis)]
    text = finger_urdf(inertial(), inertial()).replace(
        "</robot>",
        '<link name="end"/><joint name="end_j" type="fixed"><parent link="link_0"/><child link="end"/>'
        f'<origin xyz="{" ".join(str(0.03 * x) for x in out)}"/></joint></robot>',
    )
    (tmp_path / "a.urdf").write_text(text)
    written = blank_scenario(tmp_path / "a.urdf", tmp_path / "a.toml").text
    assert '"link_1",  # its origin is that of its joint' in written
    (turned,) = [tip for tip in parse_toml(written)["hand"]["tips"] if tip != "link_1"]
    rpy = [0.0, 0.0, 0.0] if turned == "end" else turned["rpy"]
    assert_allclose(rotation_of(rpy)[:, 0], out, atol=1e-15)
