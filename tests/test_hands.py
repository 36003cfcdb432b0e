"""Any hand: tips placed on links, mounts, packages, redundant fingers, the Allegro hands, the gripper."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from softhand import Controller, GraspError, ModelError, Recording, ScenarioError, build, load_scenario, simulate
from softhand.analysis.summary import summarize
from softhand.checks.recording import check_recording
from softhand.commands.main import app
from softhand.controllers.regulation import Regulation
from softhand.model.snapshot import Snapshot
from softhand.model.urdf.examination import HAND, examine
from softhand.model.urdf.mounting import MOUNT, TipPlace, mounted, with_tips
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.roots import nearest_root
from softhand.numerics.spatial import rotation_of
from softhand.scenario.file import resolve_path
from softhand.scenario.hands import known_hands
from softhand.sensing.observation import Observation
from softhand.simulation.simulation import Simulation
from softhand.studies.compare import pairs
from softhand.viewer.scene.recorded import RecordedScene
from softhand.viewer.scene.shapes.mesh import pressed_flat
from softhand.viewer.scene.shapes.solids import sphere

Array = np.ndarray

needs_robots = pytest.mark.skipif(
    importlib.util.find_spec("example_robot_data") is None,
    reason='needs the extra robots: pip install "softhand[robots]"',
)
ALLEGRO = [pytest.param(name, marks=needs_robots) for name in ("allegro-box", "allegro-left-box", "allegro-prism")]
NEW = [*ALLEGRO, "gripper"]
GOOD = Path(__file__).parent / "data/good.urdf"
GOOD_TEXT = GOOD.read_text()
GOOD_HAND = Urdf.parse(GOOD_TEXT, GOOD, HAND)
FLIP = np.array([-1, 1, 1, 1, 1, 1, 1, 1, -1, 1, 1, 1, -1, 1, 1, 1.0])
"""Signs of the joint angles of the left hand that make it the mirror image: those of the spreading joints."""


def start_of(name: str, values: dict[str, Any] | None = None) -> tuple[Simulation, Observation]:
    """A scenario at its start, after one sample."""
    simulation = build(load_scenario(name, values or {}))
    return simulation, simulation.sample().copy()


# --------------------------------------------------------------------------------------------------------------- starts


@pytest.mark.parametrize("contact", ["rolling", "coulomb"])
@pytest.mark.parametrize("name", NEW)
def test_start_is_at_rest(name: str, contact: str) -> None:
    """The controller's first torques hold hand and object: no acceleration, by Pinocchio's own dynamics."""
    simulation, seen = start_of(name, {"fingertip.contact": contact})
    plant, model = simulation.plant, simulation.plant.world.model
    q, data = simulation.state.q, model.createData()
    push = np.concatenate([simulation.torque, np.zeros(6)])
    push -= np.einsum("irk,ir->k", plant.jacobian, plant.contacts["force"])
    acceleration = pin.aba(model, data, q, np.zeros(model.nv), push)
    assert np.max(np.abs(acceleration)) < 1e-9
    assert seen.friction_use.max() < 0.9


@pytest.mark.parametrize("name", ALLEGRO)
def test_start_is_inside_the_joint_limits(name: str) -> None:
    """No joint of the start is within 5 % of its range of a limit."""
    simulation, seen = start_of(name)
    lower, upper = simulation.plant.world.position_limits
    share = (seen.joint_position - lower) / (upper - lower)
    assert share.min() > 0.05 and share.max() < 0.95


@needs_robots
def test_redundant_fingers_start_nearest_to_the_guess() -> None:
    """No motion of the finger that keeps its tip brings the joints closer to the guess, each measured by its range."""
    simulation, seen = start_of("allegro-box")
    world = simulation.plant.world
    lower, upper = world.position_limits
    pull = (np.array(load_scenario("allegro-box").grasp.joint_guess) - seen.joint_position) / (upper - lower) ** 2
    for J, tip in zip(seen.tip_jacobian, world.tips, strict=True):
        columns = list(tip.columns)
        idle = np.linalg.svd(J[:, columns])[2][3]
        assert np.linalg.norm(pull[columns]) > 1e-3 and abs(idle @ pull[columns]) < 1e-6


def test_nearest_root_on_a_circle() -> None:
    """On |x| = 1 the nearest to (2, 1) is in its direction; with x_0 <= 0.5 it is on that bound; ranges weigh."""

    def excess(x: Array) -> Array:
        return np.array([x @ x - 1.0])

    def slope(x: Array) -> Array:
        return 2.0 * x[None]

    root, wish, far = np.array([0.0, 1.0]), np.array([2.0, 1.0]), np.full(2, 3.0)
    free = nearest_root(excess, slope, root, wish, -far, far, 1e-9)
    assert_allclose(free, wish / np.sqrt(5.0), atol=1e-7)
    held = nearest_root(excess, slope, root, wish, -far, np.array([0.5, 3.0]), 1e-9)
    bound = 0.5 - 3.5e-3  # a thousandth of the range inside
    assert_allclose(held, [bound, np.sqrt(1.0 - bound**2)], atol=1e-9)
    weighed = nearest_root(excess, slope, root, wish, np.array([-30.0, -3.0]), np.array([30.0, 3.0]), 1e-9)
    assert weighed[1] > free[1] + 0.1


def test_a_finger_with_too_few_joints_is_told_by_name() -> None:
    """A jaw that slides along one line cannot get to a point beside it: the error has jaw, joints and distance."""
    gravity = [0.0, 0.0, 0.0]
    points = [[-0.028, 0.002, 0.010], [0.028, 0.002, 0.010]]
    with pytest.raises(GraspError, match=r"left_tip: .* out of reach by 2 mm .*with 1 joint, where any point needs 3"):
        build(load_scenario("gripper", {"grasp.contact_points": points, "gravity": gravity}))


# ----------------------------------------------------------------------------------------------------------------- runs


@pytest.mark.parametrize("contact", ["rolling", "coulomb"])
@pytest.mark.parametrize("name", ALLEGRO)
def test_allegro_moves_the_box(name: str, contact: str) -> None:
    """10 mm and 10 deg are reached inside the friction cone and the torque limits, the squeeze is kept."""
    run = simulate(load_scenario(name, {"fingertip.contact": contact}))
    figures = summarize(run)
    assert run.complete and not figures.warnings() and not figures.torque_limited
    assert np.linalg.norm(run.object_position[-1] - run.object_position[0]) == pytest.approx(0.010, rel=1e-3)
    assert figures.position_error < 0.005 and figures.orientation_error < 0.001 and figures.force_error < 1e-4
    assert 0.4 < figures.limit_surface_use < 0.8


@needs_robots
@pytest.mark.parametrize("contact", ["rolling", "coulomb"])
def test_allegro_moves_the_can(contact: str) -> None:
    """The contacts of the prism, moved outwards onto a cylinder of its outer radius, hold and regulate that as well."""
    points = np.array(load_scenario("allegro-prism").grasp.contact_points)
    points[:, :2] *= 0.028 / np.linalg.norm(points[:, :2], axis=1, keepdims=True)
    can = {"object.urdf": "package://softhand/urdf/can.urdf", "grasp.contact_points": points.tolist()}
    scenario = load_scenario("allegro-prism", {**can, "fingertip.contact": contact})
    run = simulate(scenario)
    figures = summarize(run)
    assert run.complete and not figures.warnings() and not figures.torque_limited
    assert np.linalg.norm(run.object_position[-1] - run.object_position[0]) == pytest.approx(0.010, rel=1e-3)
    assert figures.position_error < 0.005 and figures.orientation_error < 0.001 and figures.force_error < 1e-4
    assert np.ptp(run.contact_coordinates[:, 0, 2]) > 0.02  # tips roll round it


def held_over_the_palm(squeeze: float, palm: bool) -> Recording:
    """The palm faces up and the box is held above a pad on it, squeezed with this share of the scenario's forces."""
    scenario = load_scenario("allegro-box")
    values: dict[str, Any] = {
        "gravity": [0.0, -9.81, 0.0],
        "duration": 0.8,
        "fingertip.contact": "coulomb",
        "reference.duration": 0.3,
        "reference.object_position": scenario.object.position,
        "reference.object_rpy": scenario.object.rpy,
        "reference.internal_force": [squeeze * force for force in scenario.grasp.internal_force],
    }
    if palm:  # between the palm and the lower face of the box, which it touches and no more
        pad = {"frame": "palm_link", "position": [0.029, 0.010, 0.025], "radius": 0.018, "friction": 0.5}
        values["palm"] = [pad]
    return simulate(scenario.with_values(values))


