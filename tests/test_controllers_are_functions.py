"""A controller is a function of the observations that it is handed: `formulas` says which, whatever runs elsewhere."""

from __future__ import annotations

import importlib.util
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from formulas import FORMULAS, Seen, block, rotation, torque_of, turning
from hands import ARM_IN_THE_AIR, DATA, Array
from numpy.testing import assert_allclose

from softhand import Controller, Simulation, build, load_scenario
from softhand.plugins import SHIPPED, find_plugin
from softhand.sensing.fields import FIELDS
from softhand.sensing.observation import Observation

needs_robots = pytest.mark.skipif(
    importlib.util.find_spec("example_robot_data") is None,
    reason='needs the extra robots: pip install "softhand[robots]"',
)
OWN = {"angle-feedback": "pinch-angle-feedback", "opposing": "pinch-opposing", "two-phase": "pinch-two-phase",
       "set-points": "set-points", "arm-pick-and-place": "arm-pick-and-place"}  # fmt: skip
VALUES: dict[str, dict[str, Any]] = {"arm in the air": ARM_IN_THE_AIR}
SENT = {"position": (-0.1, -0.4, 1.5, 0.1, -0.5, 1.4, 0.0, -0.7, 1.6), "offset": 0.02, "duration": 0.02}
NEEDED = {"state-feedback": {"gain_file": str(DATA / "state_feedback.toml")}, "set-points": SENT}
UNEQUAL = {"K_O_position": (80.0, 100.0, 120.0), "K_N": (1.2, 1.5, 1.8), "K_v": 0.01}
EULER = {"orientation_error": "euler"}
CASES: list[Any] = [
    *((name, OWN.get(name, "target-a"), NEEDED.get(name, {})) for name in SHIPPED["controllers"]),
    *((name, "target-a", {"torsion_compensation": False}) for name in
      ("regulation", "finger-only", "point-contact", "object-impedance", "computed-torque")),
    *((name, "target-a", EULER) for name in ("regulation", "finger-only", "object-impedance", "computed-torque")),
    ("regulation", "target-a", UNEQUAL),
    ("regulation", "pinch", {}),
    ("pick-and-place", "grasp-and-lift", {}),  # with free tips
    ("arm-pick-and-place", "arm in the air", {}),
    pytest.param(("regulation", "allegro-box", {"K_posture": 0.05}), marks=needs_robots),  # with idle motions
]  # fmt: skip
each_case = pytest.mark.parametrize("case", CASES, indirect=True, ids=lambda case: " ".join([*case[:2], *case[2]]))


@dataclass(frozen=True)
class Case:
    """A controller, and what there was to see in a run of it."""

    name: str
    controller: Controller
    simulation: Simulation
    run: list[Observation]
    """Copies of the first samples of a run that begins in motion."""


@pytest.fixture(scope="module")
def case(request: pytest.FixtureRequest) -> Case:
    name, scenario, settings = request.param
    controller = find_plugin("controllers", name, "controller.name")(**settings)
    values = {"duration": 0.03, "control_period": 0.001, **VALUES.get(scenario, {})}
    scenario = name if scenario in VALUES else scenario
    simulation = build(load_scenario(scenario, values), controller)
    rng, n = np.random.default_rng(3), simulation.plant.world.n_joints
    simulation.state.v[:] = np.concatenate([rng.normal(0.0, 0.3, n), rng.normal(0.0, 0.02, 3), rng.normal(0.0, 0.3, 3)])
    run = []
    for _ in range(16):
        run.append(simulation.sample().copy())
        simulation.step()
    return Case(name, controller, simulation, run)


# ------------------------------------------------------------------------------------------------- what is handed over


def plain(run: Seen, rng: np.random.Generator) -> list[Observation]:
    """Samples of the run as they are."""
    return [run[0].copy(), run[6].copy(), run[12].copy()]


