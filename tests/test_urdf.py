"""A URDF as one object: text and elements stay the same thing, and what real files have is read."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import BOX_URDF, HAND_URDF, world_from
from numpy.testing import assert_allclose

from softhand.errors import ModelError
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.urdf.examination import HAND, OBJECT, examine
from softhand.model.urdf.mounting import MOUNT, TipPlace, mounted, with_tips
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import load_world
from softhand.numerics.spatial import rotation_of

DATA = Path(__file__).parent / "data"
GOOD = DATA / "good.urdf"
GOOD_TEXT = GOOD.read_text()
TIPS = ["left_tip", "right_tip"]
PAD = TipPlace("pad & co", "left_finger", (0.01, -0.02, 0.03), (0.4, -0.5, 0.6))


def hand_of(text: str) -> Urdf:
    return Urdf.parse(text, GOOD, HAND)


def shape_of_tree(urdf: Urdf) -> tuple[Any, ...]:
    """Links and joints by name, from the root outward."""
    joints = {(joint.name, joint.kind, joint.parent, joint.child) for joint in urdf.tree.joints}
    return urdf.tree.root, set(urdf.tree.links), joints


# --------------------------------------------------------------------------------------------------- text and elements


@pytest.mark.parametrize(
    "text",
    [
        GOOD_TEXT,
        GOOD_TEXT.replace("A gripper", "Ein Greifer f\u00fcr K\u00f6rper \U0001f916"),
        GOOD_TEXT.replace("</robot>", "</robot  >\n<!-- behind </robot> and <robot> -->\n"),
        "\n".join(line.strip() for line in GOOD_TEXT.splitlines()),
    ],
    ids=["as it is", "letters of more bytes", "an end tag in a comment", "no spaces"],
)
def test_what_is_added_is_in_text_and_elements_alike(text: str) -> None:
    """Mount and tip stand before the end tag and nothing else changes; reading the text anew gives the same hand."""
    bare = hand_of(text)
    hand = mounted(with_tips(bare, [PAD]), (0.1, 0.0, -0.2), (0.0, 0.3, 0.0))
    added = '<link name="pad &amp; co"/>'
    start = hand.text.index(added)
    end = start + len(hand.text) - len(text)
    assert hand.text[:start] + hand.text[end:] == text and text[start:].startswith("</robot")
    again = hand_of(hand.text)
    assert shape_of_tree(again) == shape_of_tree(hand) and hand.tree.root == MOUNT
    assert {"pad & co", MOUNT} <= set(hand.tree.links) and hand.tree.joints[0].child == "palm"
    assert bare.text == text and "pad & co" not in bare.tree.links and bare.tree.root == "palm"
    for one, other in zip(build_model(hand).frames, build_model(again).frames, strict=True):
        assert one.name == other.name and one.placement == other.placement


def test_what_is_recorded_gives_the_same_model() -> None:
    """The text of a world, read anew, has all joints, masses and frames."""
    hand = HandModel.read(
        HAND_URDF, [TipPlace("soft", "finger_1_tip"), "finger_2_tip"], (0.0, 0.1, 0.2), (0.1, 0.2, 0.3)
    )
    world = load_world(hand, ObjectModel.read(BOX_URDF))
    again = build_model(hand_of(world.hand_text))
    assert build_model(Urdf.parse(world.object_text, BOX_URDF, OBJECT)).inertias[1] == world.model.inertias[-1]
    n = world.object_joint
    assert list(again.names) == list(world.model.names)[:n]
    for k in range(1, n):
        assert (
            again.inertias[k] == world.model.inertias[k] and again.jointPlacements[k] == world.model.jointPlacements[k]
        )
    soft = again.frames[again.getFrameId("soft")]
    assert_allclose(soft.placement.translation, world.tips[0].position, atol=0.0)


def test_a_place_that_is_hardly_meant_is_told_in_its_line() -> None:
    """A mount 1.5 m away and a tip turned by 90 rad: warnings in the last line, where they are written."""
    hand = mounted(hand_of(GOOD_TEXT), (0.0, 0.0, 1.5), (0.0, 0.0, 0.0))
    hand = with_tips(hand, [replace(PAD, rpy=(0.0, 90.0, 0.0))])
    last = len(GOOD_TEXT.rstrip().splitlines())
    assert [warning.line for warning in hand.warnings] == [last, last]
    far, turned = map(str, hand.warnings)
    assert f"line {last}, <origin> of joint '{MOUNT}_place': xyz=\"0.0 0.0 1.5\" is 1.5 m long" in far
    assert "'pad & co_place': rpy=\"0.0 90.0 0.0\" is more than a turn" in turned


def test_two_tips_need_two_names() -> None:
    """The second of one name is refused, also where the first was added."""
    with pytest.raises(ModelError, match="is called 'pad & co' already"):
        with_tips(hand_of(GOOD_TEXT), [PAD, PAD])


def test_geometries_are_read_with_place_size_and_colour(tmp_path: Path) -> None:
    """Each kind, a colour by the name of a material, and a mesh that is there or not."""
    (tmp_path / "a.stl").write_text("solid")
    shapes = [
        '<box size="1 2 3"/>',
        '<sphere radius="4"/>',
        '<cylinder radius="5" length="6"/>',
        '<capsule radius="7" length="8"/>',
        '<mesh filename="a.stl" scale="1 2 -3"/>',
        '<mesh filename="b.stl"/>',
    ]
    visuals = "".join(
        f'<visual><origin xyz="0 0 {k}" rpy="0.1 0.2 {k}"/><geometry>{shape}</geometry><material name="blue"/></visual>'
        for k, shape in enumerate(shapes)
    )
    text = (
        '<robot name="r"><material name="blue"><color rgba="0.1 0.2 0.9 1"/></material><link name="l">'
        f"{visuals}"
        '<collision><geometry><sphere radius="9"/></geometry></collision></link></robot>'
    )
    urdf = Urdf.parse(text, tmp_path / "r.urdf", HAND, tmp_path)
    found = urdf.geometries("visual")
    assert [geometry.kind for geometry in found] == ["box", "sphere", "cylinder", "capsule", "mesh", "mesh"]
    sizes = [[1, 2, 3], [4], [5, 6], [7, 8], [1, 2, -3], [1, 1, 1]]
    for k, (geometry, size) in enumerate(zip(found, sizes, strict=True)):
        assert geometry.link == "l" and geometry.colour == (0.1, 0.2, 0.9) and geometry.size.tolist() == size
        assert_allclose(geometry.position, [0.0, 0.0, k])
        assert_allclose(geometry.rotation, rotation_of((0.1, 0.2, k)))
    assert [geometry.file for geometry in found[4:]] == [tmp_path / "a.stl", None]
    (ball,) = urdf.geometries("collision")
    assert (ball.size.tolist(), ball.colour) == ([9.0], None)


def test_the_pose_of_the_object_is_where_pinocchio_has_it(rng: np.random.Generator) -> None:
    """Position and axes of the accessors are those of the last joint; writing and reading give the same."""
    world = world_from(HAND_URDF, ["finger_1_tip", "finger_2_tip"], BOX_URDF)
    q = pin.randomConfiguration(world.model, -np.ones(world.model.nq), np.ones(world.model.nq))
    data = world.model.createData()
    pin.forwardKinematics(world.model, data, q)
    pose = data.oMi[world.object_joint]
    assert_allclose(world.object_position(q), pose.translation, atol=1e-15)
    assert_allclose(world.object_rotation(q), pose.rotation, atol=1e-14)
    position, rotation = rng.normal(size=3), rotation_of(rng.normal(size=3))
    joints = q[: world.n_joints].copy()
    world.set_object_pose(position, rotation, q)
    assert_allclose(world.object_position(q), position, atol=0.0)
    assert_allclose(world.object_rotation(q), rotation, atol=1e-14)
    assert_allclose(q[: world.n_joints], joints, atol=0.0)
    world.object_position(q)[0] = 7.0
    assert q[world.model.joints[world.object_joint].idx_q] == 7.0


# ------------------------------------------------------------------------------------------------- what real files have


def inertial(mass: float, moments: str, xyz: str = "0 0 0") -> str:
    ixx, iyy, izz = moments.split()
    return (
        f'<inertial><origin xyz="{xyz}"/><mass value="{mass}"/>'
        f'<inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial>'
    )


def with_inertial(link: str, *parts: str) -> str:
    """The good hand with the inertial of a link, and more links fixed to it, each a point at its own place."""
    head, _, tail = GOOD_TEXT.partition(f'<link name="{link}">' if link != "right_tip" else '<link name="right_tip"/>')
    body = f'<link name="{link}">{parts[0]}' + ("</link>" if link == "right_tip" else "")
    more = "".join(
        f'<link name="more_{k}">{part}</link><joint name="fix_{k}" type="fixed"><parent link="{link}"/>'
        f'<child link="more_{k}"/></joint>'
        for k, part in enumerate(parts[1:])
    )
    return (head + body + tail).replace("</robot>", more + "</robot>")


def test_a_point_mass_on_a_link_counts_at_its_place() -> None:
    """1 g without a moment of inertia 60 mm along the finger: a warning, and the sum of both by the parallel axes."""
    text = with_inertial("right_tip", inertial(0.001, "0 0 0", "0.002 0.003 -0.004"))
    hand = hand_of(text)
    (warning,) = hand.warnings
    assert (
        "link 'right_tip'" in str(warning) and "a point or a rod" in str(warning) and "(right_finger)" in str(warning)
    )
    found = build_model(hand).inertias[2]
    places, masses = np.array([[0.03, 0.0, 0.0], [0.062, 0.003, -0.004]]), np.array([0.050, 0.001])
    centre = masses @ places / masses.sum()
    tensor = np.diag([2.0e-6, 16.0e-6, 16.0e-6])
    for place, mass in zip(places - centre, masses, strict=True):
        tensor = tensor + mass * (place @ place * np.eye(3) - np.outer(place, place))
    assert_allclose([found.mass, *found.lever], [0.051, *centre], rtol=1e-12, atol=1e-15)
    assert_allclose(found.inertia, tensor, rtol=1e-12, atol=1e-18)


POINT, ROD = inertial(0.01, "0 0 0"), inertial(0.01, "0 1e-6 1e-6")


@pytest.mark.parametrize(
    ("parts", "is_sound"),
    [
        ((POINT,), False),
        ((ROD,), False),
        ((POINT, inertial(0.01, "0 0 0", "0.03 0.01 0")), False),  # two points are a rod
        ((POINT, inertial(0.01, "0 0 0", "0.03 0.01 0"), inertial(0.01, "0 0 0", "0 0.02 0.01")), True),
        ((ROD, inertial(0.01, "0 0 0", "0 0.01 0")), True),
        ((inertial(0.01, "1e-6 1e-6 -1e-7"), inertial(0.5, "1e-3 1e-3 1e-3")), False),  # no part has that
    ],
    ids=["point", "rod", "two points", "three points", "rod and point", "a negative moment"],
)
def test_points_and_rods_count_by_their_sum(parts: tuple[str, ...], is_sound: bool) -> None:
    """The links of a finger as points and rods: a body if they do not lie in a line."""
    text = with_inertial("right_finger", *parts)
    start = text.index("<inertial>", text.index("</inertial>", text.index('"right_finger">')))
    text = text[:start] + text[text.index("</inertial>", start) + len("</inertial>") :]  # that of the good file
    if is_sound:
        assert build_model(hand_of(text)).inertias[2].mass == pytest.approx(0.01 * len(parts))
    else:
        with pytest.raises(ModelError, match="not positive definite: its principal moments are"):
            hand_of(text)


@pytest.mark.parametrize("moments", ["0 0 0", "1e-6 1e-6 9e-6", "1e-6 1e-6 -1e-6"])
def test_the_inertia_of_a_base_does_not_count(moments: str) -> None:
    """A hand is fixed at its root: moments that no body has are a warning there."""
    hand = hand_of(with_inertial("palm", inertial(0.3, moments)))
    (warning,) = hand.warnings
    assert "link 'palm'" in str(warning) and "does not move" in str(warning)


MIRRORED = 'ixx="2e-6" ixy="1e-7" ixz="-2e-7" iyx="1e-7" iyy="16e-6" iyz="3e-7" izx="-2e-7" izy="3e-7" izz="16e-6"'


def test_products_of_inertia_may_be_written_twice() -> None:
    """iyx, izx and izy beside their twins, as some programs write them; where they differ it is told which."""
    old = 'ixx="2.0e-6" ixy="0" ixz="0" iyy="16.0e-6" iyz="0" izz="16.0e-6"'
    hand = hand_of(GOOD_TEXT.replace(old, MIRRORED, 1))
    assert not hand.warnings
    tensor = [[2e-6, 1e-7, -2e-7], [1e-7, 16e-6, 3e-7], [-2e-7, 3e-7, 16e-6]]
    assert_allclose(build_model(hand).inertias[1].inertia, tensor, rtol=1e-12)
    for name, twin, value in (("iyx", "ixy", "1e-7"), ("izx", "ixz", "-2e-7"), ("izy", "iyz", "3e-7")):
        wrong = MIRRORED.replace(f'{name}="{value}"', f'{name}="5e-7"')
        words = f'line 21, <inertia> of link \'left_finger\': {name}="5e-7" is not {twin}="{value}".*symmetric'
        with pytest.raises(ModelError, match=words):
            hand_of(GOOD_TEXT.replace(old, wrong, 1))
    with pytest.raises(ModelError, match="the attribute ixy is missing"):
        hand_of(GOOD_TEXT.replace(old, MIRRORED.replace('ixy="1e-7" ', ""), 1))


@pytest.mark.parametrize("name", ["left_mount", "left_flexion", "left_tip", "palm"])
def test_a_joint_or_a_link_may_be_called_root_joint(name: str, tmp_path: Path) -> None:
    """Beside the free-flyer of the object, which Pinocchio calls so: each tip has its joints and its place."""
    file = tmp_path / "hand.urdf"
    file.write_text(GOOD_TEXT.replace(f'"{name}"', '"root_joint"'))
    tips = ["root_joint" if tip == name else tip for tip in TIPS]
    world, plain = world_from(file, tips, BOX_URDF), world_from(GOOD, TIPS, BOX_URDF)
    assert world.model.njoints == 4
    for tip, other in zip(world.tips, plain.tips, strict=True):
        moved_by = [plain.joint_names[column] for column in other.columns]
        assert [world.joint_names[column] for column in tip.columns] == [
            "root_joint" if joint == name else joint for joint in moved_by
        ]
        assert_allclose(tip.position, other.position, atol=0.0)
    assert world.hand_frame("root_joint")[0] < world.object_joint


@pytest.mark.parametrize("word", ["joint", "link"])
def test_a_part_of_an_object_may_be_called_root_joint(word: str, tmp_path: Path) -> None:
    """A fixed joint, or a link that has the shape: where it is counts."""
    joint, link = ("root_joint", "lid") if word == "joint" else ("lid_place", "root_joint")
    shape = '<collision><geometry><box size="0.056 0.036 0.060"/></geometry></collision>'
    text = BOX_URDF.read_text().replace(shape, "")
    head, _, tail = text.partition("<collision>")
    text = head + tail.partition("</collision>")[2].replace(
        "</robot>",
        f'<joint name="{joint}" type="fixed"><parent link="box"/><child link="{link}"/><origin xyz="0 0 0.1"/></joint>'
        f'<link name="{link}">{shape}</link></robot>',
    )
    (tmp_path / "box.urdf").write_text(text)
    world = world_from(GOOD, TIPS, tmp_path / "box.urdf")
    assert_allclose(world.shape.centre, [0.0, 0.0, 0.1], atol=1e-15)


LOST = '<mesh filename="package://lost/jaw.stl"/>'


def test_a_collision_mesh_counts_where_it_is_touched(tmp_path: Path) -> None:
    """Missing at a hand: a warning. At an object: an error, but a warning where an ellipsoid stands for it."""
    file, box = tmp_path / "hand.urdf", tmp_path / "box.urdf"
    file.write_text(GOOD_TEXT.replace('<cylinder radius="0.008" length="0.06"/>', LOST))
    hand = HandModel.read(file, TIPS)
    assert ["there is no such file" in str(warning) for warning in hand.urdf.warnings] == [True]
    box.write_text(BOX_URDF.read_text().replace('<box size="0.056 0.036 0.060"/>', LOST))
    with pytest.raises(ModelError, match=r"line 1\d, <mesh> of link 'box': .*there is no such file"):
        ObjectModel.read(box)
    world = load_world(hand, ObjectModel.read(box, ellipsoid=(0.03, 0.02, 0.04)))
    assert "there is no such file" in str(world.object.warnings[-1]) and not world.faces


def test_an_effort_of_zero_counts_where_it_is_used(tmp_path: Path) -> None:
    """Refused, but not where the scenario gives the limits."""
    file = tmp_path / "hand.urdf"
    file.write_text(GOOD_TEXT.replace('effort="2.0"', 'effort="0"').replace('effort="40"', 'effort="0.0"'))
    with pytest.raises(ModelError, match=r"no torque can act.*or set hand\.effort_limit") as caught:
        HandModel.read(file, TIPS)
    assert len(str(caught.value).splitlines()) == 2
    world = load_world(HandModel.read(file, TIPS, effort_limit=3.0), ObjectModel.read(BOX_URDF))
    assert world.effort_limit.tolist() == [3.0, 3.0] and not world.hand.warnings
    assert len(examine(file.read_text(), file).findings.errors) == 2


def test_a_role_is_told_by_the_joints() -> None:
    """Without a role, what has no moving joint is an object."""
    assert Urdf.read(BOX_URDF).is_object and not Urdf.read(GOOD).is_object