@needs_robots
def test_a_palm_carries_what_a_small_squeeze_cannot() -> None:
    """A firm squeeze leaves the pad unloaded, one that slips puts part of the weight on it; without it the box falls.

    Fingers and palm together carry m g.
    """
    firm = held_over_the_palm(1.0, palm=True)
    assert np.abs(firm.support_force).max() < 1e-9
    assert np.abs(firm.object_position[-1] - firm.object_position[0]).max() < 1e-6
    loose, without = held_over_the_palm(0.27, palm=True), held_over_the_palm(0.27, palm=False)
    late, weight = loose.time > 0.6, 0.2 * 9.81
    palm = np.einsum("tr,tr->t", loose.support_rotation[late, 0, 1], loose.support_force[late, 0, :3])
    fingers = np.einsum("tcr,tcr->t", loose.contact_rotation[late, :, 1], loose.contact_force[late, :, :3])
    assert 0.05 * weight < palm.mean() < 0.95 * weight
    assert palm.mean() + fingers.mean() == pytest.approx(weight, rel=0.02)
    assert np.linalg.norm(loose.object_position[-1] - loose.object_position[0]) < 0.005
    assert without.object_position[-1, 1] < without.object_position[0, 1] - 0.05


@needs_robots
def test_left_hand_is_the_mirror_image() -> None:
    """At the start joints and torques are mirrored to the last digits; the runs differ by the file's inertias only.

    The URDF of the left hand keeps the signs of the products of inertia, which a mirror would change.
    """
    (right, one), (left, two) = start_of("allegro-box"), start_of("allegro-left-box")
    assert_allclose(FLIP * two.joint_position, one.joint_position, rtol=0.0, atol=1e-9)
    assert_allclose(FLIP * left.torque, right.torque, rtol=0.0, atol=1e-9)
    assert_allclose(two.tip_position * [1, -1, 1], one.tip_position, rtol=0.0, atol=1e-9)
    runs = [simulate(load_scenario(name, {"duration": 1.0})) for name in ("allegro-box", "allegro-left-box")]
    assert_allclose(runs[1].object_position * [1, -1, 1], runs[0].object_position, rtol=0.0, atol=5e-5)
    assert_allclose(FLIP * runs[1].joint_position, runs[0].joint_position, rtol=0.0, atol=5e-3)


