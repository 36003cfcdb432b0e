"""A hand on an arm: two URDFs as one, all joints at once, and what the wrist changes in every Jacobian."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import ARM_IN_THE_AIR, BOX_URDF, HAND_URDF, REPOSITORY, Array
from numpy.testing import assert_allclose

import softhand
from softhand.assembly.build import build
from softhand.assembly.plant import read_world
from softhand.assembly.resolve import resolve
from softhand.errors import GraspError, ModelError, ScenarioError
from softhand.grasping.palm import standing_joints
from softhand.grasping.proposals import propose_grasps
from softhand.model.arm import REACHED, Arm
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.joined import shared_columns
from softhand.model.posture import SHARED, reach_together
from softhand.model.urdf.carrying import ArmPlace, carried
from softhand.model.urdf.examination import HAND
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import World, joints_of, load_world
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario, load_scenario
from softhand.settings.toml import tomllib

ARM_URDF = REPOSITORY / "urdf" / "six_axis_arm.urdf"
TIPS = ("finger_1_tip", "finger_2_tip", "finger_3_tip")
PLACE = (0.01, -0.02, 0.03), (0.3, -0.5, 0.8)
ROOT = (0.2, -0.1, 0.4), (-0.6, 0.2, 1.1)


def scenario(**values: Any) -> Scenario:
    """The scenario that ships."""
    return load_scenario("arm-pick-and-place", values)


def mounted() -> World:
    """The reference hand askew on the flange of an arm that stands askew."""
    arm = ArmPlace(Urdf.read(ARM_URDF, HAND), "flange", *PLACE)
    hand = HandModel.read(HAND_URDF, TIPS, *ROOT, arm=arm)
    return load_world(hand, ObjectModel.read(BOX_URDF), (1.0, -2.0, -9.0))


# ------------------------------------------------------------------------------------------------------ two as one


def test_it_is_the_hand_appended_to_the_arm_by_pinocchio() -> None:
    """M, C v + N and the tips at random states: what Pinocchio makes of the two files by itself."""
    arm, hand = (pin.buildModelFromUrdf(str(file)) for file in (ARM_URDF, HAND_URDF))
    place, root = (pin.SE3(rotation_of(rpy), np.array(position)) for position, rpy in (PLACE, ROOT))
    expected = pin.appendModel(arm, hand, arm.getFrameId("flange"), place)
    expected.gravity.linear = root.rotation.T @ [1.0, -2.0, -9.0]  # the arm as it stands
    world, rng = mounted(), np.random.default_rng(0)
    model = world.model
    at = [expected.joints[expected.getJointId(name)].idx_v for name in world.joint_names]
    data, other = model.createData(), expected.createData()
    for _ in range(3):
        q, v = rng.uniform(-2.0, 2.0, (2, 15))
        whole = pin.neutral(model)
        world.set_joint_position(q, whole)
        there, speed = np.empty(15), np.empty(15)
        there[at], speed[at] = q, v
        M = np.triu(pin.crba(model, data, whole)[:15, :15])
        M_there = pin.crba(expected, other, there)
        M_there = np.triu(M_there) + np.triu(M_there, 1).T
        assert_allclose(M, np.triu(M_there[np.ix_(at, at)]), rtol=0.0, atol=1e-12)
        terms = pin.nonLinearEffects(model, data, whole, np.concatenate([v, np.zeros(6)]))[:15]
        assert_allclose(terms, pin.nonLinearEffects(expected, other, there, speed)[at], rtol=0.0, atol=1e-11)
        kinematics = Arm(world)
        kinematics.move(q)
        pin.framesForwardKinematics(expected, other, there)
        for i, name in enumerate(TIPS):
            pose = root * other.oMf[expected.getFrameId(name)]
            assert_allclose(kinematics.tip(i)[0], pose.translation, rtol=0.0, atol=1e-14)
            assert_allclose(kinematics.tip(i)[1], pose.rotation, rtol=0.0, atol=1e-14)


def written(folder: Path, name: str, *, link: str, mesh: str = "", more: str = "") -> Path:
    """A URDF of two links, in a folder of its own, with a mesh beside it."""
    folder.mkdir()
    if mesh:
        (folder / mesh).write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n")
    shape = f'<visual><geometry><mesh filename="{mesh}"/></geometry><material name="grey"/></visual>' if mesh else ""
    file = folder / f"{name}.urdf"
    file.write_text(
        f"""<robot name="{name}"><material name="grey"><color rgba="0.{len(name)} 0.5 0.5 1"/></material>
        <link name="base"/>
        <link name="{link}">{shape}<inertial><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="joint" type="revolute"><parent link="base"/><child link="{link}"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="5" velocity="1"/></joint>{more}</robot>"""
    )
    return file


def test_names_that_both_have_are_told_apart_and_meshes_are_found(tmp_path: Path) -> None:
    """`base`, `joint` and the material of the arm are renamed; each file has its mesh in its own folder."""
    arm = Urdf.read(written(tmp_path / "one", "an_arm", link="end", mesh="part.obj"), HAND)
    hand = Urdf.read(written(tmp_path / "other", "hand", link="finger", mesh="part.obj"), HAND)
    both = carried(hand, ArmPlace(arm, "", (0.0, 0.0, 0.1)))
    assert list(both.tree.links) == ["arm_base", "end", "base", "finger"] and both.tree.root == "arm_base"
    assert [joint.name for joint in both.moving_joints] == ["arm_joint", "joint"]
    shapes = {shape.link: shape for shape in both.geometries("visual")}
    assert [shapes[name].file for name in ("end", "finger")] == [
        (tmp_path / folder / "part.obj").resolve() for folder in ("one", "other")
    ]
    assert shapes["end"].colour != shapes["finger"].colour
    again = Urdf.parse(both.text, Path("again.urdf"), HAND)
    assert [joint.name for joint in again.moving_joints] == ["arm_joint", "joint"]


def test_a_mimic_of_the_arm_follows_the_renamed_joint(tmp_path: Path) -> None:
    """The joint that it follows is its own one, not that of the hand with the same name."""
    follower = """<link name="tool"><inertial><mass value="1"/>
        <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="follower" type="revolute"><parent link="end"/><child link="tool"/><axis xyz="0 0 1"/>
        <limit lower="-1" upper="1" effort="5" velocity="1"/><mimic joint="joint" multiplier="0.5"/></joint>"""
    arm = Urdf.read(written(tmp_path / "one", "arm", link="end", more=follower), HAND)
    hand = Urdf.read(written(tmp_path / "other", "hand", link="finger"), HAND)
    both = carried(hand, ArmPlace(arm))
    mimics = [element.get("joint") for element in both.root.iter("mimic")]
    assert mimics == ["arm_joint"]


def test_efforts_of_the_arm_stay() -> None:
    """`hand.effort_limit` is of the joints of the hand alone."""
    world = read_world(scenario(**{"hand.effort_limit": 0.7}))
    assert world.effort_limit.tolist() == [150.0, 150.0, 80.0, 30.0, 30.0, 15.0, *[0.7] * 9]


@pytest.mark.parametrize(
    ("values", "error", "words"),
    [
        ({"hand.arm.link": "hand"}, ModelError, "no link is called 'hand', which the hand shall sit on.*flange, tool"),
        ({"hand.arm.urdf": "package://softhand/urdf/nothing.urdf"}, softhand.SofthandError, "nothing.urdf"),
        ({"hand.arm.urdf": str(HAND_URDF)}, ModelError, "3 ends, finger_1_tip, .* name the link.*hand.arm.link"),
        ({"hand.arm.lnk": "tool"}, ScenarioError, "hand.arm.lnk.*hand.arm.link"),
        ({"grasp.reach": "fingers"}, GraspError, 'with grasp.reach = "all" base_yaw to flange_roll would move too'),
        (
            {"object.position": [1.4, 0.0, 0.03]},
            GraspError,
            r"out of reach by \d+ mm .* base_yaw to flange_roll moving",
        ),
        ({"grasp.opening": 0.0, "grasp.standoff": [0.0, 0.0, 0.1]}, ScenarioError, "grasp.standoff.*grasp.opening"),
        ({"grasp.reach": "arm"}, ScenarioError, 'grasp.reach.*"fingers".*"all"'),
        ({"hand.arm": None}, GraspError, "joint_guess has 15 angles; the hand has 9 joints"),
    ],
)
def test_mistakes_are_told(values: dict[str, Any], error: type[Exception], words: str) -> None:
    """With the name and what to do."""
    with pytest.raises(error, match=f"(?s){words}"):
        build(scenario(**values))


def test_the_controller_needs_a_palm_that_moves() -> None:
    """On a hand that is fixed, and on coupled joints, it says so."""
    for name, words in (("target-a", "no joint of this hand carries"), ("coupled-hand", "no joint of this hand")):
        with pytest.raises(ScenarioError, match=words):
            softhand.simulate(name, overrides={"controller": {"name": "arm-pick-and-place"}, "duration": 0.01})


# --------------------------------------------------------------------------------------------------- all joints at once


def random_targets(arm: Arm, rng: np.random.Generator) -> tuple[Array, Array]:
    """Places of the tips for a random posture, and a guess beside it."""
    lower, upper = arm.limits
    there = rng.uniform(0.5 * lower, 0.5 * upper)
    there[4] = rng.choice([-1.0, 1.0]) * rng.uniform(0.5, 1.5)  # away from where the axes of the wrist are in one line
    arm.move(there)
    targets = np.array([arm.tip(i)[0] for i in range(3)])
    return targets, np.clip(there + rng.normal(0.0, 0.15, len(there)), lower, upper)


@pytest.mark.parametrize("seed", range(4))
def test_the_posture_is_that_nearest_to_the_guess(seed: int) -> None:
    """All tips are at their places, and the slope of the cost is one of the constraints: no other motion lowers it."""
    arm, rng = Arm(mounted()), np.random.default_rng(seed)
    targets, guess = random_targets(arm, rng)
    found, left = reach_together(arm, targets, guess)
    assert left <= REACHED
    arm.move(found)
    assert_allclose([arm.tip(i)[0] for i in range(3)], targets, rtol=0.0, atol=REACHED)
    lower, upper = arm.limits
    size = upper - lower
    size[shared_columns(arm.world.tips)] *= SHARED
    free = (found > lower + 2e-3 * (upper - lower)) & (found < upper - 2e-3 * (upper - lower))
    J = np.vstack([arm.point_jacobian(i, targets[i]) for i in range(3)]) * size
    slope = ((found - guess) / size)[free]
    idle = slope - np.linalg.pinv(J[:, free]) @ (J[:, free] @ slope)
    assert np.linalg.norm(slope) > 1e-3 and np.linalg.norm(idle) < 1e-10

    def cost(angles: Array) -> float:
        return float(np.sum(((angles - guess) / size) ** 2))

    for _ in range(6):  # other postures that put the tips there
        near, gap = reach_together(arm, targets, found + rng.normal(0.0, 0.05, 15))
        assert gap > REACHED or cost(near) >= cost(found) - 1e-12


def test_the_fingers_keep_the_posture_of_the_guess_where_they_can() -> None:
    """Targets of a palm that is moved by the arm alone: the fingers do not stir, and the arm gets there."""
    arm, rng = Arm(read_world(scenario())), np.random.default_rng(3)
    guess = np.array(scenario().grasp.joint_guess)
    there = guess.copy()
    there[:6] += rng.uniform(-0.15, 0.15, 6)
    arm.move(there)
    targets = np.array([arm.tip(i)[0] for i in range(3)])
    found, left = reach_together(arm, targets, guess)
    assert left <= REACHED
    assert_allclose(found, there, rtol=0.0, atol=2e-4)  # by SHARED^-2 the arm would rather stay
    assert np.abs(found[6:] - there[6:]).max() > 0.0


def test_limits_of_the_arm_are_kept() -> None:
    """A box that the arm could fetch only with its elbow beyond the limit is out of reach; else it stays inside."""
    arm = Arm(read_world(scenario()))
    guess = np.array(scenario().grasp.joint_guess)
    arm.move(guess)
    targets = np.array([arm.tip(i)[0] + np.array([0.02, 0.0, 0.01]) for i in range(3)])
    free, _ = reach_together(arm, targets, guess)
    held = Arm(arm.world)
    held.limits = arm.limits.copy()
    held.limits[1, 2] = free[2] - 0.05
    bound, left = reach_together(held, targets, guess)
    assert left <= REACHED and np.all(bound >= held.limits[0]) and np.all(bound <= held.limits[1])
    assert np.abs(bound - free).max() > 0.01


def test_the_start_stands_where_it_is_asked_to() -> None:
    """Each tip by opening and standoff from its contact point; the fingers as they are at the box without standoff."""
    away = np.array([0.03, -0.02, 0.1])
    near, far = (
        build(scenario(**{"grasp.standoff": standoff, "duration": 0.001}))
        for standoff in ([0.0, 0.0, 0.0], away.tolist())
    )
    one, other = near.sample(), far.sample()
    assert_allclose(other.tip_position, one.tip_position + away, rtol=0.0, atol=1e-9)
    assert_allclose(other.joint_position[6:], one.joint_position[6:], rtol=0.0, atol=1e-4)  # SHARED^-2
    assert np.abs(other.joint_position[:6] - one.joint_position[:6]).max() > 0.05
    assert_allclose(other.object_position, one.object_position, rtol=0.0, atol=1e-12)
    assert_allclose(one.deformation[:, 0], -0.015, rtol=0.0, atol=1e-9)
    assert_allclose(other.standoff_desired, away)


def test_searches_stand_where_the_start_does() -> None:
    """`softhand grasp --propose` and `workspace` have the palm where the contact points want it, else at the guess."""
    asked = scenario(**ARM_IN_THE_AIR)
    setup = resolve(asked)
    joints = joints_of(setup.world, setup.grasp.state.q)
    assert_allclose(standing_joints(setup.world, asked)[:6], joints[:6], rtol=0.0, atol=1e-9)
    far = asked.with_values({"object.position": [1.4, 0.0, 0.1]})
    assert_allclose(standing_joints(setup.world, far), asked.grasp.joint_guess)


@pytest.mark.slow
def test_grasps_are_proposed_for_a_hand_on_an_arm() -> None:
    """With the palm brought along; the section that is printed has all that its start needs, and is one."""
    proposal = propose_grasps(scenario(), count=1, points=60)[0]
    table = tomllib.loads(proposal.section())["grasp"]
    assert (table["reach"], table["standoff"], table["opening"]) == ("all", [0.0, 0.0, 0.1], 0.015)
    again = build(scenario(grasp=table, duration=0.001)).sample()
    assert again.tip_position[:, 2].min() > 0.1 and proposal.margin > 0.1


# --------------------------------------------------------------------------------------------------------- in motion


def test_all_that_is_observed_is_that_of_pinocchio_in_general_position() -> None:
    """Jacobians of the tips, gravity and M through all fifteen joints, at random postures and velocities."""
    simulation, rng = build(scenario(**ARM_IN_THE_AIR, duration=0.001)), np.random.default_rng(7)
    world = simulation.plant.world
    model, data = world.model, world.model.createData()
    for _ in range(3):
        state = simulation.state
        state.q[:] = pin.integrate(model, state.q, np.concatenate([rng.normal(0.0, 0.4, 15), np.zeros(6)]))
        state.v[:] = rng.normal(0.0, 0.5, 21)
        seen = simulation.sample()
        pin.computeJointJacobians(model, data, state.q)
        pin.forwardKinematics(model, data, state.q, state.v)
        for i, tip in enumerate(world.tips):
            frame = pin.SE3(tip.rotation, tip.position)
            J = pin.getJointJacobian(model, data, tip.joint, pin.LOCAL_WORLD_ALIGNED)
            lever = data.oMi[tip.joint].rotation @ tip.position
            assert_allclose(seen.tip_position[i], (data.oMi[tip.joint] * frame).translation, rtol=0.0, atol=1e-13)
            linear = (J[:3] - pin.skew(lever) @ J[3:])[:, :15]
            assert_allclose(seen.tip_jacobian[i], linear, rtol=0.0, atol=1e-12)
            assert_allclose(seen.tip_angular_jacobian[i], J[3:, :15], rtol=0.0, atol=1e-12)
            assert np.all(np.abs(seen.tip_jacobian[i][:, :6]).max(axis=0) > 1e-6), "the arm moves every tip"
            arm = seen.contact_point[i] - data.oMi[tip.joint].translation
            at_contact = seen.contact_rotation[i].T @ (J[:3] - pin.skew(arm) @ J[3:])[:, :15]
            assert_allclose(seen.hand_force_jacobian[3 * i : 3 * i + 3], at_contact, rtol=0.0, atol=1e-11)
        gravity = pin.computeGeneralizedGravity(model, data, state.q)[:15]
        assert_allclose(seen.gravity_torque, gravity, rtol=0.0, atol=1e-10)
        M = np.triu(pin.crba(model, data, state.q))[:15, :15]
        assert_allclose(np.triu(seen.hand_mass_matrix), M, rtol=0.0, atol=1e-12)


def test_an_arm_that_cannot_move_is_no_arm(tmp_path: Path) -> None:
    """The heavier its links, the nearer is the way of the box to that in a hand which is fixed there, in proportion."""
    asked = scenario(**ARM_IN_THE_AIR, gravity=[0.0, 0.0, 0.0], duration=0.15)
    asked = asked.with_values({
        "controller": {"name": "regulation"},
        "reference": {"kind": "step", "object_position": [0.402, 0.121, 0.111], "object_rpy": [0.0, 0.0, 0.05],
                      "internal_force": [5.0, 5.0, 4.0]},
    })  # fmt: skip
    setup = resolve(asked)
    kinematics = Arm(setup.world)
    joints = joints_of(setup.world, setup.grasp.state.q)
    kinematics.move(joints)
    palm = kinematics._data.oMi[6] * pin.SE3(rotation_of((0.0, 0.0, np.pi)), np.array([0.0, 0.0, 0.04 + 0.028]))
    fixed = asked.with_values({
        "hand.arm": None, "hand.position": palm.translation.tolist(),
        "hand.rpy": pin.rpy.matrixToRpy(palm.rotation).tolist(), "grasp.joint_guess": joints[6:].tolist(),
    })  # fmt: skip
    alone = softhand.simulate(fixed)
    gaps = []
    for heavier in (1e4, 1e6):
        text = ARM_URDF.read_text()
        for word in ("mass value", "ixx", "iyy", "izz"):
            head, *parts = text.split(f'{word}="')
            text = head + "".join(
                f'{word}="{heavier * float(part.partition(chr(34))[0])!r}"{part.partition(chr(34))[2]}'
                for part in parts
            )
        (tmp_path / "heavy.urdf").write_text(text)
        run = softhand.simulate(asked.with_values({"hand.arm.urdf": str(tmp_path / "heavy.urdf")}))
        assert run.complete
        gaps.append(np.abs(run.object_position - alone.object_position).max())
        still = np.ptp(run.joint_position[:, :6], axis=0).max()
        assert still < 10.0 / heavier
    way = np.ptp(alone.object_position, axis=0).max()
    assert way > 5e-4 and gaps[0] < 1e-3 * way
    assert gaps[1] < 0.03 * gaps[0] or gaps[1] < 1e-8 * way


def test_a_fixed_mount_changes_nothing(tmp_path: Path) -> None:
    """A hand on an arm whose joints are all fixed is the hand at that place, to the last digits."""
    text = ARM_URDF.read_text().replace('type="revolute"', 'type="fixed"')
    (tmp_path / "stand.urdf").write_text(text)
    stand = Urdf.read(tmp_path / "stand.urdf", replace(HAND, is_object=False))
    world = load_world(
        HandModel.read(HAND_URDF, TIPS, *ROOT, arm=ArmPlace(stand, "tool", *PLACE)), ObjectModel.read(BOX_URDF)
    )
    place, root = (pin.SE3(rotation_of(rpy), np.array(position)) for position, rpy in (PLACE, ROOT))
    there = root * pin.SE3(np.eye(3), np.array([0.0, 0.0, 0.12 + 0.13 + 0.30 + 0.12 + 0.18 + 0.08 + 0.04])) * place
    alone = load_world(
        HandModel.read(HAND_URDF, TIPS, tuple(there.translation), tuple(pin.rpy.matrixToRpy(there.rotation))),
        ObjectModel.read(BOX_URDF),
    )
    assert world.joint_names == alone.joint_names and world.palm_joint == 0
    one, other = Arm(world), Arm(alone)
    angles = np.random.default_rng(2).uniform(-1.0, 1.0, 9)
    for arm in (one, other):
        arm.move(angles)
    for i in range(3):
        assert_allclose(one.tip(i)[0], other.tip(i)[0], rtol=0.0, atol=1e-14)
    assert_allclose(one.gravity_torque(), other.gravity_torque(), rtol=0.0, atol=1e-13)