def noise(run: Seen, rng: np.random.Generator) -> list[Observation]:
    """Noise of one part in a hundred on everything that is measured, and on all that is computed from it."""
    handed = plain(run, rng)
    for seen in handed:
        for name in FIELDS:
            values = getattr(seen, name)
            if name == "configuration":
                step = rng.normal(0.0, 0.01, len(seen.joint_position) + 6)
                values[...] = pin.integrate(model_of(seen), values, step)
            elif name == "object_rotation":
                values[...] = pin.exp3(rng.normal(0.0, 0.01, 3)) @ values
            elif not name.endswith("_desired") and name != "clock" and values.size:
                values += 0.01 * np.max(np.abs(values)) * rng.normal(size=values.shape) * (values != 0.0)
    return handed


def delay(run: Seen, rng: np.random.Generator) -> list[Observation]:
    """What was seen some samples before."""
    return [run[0].copy(), run[3].copy(), run[7].copy()]


def pose(run: Seen, rng: np.random.Generator) -> list[Observation]:
    """Another pose of the object, as a camera that is set up askew sees it."""
    handed = plain(run, rng)
    for seen in handed:
        seen.object_position += rng.normal(0.0, 2e-3, 3)
        seen.object_rpy += rng.normal(0.0, 0.1, 3)
        seen.object_rotation = rotation(seen.object_rpy)
        seen.object_twist += rng.normal(0.0, 0.1, 6)
    return handed


def desired(run: Seen, rng: np.random.Generator) -> list[Observation]:
    """Another thing that is asked for."""
    handed = plain(run, rng)
    for seen in handed:
        seen.object_coordinates_desired += np.concatenate([rng.normal(0.0, 2e-3, 3), rng.normal(0.0, 0.1, 3)])
        seen.object_coordinates_rate_desired += rng.normal(0.0, 0.1, 6)
        seen.object_coordinates_acceleration_desired += rng.normal(0.0, 1.0, 6)
        seen.object_twist_desired += rng.normal(0.0, 0.1, 6)
        seen.object_twist_rate_desired += rng.normal(0.0, 1.0, 6)
        seen.internal_force_desired *= rng.uniform(0.7, 1.3, seen.internal_force_desired.shape)
        seen.opening_desired += 2e-3
        seen.carried_desired = 0.6
        seen.standoff_desired += rng.normal(0.0, 0.01, 3)
        seen.standoff_rate_desired += rng.normal(0.0, 0.1, 3)
        seen.standoff_acceleration_desired += rng.normal(0.0, 1.0, 3)
    return handed


CHANGES: list[Callable[[Seen, np.random.Generator], list[Observation]]] = [plain, noise, delay, pose, desired]


def model_of(seen: Observation) -> pin.Model:
    """The rigid bodies that an observation knows."""
    return seen.known.rigid.__reduce__()[1][0]


def close(found: Array, expected: Array) -> None:
    """To nine digits of the largest."""
    assert_allclose(found, expected, rtol=0.0, atol=1e-9 * float(np.max(np.abs(expected))))


# ---------------------------------------------------------------------------------------------------------- claims


def test_every_controller_has_a_formula() -> None:
    """One that is added is written down here too."""
    assert set(FORMULAS) == set(SHIPPED["controllers"])


@each_case
@pytest.mark.parametrize("change", CHANGES, ids=lambda change: change.__name__)
def test_the_torque_is_the_formula_of_what_is_handed(case: Case, change: Any) -> None:
    """Copied and changed, delayed, moved, with other desired values: numpy finds the same torque from these numbers."""
    for seed in range(2):
        handed = change(case.run, np.random.default_rng(seed))
        close(torque_of(case.controller, handed), FORMULAS[case.name](case.controller, handed))


@each_case
def test_changes_change_the_torque(case: Case) -> None:
    """Otherwise the claim above would be empty: noise, delay and other desired values are answered."""
    rng = np.random.default_rng(0)
    before = torque_of(case.controller, plain(case.run, rng))
    for change in (
        (noise, delay) if case.name == "set-points" else (noise, delay, desired)
    ):  # which has no desired values
        after = torque_of(case.controller, change(case.run, rng))
        assert np.max(np.abs(after - before)) > 1e-4 * np.max(np.abs(before)), change.__name__