@pytest.mark.parametrize("contact", ["rolling", "coulomb"])
def test_gripper_regulates_what_its_joints_can_do(contact: str) -> None:
    """Place along the jaws and squeeze are reached; across the line and in orientation no joint does anything."""
    run = simulate(load_scenario("gripper", {"fingertip.contact": contact}))
    assert run.complete and run.friction_use.max() < 0.5
    error = run.object_position[-1] - run.object_position_desired[-1]
    assert abs(error[0]) < 1e-6 and abs(run.internal_force[-1, 0] - 12.0) < 1e-5
    assert 1e-6 < np.linalg.norm(error[1:]) < 2e-4  # held by the shear of the tips, not regulated
    assert np.abs(run.object_rpy[-1]).max() < 1e-3
    _, seen = start_of("gripper")
    assert np.linalg.matrix_rank(seen.J_CF_f, tol=1e-9) == 2
    wrench = np.array([0.0, 0.3, -0.2, 0.01, 0.02, -0.03])  # nothing along x
    assert_allclose(seen.J_CF_f.T @ np.linalg.pinv(seen.J_O_f.T) @ wrench, 0.0, atol=1e-9)


def test_a_recording_at_the_apex_is_not_doubted() -> None:
    """Flat jaws touch at the pole of theta, where eta' is no number: no error of the recording."""
    run = simulate(load_scenario("gripper", {"duration": 0.01}))
    assert not np.isfinite(run.contact_coordinates_rate).all()
    assert not check_recording(run).errors


