"""Workspace: chains of joints, the ends of ranges by hand calculation, and shares of boxes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hands import CONTACT_POINTS, FINGER_GUESS, HAND_URDF, START_POSITION, Task

from softhand.assembly.plant import read_world
from softhand.errors import GraspError
from softhand.grasping.chains import finger_chain, place_tip, work_rows
from softhand.grasping.inverse import reach
from softhand.grasping.poses import Poses
from softhand.grasping.verdicts import Verdict
from softhand.grasping.workspace import largest_box, ranges, share_held
from softhand.model.arm import Arm
from softhand.numerics.spatial import rotation_of
from softhand.plots.style import save_figure
from softhand.plots.workspace import draw_workspace
from softhand.scenario.scenario import load_scenario

L1, L2, L3, RADIUS = 0.076, 0.051, 0.052, 0.010  # [m] links and tip of the reference hand
BASE_1 = np.array([0.055, 0.040, 0.0])  # finger 1, facing -x


@pytest.fixture(scope="module")
def poses() -> Poses:
    """Of the reference hand."""
    return Poses(load_scenario("target-a"))


def joint_2_to_tip(x: float) -> float:
    """Distance from joint 2 of finger 1 to the centre of its tip when the object is moved along x [m].

    Joint 1 turns about the horizontal axis through the base, so joint 2 lies at L1 from the axis, above the base's
    inward coordinate; the centre of the tip is outside of the contact by the radius.
    """
    centre = np.array(START_POSITION) + CONTACT_POINTS[0] + [x + RADIUS, 0.0, 0.0] - BASE_1
    return math.hypot(-centre[0], math.hypot(centre[1], centre[2]) - L1)


def solve_x(distance: float) -> float:
    """Move of the object towards -x at which joint 2 and the tip are so far apart [m]."""
    _, y, z = np.array(START_POSITION) + CONTACT_POINTS[0] - BASE_1
    inward = math.sqrt(distance**2 - (math.hypot(y, z) - L1) ** 2)
    return BASE_1[0] - inward - (START_POSITION[0] + CONTACT_POINTS[0][0] + RADIUS)


def test_chains_are_the_hand(task: Task, rng):
    """Position, axes and Jacobian of every tip agree with Pinocchio's, wrist, continuous joints and canted tips too."""
    lower, upper = (np.clip(limit, -3.0, 3.0) for limit in task.world.position_limits)
    angles = rng.uniform(lower, upper)
    arm = Arm(task.world)
    arm.move(angles)
    for index in range(task.world.n_tips):
        links, columns = finger_chain(task.world, index, angles)
        rotation, position, jacobian = np.empty((3, 3)), np.empty(3), np.empty((3, len(columns)))
        place_tip(links, angles[columns], rotation, position, jacobian, np.empty((work_rows(len(columns)), 3)))
        expected, axes = arm.tip(index)
        assert position == pytest.approx(expected, abs=1e-12) and rotation == pytest.approx(axes, abs=1e-12)
        assert jacobian == pytest.approx(arm.point_jacobian(index, expected)[:, columns], abs=1e-12)


