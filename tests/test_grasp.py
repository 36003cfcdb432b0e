"""The grasp at rest: equilibrium for any hand, and refusals by name."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import (
    CONTACT_POINTS,
    FINGER_GUESS,
    START_FORCE,
    START_POSITION,
    Array,
    Task,
    holding_torque,
    make_fingertips,
    make_law,
    read_reference,
    ring,
    start_acceleration,
    world_from,
    write_box,
    write_hand,
)

from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError, LawError
from softhand.laws.law import Law
from softhand.model.world import World
from softhand.plant.state import State
from softhand.references.reference import Desired
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor
from softhand.start.grasp import Grasp, faces_of, solve_grasp


def observe(task: Task, state: State) -> Observation:
    """The observation at a state."""
    pairs = len(contact_pairs(task.world.n_tips))
    return Sensor(task.plant(), Desired(*np.zeros((3, 6)), np.zeros(pairs))).observe(state, 0.0)


# ---------------------------------------------------------------------------------------------------------- equilibrium


def test_start_is_an_equilibrium(task: Task) -> None:
    """Under the holding torques no joint and no object coordinate of any hand accelerates."""
    np.testing.assert_allclose(start_acceleration(task), 0.0, atol=1e-8)


def test_deformation_of_the_start_is_that_of_its_poses(task: Task) -> None:
    """The deformations, forces and angles of the grasp are those that the contact layer finds at its state."""
    grasp, plant = task.grasp, task.plant()
    plant.update(grasp.state.q, grasp.state.v, grasp.state.z)
    contacts = plant.contacts
    np.testing.assert_allclose(contacts["deformation"], grasp.deformation, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(contacts["force"], grasp.force, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(contacts["angles"], grasp.angles, rtol=0.0, atol=1e-10)


def test_start_has_the_contact_points_asked_for(task: Task) -> None:
    """The contacts lie where they were asked for, to a nanometre."""
    seen = observe(task, task.grasp.state)
    points = (seen.contact_point - seen.object_position) @ seen.object_rotation
    np.testing.assert_allclose(points, task.contact_points, rtol=0.0, atol=1e-9)


def test_start_has_the_internal_force_asked_for(task: Task) -> None:
    """The measured f_N at the start is the one asked for, and no torsion is stored."""
    seen = observe(task, task.grasp.state)
    np.testing.assert_allclose(seen.internal_force, task.internal_force, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(seen.contact_force[:, 3], 0.0, atol=1e-15)
    np.testing.assert_allclose(task.grasp.deformation[:, 3], 0.0, atol=1e-15)


def test_start_carries_the_weight(task: Task) -> None:
    """The contact forces on the object add up to its weight, and their moment to that of its centre of mass."""
    seen = observe(task, task.grasp.state)
    lever = task.world.model.inertias[task.world.object_joint].lever
    weight = np.array([0.0, 0.0, 0.2 * 9.81])
    expected = np.concatenate([weight, np.cross(lever, weight)])
    np.testing.assert_allclose(seen.N_O, expected, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(seen.J_O.T @ seen.contact_force.ravel(), expected, rtol=0.0, atol=1e-7)


def test_start_lies_within_the_joint_limits(task: Task) -> None:
    """The inverse kinematics keeps the joint limits."""
    lower, upper = task.world.position_limits
    angles = observe(task, task.grasp.state).joint_position
    assert np.all(angles >= lower) and np.all(angles <= upper)


def test_reference_start_is_the_first_row_of_the_reference(reference: Task) -> None:
    """Joint angles, deformations, forces, friction and torques are those of an independent implementation at t = 0."""
    row = {name: values[0] for name, values in read_reference("minimum-jerk", True).items()}
    grasp = reference.grasp
    plant = reference.plant()
    torque = holding_torque(plant, grasp.state).reshape(3, 3)
    for i in range(3):
        f = f"f{i + 1}"
        angles = [row[f"{f}_q{k}_rad"] for k in (1, 2, 3)]
        np.testing.assert_allclose(grasp.state.q[3 * i : 3 * i + 3], angles, rtol=0.0, atol=1e-9)
        deformation = [row[f"{f}_delta_{name}"] for name in ("r_m", "theta_rad", "phi_rad", "psi_rad")]
        np.testing.assert_allclose(grasp.deformation[i], deformation, rtol=0.0, atol=1e-10)
        force = [row[f"{f}_{name}"] for name in ("fx_N", "fy_N", "fz_N", "torsion_Nm")]
        np.testing.assert_allclose(grasp.force[i], force, rtol=0.0, atol=1e-8)
        assert grasp.angles[i, 1] == pytest.approx(row[f"{f}_Phi_rad"], abs=1e-9)
        assert 0.5 * grasp.friction_use[i] == pytest.approx(row[f"{f}_friction_ratio"], abs=1e-9)
        commanded = [row[f"{f}_torque{k}_Nm"] for k in (1, 2, 3)]
        np.testing.assert_allclose(torque[i], commanded, rtol=0.0, atol=1e-9)


def test_reference_start_has_the_figures_of_the_layout(grasp: Grasp) -> None:
    """Phi = 60.9, 60.9, 56.5 deg, dr = 2.31, 2.31, 1.94 mm and |f_t| / f_z = 0.36, 0.36, 0.28."""
    np.testing.assert_allclose(np.degrees(grasp.angles[:, 1]), [60.9, 60.9, 56.5], atol=0.05)
    np.testing.assert_allclose(1e3 * grasp.deformation[:, 0], [2.31, 2.31, 1.94], atol=0.005)
    np.testing.assert_allclose(0.5 * grasp.friction_use, [0.36, 0.36, 0.28], atol=0.005)


def test_start_without_a_guess_is_an_equilibrium(reference: Task) -> None:
    """Without a guess of the joint angles the start is found, too."""
    world, tips = reference.world, reference.fingertips
    grasp = solve_grasp(world, tips, CONTACT_POINTS, START_FORCE, START_POSITION, np.eye(3))
    np.testing.assert_allclose(start_acceleration(replace(reference, grasp=grasp)), 0.0, atol=1e-8)


@pytest.mark.parametrize("rpy", [(0.1, 0.0, 0.0), (0.0, -0.12, 0.0), (-0.05, 0.05, 0.2)])
def test_tilted_object_is_held_in_equilibrium(reference: Task, rpy: tuple[float, float, float]) -> None:
    """A start with the object turned is in equilibrium and has that orientation."""
    rotation = pin.rpy.rpyToMatrix(*rpy)
    guess = np.tile(FINGER_GUESS, 3)
    world, tips = reference.world, reference.fingertips
    grasp = solve_grasp(world, tips, CONTACT_POINTS, START_FORCE, START_POSITION, rotation, guess)
    np.testing.assert_allclose(start_acceleration(replace(reference, grasp=grasp)), 0.0, atol=1e-8)
    np.testing.assert_allclose(pin.Quaternion(grasp.state.q[-4:]).matrix(), rotation, rtol=0.0, atol=1e-14)


def test_wrist_stays_at_its_guess(make_task: Callable[[str], Task]) -> None:
    """A joint that moves several tips is not used to reach a single contact."""
    assert make_task("wrist").grasp.state.q[0] == 0.05


# ------------------------------------------------------------------------------------------------------------- refusals


def try_grasp(reference: Task, **changes: Any) -> Grasp:
    """The start of the reference hand with some of it changed."""
    friction = changes.pop("friction", 0.5)
    tips = [replace(tip, friction=friction) for tip in reference.fingertips]
    arguments: dict[str, Any] = {
        "contact_points": CONTACT_POINTS,
        "internal_force": START_FORCE,
        "position": START_POSITION,
        "rotation": np.eye(3),
        "joint_guess": np.tile(FINGER_GUESS, 3),
    }
    return solve_grasp(reference.world, tips, **(arguments | changes))


def test_object_out_of_reach_is_refused(reference: Task) -> None:
    """An object too high for the fingers is refused with the distance that is missing."""
    with pytest.raises(GraspError, match=r"finger_1_tip: the contact point is out of reach by \d") as caught:
        try_grasp(reference, position=(0.0, 0.010, 0.230))
    assert caught.value.finger == "finger_1_tip"
    assert caught.value.quantity == "reach"
    assert 0.04 < caught.value.value < 0.06  # [m]


def test_pulling_contact_is_refused(reference: Task) -> None:
    """An internal force that pulls is refused with the normal force that it would need."""
    with pytest.raises(GraspError, match="finger_3_tip: the contact would have to pull the object with") as caught:
        try_grasp(reference, internal_force=(-1.0, -1.0, 5.0))
    assert caught.value.finger == "finger_3_tip"
    assert caught.value.quantity == "normal force"
    assert caught.value.value < 0.0


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.35])
def test_start_beyond_the_friction_is_refused(reference: Task, friction: float) -> None:
    """A start that needs more than the friction is refused with the friction use."""
    with pytest.raises(GraspError, match=r"finger_1_tip: the start needs \d.* times the available friction") as caught:
        try_grasp(reference, friction=friction)
    assert caught.value.finger == "finger_1_tip"
    assert caught.value.quantity == "friction use"
    assert caught.value.value == pytest.approx(reference.grasp.friction_use[0] * 0.5 / friction, rel=1e-9)
    assert caught.value.value > 1.0


def test_start_at_the_edge_of_the_friction_is_taken(reference: Task) -> None:
    """Friction use just below one is allowed."""
    assert np.max(try_grasp(reference, friction=0.357).friction_use) == pytest.approx(0.997, abs=0.002)


def two_fingers(folder: Path, base: float) -> World:
    """Two fingers that face each other at that distance [m] from the middle."""
    return world_from(write_hand(folder, ring(2, base)), ["finger_1_tip", "finger_2_tip"], write_box(folder))


TWO_POINTS = ((0.028, 0.0, 0.0), (-0.028, 0.0, 0.0))


def hold_with_two(world: World, height: float, points: Sequence[Sequence[float]] = TWO_POINTS) -> Grasp:
    """The start of a two-finger hand."""
    tips, guess = make_fingertips(world, make_law(), points), np.tile(FINGER_GUESS, 2)
    return solve_grasp(world, tips, points, (5.0,), (0.0, 0.0, height), np.eye(3), guess)


def test_contact_at_the_apex_is_refused(tmp_path: Path) -> None:
    """A finger that meets the face head-on is refused: Phi = 90 deg is singular."""
    world = two_fingers(tmp_path, 0.055)
    low, high = 0.112, 0.128
    assert hold_with_two(world, high).angles[0, 1] < math.radians(80)
    with pytest.raises(
        GraspError, match=r"finger_1_tip: the contact lies at Phi = (89|90)\.\d deg, at the apex"
    ) as caught:
        for height in np.linspace(high, low, 33):
            hold_with_two(world, height)
    assert caught.value.finger == "finger_1_tip"
    assert caught.value.quantity == "Phi"
    assert caught.value.value > math.radians(89.0)


def test_contact_at_the_rim_is_refused(tmp_path: Path) -> None:
    """A finger that lies along the face is refused: only the hemisphere is soft."""
    world = two_fingers(tmp_path, 0.020)
    with pytest.raises(GraspError, match=r"finger_1_tip: the contact lies at Phi = .* deg, at the rim") as caught:
        hold_with_two(world, 0.177)
    assert caught.value.finger == "finger_1_tip"
    assert caught.value.quantity == "Phi"
    assert caught.value.value < math.radians(1.0)


POINTS_OFF_THE_SURFACE = {
    "outside": ((0.0281, 0.0, 0.0), 1e-4),
    "inside": ((0.0279, 0.0, 0.0), 1e-4),
    "beyond the edge": ((0.028, 0.019, 0.0), 1e-3),
    "middle": ((0.0, 0.0, 0.0), 0.018),
}


@pytest.mark.parametrize("place", list(POINTS_OFF_THE_SURFACE))
def test_point_off_the_face_is_refused(world: World, place: str) -> None:
    """A contact point that is not on the surface of the box is refused with its distance."""
    point, gap = POINTS_OFF_THE_SURFACE[place]
    with pytest.raises(GraspError, match=r"finger_2_tip: the contact point \(.*\) mm .* is .* mm off") as caught:
        faces_of(world, [CONTACT_POINTS[0], point, CONTACT_POINTS[2]])
    assert caught.value.finger == "finger_2_tip"
    assert caught.value.quantity == "contact point"
    assert caught.value.value == pytest.approx(gap, rel=1e-9)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_point_on_a_face_gets_that_face(world: World, axis: int, side: float) -> None:
    """Each face is found from a point on it, also near its edges."""
    point = 0.95 * np.array([0.028, 0.018, 0.030])
    point[axis] *= side / 0.95
    face = faces_of(world, [point] * 3)[0]
    np.testing.assert_allclose(face.normal, side * np.eye(3)[axis], rtol=0.0, atol=1e-15)
    assert face.normal @ face.tangent == pytest.approx(0.0, abs=1e-15)


def test_torque_beyond_the_effort_limit_is_refused(reference: Task) -> None:
    """A start that needs more than an effort limit is refused with the joint and its torque."""
    with pytest.raises(GraspError, match=r"joint 'finger_\d_.*' would need .* N m at the start; its effort") as caught:
        try_grasp(reference, internal_force=(30.0, 30.0, 25.0))
    assert caught.value.finger in reference.world.joint_names
    assert caught.value.quantity == "torque"
    assert abs(caught.value.value) > 2.0  # [N m]


def test_load_that_two_contacts_cannot_carry_is_refused(tmp_path: Path) -> None:
    """Two point contacts below the centre of mass cannot carry the moment about their line when it is off the line."""
    points = ((0.028, 0.004, 0.0), (-0.028, 0.004, 0.0))
    with pytest.raises(GraspError, match="cannot carry the object") as caught:
        hold_with_two(two_fingers(tmp_path, 0.055), 0.142, points)
    assert caught.value.quantity == "residual load"
    assert np.linalg.norm(caught.value.value) == pytest.approx(0.2 * 9.81 * 0.004, rel=0.01)


def test_soft_tip_that_cannot_answer_is_refused(reference: Task) -> None:
    """A force that would press the tip flat is refused with the force."""
    soft = [replace(tip, law=make_law(0.01)) for tip in reference.fingertips]
    with pytest.raises(GraspError, match="finger_1_tip: no deformation of the tip answers with the force") as caught:
        solve_grasp(
            reference.world, soft, CONTACT_POINTS, START_FORCE, START_POSITION, np.eye(3), np.tile(FINGER_GUESS, 3)
        )
    assert caught.value.finger == "finger_1_tip"
    assert isinstance(caught.value.value, np.ndarray)


def test_law_without_a_number_at_the_start_is_named(reference: Task) -> None:
    """A formula that gives NaN where the grasp presses is refused with law, depth and finger."""

    class Undefined(Law):
        """NaN beyond 1 mm."""

        @staticmethod
        def force(dr: float, dtheta: float, dphi: float, dpsi: float, phi: float, radius: float) -> tuple[float, ...]:
            """A spring that ends."""
            return 2e3 * dr if dr < 0.001 else float("nan"), 0.4 * dtheta, 0.4 * dphi, 0.004 * dpsi

    tips = [replace(tip, law=Undefined(radius=0.010)) for tip in reference.fingertips]
    with pytest.raises(LawError, match=r"law 'Undefined' answers the plain compression dr = 1\.\d+ mm of finger_1_tip"):
        solve_grasp(
            reference.world, tips, CONTACT_POINTS, START_FORCE, START_POSITION, np.eye(3), np.tile(FINGER_GUESS, 3)
        )


def test_guess_of_the_wrong_length_is_refused(reference: Task) -> None:
    """A guess needs one angle a joint."""
    with pytest.raises(GraspError, match="has 6 angles; the hand has 9 joints"):
        try_grasp(reference, joint_guess=np.zeros(6))


def friction_cone(force: Array) -> float:
    """|f_t| / f_z of a contact force."""
    return float(np.hypot(force[0], force[1]) / force[2])


def test_friction_use_of_the_start(task: Task) -> None:
    """The friction use of the grasp is |f_t| / (mu f_z), below one."""
    expected = [
        friction_cone(force) / tip.friction for force, tip in zip(task.grasp.force, task.fingertips, strict=True)
    ]
    np.testing.assert_allclose(task.grasp.friction_use, expected, rtol=1e-12)
    assert np.max(task.grasp.friction_use) < 1.0
