"""What a controller may ask for beyond the arrays: each against finite differences."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from copy import copy, deepcopy
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import Array, Task
from numpy.testing import assert_allclose

from softhand import Simulation, build, load_scenario
from softhand.contact.pairs import contact_pairs
from softhand.numerics.spatial import rotation_of, turning_of
from softhand.plant.state import State
from softhand.recording.variables import VARIABLES
from softhand.references.reference import Desired
from softhand.scenario.scenario import with_law
from softhand.sensing.fields import FIELDS, RECORDED, SPANS, room, shapes
from softhand.sensing.observation import ALIASES, Observation
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


# ----------------------------------------------------------------------------------------- what may be done with one


@pytest.fixture(scope="module")
def live() -> Simulation:
    """A run on its way, with supports, so that every field has numbers."""
    values = {"duration": 1.0, "tactile.count": 12, "fingertip.slip_elements": 2}
    simulation = build(with_law(load_scenario("grasp-and-lift", values), "bulk"))
    simulation.run()
    return simulation


def test_the_blocks_of_an_observation_have_all_fields_once(live: Simulation) -> None:
    """The views lie one behind the other in the block, without gap or overlap, and each has the shape that is told."""
    seen, end = live.observation, 0
    address = seen.block.ctypes.data
    for name, shape in shapes(seen.known.sizes).items():
        view = getattr(seen, name)
        assert view.shape == shape and view.ctypes.data == address + 8 * end, name
        end += view.size
    assert end == seen.block.size == room(seen.known.sizes)
    assert np.array_equal(seen.object_coordinates, [*seen.object_position, *seen.object_rpy])
    assert np.array_equal(seen.object_coordinates_desired, [*seen.object_position_desired, *seen.object_rpy_desired])


@pytest.mark.parametrize("name", [*FIELDS, *SPANS])
def test_what_is_seen_live_can_only_be_read(live: Simulation, name: str) -> None:
    """Neither the array nor the name takes another value; what is said tells the way, `copy`."""
    seen = live.observation
    before = seen.copy()
    with pytest.raises(ValueError, match="read-only"):
        getattr(seen, name)[...] = 1.0
    with pytest.raises(AttributeError, match=rf"only be read; set '{name}' of observation\.copy\(\)"):
        setattr(seen, name, 1.0)
    assert np.array_equal(seen.block, before.block)


def test_nothing_that_is_handed_over_can_be_changed(live: Simulation) -> None:
    """All arrays that are reached by names without an underscore, and what holds them."""
    seen, arrays = live.observation, []
    parts = [seen, seen.desired, seen.known, *seen.fingertips, *(tip.face for tip in seen.fingertips)]
    for part in parts:
        arrays += [value for name, value in vars(part).items() if isinstance(value, np.ndarray)]
    assert len(arrays) > len(FIELDS) and not any(array.flags.writeable for array in arrays)
    for name, value in (("time", 1.0), ("desired", seen.desired), ("block", seen.block)):
        with pytest.raises(AttributeError):
            setattr(seen, name, value)
    with pytest.raises(AttributeError):
        seen.desired.coordinates = np.zeros(6)  # type: ignore[misc]
    assert not hasattr(seen, "fields")


def test_constants_and_what_is_computed_cannot_be_set(live: Simulation) -> None:
    """Of a copy either; a name that is none is told with the nearest."""
    mine = live.observation.copy()
    for name in ("effort_limit", "gravity", "object_lever"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(mine, name)[...] = 1.0
    for name in ("object_mass", "grasp_matrix", "hand_mass_matrix", "J_CF"):
        with pytest.raises(AttributeError):
            setattr(mine, name, 1.0)
    with pytest.raises(
        AttributeError, match="no field 'object_positon' that can be set; did you mean 'object_position'"
    ):
        mine.object_positon = 1.0
    with pytest.raises(AttributeError, match="no 'joint_velocty'; did you mean 'joint_velocity'"):
        _ = mine.joint_velocty
    with pytest.raises(AttributeError, match="read"):
        live.observation.desired = mine.desired


@pytest.mark.parametrize("name", [*FIELDS, *SPANS])
def test_a_copy_can_be_written(live: Simulation, name: str) -> None:
    """By array and by name, and only there: neither what is live nor another copy changes."""
    seen = live.observation
    before, mine, other = seen.block.copy(), seen.copy(), seen.copy()
    getattr(mine, name)[...] = 0.25
    assert np.all(getattr(mine, name) == 0.25) and (mine.block == 0.25).sum() >= getattr(mine, name).size
    setattr(mine, name, 0.75)
    assert np.all(getattr(mine, name) == 0.75)
    untouched = [field for field in FIELDS if not np.shares_memory(getattr(mine, field), getattr(mine, name))]
    assert len(untouched) == len(FIELDS) - (2 if name in SPANS else 1)
    assert all(np.array_equal(getattr(mine, field), getattr(other, field)) for field in untouched)
    assert np.array_equal(seen.block, before) and np.array_equal(other.block, before)


def test_what_is_desired_can_be_set_as_a_whole(live: Simulation) -> None:
    """The record, its fields and the names are one; the time is a number of its own."""
    rng, mine = np.random.default_rng(2), live.observation.copy()
    coordinates, twists = rng.normal(size=(3, 6)), rng.normal(size=(2, 6))
    wanted = Desired(
        *coordinates, rng.normal(size=3), *twists, np.full(1, 0.01), np.full(1, 0.5), *rng.normal(size=(3, 3))
    )
    mine.desired, mine.time = wanted, 7
    for name, value in vars(wanted).items():
        assert np.array_equal(getattr(mine.desired, name), value), name
    assert np.array_equal(mine.object_position_desired, wanted.coordinates[:3])
    assert np.array_equal(mine.object_coordinates_acceleration_desired, wanted.coordinates_acceleration)
    assert (mine.opening_desired, mine.carried_desired, mine.time) == (0.01, 0.5, 7.0)
    mine.internal_force_desired[1] = -2.0
    assert mine.desired.internal_force[1] == -2.0
    assert live.observation.time == pytest.approx(1.0)


def test_letters_are_second_names(live: Simulation) -> None:
    """Each letter of the paper is the array of the word, also to write to a copy."""
    seen, mine = live.observation, live.observation.copy()
    for letter, name in ALIASES.items():
        assert np.array_equal(getattr(seen, letter), getattr(seen, name)), letter
        if name in FIELDS or name in SPANS:
            setattr(mine, letter, 3.0)
            assert np.all(getattr(mine, name) == 3.0)
    assert np.array_equal(seen.f_C.reshape(-1, 3), seen.contact_force[:, :3])
    assert np.array_equal(seen.tau_C, seen.contact_force[:, 3])


@pytest.mark.parametrize("make", [Observation.copy, copy, deepcopy, lambda seen: pickle.loads(pickle.dumps(seen))])
def test_copies_are_equal_and_apart(live: Simulation, make: Callable[[Observation], Observation]) -> None:
    """However it is copied: the same numbers, constants and computed matrices, in memory of its own."""
    seen = live.observation
    mine = make(seen)
    assert np.array_equal(mine.block, seen.block) and mine.time == seen.time
    assert not np.shares_memory(mine.block, seen.block)
    for name in ("hand_mass_matrix", "object_mass_matrix", "grasp_matrix", "effort_limit", "gravity", "object_lever"):
        assert np.array_equal(getattr(mine, name), getattr(seen, name)), name
    assert mine.tip_names == seen.tip_names and mine.object_mass == seen.object_mass
    mine.joint_position[0] = 5.0
    assert seen.joint_position[0] != 5.0


def test_a_copy_stays_and_what_is_live_goes_on() -> None:
    """The next control period overwrites the one and leaves the other."""
    simulation = build(load_scenario("target-a", {"duration": 0.01, "reference.kind": "step"}))
    seen = simulation.sample()
    kept = seen.copy()
    before = kept.block.copy()
    for _ in range(5):
        simulation.step()
        assert simulation.sample() is seen
    assert np.array_equal(kept.block, before) and kept.time == 0.0
    assert seen.time == 0.005 and not np.array_equal(seen.block, before)


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("target-a", {"fingertip.contact": "coulomb", "fingertip.friction": 0.42, "reference.kind": "step"}),
        ("target-a", {"fingertip.contact": "coulomb", "fingertip.slip_elements": 3}),
        ("grasp-and-lift", {"duration": 0.9}),
    ],
)
def test_recordings_have_the_same_names_and_numbers(name: str, values: dict[str, Any]) -> None:
    """A variable of a recording that is a field of an observation has its shape and, at each sample, its numbers."""
    seen: list[Observation] = []
    simulation = build(load_scenario(name, {"duration": 0.05, **values}))
    recording = simulation.run(watch=lambda observation: seen.append(observation.copy()))
    shared = [variable for variable in VARIABLES if variable in FIELDS]
    assert set(shared) == set(RECORDED)
    supports = bool(simulation.plant.supports)
    parts = bool(simulation.plant.n_elements)
    assert [variable in recording.variables for variable in shared] == [
        (supports or not variable.startswith("support"))
        and not {"taxel", "moment_component"} & {*VARIABLES[variable].dims}
        and (parts or ("element" not in VARIABLES[variable].dims and variable != "slipped_share"))
        for variable in shared
    ]
    for variable in shared:
        if variable in recording.variables:
            values_seen = np.array([getattr(observation, variable) for observation in seen])
            assert recording[variable].shape == values_seen.shape, variable
            told = recording[variable]
            if variable == "contact_coordinates":  # its angles go on beyond one turn in a recording
                told = told - 2.0 * np.pi * np.round((told - values_seen) / (2.0 * np.pi))
                np.testing.assert_allclose(told, values_seen, rtol=0.0, atol=1e-14)
            else:
                assert np.array_equal(told, values_seen), variable
    assert np.array_equal(recording.time, [observation.time for observation in seen])
