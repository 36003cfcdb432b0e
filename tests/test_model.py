"""The rigid bodies: against differences of body poses, against a second URDF reader, and against Table 1."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from hands import (
    BOX_INERTIA,
    BOX_URDF,
    CONTACT_POINTS,
    GRAVITY,
    HAND_URDF,
    LENGTHS,
    REFERENCE_BASES,
    Array,
    Task,
    numerical_jacobian,
    random_state,
    world_from,
    write_box,
    write_hand,
)

from softhand.model.gravity import gravity_forces
from softhand.model.snapshot import Snapshot
from softhand.model.terms import RigidTerms
from softhand.model.world import World
from softhand.plant.state import State

TIP_NAMES = ["finger_1_tip", "finger_2_tip", "finger_3_tip"]


class Bodies:
    """Inertias and poses of all bodies, from joint poses alone."""

    def __init__(self, world: World) -> None:
        self.model = world.model
        self._data = world.model.createData()

    def poses(self, q: Array) -> list[tuple[Array, Array]]:
        """Rotation and position of each joint frame."""
        pin.forwardKinematics(self.model, self._data, q)
        return [(pose.rotation.copy(), pose.translation.copy()) for pose in self._data.oMi]

    def centres(self, q: Array) -> Array:
        """Centres of mass [m], shape (bodies, 3)."""
        poses = self.poses(q)[1:]
        return np.array([p + R @ body.lever for (R, p), body in zip(poses, self._bodies(), strict=True)])

    def _bodies(self) -> list[pin.Inertia]:
        return list(self.model.inertias)[1:]

    def potential(self, q: Array) -> float:
        """Energy of gravity [J]."""
        masses = np.array([body.mass for body in self._bodies()])
        return float(-masses @ self.centres(q) @ self.model.gravity.linear)

    def mass_matrix(self, q: Array) -> Array:
        """M from the kinetic energy, body velocities by differences of body poses, shape (nv, nv)."""
        nv = self.model.nv
        rotations = [R for R, _ in self.poses(q)[1:]]

        def move(dv: Array) -> Array:
            moved = pin.integrate(self.model, q, dv)
            turns = [pin.log3(R @ R0.T) for (R, _), R0 in zip(self.poses(moved)[1:], rotations, strict=True)]
            return np.concatenate([self.centres(moved), np.array(turns)], axis=1)

        jacobians = numerical_jacobian(move, nv, 1e-5)  # (bodies, 6, nv)
        M = np.zeros((nv, nv))
        for J, R, body in zip(jacobians, rotations, self._bodies(), strict=True):
            M += body.mass * J[:3].T @ J[:3] + J[3:].T @ R @ body.inertia @ R.T @ J[3:]
        return M


def symmetric(M: Array) -> Array:
    """The whole matrix from its upper triangle."""
    return np.triu(M) + np.triu(M, 1).T


def snapshot_at(world: World, state: State) -> Snapshot:
    """Rigid-body terms at a state."""
    snapshot = Snapshot(world)
    snapshot.update(state.q, state.v)
    return snapshot


# ------------------------------------------------------------------------------------------------------- rigid dynamics


def test_mass_matrix_is_that_of_the_kinetic_energy(task: Task, state: State) -> None:
    """M is the mass matrix of the bodies' kinetic energy."""
    snapshot = snapshot_at(task.world, state)
    expected = Bodies(task.world).mass_matrix(state.q)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(symmetric(snapshot.M) / scale, expected / scale, rtol=0.0, atol=1e-7)


def test_joint_terms_are_lagranges(task: Task, state: State) -> None:
    """C v + g of the joints is (dM/dt) v - d(v M v / 2)/dq + dV/dq."""
    world, n = task.world, task.world.n_joints
    bodies, v = Bodies(world), state.v[:n]

    def hand_mass(move: Array) -> Array:
        q = pin.integrate(world.model, state.q, np.concatenate([move, np.zeros(6)]))
        snapshot = Snapshot(world)
        snapshot.update(q, np.zeros(world.model.nv))
        return symmetric(snapshot.M[:n, :n])

    def potential(move: Array) -> float:
        return bodies.potential(pin.integrate(world.model, state.q, np.concatenate([move, np.zeros(6)])))

    slope = numerical_jacobian(hand_mass, n, 1e-5)  # (n, n, n), the last by the joints
    expected = np.einsum("kji,i,j->k", slope, v, v) - 0.5 * np.einsum("ijk,i,j->k", slope, v, v)
    expected += numerical_jacobian(potential, n, 1e-5)
    nle = snapshot_at(world, state).nle[:n]
    np.testing.assert_allclose(nle, expected, rtol=0.0, atol=1e-8 * (1.0 + np.max(np.abs(expected))))


