"""The contact layer: frames, Jacobians, deformation, forces and coordinates against the paper's construction."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hands import Array, Task, make_law, numerical_jacobian, random_state
from scipy.optimize import fsolve

from softhand.contact.answer import contact_force
from softhand.contact.kinematics import (
    contact_coordinates,
    deformation_jacobian,
    deformation_rate,
    integrate_memory,
)
from softhand.contact.pairs import contact_pairs
from softhand.contact.records import CONTACT, PAD
from softhand.laws.law import Law
from softhand.model.configuration import integrate
from softhand.plant.dynamics import generalized_force
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.references.reference import Desired
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor

PERMUTATION = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])


def polar_point(R: float, Theta: float, Phi: float) -> Array:
    """Contact point in the finger frame, Eq. (14)."""
    return R * np.array([math.sin(Phi), math.cos(Theta) * math.cos(Phi), math.sin(Theta) * math.cos(Phi)])


def polar_frame(Theta: float, Phi: float) -> Array:
    """Axes of the contact frame in the finger frame, Eq. (17)."""
    about_x = pin.AngleAxis(Theta, np.array([1.0, 0.0, 0.0])).matrix()
    about_z = pin.AngleAxis(-Phi, np.array([0.0, 0.0, 1.0])).matrix()
    return about_x @ about_z @ PERMUTATION


def face_axes(pad: np.void) -> Array:
    """Axes of the face frame in the object frame."""
    n, t = pad["face_normal"], pad["face_tangent"]
    return np.column_stack([t, np.cross(n, t), n])


def contact_J_delta(contact: np.void) -> Array:
    """J_delta of a contact."""
    J_delta = np.full((4, 4), np.nan)
    deformation_jacobian(contact["distance"], contact["sin_Phi"], contact["cos_Phi"], J_delta)
    return J_delta


class Poses:
    """Frames of the tips and of the object at any configuration, from Pinocchio's joint poses alone."""

    def __init__(self, task: Task) -> None:
        self._world = task.world
        self._data = task.world.model.createData()

    def move(self, q: Array) -> None:
        """Go to a configuration."""
        pin.forwardKinematics(self._world.model, self._data, q)

    def tip(self, index: int) -> tuple[Array, Array]:
        """Axes and origin of the finger frame F."""
        tip = self._world.tips[index]
        pose = self._data.oMi[tip.joint]
        return pose.rotation @ tip.rotation, pose.translation + pose.rotation @ tip.position

    def object(self) -> tuple[Array, Array]:
        """Axes and origin of the object frame."""
        pose = self._data.oMi[self._world.object_joint]
        return pose.rotation.copy(), pose.translation.copy()


@pytest.fixture
def moving(task: Task, state: State) -> Plant:
    """A plant at a random moving state, stiffness included."""
    plant = task.plant()
    plant.snapshot.update(state.q, state.v)
    plant.touch(state.v, state.z, with_stiffness=True)
    return plant


@pytest.fixture
def seen(task: Task, state: State) -> Observation:
    """The observation at a random moving state."""
    return observe(task, state)


def observe(task: Task, state: State) -> Observation:
    """The observation at a state."""
    pairs = len(contact_pairs(task.world.n_tips))
    return Sensor(task.plant(), Desired(*np.zeros((3, 6)), np.zeros(pairs))).observe(state, 0.0)


# ------------------------------------------------------------------------------------------------------------- geometry