def test_reach_finds_the_angles(task: Task, rng):
    """From angles nearby, the joint angles of a tip position are found to rounding."""
    count = task.world.n_joints
    start = np.concatenate([np.zeros(count % 3), np.tile(FINGER_GUESS, count // 3)])
    for index in range(task.world.n_tips):
        links, columns = finger_chain(task.world, index, start)
        wanted = start[columns] + rng.normal(0.0, 0.1, len(columns))
        rotation, position, jacobian = np.empty((3, 3)), np.empty(3), np.empty((3, len(columns)))
        place_tip(links, wanted, rotation, position, jacobian, np.empty((work_rows(len(columns)), 3)))
        found = start[columns].copy()
        assert reach(links, position, found, rotation) and found == pytest.approx(wanted, abs=1e-8)


def test_the_start_can_be_held_and_the_far_cannot(poses):
    """The start is held; half a metre away is out of reach."""
    verdicts = poses.judge([poses.start, poses.start + 0.5 * np.eye(6)[0]])
    assert list(verdicts.held) == [True, False] and poses.describe(verdicts, 0) == "held"
    assert verdicts.verdict[1] == Verdict.REACH and "out of reach" in poses.describe(verdicts, 1)


def test_a_straight_finger_ends_the_range(poses):
    """Towards -x finger 1 is stretched where joint 2 and the tip are L2 + L3 apart."""
    way = ranges(poses)[0]
    assert way.lower_end == "finger_1_tip out of reach"
    assert way.lower == pytest.approx(solve_x(L2 + L3), abs=2e-5)


def test_a_joint_limit_ends_the_range_where_the_law_of_cosines_says(tmp_path):
    """With joint 3 of finger 1 kept above 1 rad, the range to -x ends there: d^2 = L2^2 + L3^2 + 2 L2 L3 cos 1."""
    text = HAND_URDF.read_text()
    before, joint, after = text.partition('<joint name="finger_1_distal_flexion"')
    assert joint
    file = tmp_path / "hand.urdf"
    file.write_text(before + joint + after.replace('lower="-0.1"', 'lower="1.0"', 1))
    way = ranges(Poses(load_scenario("target-a", {"hand.urdf": str(file)})))[0]
    assert way.lower_end == "limit of finger_1_distal_flexion"
    assert way.lower == pytest.approx(solve_x(math.sqrt(L2**2 + L3**2 + 2.0 * L2 * L3 * math.cos(1.0))), abs=2e-5)


@pytest.mark.parametrize(("coordinate", "side", "Phi"), [(2, "lower", 89.0), (3, "upper", 89.0), (1, "lower", 1.0)])
def test_the_tip_ends_the_range_at_its_own_limits(poses, coordinate, side, Phi):
    """Where a range ends at the apex or the rim, the angle of that contact by Pinocchio is that limit."""
    way, pose = ranges(poses)[coordinate], poses.start.copy()
    pose[coordinate] += getattr(way, side)
    scenario = load_scenario("target-a")
    world, angles = read_world(scenario), np.array(scenario.grasp.joint_guess)
    finger = int(getattr(way, f"{side}_end")[len("finger_")]) - 1
    normal, rotation, arm = poses.fingers.normals[finger], rotation_of(pose[3:]), Arm(world)
    target = pose[:3] + rotation @ (poses.fingers.points[finger] + RADIUS * normal)
    assert arm.reach(finger, target, angles) < 1e-9
    arm.move(angles)
    sin_Phi = -(arm.tip(finger)[1].T @ rotation @ normal)[0]
    assert math.degrees(math.asin(sin_Phi)) == pytest.approx(Phi, abs=0.1)


def test_fingers_in_a_plane_hold_what_moves_in_it():
    """Two planar fingers follow the object in their plane and about the line between them, and no other way."""
    ways = {way.name: way for way in ranges(Poses(load_scenario("pinch")))}
    assert all(ways[name].upper > 0.01 and ways[name].lower < -0.01 for name in ("x", "z", "pitch", "roll"))
    for name in ("y", "yaw"):
        assert abs(ways[name].lower) < 1e-3 and ways[name].upper_end.endswith("out of reach")


def test_slides_end_the_range_at_their_travel():
    """The jaws of the gripper follow the object along their line, up to the limits of their slides; no tip at its apex,
    which its law in surface coordinates does not mind, ends it before."""
    scenario = load_scenario("gripper")
    poses = Poses(scenario)
    way, (lower, upper) = ranges(poses)[0], read_world(scenario).position_limits
    assert (way.lower_end, way.upper_end) == ("limit of right_slide", "limit of left_slide")
    travel = min(
        float(np.min(poses.fingers.angles - lower[:, None])), float(np.min(upper[:, None] - poses.fingers.angles))
    )
    assert way.upper == pytest.approx(travel, abs=2e-5) and way.lower == pytest.approx(-travel, abs=2e-5)


def test_a_narrower_range_of_Phi_holds_less(poses):
    """Phi up to 75 deg allows fewer poses than up to 89 deg, and fewer than beyond the apex."""
    scenario = load_scenario("target-a")
    shares = [
        share_held(Poses(scenario, tuple(np.radians([1.0, far]))), samples=2048)[0] for far in (75.0, 89.0, 179.0)
    ]
    assert shares[0] < shares[1] < shares[2]


def test_shares_add_up_and_a_small_box_is_held(poses):
    """Held and reasons are all poses; within the largest box all are held, a tenth further out they are not."""
    held, reasons = share_held(poses, samples=2048)
    assert held + sum(reasons.values()) == pytest.approx(1.0) and 0.2 < held < 0.9
    factor = largest_box(poses, samples=1024)
    assert share_held(poses, 0.999 * factor * 0.020, 0.999 * factor * math.radians(30.0), samples=1024)[0] == 1.0
    assert share_held(poses, 1.1 * factor * 0.020, 1.1 * factor * math.radians(30.0), samples=1024)[0] < 1.0


def test_the_figure_is_drawn(poses, tmp_path):
    """Six planes; the middle of each is held."""
    figure = draw_workspace(poses, "poses", count=21)
    assert len(figure.axes) == 6
    for axes in figure.axes:
        assert axes.collections[0].get_array().reshape(21, 21)[10, 10] == Verdict.HELD
    save_figure(figure, tmp_path / "workspace.png")


def test_a_start_out_of_reach_is_named():
    """A start that rigid tips do not reach is an error with the finger."""
    with pytest.raises(GraspError, match="finger_1_tip"):
        Poses(load_scenario("target-a", {"object.position": (0.0, 0.0, 1.0)}))