@pytest.mark.parametrize("centre_of_mass", [(0.0, 0.0, 0.0), (0.004, -0.003, 0.007)], ids=["centred", "off-centre"])
def test_object_terms_are_the_rate_of_its_momentum(
    tmp_path: Path, centre_of_mass: tuple[float, ...], rng: np.random.Generator
) -> None:
    """C v + g of the object is the rate of its momentum at constant v, less its weight, in the object frame."""
    world = world_from(HAND_URDF, TIP_NAMES, write_box(tmp_path, mass=0.3, centre_of_mass=centre_of_mass))
    model, body = world.model, world.model.inertias[world.object_joint]
    q = pin.integrate(model, pin.neutral(model), rng.normal(0.0, 0.7, model.nv))
    v = rng.normal(0.0, 2.0, model.nv)
    R = pin.Quaternion(q[-4:]).matrix()

    def momentum(time: Array) -> Array:
        turned = R @ pin.exp3(time[0] * v[-3:])
        velocity = turned @ (v[-6:-3] + np.cross(v[-3:], body.lever))
        return np.concatenate([body.mass * velocity, turned @ body.inertia @ v[-3:]])

    rate = numerical_jacobian(momentum, 1)[:, 0]
    force = rate[:3] - body.mass * np.array(GRAVITY)
    moment = rate[3:] + np.cross(R @ body.lever, force)
    nle = snapshot_at(world, State(q, v, np.zeros((3, 3)))).nle[-6:]
    np.testing.assert_allclose(nle, np.concatenate([R.T @ force, R.T @ moment]), rtol=0.0, atol=3e-9)


def gravity_at(world: World, q: Array) -> Array:
    """N(q) from the poses and Jacobians of a snapshot."""
    snapshot, moments, out = Snapshot(world), np.zeros((world.model.njoints, 4)), np.zeros(world.model.nv)
    snapshot.sense(q)
    gravity_forces(world.bodies, world.gravity, snapshot.poses, snapshot.J, moments, out)
    return out


def test_gravity_is_the_slope_of_the_potential_energy(task: Task, state: State) -> None:
    """The gravity terms are dV/dq, joints and object."""
    world, bodies = task.world, Bodies(task.world)
    expected = numerical_jacobian(
        lambda move: bodies.potential(pin.integrate(world.model, state.q, move)), world.model.nv, 1e-5
    )
    np.testing.assert_allclose(gravity_at(world, state.q), expected, rtol=0.0, atol=1e-9)


def test_gravity_acts_in_the_given_direction() -> None:
    """The weight of the object follows the gravity vector that the world was given."""
    world = world_from(HAND_URDF, TIP_NAMES, BOX_URDF, gravity=(1.0, -2.0, 0.5))
    weight = gravity_at(world, pin.neutral(world.model))[-6:-3]
    np.testing.assert_allclose(weight, -0.2 * np.array([1.0, -2.0, 0.5]), rtol=1e-14)


def test_gravity_is_that_of_pinocchio(task: Task, state: State) -> None:
    """The gravity terms from poses and Jacobians are those that Pinocchio computes by itself."""
    model = task.world.model
    expected = pin.computeGeneralizedGravity(model, model.createData(), state.q)
    np.testing.assert_allclose(gravity_at(task.world, state.q), expected, rtol=0.0, atol=1e-14)


def test_sense_and_update_agree(task: Task, state: State) -> None:
    """`sense` gives the same J and poses as `update`; `RigidTerms` the same M, both triangles, and C v."""
    moving, sensing = snapshot_at(task.world, state), Snapshot(task.world)
    sensing.sense(state.q)
    for name in ("J", "poses"):
        np.testing.assert_allclose(getattr(sensing, name), getattr(moving, name), rtol=0.0, atol=1e-15)
    apart = RigidTerms(task.world.model)
    mass = apart.mass_matrix(state.q)
    np.testing.assert_allclose(np.triu(mass), np.triu(moving.M), rtol=0.0, atol=1e-15)
    np.testing.assert_array_equal(mass, mass.T)
    still = snapshot_at(task.world, State(state.q, np.zeros_like(state.v), state.z))
    np.testing.assert_allclose(apart.velocity_terms(state.q, state.v), moving.nle - still.nle, rtol=0.0, atol=1e-12)