def test_contact_solves_the_contact_equations(task: Task, state: State, moving: Plant) -> None:
    """R, Theta, Phi and the contact point are what a solver finds from (13), (14), (16) and (17).

    Equal positions on tip and face, (13), and opposite normals, (16), are five equations for R, Theta, Phi and the two
    coordinates on the face.
    """
    poses = Poses(task)
    poses.move(state.q)
    R_O, p_O = poses.object()
    for i, (pad, contact) in enumerate(zip(moving.pads, moving.contacts, strict=True)):
        R_F, p_F = poses.tip(i)
        A = R_O @ face_axes(pad)

        def miss(x: Array, A: Array = A, R_F: Array = R_F, p_F: Array = p_F, d: float = pad["face_offset"]) -> Array:
            on_tip = p_F + R_F @ polar_point(*x[:3])
            on_face = p_O + A @ np.array([x[3], x[4], d])
            normal = R_F @ polar_frame(x[1], x[2])[:, 2]
            return np.concatenate([1e3 * (on_tip - on_face), A[:, :2].T @ normal])

        angles = contact["angles"]
        start = np.array([0.008, angles[0] + 0.1, angles[1] - 0.1, 0.001, -0.001])
        found, _, success, _ = fsolve(miss, start, xtol=1e-13, full_output=True)
        assert success == 1 and np.max(np.abs(miss(found))) < 1e-10
        np.testing.assert_allclose([contact["distance"], *angles], found[:3], rtol=0.0, atol=1e-10)
        np.testing.assert_allclose(contact["point"], p_F + R_F @ polar_point(*found[:3]), rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(contact["tip"], p_F, rtol=0.0, atol=1e-15)


def test_contact_frame_is_that_of_eq_17(task: Task, state: State, moving: Plant) -> None:
    """The axes of C_F are R_X(Theta) R_Z(-Phi) P in the finger frame, right-handed, z into the face."""
    poses = Poses(task)
    poses.move(state.q)
    R_O, _ = poses.object()
    for i, (pad, contact) in enumerate(zip(moving.pads, moving.contacts, strict=True)):
        R_F, _ = poses.tip(i)
        np.testing.assert_allclose(contact["rotation"], R_F @ polar_frame(*contact["angles"]), rtol=0.0, atol=1e-12)
        assert np.linalg.det(contact["rotation"]) == pytest.approx(1.0, abs=1e-12)
        np.testing.assert_allclose(contact["rotation"][:, 2], -R_O @ pad["face_normal"], rtol=0.0, atol=1e-14)
        sine_cosine = [math.sin(contact["angles"][1]), math.cos(contact["angles"][1])]
        np.testing.assert_allclose([contact["sin_Phi"], contact["cos_Phi"]], sine_cosine, rtol=0.0, atol=1e-14)


def test_contact_frame_axes_point_along_the_angles(moving: Plant, task: Task, state: State) -> None:
    """x_C is the direction in which the point (14) moves with Theta, y_C that with Phi."""
    poses = Poses(task)
    poses.move(state.q)
    for i, contact in enumerate(moving.contacts):
        R_F, _ = poses.tip(i)
        slopes = R_F @ numerical_jacobian(
            lambda move, contact=contact: polar_point(contact["distance"], *(contact["angles"] + move)), 2
        )
        np.testing.assert_allclose(
            contact["rotation"][:, :2], slopes / np.linalg.norm(slopes, axis=0), rtol=0.0, atol=1e-8
        )


def test_coordinates_are_those_of_eqs_15_and_18_to_20(task: Task, state: State, seen: Observation) -> None:
    """Theta + dtheta, Phi + dphi, the point on the face and Psi - dpsi, with Psi from the two contact frames (18)."""
    plant = task.plant()
    poses = Poses(task)
    poses.move(state.q)
    R_O, p_O = poses.object()
    for i, pad in enumerate(plant.pads):
        A = R_O @ face_axes(pad)
        np.testing.assert_allclose(seen.eta[i, :2], seen.contact_angles[i] + state.z[i, :2], rtol=0.0, atol=1e-14)
        on_face = A.T @ (seen.contact_point[i] - p_O)
        np.testing.assert_allclose(on_face, [*seen.eta[i, 2:4], pad["face_offset"]], rtol=0.0, atol=1e-13)
        Psi = seen.eta[i, 4] + state.z[i, 2]
        c, s = math.cos(Psi), math.sin(Psi)
        expected = np.array([[c, -s, 0.0], [-s, -c, 0.0], [0.0, 0.0, -1.0]])
        np.testing.assert_allclose(A.T @ seen.contact_rotation[i], expected, rtol=0.0, atol=1e-13)


def test_deformation_is_geometry_and_memory(task: Task, state: State, moving: Plant) -> None:
    """dr = r - R; dtheta, dphi and dpsi are those of the state."""
    np.testing.assert_allclose(
        moving.contacts["deformation"][:, 0], 0.010 - moving.contacts["distance"], rtol=0.0, atol=1e-17
    )
    np.testing.assert_array_equal(moving.contacts["deformation"][:, 1:], state.z)


# ----------------------------------------------------------------------------------------------------------- kinematics


def test_contact_jacobian_is_the_relative_motion_of_material_points(task: Task, state: State, moving: Plant) -> None:
    """[J_CF, -J_O] gives the velocity of the tip's material point at the contact relative to the object's, in C_F."""
    poses, model = Poses(task), task.world.model
    poses.move(state.q)
    R_O, p_O = poses.object()
    for i, contact in enumerate(moving.contacts):
        R_F, p_F = poses.tip(i)
        on_tip, on_object = R_F.T @ (contact["point"] - p_F), R_O.T @ (contact["point"] - p_O)

        def relative(
            move: Array, i: int = i, on_tip: Array = on_tip, on_object: Array = on_object, R_F: Array = R_F
        ) -> Array:
            poses.move(pin.integrate(model, state.q, move))
            (tip, p_tip), (box, p_box) = poses.tip(i), poses.object()
            gap = (p_tip + tip @ on_tip) - (p_box + box @ on_object)
            return np.concatenate([gap, pin.log3(tip @ R_F.T) - pin.log3(box @ R_O.T)])

        motion = numerical_jacobian(relative, model.nv)
        C = contact["rotation"]
        expected = np.vstack([C.T @ motion[:3], C[:, 2] @ motion[3:]])
        np.testing.assert_allclose(moving.jacobian[i], expected, rtol=0.0, atol=2e-9)
        np.testing.assert_allclose(contact["velocity"], expected @ state.v, rtol=0.0, atol=2e-8)


def test_deformation_jacobian_is_the_motion_of_the_deformed_point(moving: Plant) -> None:
    """J_delta of (37), (42) is the motion of the point (14) and of its frame (17) with R, Theta, Phi, and a spin."""
    for contact in moving.contacts:
        distance, angles = contact["distance"], contact["angles"]
        frame = polar_frame(*angles)

        def move_contact(
            move: Array, distance: float = distance, angles: Array = angles, frame: Array = frame
        ) -> Array:
            moved = polar_frame(angles[0] + move[1], angles[1] + move[2])
            spin = pin.log3(moved @ pin.exp3(np.array([0.0, 0.0, move[3]])) @ frame.T)
            return np.concatenate([polar_point(distance + move[0], angles[0] + move[1], angles[1] + move[2]), spin])

        motion = numerical_jacobian(move_contact, 4)
        expected = np.vstack([frame.T @ motion[:3], frame[:, 2] @ motion[3:]])
        np.testing.assert_allclose(contact_J_delta(contact), expected, rtol=0.0, atol=1e-9)


def test_deformation_jacobian_is_that_of_the_paper() -> None:
    """J_delta has the entries of (37), (42)."""
    J_delta = np.full((4, 4), np.nan)
    deformation_jacobian(0.0077, math.sin(1.1), math.cos(1.1), J_delta)
    expected = [
        [0.0, 0.0077 * math.cos(1.1), 0.0, 0.0],
        [0.0, 0.0, 0.0077, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0, math.sin(1.1), 0.0, 1.0],
    ]
    np.testing.assert_array_equal(J_delta, expected)


def test_deformation_rate_solves_eq_43(moving: Plant) -> None:
    """J_delta times the deformation rate is the contact velocity."""
    for contact in moving.contacts:
        np.testing.assert_allclose(
            contact_J_delta(contact) @ contact["deformation_rate"], contact["velocity"], rtol=1e-12, atol=1e-14
        )


def test_deformation_rate_inverts_any_velocity(moving: Plant, rng: np.random.Generator) -> None:
    """`deformation_rate` is J_delta^-1 for any velocity."""
    for contact in moving.contacts:
        velocity, rate = rng.normal(size=4), np.zeros(4)
        deformation_rate(contact, velocity, rate)
        np.testing.assert_allclose(rate, np.linalg.solve(contact_J_delta(contact), velocity), rtol=1e-12)


def test_compression_rate_is_the_normal_velocity(task: Task, state: State, moving: Plant) -> None:
    """dr, which is computed from poses, changes with v_z."""
    other, model = task.plant(), task.world.model

    def compression(time: Array) -> Array:
        other.update(pin.integrate(model, state.q, time[0] * state.v), state.v, state.z)
        return other.contacts["deformation"][:, 0].copy()

    expected = numerical_jacobian(compression, 1)[:, 0]
    np.testing.assert_allclose(moving.contacts["velocity"][:, 2], expected, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(moving.contacts["deformation_rate"][:, 0], expected, rtol=0.0, atol=1e-8)


def test_lead_moves_the_memory_only(task: Task, state: State, moving: Plant) -> None:
    """With a lead the deformation is taken at z + lead z'(v); geometry and velocities stay."""
    lead, other = 3e-4, task.plant()
    other.snapshot.update(state.q, state.v)
    other.touch(state.v, state.z, lead=lead)
    before, after = moving.contacts, other.contacts
    for name in ("distance", "angles", "point", "velocity", "deformation_rate"):
        np.testing.assert_array_equal(after[name], before[name])
    np.testing.assert_array_equal(after["deformation"][:, 0], before["deformation"][:, 0])
    expected = state.z + lead * before["deformation_rate"][:, 1:]
    np.testing.assert_allclose(after["deformation"][:, 1:], expected, rtol=0.0, atol=1e-16)


def test_memory_is_integrated_with_its_rate(task: Task, state: State, moving: Plant, rng: np.random.Generator) -> None:
    """`integrate_memory` adds h z'(v) to (dtheta, dphi, dpsi), for a velocity other than the last one, too."""
    step, v = 2e-3, rng.normal(size=state.v.shape)
    z = state.z.copy()
    integrate_memory(moving.pads, moving.columns, moving.contacts, moving.contact_columns, v, step, z)
    for contact, jacobian, before, after in zip(moving.contacts, moving.jacobian, state.z, z, strict=True):
        rate = np.linalg.solve(contact_J_delta(contact), jacobian @ v)
        np.testing.assert_allclose(after, before + step * rate[1:], rtol=0.0, atol=1e-13)


# --------------------------------------------------------------------------------------------------------------- forces


def force_at(law: Law, contact: np.void, deformation: Array) -> Array:
    """Contact force by (48) for a deformation at the geometry of a contact."""
    dF = law(deformation, contact["angles"][1])
    return np.linalg.solve(contact_J_delta(contact).T, dF)


def test_contact_force_is_eq_48(task: Task, moving: Plant) -> None:
    """The force in C_F is J_delta^-T dF, dF by the law at phi = Phi + dphi."""
    for fingertip, contact in zip(task.fingertips, moving.contacts, strict=True):
        expected = force_at(fingertip.law, contact, contact["deformation"])
        np.testing.assert_allclose(contact["force"], expected, rtol=1e-11, atol=1e-14)
        dF = fingertip.law(contact["deformation"], contact["angles"][1])
        np.testing.assert_allclose(contact["deformation_force"], dF, rtol=1e-12)


def test_contact_force_is_the_transposed_inverse(moving: Plant, rng: np.random.Generator) -> None:
    """`contact_force` is J_delta^-T for any dF: power is conserved between deformation and contact."""
    for contact in moving.contacts:
        dF, velocity, force, rate = rng.normal(size=4), rng.normal(size=4), np.zeros(4), np.zeros(4)
        contact_force(contact, dF, force)
        deformation_rate(contact, velocity, rate)
        assert force @ velocity == pytest.approx(dF @ rate, rel=1e-10)


def test_stiffness_is_the_derivative_of_the_force(task: Task, moving: Plant) -> None:
    """`stiffness` is d force / d displacement in C_F at fixed contact geometry."""
    pressed = 0
    for fingertip, contact in zip(task.fingertips, moving.contacts, strict=True):
        inverse = np.linalg.inv(contact_J_delta(contact))
        size = np.array([1e-7, 1e-7, 1e-7, 1e-5])  # m, m, m, rad

        def force(
            move: Array,
            law: Law = fingertip.law,
            contact: np.void = contact,
            inverse: Array = inverse,
            size: Array = size,
        ) -> Array:
            return force_at(law, contact, contact["deformation"] + inverse @ (size * move))

        expected = numerical_jacobian(force, 4, 1.0) / size
        scale = np.array([1e3, 1e3, 1e3, 1.0])  # N/m; N, the first three rows by rotation, are small beside it
        np.testing.assert_allclose(contact["stiffness"] / scale, expected / scale, rtol=2e-6, atol=1e-6)
        pressed += contact["deformation"][0] > 0.0
    assert pressed >= 1


def test_object_gets_minus_the_wrench_of_the_tips(task: Task, state: State, moving: Plant) -> None:
    """Action equals reaction: about the world origin the wrench on the object is minus the sum of those on the tips.

    The wrench on the object is read from its six generalised forces; those on the tips are taken from the contact
    forces, and give back the generalised forces of the joints through the world Jacobians.
    """
    world, nv = task.world, task.world.model.nv
    generalised = np.zeros(nv)
    generalized_force(moving.touching, np.zeros(nv), np.zeros(world.n_joints), np.zeros(nv), generalised)
    on_tips = []
    for contact in moving.contacts:
        force = -contact["rotation"] @ contact["force"][:3]
        moment = -contact["rotation"][:, 2] * contact["force"][3]
        on_tips.append(np.concatenate([force, np.cross(contact["point"], force) + moment]))
    joints = np.zeros(world.n_joints)
    for tip, wrench in zip(world.tips, on_tips, strict=True):
        joints[list(tip.columns)] += moving.snapshot.J[:, list(tip.columns)].T @ wrench
    np.testing.assert_allclose(generalised[:-6], joints, rtol=0.0, atol=1e-12)
    R, p = pin.Quaternion(state.q[-4:]).matrix(), state.q[-7:-4]
    force = R @ generalised[-6:-3]
    on_object = np.concatenate([force, np.cross(p, force) + R @ generalised[-3:]])
    assert np.linalg.norm(on_object) > 1e-3
    np.testing.assert_allclose(on_object, -np.sum(on_tips, axis=0), rtol=0.0, atol=1e-12)


def test_acceleration_solves_the_equations_of_motion(
    task: Task, state: State, moving: Plant, rng: np.random.Generator
) -> None:
    """M dv/dt = (torque, 0) - (C v + N) - J^T C_F, (46) and (47)."""
    n, M = task.world.n_joints, np.triu(moving.snapshot.M)
    M += np.triu(M, 1).T
    torque = rng.normal(size=n)
    acceleration = moving.acceleration(torque, np.zeros(task.world.model.nv))
    pull = np.einsum("irk,ir->k", moving.jacobian, moving.contacts["force"])
    expected = np.concatenate([torque, np.zeros(6)]) - moving.snapshot.nle - pull
    np.testing.assert_allclose(M @ acceleration, expected, rtol=0.0, atol=1e-10)


# ---------------------------------------------------------------------------------------- what the controller is handed


def test_object_jacobian_follows_the_coordinates(task: Task, state: State, seen: Observation) -> None:
    """J_O gives the velocity of the object's material points at the contacts, and its spin, from the rates of q_O."""
    position, rpy = seen.q_O[:3].copy(), seen.q_O[3:].copy()
    R_O = pin.rpy.rpyToMatrix(rpy)
    np.testing.assert_allclose(R_O, seen.object_rotation, rtol=0.0, atol=1e-14)
    for i in range(task.world.n_tips):
        C, arm = seen.contact_rotation[i], R_O.T @ (seen.contact_point[i] - position)

        def motion(move: Array, arm: Array = arm) -> Array:
            turned = pin.rpy.rpyToMatrix(rpy + move[3:])
            return np.concatenate([position + move[:3] + turned @ arm, pin.log3(turned @ R_O.T)])

        slope = numerical_jacobian(motion, 6)
        np.testing.assert_allclose(seen.J_O_f[3 * i : 3 * i + 3], C.T @ slope[:3], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(seen.J_O_tau[i], C[:, 2] @ slope[3:], rtol=0.0, atol=1e-9)
        np.testing.assert_array_equal(seen.J_O[4 * i : 4 * i + 3], seen.J_O_f[3 * i : 3 * i + 3])
        np.testing.assert_array_equal(seen.J_O[4 * i + 3], seen.J_O_tau[i])


def test_finger_jacobian_is_the_hand_part_of_the_contact_jacobian(
    task: Task, state: State, moving: Plant, seen: Observation
) -> None:
    """J_CF_f and J_CF_tau are the joints' columns of the contact Jacobian, and J_CF holds both."""
    n, nc = task.world.n_joints, task.world.n_tips
    np.testing.assert_array_equal(seen.J_CF_f, moving.jacobian[:, :3, :n].reshape(3 * nc, n))
    np.testing.assert_array_equal(seen.J_CF_tau, moving.jacobian[:, 3, :n])
    np.testing.assert_array_equal(seen.J_CF, moving.jacobian[:, :, :n].reshape(4 * nc, n))


def test_relative_velocity_in_the_paper_coordinates(task: Task, state: State, seen: Observation) -> None:
    """J_CF q_F' - J_O q_O' is J_delta times the deformation rate, (43), q_O' from the twist through T_O."""
    coordinates_rate = np.linalg.solve(seen.T_O, seen.object_twist)
    velocity = (seen.J_CF @ seen.joint_velocity - seen.J_O @ coordinates_rate).reshape(-1, 4)
    plant = task.plant()
    plant.update(state.q, state.v, state.z)
    for contact, value in zip(plant.contacts, velocity, strict=True):
        np.testing.assert_allclose(contact_J_delta(contact) @ contact["deformation_rate"], value, rtol=0.0, atol=1e-12)


def test_twist_and_T_O_follow_the_coordinates(task: Task, state: State, seen: Observation) -> None:
    """`object_twist` = T_O q_O', q_O' by differences of q_O along the motion."""

    def coordinates(time: Array) -> Array:
        moved = State(pin.integrate(task.world.model, state.q, time[0] * state.v), state.v, state.z)
        return observe(task, moved).q_O.copy()

    rate = numerical_jacobian(coordinates, 1)[:, 0]
    np.testing.assert_allclose(seen.T_O @ rate, seen.object_twist, rtol=0.0, atol=1e-8)
    R = seen.object_rotation
    np.testing.assert_allclose(seen.object_twist[:3], R @ state.v[-6:-3], rtol=0.0, atol=1e-14)
    np.testing.assert_allclose(seen.object_twist[3:], R @ state.v[-3:], rtol=0.0, atol=1e-14)


@pytest.mark.parametrize("rpy", [(0.4, -1.2, 2.8), (-2.9, 1.3, -2.0), (1.6, 0.2, -0.7)])
def test_T_O_holds_for_large_angles(reference: Task, rpy: tuple[float, float, float]) -> None:
    """T_O maps the rates of roll, pitch and yaw to the angular velocity far from zero, too."""
    state = reference.grasp.state.copy()
    state.q[-4:] = pin.Quaternion(pin.rpy.rpyToMatrix(*rpy)).coeffs()
    seen = observe(reference, state)
    np.testing.assert_allclose(seen.object_rpy, rpy, rtol=0.0, atol=1e-13)
    R = pin.rpy.rpyToMatrix(*rpy)
    expected = numerical_jacobian(lambda move: pin.log3(pin.rpy.rpyToMatrix(np.array(rpy) + move) @ R.T), 3)
    np.testing.assert_allclose(seen.T_O[3:, 3:], expected, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(seen.T_O[:3], np.eye(3, 6))


def test_gravity_terms_of_the_object_are_a_potential_slope(task: Task, state: State, seen: Observation) -> None:
    """N_O is the derivative of the weight's potential energy by q_O, and N_F that by the joints."""
    model = task.world.model
    data = model.createData()
    position, rpy = seen.q_O[:3].copy(), seen.q_O[3:].copy()

    def potential(move: Array) -> float:
        q = pin.integrate(model, state.q, np.concatenate([move[6:], np.zeros(6)]))
        q[-7:-4] = position + move[:3]
        q[-4:] = pin.Quaternion(pin.rpy.rpyToMatrix(rpy + move[3:6])).coeffs()
        return pin.computePotentialEnergy(model, data, q)

    slope = numerical_jacobian(potential, 6 + task.world.n_joints, 1e-5)
    np.testing.assert_allclose(seen.N_O, slope[:6], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(seen.N_F, slope[6:], rtol=0.0, atol=1e-9)


def test_mass_matrices_give_the_kinetic_energy(task: Task, state: State, seen: Observation) -> None:
    """M_F and M_O, in the coordinates q_F and q_O, give the kinetic energy of the hand and of the object."""
    model = task.world.model
    energy = pin.computeKineticEnergy(model, model.createData(), state.q, state.v)
    rate = np.linalg.solve(seen.T_O, seen.object_twist)
    v = seen.joint_velocity
    assert 0.5 * (v @ seen.M_F @ v + rate @ seen.M_O @ rate) == pytest.approx(energy, rel=1e-12)


def test_K_is_a_kernel_of_the_grasp_map(task: Task, seen: Observation) -> None:
    """Internal forces along the columns of K put no force and no moment on the object, (58)."""
    assert seen.K.shape == (3 * task.world.n_tips, len(contact_pairs(task.world.n_tips)))
    np.testing.assert_allclose(seen.J_O_f.T @ seen.K, 0.0, rtol=0.0, atol=1e-14)


def test_positive_internal_force_squeezes(task: Task, seen: Observation) -> None:
    """Column k of K holds unit forces on the object that point from each contact of pair k at the other."""
    for k, (i, j) in enumerate(contact_pairs(task.world.n_tips)):
        line = seen.contact_point[j] - seen.contact_point[i]
        line /= np.linalg.norm(line)
        forces = np.einsum("iab,ib->ia", seen.contact_rotation, seen.K[:, k].reshape(-1, 3))
        np.testing.assert_allclose(forces[i], line, rtol=0.0, atol=1e-14)
        np.testing.assert_allclose(forces[j], -line, rtol=0.0, atol=1e-14)
        np.testing.assert_array_equal(np.delete(forces, [i, j], axis=0), 0.0)


def test_internal_force_is_the_pseudoinverse(task: Task, seen: Observation) -> None:
    """The measured f_N is K^+ f_C."""
    expected = np.linalg.pinv(seen.K) @ seen.f_C
    np.testing.assert_allclose(seen.internal_force, expected, rtol=0.0, atol=1e-9 * (1 + np.max(np.abs(expected))))


def test_pairs_are_in_the_order_of_the_paper() -> None:
    """Three contacts: between 2 and 3, then 1 and 3, then 1 and 2."""
    assert contact_pairs(3) == [(1, 2), (0, 2), (0, 1)]


def test_friction_use_is_the_share_of_the_cone(task: Task, seen: Observation) -> None:
    """Friction use is |f_t| / (mu f_z), and infinite at a tip that holds a tangential force without pressing."""
    for fingertip, force, use in zip(task.fingertips, seen.contact_force, seen.friction_use, strict=True):
        tangential = math.hypot(force[0], force[1])
        expected = tangential / (fingertip.friction * force[2]) if force[2] > 0.0 else math.inf
        assert use == pytest.approx(expected)


# ------------------------------------------------------------------------------------- rates of the paper's coordinates


def coordinates_along(task: Task, state: State, rates: Array) -> Callable[[Array], Array]:
    """eta at a time of the motion with the velocity of the state, z moving with the given rates."""

    def eta(time: Array) -> Array:
        q = np.empty_like(state.q)
        integrate(task.world.joints, state.q, state.v, time[0], q)
        return observe(task, State(q, state.v, state.z + time[0] * rates)).eta.copy()

    return eta


def test_coordinate_rates_in_rolling(task: Task, state: State, seen: Observation) -> None:
    """(38)-(40) are the rates of eta along a rolling motion in which everything moves."""
    expected = numerical_jacobian(coordinates_along(task, state, seen.deformation_rate[:, 1:].copy()), 1)[..., 0]
    assert np.min(np.abs(expected)) > 1e-6
    np.testing.assert_allclose(seen.eta_rate, expected, rtol=2e-6, atol=1e-6)


def slipping(task: Task, state: State, rng: np.random.Generator) -> tuple[Plant, Array]:
    """A plant whose tips slip: deformation rates that do not use up the whole contact velocity, and these rates."""
    plant = task.plant()
    plant.update(state.q, state.v, state.z)
    rates = plant.contacts["deformation_rate"]
    rates[:, 1:] += rng.normal(0.0, 5.0, rates[:, 1:].shape)
    return plant, rates.copy()


def slip_coordinates(plant: Plant, state: State) -> tuple[Array, Array]:
    """eta and its rate by (38)-(40) at the plant's contacts, shape (nc, 5) each."""
    nc = len(plant.contacts)
    eta, rate = np.zeros((nc, 5)), np.zeros((nc, 5))
    for i in range(nc):
        contact_coordinates(
            plant.pads[i],
            plant.contacts[i],
            plant.columns[i],
            plant.snapshot.poses[-1],
            plant.snapshot.J,
            state.v,
            eta[i],
            rate[i],
        )
    return eta, rate


def test_coordinate_rates_in_slip(task: Task, state: State, rng: np.random.Generator) -> None:
    """(38)-(40), (39) with a plus, are the rates of eta also while the tips slip and spin on the face."""
    plant, rates = slipping(task, state, rng)
    _, rate = slip_coordinates(plant, state)
    expected = numerical_jacobian(coordinates_along(task, state, rates[:, 1:]), 1)[..., 0]
    np.testing.assert_allclose(rate, expected, rtol=2e-6, atol=1e-6)


def test_printed_sign_of_eq_39_fails_in_slip(task: Task, state: State, rng: np.random.Generator) -> None:
    """With the minus that the paper prints, (39) misses the motion of the contact point by twice the slip velocity."""
    plant, rates = slipping(task, state, rng)
    eta, rate = slip_coordinates(plant, state)
    expected = numerical_jacobian(coordinates_along(task, state, rates[:, 1:]), 1)[..., 0]
    for i, contact in enumerate(plant.contacts):
        slip = contact["velocity"][:2] - (contact_J_delta(contact) @ rates[i])[:2]
        Psi = eta[i, 4] + state.z[i, 2]
        R_psi = np.array([[math.cos(Psi), -math.sin(Psi)], [-math.sin(Psi), -math.cos(Psi)]])
        printed = rate[i, 2:4] - 2.0 * np.linalg.solve(R_psi, slip)
        assert np.linalg.norm(slip) > 1e-3
        miss = np.linalg.norm(printed - expected[i, 2:4])
        assert miss == pytest.approx(2.0 * np.linalg.norm(slip), rel=1e-3)


# --------------------------------------------------------------------------------------------------------------- tables


def test_pads_hold_tip_and_face(reference: Task, plant: Plant) -> None:
    """The constants of each contact are those of its tip, its law and its face."""
    assert plant.pads.dtype == PAD and plant.contacts.dtype == CONTACT
    law = make_law()
    for pad, tip, fingertip in zip(plant.pads, reference.world.tips, reference.fingertips, strict=True):
        assert (pad["joint"], pad["radius"], pad["friction"]) == (tip.joint, 0.010, 0.5)
        np.testing.assert_array_equal(pad["face_normal"], fingertip.face.normal)
        np.testing.assert_array_equal(pad["law_arguments"][5:10], law.parameters())


def test_each_contact_has_its_own_law(reference: Task, rng: np.random.Generator) -> None:
    """Tips of different materials each answer with their own law."""
    laws = [make_law(), make_law(2.0), make_law(0.5)]
    fingertips = [replace(tip, law=law) for tip, law in zip(reference.fingertips, laws, strict=True)]
    state = random_state(reference, rng)
    plant, mixed = reference.plant(), Plant(reference.world, fingertips)
    for each in (plant, mixed):
        each.update(state.q, state.v, state.z)
    factors = np.array([[1.0], [2.0], [0.5]])
    np.testing.assert_allclose(mixed.contacts["force"], factors * plant.contacts["force"], rtol=1e-12, atol=1e-15)