def test_only_laws_that_are_given_enough_are_compared() -> None:
    """A scenario without k_theta is not compared with the law that needs it; one with it is."""
    laws = {law for law, _ in pairs(load_scenario("gripper"))}
    assert "nakashima" not in laws and {"conservative", "radial"} <= laws
    assert {"nakashima", "conservative"} <= {law for law, _ in pairs(load_scenario("target-a"))}


# ---------------------------------------------------------------------------------------------------- redundant control


@needs_robots
def test_k_loses_a_rank_where_four_contacts_lie_in_a_plane() -> None:
    """K of four contacts has rank 6, and 5 where they lie in a plane."""
    _, seen = start_of("allegro-box")
    assert seen.K.shape == (12, 6) and np.linalg.matrix_rank(seen.K, tol=1e-6) == 6
    flat = [[0.028, 0.0, 0.035], [0.028, 0.0, 0.0], [0.028, 0.0, -0.035], [-0.028, 0.0, 0.0]]
    _, seen = start_of("allegro-box", {"grasp.contact_points": flat})
    assert np.linalg.matrix_rank(seen.K, tol=1e-6) == 5
    idle = np.linalg.svd(seen.K)[2][5]
    measured = np.linalg.pinv(seen.K, rcond=1e-6) @ seen.f_C
    assert_allclose(seen.internal_force, measured, atol=1e-9)
    assert abs(idle @ seen.internal_force) < 1e-9  # the least norm: nothing outside the row space


@needs_robots
def test_a_squeeze_outside_the_row_space_of_k_is_ignored() -> None:
    """f_Nd and f_Nd + x with K x = 0 give the same torques."""
    flat = [[0.028, 0.0, 0.035], [0.028, 0.0, 0.0], [0.028, 0.0, -0.035], [-0.028, 0.0, 0.0]]
    _, seen = start_of("allegro-box", {"grasp.contact_points": flat})
    torque = torque_of(Regulation(), seen)
    seen.desired.internal_force[:] += 3.0 * np.linalg.svd(seen.K)[2][5]
    assert_allclose(torque_of(Regulation(), seen), torque, atol=1e-9)
    seen.desired.internal_force[:] += np.linalg.svd(seen.K)[2][0]
    assert np.abs(torque_of(Regulation(), seen) - torque).max() > 1e-3


def torque_of(controller: Controller, seen: Observation) -> Array:
    """The first torque of a controller that starts here."""
    return controller.torque(seen, controller.start(seen))[0].copy()


def idle_motions(seen: Observation) -> Array:
    """Orthonormal joint motions that move no contact point, J_CF^f q_F' = 0, in rows."""
    return np.linalg.svd(seen.J_CF_f)[2][np.linalg.matrix_rank(seen.J_CF_f, tol=1e-9) :]


@needs_robots
def test_posture_moves_no_contact_point_and_pulls_back() -> None:
    """J_CF^f times the term is zero; in the idle motions it is all of K_posture (q_F(0) - q_F)."""
    _, seen = start_of("allegro-box")
    assert idle_motions(seen).shape == (4, 16)
    away = np.random.default_rng(0).normal(0.0, 0.1, 16)
    torques = []
    for stiffness in (0.0, 0.3):
        controller = Regulation(K_posture=stiffness)
        memory = controller.start(seen)
        seen.joint_position[:] += away
        torques.append(controller.torque(seen, memory)[0].copy())
        seen.joint_position[:] -= away
    term = torques[1] - torques[0]
    assert np.abs(seen.J_CF_f @ term).max() < 1e-12
    assert_allclose(idle_motions(seen) @ term, -0.3 * idle_motions(seen) @ away, atol=1e-12)


@needs_robots
def test_posture_comes_back_and_the_object_stays() -> None:
    """Fingers kicked in their idle motion return with K_posture and stay away without; the object is held in both."""
    rest = {"reference.object_position": [0.025, 0.075, 0.010], "reference.object_rpy": [0.0, 0.0, 0.0]}
    left = {}
    for stiffness in (0.0, 0.1):
        simulation, seen = start_of("allegro-box", {**rest, "controller.K_posture": stiffness})
        before, object_before = seen.joint_position.copy(), seen.q_O.copy()
        simulation.state.v[:16] = 2.0 * idle_motions(seen).sum(axis=0)
        for _ in range(3000):
            simulation.step()
            simulation.sample()
        now = simulation.observation
        left[stiffness] = np.abs(now.joint_position - before).max()
        assert np.abs(now.q_O - object_before).max() < 2e-5
    assert left[0.1] < 0.2 * left[0.0] and left[0.0] > 1e-3