@each_case
def test_nothing_but_what_is_handed_matters(case: Case) -> None:
    """Whatever the simulation does meanwhile, a controller answers an observation as it did before, to the last bit."""
    handed = noise(case.run, np.random.default_rng(5))
    before = torque_of(case.controller, handed)
    simulation = case.simulation
    simulation.reset()
    memory = case.controller.start(handed[0])
    for seen in handed:
        for _ in range(3):
            simulation.sample()
            simulation.step()
        tau, memory = case.controller.torque(seen, memory)
    assert np.array_equal(tau, before)
    again = pickle.loads(pickle.dumps(handed))  # as it comes from another process
    assert np.array_equal(torque_of(case.controller, again), before)


@each_case
def test_two_runs_at_a_time_do_not_mix(case: Case) -> None:
    """One controller asked in turn for two hands says to each what it says to it alone; no torque is overwritten."""
    hands = [noise(case.run, np.random.default_rng(seed)) for seed in (6, 7)]
    alone = [torque_of(case.controller, handed) for handed in hands]
    memories: list[Any] = [case.controller.start(handed[0]) for handed in hands]
    told: list[list[Array]] = [[], []]
    kept: list[list[Array]] = [[], []]
    for k in range(3):
        for i, handed in enumerate(hands):
            tau, memories[i] = case.controller.torque(handed[k], memories[i])
            told[i].append(tau)
            kept[i].append(tau.copy())
    for i in range(2):
        assert np.array_equal(told[i][-1], alone[i])
        assert all(map(np.array_equal, told[i], kept[i]))


@each_case
def test_a_copy_is_as_good_as_what_is_seen_live(case: Case) -> None:
    """The same numbers, and the same torque to the last bit."""
    simulation, controller = case.simulation, case.controller
    simulation.reset()
    memory: Any = None
    for k in range(6):
        live = simulation.sample()
        copy = live.copy()
        assert np.array_equal(copy.block, live.block) and copy.time == live.time
        memory = controller.start(copy) if k == 0 else memory
        first, _ = controller.torque(live, memory)
        second, memory = controller.torque(copy, memory)
        assert np.array_equal(first, second)
        assert np.array_equal(first, _given(simulation)) or np.any(simulation.torque_limited)
        simulation.step()


def _given(simulation: Simulation) -> Array:
    """Torques, or set points where servos take these."""
    drive = simulation._actuators.drive
    return simulation.torque if drive is None else drive.commanded


JOINTS = {"clock", "joint_position", "joint_velocity", "gravity_torque", "tip_position", "tip_rotation", "tip_jacobian",
          "tip_angular_jacobian"}  # fmt: skip
GRASP = {"hand_force_jacobian", "hand_torsion_jacobian", "internal_force_basis", "object_position", "contact_force"}
TWIST = {"object_gravity", "object_force_jacobian", "object_torsion_jacobian"}
MEASURED = {
    "regulation": GRASP | TWIST | {"object_rotation", "internal_force"},
    "least-squeeze": GRASP | TWIST | {"object_rotation", "internal_force", "deformation"},
    "finger-only": {"contact_force"},
    "object-impedance": GRASP | TWIST | {"object_rotation", "object_twist"},
    "computed-torque": GRASP | TWIST | {"object_rotation", "object_twist", "configuration"},
    "point-contact": {"object_position", "object_rotation", "object_twist", "contact_rotation", "contact_force"},
    "state-feedback": {"object_position", "object_rpy", "object_rotation", "object_twist", "internal_force"},
    "blind": set(),
    "opposing": set(),
    "angle-feedback": {"object_position", "object_rotation", "object_twist", "contact_rotation", "contact_point",
                       "hand_force_jacobian"},
    "two-phase": {"object_rotation"},
    "set-points": set(),
    "pick-and-place": GRASP | TWIST | {"object_rotation", "internal_force"},
    "arm-pick-and-place": GRASP | TWIST | {"object_rotation", "internal_force", "configuration"},
}  # fmt: skip
"""What each reads after its start, beside the time, the joints, what depends on these alone, and what is desired."""
MEASURED_AS_EULER = {
    "regulation": GRASP | {"object_rpy", "N_O", "J_O_f", "J_O_tau", "internal_force"},
    "finger-only": {"contact_force"},
    "object-impedance": GRASP | TWIST | {"object_rpy", "coordinate_map", "object_twist"},
    "computed-torque": GRASP | TWIST | {"object_rpy", "coordinate_map", "object_twist", "object_rotation",
                                        "configuration"},
}  # fmt: skip
"""The same with errors as the paper has them."""


