"""What a controller may ask for beyond the arrays: each against finite differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from hands import Array, Task
from numpy.testing import assert_allclose

from softhand import build, load_scenario
from softhand.contact.pairs import contact_pairs
from softhand.numerics.spatial import rotation_of, turning_of
from softhand.plant.state import State
from softhand.references.reference import Desired
from softhand.sensing.observation import Observation
from softhand.sensing.sensor import Sensor

STEP = 1e-6


class Watch:
    """Observations of one task at many states."""

    def __init__(self, task: Task) -> None:
        self.model = task.world.model
        pairs = len(contact_pairs(task.world.n_tips))
        self._sensor = Sensor(task.plant(), Desired(*np.zeros((3, 6)), np.zeros(pairs)))

    def at(self, state: State) -> Observation:
        """The observation there."""
        return self._sensor.observe(state, 0.0)

    def later(self, state: State, time: float) -> Observation:
        """The observation after moving on with the velocity of the state, which stays as it is in body axes."""
        return self.at(State(pin.integrate(self.model, state.q, time * state.v), state.v, state.z))


def rate(watch: Watch, state: State, name: str) -> Array:
    """Central difference of an array of the observation along the velocity of the state."""
    after = np.array(getattr(watch.later(state, STEP), name))
    return (after - np.array(getattr(watch.later(state, -STEP), name))) / (2.0 * STEP)


def test_tip_jacobian_gives_the_velocity_of_the_tips(task: Task, state: State) -> None:
    """J_i q_F' is the rate of the tip centres, for every hand."""
    watch = Watch(task)
    seen = watch.at(state)
    velocity = seen.tip_jacobian @ seen.joint_velocity
    assert_allclose(velocity, rate(watch, state, "tip_position"), rtol=0.0, atol=1e-7)


def test_tip_angular_jacobian_turns_the_tips(task: Task, state: State) -> None:
    """R' = w x R with w from the Jacobian, column by column."""
    watch = Watch(task)
    seen = watch.at(state)
    w = seen.tip_angular_jacobian @ seen.joint_velocity
    turned = np.cross(w[:, :, None], seen.tip_rotation, axis=1)
    assert_allclose(turned, rate(watch, state, "tip_rotation"), rtol=0.0, atol=1e-6)


def test_tip_jacobians_make_up_that_of_the_contacts(task: Task, state: State) -> None:
    """J_CF is J_i moved to the contact point and turned into C_F."""
    seen = Watch(task).at(state)
    arm = seen.contact_point - seen.tip_position
    at_contact = seen.tip_jacobian + np.cross(seen.tip_angular_jacobian, arm[:, :, None], axis=1)
    rows = np.einsum("iba,ibk->iak", seen.contact_rotation, at_contact)
    assert_allclose(rows.reshape(seen.J_CF_f.shape), seen.J_CF_f, rtol=0.0, atol=1e-12)
    assert_allclose(np.einsum("ib,ibk->ik", seen.contact_rotation[:, :, 2], seen.tip_angular_jacobian), seen.J_CF_tau,
                    rtol=0.0, atol=1e-12)  # fmt: skip


def test_tips_depend_on_the_joints_alone(reference: Task) -> None:
    """Another pose of the object leaves tips, their Jacobians and N_F as they are."""
    watch, start = Watch(reference), reference.grasp.state
    names = ("tip_position", "tip_rotation", "tip_jacobian", "tip_angular_jacobian", "N_F")
    before = [np.array(getattr(watch.at(start), name)) for name in names]
    moved = start.copy()
    moved.q[-7:-4] += 0.001
    for name, value in zip(names, before, strict=True):
        assert np.array_equal(np.array(getattr(watch.at(moved), name)), value), name


def test_rate_of_the_coordinates(task: Task, state: State) -> None:
    """q_O' is the rate of q_O."""
    watch = Watch(task)
    assert_allclose(watch.at(state).q_O_rate, rate(watch, state, "q_O"), rtol=0.0, atol=1e-6)


def test_turning_of_is_the_rotation_part_of_T_O(task: Task, state: State) -> None:
    """The same matrix, from the angles alone."""
    seen = Watch(task).at(state)
    assert_allclose(turning_of(seen.object_rpy), seen.T_O[3:, 3:], rtol=0.0, atol=1e-14)


def test_velocity_terms_of_the_object_are_those_of_lagrange(task: Task, state: State) -> None:
    """C q' = M' q' - d(q'^T M q' / 2)/dq, in the coordinates q_O."""
    watch = Watch(task)
    seen = watch.at(state)
    q, qd, terms = seen.q_O.copy(), seen.q_O_rate, seen.velocity_terms_O

    def mass(coordinates: Array) -> Array:
        moved = state.copy()
        moved.q[-7:-4] = coordinates[:3]
        moved.q[-4:] = pin.Quaternion(rotation_of(coordinates[3:])).coeffs()
        return watch.at(moved).M_O

    slopes = [(mass(q + h) - mass(q - h)) / (2.0 * STEP) for h in STEP * np.eye(6)]
    lagrange = sum(rate * slope for rate, slope in zip(qd, slopes, strict=True)) @ qd
    lagrange -= 0.5 * np.array([qd @ slope @ qd for slope in slopes])
    assert_allclose(terms, lagrange, rtol=0.0, atol=1e-8)


def test_velocity_terms_of_the_hand_are_those_of_lagrange(task: Task, state: State) -> None:
    """The same of the hand, in the joint angles."""
    watch = Watch(task)
    seen = watch.at(state)
    qd, terms = seen.joint_velocity.copy(), seen.velocity_terms_F

    def slope(k: int) -> Array:
        direction = np.zeros_like(state.v)
        direction[k] = STEP
        sides = [State(pin.integrate(watch.model, state.q, s * direction), state.v, state.z) for s in (1.0, -1.0)]
        return (watch.at(sides[0]).M_F - watch.at(sides[1]).M_F) / (2.0 * STEP)

    slopes = [slope(k) for k in range(len(qd))]
    lagrange = sum(rate * slope for rate, slope in zip(qd, slopes, strict=True)) @ qd
    lagrange -= 0.5 * np.array([qd @ slope @ qd for slope in slopes])
    assert_allclose(terms, lagrange, rtol=0.0, atol=1e-7)


def test_constants_are_those_of_the_model(task: Task) -> None:
    """Mass, lever and gravity make up N_O; the faces are those that are touched."""
    seen = Watch(task).at(task.grasp.state)
    weight = -seen.object_mass * seen.gravity
    lever = seen.object_rotation @ seen.object_lever
    assert_allclose(seen.N_O[:3], weight, rtol=0.0, atol=1e-12)
    assert_allclose(seen.N_O[3:], seen.T_O[3:, 3:].T @ np.cross(lever, weight), rtol=0.0, atol=1e-12)
    normals = np.array([tip.face.normal for tip in seen.fingertips]) @ seen.object_rotation.T
    assert_allclose(normals, -seen.contact_rotation[:, :, 2], rtol=0.0, atol=1e-12)


def test_tips_that_are_nearest_to_one_vertex_have_no_internal_force() -> None:
    """Between contacts at one point there is no direction; nothing is NaN, so that the run goes on."""
    simulation = build(load_scenario("target-a", {"fingertip.contact": "coulomb", "duration": 0.1}))
    simulation.state.q[-7:-4] = 5.0, 5.0, 5.0
    seen = simulation.sample()
    assert_allclose(seen.contact_point, np.broadcast_to(seen.contact_point[0], (3, 3)), atol=1e-12)
    assert not np.any(seen.internal_force)
    assert np.all(np.isfinite(simulation.torque))