def test_posture_of_three_joints_a_finger_is_no_term() -> None:
    """Where J_CF^f has full column rank nothing is idle."""
    _, seen = start_of("target-a")
    controller = Regulation(K_posture=1.0)
    memory = controller.start(seen)
    seen.joint_position[:] += 0.1
    with_posture = controller.torque(seen, memory)[0].copy()
    assert_allclose(with_posture, torque_of(Regulation(), seen), atol=1e-9)


# --------------------------------------------------------------------------------------------------------- rigid bodies


@pytest.mark.parametrize("name", NEW)
def test_dynamics_are_those_of_the_file(name: str, rng: np.random.Generator) -> None:
    """M and C v + N of the mounted hand are Pinocchio's of the bare file with gravity turned the other way."""
    scenario = load_scenario(name)
    world = build(scenario).plant.world
    file = resolve_path(scenario.hand.urdf)
    bare = pin.buildModelFromUrdf(str(file))
    bare.gravity.linear = rotation_of(scenario.hand.rpy).T @ np.array(scenario.gravity)
    data, n = bare.createData(), bare.nv
    q, v = pin.randomConfiguration(bare), rng.normal(size=n)
    M = np.triu(pin.crba(bare, data, q))
    snapshot = Snapshot(world)
    state, rate = pin.neutral(world.model), np.zeros(world.model.nv)
    state[:n], rate[:n] = q, v
    snapshot.update(state, rate)
    assert_allclose(np.triu(snapshot.M[:n, :n]), M, rtol=0.0, atol=1e-12)
    assert_allclose(snapshot.nle[:n], pin.nonLinearEffects(bare, data, q, v), rtol=0.0, atol=1e-12)


@needs_robots
def test_tip_frames_stand_on_their_links() -> None:
    """x of the tip is z of the link of the URDF, in the world, at the same place."""
    simulation, seen = start_of("allegro-box")
    scenario, world = load_scenario("allegro-box"), simulation.plant.world
    bare = pin.buildModelFromUrdf(str(resolve_path(scenario.hand.urdf)))
    data, R = bare.createData(), rotation_of(scenario.hand.rpy)
    pin.framesForwardKinematics(bare, data, seen.joint_position)
    assert [tip.name for tip in world.tips] == ["index", "middle", "ring", "thumb"]
    for k, tip in enumerate(scenario.hand.tips):
        place = data.oMf[bare.getFrameId(tip.frame)]
        assert_allclose(seen.tip_position[k], R @ place.translation, atol=1e-12)
        assert_allclose(seen.tip_rotation[k][:, 0], R @ place.rotation[:, 2], atol=1e-12)


@needs_robots
def test_effort_limit_of_the_scenario_counts() -> None:
    """0.7 N m in place of the 15 of the URDF; a start that needs more is refused."""
    simulation, _ = start_of("allegro-box")
    assert_allclose(simulation.plant.world.effort_limit, 0.7)
    with pytest.raises(GraspError, match=r"its effort limit is 0\.1 N m"):
        build(load_scenario("allegro-box", {"hand.effort_limit": 0.1}))


@needs_robots
def test_allegro_urdf_is_read_with_warnings() -> None:
    """Four distal links are no bodies alone, but are with their tips: a warning; one for damping, one for friction."""
    file = resolve_path(load_scenario("allegro-box").hand.urdf)
    findings = examine(file.read_text(), file, folder=file.parent).findings
    assert not findings.errors
    told = [str(warning) for warning in findings.warnings]
    assert sum("in 4 places (link_" in text and "with what is fixed to it (link_" in text for text in told) == 1
    assert sum("nor that of 15 more in this file" in text for text in told) == 2 and len(told) == 3


FLAT = ('iyy="16.0e-6" iyz="0" izz="16.0e-6"', 'iyy="16.0e-6" iyz="0" izz="20.0e-6"')