def test_poses_are_the_joint_poses(task: Task, state: State) -> None:
    """The view on Pinocchio's poses holds rotations by columns, then translations."""
    poses = snapshot_at(task.world, state).poses
    for pose, (R, p) in zip(poses, Bodies(task.world).poses(state.q), strict=True):
        np.testing.assert_allclose(pose[:9].reshape(3, 3).T, R, rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(pose[9:], p, rtol=0.0, atol=1e-15)


def test_jacobian_columns_are_the_tips_velocities(task: Task, state: State) -> None:
    """J gives the velocity and angular velocity of each tip, from the columns listed for it and no others."""
    world, bodies = task.world, Bodies(task.world)
    J = snapshot_at(world, state).J
    for tip in world.tips:
        R0, p0 = bodies.poses(state.q)[tip.joint]
        point = p0 + R0 @ tip.position

        def pose(move: Array, tip: object = tip, R0: Array = R0) -> Array:
            R, p = bodies.poses(pin.integrate(world.model, state.q, move))[tip.joint]
            return np.concatenate([p + R @ tip.position, pin.log3(R @ R0.T)])

        expected = numerical_jacobian(pose, world.model.nv)
        columns = list(tip.columns)
        velocity = J[:3, columns] - np.cross(point, J[3:, columns], axis=0)
        np.testing.assert_allclose(velocity, expected[:3, columns], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(J[3:, columns], expected[3:, columns], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(np.delete(expected, columns, axis=1), 0.0, atol=1e-12)


def test_jacobian_columns_of_the_object(task: Task, state: State) -> None:
    """The last six columns of J give the velocity and angular velocity of the object."""
    world, bodies = task.world, Bodies(task.world)
    J = snapshot_at(world, state).J[:, -6:]
    R0, p0 = bodies.poses(state.q)[-1]

    def pose(move: Array) -> Array:
        R, p = bodies.poses(pin.integrate(world.model, state.q, move))[-1]
        return np.concatenate([p, pin.log3(R @ R0.T)])

    expected = numerical_jacobian(pose, world.model.nv)[:, -6:]
    np.testing.assert_allclose(J[:3] - np.cross(p0, J[3:], axis=0), expected[:3], rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(J[3:], expected[3:], rtol=0.0, atol=1e-9)


# ------------------------------------------------------------------------------------------------------------- envelope


def test_mass_matrix_is_zero_outside_the_envelope(task: Task, state: State) -> None:
    """No entry of M, nor of J^T J of the contacts, lies left of the envelope."""
    plant = task.plant()
    plant.update(state.q, state.v, state.z)
    J = plant.jacobian.reshape(-1, task.world.model.nv)
    for matrix in (symmetric(plant.snapshot.M), J.T @ J):
        for i, start in enumerate(task.world.envelope):
            np.testing.assert_array_equal(matrix[i, :start], 0.0)


ENVELOPES = {
    "reference": [0, 0, 0, 3, 3, 3, 6, 6, 6] + [0] * 6,
    "two fingers": [0, 0, 0, 3, 3, 3] + [0] * 6,
    "wrist": [0] * 16,
}


@pytest.mark.parametrize("name", list(ENVELOPES))
def test_envelope_is_as_narrow_as_the_tree(make_task: Callable[[str], Task], name: str) -> None:
    """Each finger has its own block unless a wrist couples them; the object's rows are full."""
    np.testing.assert_array_equal(make_task(name).world.envelope, ENVELOPES[name])


def test_wrist_couples_the_fingers(make_task: Callable[[str], Task], rng: np.random.Generator) -> None:
    """The wrist moves every tip, and its row of M couples it with every joint."""
    task = make_task("wrist")
    assert all(tip.columns[0] == 0 and len(tip.columns) == 4 for tip in task.world.tips)
    M = symmetric(snapshot_at(task.world, random_state(task, rng)).M)
    assert np.all(np.abs(M[0, 1:10]) > 1e-9)


# ----------------------------------------------------------------------------------------------------------------- URDF


@pytest.mark.parametrize("mass", [0.05, 0.2, 1.7])
def test_object_mass_scales_the_inertia(mass: float) -> None:
    """A given mass replaces that of the file and scales the inertia alike."""
    world = world_from(HAND_URDF, TIP_NAMES, BOX_URDF, mass=mass)
    body = world.model.inertias[world.object_joint]
    assert world.object_mass == body.mass == mass
    np.testing.assert_allclose(body.inertia, mass / 0.2 * np.diag(BOX_INERTIA), rtol=1e-12)


def test_hand_is_that_of_table_1(world: World) -> None:
    """Masses, centres of mass, inertias and lengths of the links are those of the paper's table."""
    model = world.model
    assert model.njoints - 2 == world.n_joints == 9
    for k in range(9):
        body, length = model.inertias[k + 1], LENGTHS[k % 3]
        assert body.mass == pytest.approx(0.070, rel=1e-12)
        np.testing.assert_allclose(body.lever, [length / 2, 0.0, 0.0], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(body.inertia, np.diag([2.04e-6, 31.5e-6, 31.4e-6]), rtol=0.0, atol=1e-18)
        if k % 3:
            np.testing.assert_allclose(model.jointPlacements[k + 1].translation, [LENGTHS[k % 3 - 1], 0.0, 0.0])
    for tip in world.tips:
        np.testing.assert_allclose(tip.position, [0.052, 0.0, 0.0], rtol=0.0, atol=1e-15)
        np.testing.assert_allclose(tip.rotation, np.eye(3), rtol=0.0, atol=1e-15)


def test_box_is_that_of_table_1(world: World) -> None:
    """Mass, inertia and faces of the box are those of the paper's table."""
    body = world.model.inertias[world.object_joint]
    assert body.mass == pytest.approx(0.200, rel=1e-12)
    np.testing.assert_allclose(body.inertia, np.diag(BOX_INERTIA), rtol=0.0, atol=1e-18)
    offsets = {tuple(np.round(face.normal).astype(int)): face.offset for face in world.faces}
    half = np.array([0.028, 0.018, 0.030])
    axes = [tuple(sign * axis) for axis in np.eye(3, dtype=int) for sign in (1, -1)]
    assert offsets == pytest.approx({axis: half[np.flatnonzero(axis)[0]] for axis in axes})


def test_faces_follow_the_collision_box(tmp_path: Path) -> None:
    """The faces are those of the collision box, wherever it lies in the object frame and however it is turned."""
    size, middle, rpy = np.array([0.05, 0.03, 0.07]), np.array([0.01, -0.02, 0.005]), (0.3, -0.5, 1.1)
    world = world_from(HAND_URDF, TIP_NAMES, write_box(tmp_path, size, middle=middle, rpy=rpy))
    R = pin.rpy.rpyToMatrix(*rpy)
    assert len(world.faces) == 6
    for axis in range(3):
        for side in (1.0, -1.0):
            centre = middle + side * 0.5 * size[axis] * R[:, axis]
            face = min(world.faces, key=lambda face, centre=centre: abs(face.distance(centre)) + face.overhang(centre))
            np.testing.assert_allclose(face.normal, side * R[:, axis], rtol=0.0, atol=1e-12)
            assert face.distance(centre) == pytest.approx(0.0, abs=1e-15)
            assert face.distance(centre + 2e-3 * face.normal) == pytest.approx(2e-3, rel=1e-9)
            assert face.overhang(centre) == pytest.approx(-0.5 * np.min(np.delete(size, axis)), rel=1e-9)
            assert face.tangent @ face.normal == pytest.approx(0.0, abs=1e-15)
            assert np.linalg.norm(face.tangent) == pytest.approx(1.0, abs=1e-15)


def test_fingers_point_up_and_bend_inward(world: World) -> None:
    """At zero the fingers point straight up from their bases; positive flexion bends them inward."""
    inward = {"finger_1_tip": (-1, 0, 0), "finger_2_tip": (1, 0, 0), "finger_3_tip": (0, 1, 0)}
    bases = np.array([[0.055, 0.040, 0.0], [-0.055, 0.040, 0.0], [0.0, -0.020, 0.0]])
    height = np.array([0.0, 0.0, sum(LENGTHS)])
    bodies, q = Bodies(world), pin.neutral(world.model)
    straight = bodies.poses(q)
    q[2:9:3] = 0.1
    bent = bodies.poses(q)
    for tip, base in zip(world.tips, bases, strict=True):
        R, p = straight[tip.joint]
        np.testing.assert_allclose(p + R @ tip.position, base + height, rtol=0.0, atol=1e-12)
        R, p = bent[tip.joint]
        moved = p + R @ tip.position - base
        assert moved @ inward[tip.name] == pytest.approx(0.052 * math.sin(0.1), rel=1e-9)


def test_limits_are_those_of_the_reference_hand(world: World) -> None:
    """Joint limits, effort and velocity limits of the reference hand."""
    lower, upper = world.position_limits
    np.testing.assert_allclose(lower, np.tile([-1.05, -1.75, -0.1], 3))
    np.testing.assert_allclose(upper, np.tile([1.05, 1.05, 2.6], 3))
    np.testing.assert_allclose(world.effort_limit, 2.0)
    np.testing.assert_allclose(world.model.upperVelocityLimit[:9], 20.0)


def test_continuous_joints_have_no_limits(make_task: Callable[[str], Task]) -> None:
    """Position limits are infinite for continuous joints and finite for the others."""
    lower, upper = make_task("continuous").world.position_limits
    assert np.all(np.isinf(lower[::3])) and np.all(np.isinf(upper[::3]))
    assert np.all(np.isfinite(np.delete(lower, [0, 3, 6]))) and np.all(np.isfinite(np.delete(upper, [0, 3, 6])))


@pytest.fixture(scope="module")
def second_reader() -> yourdfpy.URDF:
    """The hand as another URDF library reads it."""
    return yourdfpy.URDF.load(str(HAND_URDF), load_meshes=False, build_scene_graph=True)


def test_second_reader_finds_the_same_mass(second_reader: yourdfpy.URDF, world: World) -> None:
    """Both readers give the same total mass of the hand and of the box."""
    masses = [link.inertial.mass for link in second_reader.robot.links if link.inertial is not None]
    box = yourdfpy.URDF.load(str(BOX_URDF), load_meshes=False)
    assert sum(masses) == pytest.approx(sum(body.mass for body in list(world.model.inertias)[1:-1]), rel=1e-12)
    assert [link.inertial.mass for link in box.robot.links] == pytest.approx([world.object_mass])


def test_second_reader_finds_the_same_limits(second_reader: yourdfpy.URDF, world: World) -> None:
    """Both readers give the same position, effort and velocity limits, joint by joint."""
    limits = {joint.name: joint.limit for joint in second_reader.robot.joints}
    lower, upper = world.position_limits
    for k, name in enumerate(world.joint_names):
        limit, velocity = limits[name], world.model.upperVelocityLimit[k]
        found = (lower[k], upper[k], world.effort_limit[k], velocity)
        assert found == (limit.lower, limit.upper, limit.effort, limit.velocity)


def test_second_reader_finds_the_same_tips(task: Task, rng: np.random.Generator) -> None:
    """Both readers put the tip frames of every hand at the same poses at random joint angles."""
    world = task.world
    second = yourdfpy.URDF.load(str(world.hand_urdf), load_meshes=False, build_scene_graph=True)
    angles = rng.uniform(-0.5, 1.0, world.n_joints)
    second.update_cfg(dict(zip(world.joint_names, angles, strict=True)))
    q = pin.neutral(world.model)
    world.set_joint_position(angles, q)
    poses = Bodies(world).poses(q)
    for tip in world.tips:
        R, p = poses[tip.joint]
        expected = second.get_transform(tip.name)
        np.testing.assert_allclose(p + R @ tip.position, expected[:3, 3], rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(R @ tip.rotation, expected[:3, :3], rtol=0.0, atol=1e-12)


def test_written_hand_is_the_shipped_one(tmp_path: Path, world: World) -> None:
    """The hand that the tests write, with the reference layout, is the hand that ships."""
    hand = write_hand(tmp_path, REFERENCE_BASES)
    written = world_from(hand, TIP_NAMES, BOX_URDF)
    assert written.joint_names == world.joint_names
    q = pin.integrate(world.model, pin.neutral(world.model), np.linspace(-1.0, 1.0, world.model.nv))
    mine, theirs = Bodies(written), Bodies(world)
    np.testing.assert_allclose(mine.centres(q), theirs.centres(q), rtol=0.0, atol=1e-15)
    np.testing.assert_allclose(mine.mass_matrix(q), theirs.mass_matrix(q), rtol=0.0, atol=1e-12)


def test_continuous_angle_is_set_as_cosine_and_sine(make_task: Callable[[str], Task], world: World) -> None:
    """Joint angles give the same poses whether the joints are revolute or continuous."""
    other = make_task("continuous").world
    angles = np.linspace(-1.0, 1.0, 9)
    poses = []
    for each in (world, other):
        q = pin.neutral(each.model)
        each.set_joint_position(angles, q)
        poses.append(Bodies(each).centres(q))
    np.testing.assert_allclose(poses[0], poses[1], rtol=0.0, atol=1e-15)


def test_contact_points_lie_on_faces(world: World) -> None:
    """The starting contact points lie on faces of the box, within their edges."""
    for point in CONTACT_POINTS:
        face = min(world.faces, key=lambda face, point=point: abs(face.distance(point)))
        assert abs(face.distance(point)) < 1e-12
        assert face.overhang(point) < -0.01