@each_case
def test_what_a_controller_does_not_measure_may_be_missing(case: Case) -> None:
    """After the start all that the page of the controllers does not list may be NaN, and the torque is the same."""
    handed = plain(case.run, np.random.default_rng(0))
    expected = torque_of(case.controller, handed)
    is_euler = getattr(case.controller, "orientation_error", "") == "euler"
    needed = JOINTS | (MEASURED_AS_EULER if is_euler else MEASURED)[case.name]
    for seen in handed[1:]:
        for name in FIELDS:
            if name not in needed and not name.endswith("_desired"):
                getattr(seen, name)[...] = np.nan
    memory = case.controller.start(handed[0])
    for seen in handed:
        tau, memory = case.controller.torque(seen, memory)
    assert np.array_equal(tau, expected)


def test_masses_and_velocity_terms_are_those_of_the_copy() -> None:
    """M and C v of a copy belong to the configuration and the velocities in it, whatever the live plant does."""
    simulation = build(load_scenario("target-a", {"duration": 0.01}))
    seen, rng = simulation.sample().copy(), np.random.default_rng(1)
    model = simulation.plant.world.model
    data, n = model.createData(), simulation.plant.world.n_joints
    seen.configuration = pin.integrate(model, seen.configuration, rng.normal(0.0, 0.3, model.nv))
    R = pin.Quaternion(*np.roll(seen.configuration[-4:], 1)).matrix()
    seen.object_rotation, seen.object_twist = R, rng.normal(size=6)
    seen.object_rpy = pin.rpy.matrixToRpy(R)
    seen.coordinate_map = block(turning(seen.object_rpy))
    seen.joint_velocity = rng.normal(size=n)
    simulation.step()
    simulation.sample()
    M = pin.crba(model, data, seen.configuration)
    M = np.triu(M) + np.triu(M, 1).T
    into_body = np.kron(np.eye(2), R.T)
    v = np.concatenate([seen.joint_velocity, into_body @ seen.object_twist])
    velocity_terms = pin.nle(model, data, seen.configuration, v) - pin.nle(model, data, seen.configuration, 0.0 * v)
    assert_allclose(seen.hand_mass_matrix, M[:n, :n], rtol=0.0, atol=1e-14)
    assert_allclose(seen.object_mass_matrix, into_body.T @ M[n:, n:] @ into_body, rtol=0.0, atol=1e-14)
    assert_allclose(seen.hand_velocity_terms, velocity_terms[:n], rtol=0.0, atol=1e-13)
    to_body = into_body @ seen.coordinate_map
    assert_allclose(seen.M_O, to_body.T @ M[n:, n:] @ to_body, rtol=0.0, atol=1e-14)

    def terms(map_at: Callable[[float], Array], rate: Array) -> Array:
        """M X' rate + C v of the object in the coordinates of X, by a difference along the motion."""
        h = 1e-6
        slope = (map_at(h) - map_at(-h)) / (2.0 * h)
        return map_at(0.0).T @ (M[n:, n:] @ slope @ rate + velocity_terms[n:])

    twist, rate = seen.object_twist, np.linalg.solve(seen.coordinate_map, seen.object_twist)
    at_twist = terms(lambda t: np.kron(np.eye(2), R.T @ pin.exp3(-t * twist[3:])), twist)
    assert_allclose(seen.object_velocity_terms, at_twist, rtol=0.0, atol=1e-8)

    def to_body_at(time: float) -> Array:
        rpy = seen.object_rpy + time * rate[3:]
        return np.kron(np.eye(2), rotation(rpy).T) @ block(turning(rpy))

    assert_allclose(seen.velocity_terms_O, terms(to_body_at, rate), rtol=0.0, atol=1e-8)