@pytest.mark.parametrize(("moment", "is_possible"), [("4.0e-6", True), ("0.5e-6", False)])
def test_a_link_that_is_no_body_may_be_one_with_its_tip(moment: str, is_possible: bool) -> None:
    """ixx = 2, iyy = 16, izz = 20 breaks the triangle by 2; a tip mends it by its own ixx."""
    tip = (
        '<inertial><origin xyz="-0.03 0 0"/><mass value="0.01"/>'
        f'<inertia ixx="{moment}" ixy="0" ixz="0" iyy="{moment}" iyz="0" izz="{moment}"/></inertial>'
    )
    text = GOOD_TEXT.replace(*FLAT, 1)
    head, name, tail = text.partition('<link name="left_tip">')
    assert name
    findings = examine(f"{head}{name}{tip}{tail}", GOOD).findings
    (found,) = [finding for finding in findings if "triangle" in finding.message]
    assert found.is_error is not is_possible and "left_finger" in found.element


# ------------------------------------------------------------------------------------------------------ tips and mounts


def test_a_tip_is_a_link_at_its_place(rng: np.random.Generator) -> None:
    """The link of the tip is where position and rpy put it on its link, and the mount moves all."""
    xyz, rpy, base, turn = rng.normal(0.0, 0.3, (4, 3)).tolist()
    hand = with_tips(GOOD_HAND, [TipPlace("pad", "left_finger", tuple(xyz), tuple(rpy))])
    model, bare = build_model(mounted(hand, tuple(base), tuple(turn))), build_model(GOOD_HAND)
    q, poses = pin.neutral(model), []
    for one, link in ((model, "pad"), (bare, "left_finger")):
        data = one.createData()
        pin.framesForwardKinematics(one, data, q)
        poses.append(data.oMf[one.getFrameId(link, pin.FrameType.BODY)])
    place = pin.SE3(rotation_of(rpy), np.array(xyz))
    mount = pin.SE3(rotation_of(turn), np.array(base))
    assert_allclose(poses[0].homogeneous, (mount * poses[1] * place).homogeneous, atol=1e-12)


def test_no_mount_leaves_the_text() -> None:
    """A hand at the origin keeps its URDF letter by letter."""
    assert mounted(GOOD_HAND, (0.0,) * 3, (0.0,) * 3) is GOOD_HAND and with_tips(GOOD_HAND, []) is GOOD_HAND
    assert GOOD_HAND.text == GOOD_TEXT


@pytest.mark.parametrize(
    ("place", "words"),
    [
        (
            TipPlace("pad", "left_fingr"),
            "no link is called 'left_fingr', which the tip 'pad' shall sit on. .*left_finger",
        ),
        (TipPlace("palm", "left_finger"), "is called 'palm' already; give the tip another name"),
    ],
)
def test_a_tip_that_cannot_be_placed(place: TipPlace, words: str) -> None:
    """The error names the link or the name, and what there is."""
    with pytest.raises(ModelError, match=words):
        with_tips(GOOD_HAND, [place])


def test_a_link_of_the_name_of_the_mount_is_told() -> None:
    """The root that a mount adds has a name of its own."""
    with pytest.raises(ModelError, match=f"'{MOUNT}' already"):
        mounted(Urdf.parse(GOOD_TEXT.replace("left_tip", MOUNT), GOOD), (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


def test_tables_and_texts_may_stand_side_by_side() -> None:
    """A placed tip at home is the frame itself: the same start, under another name."""
    placed = {"frame": "finger_2_tip", "name": "second"}
    one, seen = start_of("target-a")
    two, other = start_of("target-a", {"hand.tips": ["finger_1_tip", placed, "finger_3_tip"]})
    assert [tip.name for tip in two.plant.world.tips] == ["finger_1_tip", "second", "finger_3_tip"]
    assert_allclose(other.joint_position, seen.joint_position, atol=1e-12)
    assert_allclose(two.torque, one.torque, atol=1e-12)
    assert load_scenario("target-a", {"hand.tips": ["a", {"frame": "b"}, "c"]}).hand.names == ("a", "b_soft", "c")


@pytest.mark.parametrize("table", [{"name": "x"}, {"frame": "x", "rpyy": [0, 0, 0]}, {"frame": "x", "rpy": [0, 0]}])
def test_a_wrong_table_of_a_tip_is_told(table: dict[str, Any]) -> None:
    """The error has the item and the keys that a tip can have."""
    with pytest.raises(
        ScenarioError, match=r"hand\.tips: .*item 3 .* a table with the keys frame, name, position, rpy"
    ):
        load_scenario("target-a", {"hand.tips": ["a", "b", table]})


# ------------------------------------------------------------------------------------------------------------- packages


def test_a_missing_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the package of the robots the error has the line that installs it, and the listing too."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    scenario = load_scenario("allegro-box")
    with pytest.raises(ScenarioError, match=r'pip install "softhand\[robots\]"'):
        build(scenario)
    hands = {hand.name: hand for hand in known_hands()}
    assert 'pip install "softhand[robots]"' in hands["allegro_right_hand"].missing
    assert not hands["three_finger_hand"].missing


def test_files_of_installed_packages_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In the folder of the package, or in share/ above it with hyphens; else the error names the folder."""
    package = tmp_path / "lib/site/my_hands"
    (package / "urdf").mkdir(parents=True)
    (tmp_path / "share/my-hands").mkdir(parents=True)
    for file in (package / "__init__.py", package / "urdf/a.urdf", tmp_path / "share/my-hands/b.urdf"):
        file.write_text("")
    monkeypatch.syspath_prepend(package.parent)
    assert resolve_path("package://my_hands/urdf/a.urdf") == package / "urdf/a.urdf"
    assert resolve_path("package://my_hands/b.urdf") == tmp_path / "share/my-hands/b.urdf"
    with pytest.raises(ScenarioError, match=r"installed in .*my_hands, but has no such file"):
        resolve_path("package://my_hands/c.urdf")
    with pytest.raises(ScenarioError, match="leads out of the package"):
        resolve_path("package://my_hands/urdf/../../../share/my-hands/b.urdf")


def test_hands_are_listed() -> None:
    """`softhand hands` shows each hand with its tips and a scenario."""
    result = CliRunner().invoke(app, ["hands"])
    assert result.exit_code == 0
    for word in ("three_finger_hand", "two_finger_hand", "gripper", "allegro_left_hand", "left_tip", "target-a"):
        assert word in result.stdout


# -------------------------------------------------------------------------------------------------------------- picture


@needs_robots
def test_meshes_of_the_hand_are_drawn() -> None:
    """All 21 links are in the picture, and nothing of them is in front of the flat face of a tip."""
    scene = RecordedScene(simulate(load_scenario("allegro-box", {"duration": 0.002})))
    links = [item for item in scene.items if item.layer in ("links", "base") and "_place" not in item.name]
    assert scene.unread == [] and sum("joint_" not in item.name for item in links) == 21
    tips = [item for item in links if "_tip_" in item.name]
    assert len(tips) == 4
    for tip in tips:
        assert tip.vertices[:, 2].max() < 1e-9 and tip.vertices[:, 2].min() < -0.009


def test_pressed_flat_keeps_what_is_behind() -> None:
    """A ball pressed onto the plane x = 0.2 ends there; what is behind is untouched."""
    ball, pose = sphere(1.0), np.eye(4)
    pose[0, 3] = 0.2
    flat = pressed_flat(ball, pose)
    behind = ball.vertices[:, 0] < 0.2
    assert_allclose(flat.vertices[behind], ball.vertices[behind], atol=0.0)
    assert_allclose(flat.vertices[~behind, 0], 0.2, atol=1e-15)
    assert_allclose(flat.vertices[:, 1:], ball.vertices[:, 1:], atol=0.0)


@needs_robots
def test_the_camera_looks_at_the_palm() -> None:
    """The palm is beside the object, so that the picture is taken from the other side."""
    for name, side in (("allegro-box", 1.0), ("allegro-left-box", -1.0)):
        scene = RecordedScene(simulate(load_scenario(name, {"duration": 0.002})))
        assert side * np.sin(scene.bounds.azimuth) > 0.5


@pytest.mark.parametrize("name", ["opposing", "angle-feedback", "two-phase"])
def test_controllers_that_need_a_turning_joint_say_so(name: str) -> None:
    """A gripper has slides alone."""
    with pytest.raises(ScenarioError, match="needs fingers with a joint that turns the tip"):
        simulate(load_scenario("gripper", {"duration": 0.01, "controller": {"name": name}}))
