"""Damping of the tips: its formulas, never a pull, stable and of second order in the steppers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from energy import ring, task_with
from hands import (
    CONTACT_POINTS,
    FINGER_GUESS,
    START_FORCE,
    START_POSITION,
    STEPPERS,
    Array,
    Task,
    holding_torque,
    make_law,
    numerical_jacobian,
    start_acceleration,
)

from softhand.assembly.build import build, simulate
from softhand.dampings.damping import Damping
from softhand.dampings.fung import Fung
from softhand.dampings.hunt_crossley import HuntCrossley
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.errors import ScenarioError
from softhand.laws.conservative import Conservative
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.scenario.scenario import load_scenario, with_law
from softhand.settings.settings import read_settings
from softhand.start.grasp import solve_grasp
from softhand.steppers.stepper import Stepper

R = 0.010  # [m]
LAWS: dict[str, Law] = {"nakashima": make_law(), "conservative": Conservative(radius=R)}
DAMPINGS: dict[str, Damping] = {
    "kelvin-voigt": KelvinVoigt(radial=3.0, tangential=2.0, torsional=2e-4),
    "hunt-crossley": HuntCrossley(radial=0.6, tangential=0.4, torsional=4e-5),
    "fung": Fung(shares=(0.25, 0.15), rates=(300.0, 20.0)),
}


def damped(law: Law, damping: Damping) -> Task:
    """The reference grasp with tips of that law and that damping."""
    task = task_with(law)
    fingertips = tuple(replace(tip, damping=damping) for tip in task.fingertips)
    grasp = solve_grasp(
        task.world, fingertips, CONTACT_POINTS, START_FORCE, START_POSITION, np.eye(3), np.tile(FINGER_GUESS, 3)
    )
    return replace(task, fingertips=fingertips, grasp=grasp)


def pushed(task: Task, speed: float = 1.0) -> State:
    """The start with small velocities."""
    state, rng, n = task.grasp.state.copy(), np.random.default_rng(0), task.world.n_joints
    push = np.concatenate([rng.normal(0.0, 0.05, n), rng.normal(0.0, 0.002, 3), rng.normal(0.0, 0.05, 3)])
    state.v[:] = speed * push
    return state


@pytest.fixture(params=list(LAWS))
def law(request: pytest.FixtureRequest) -> Law:
    """A law in each kind of coordinates."""
    return LAWS[request.param]


@pytest.fixture(params=list(DAMPINGS))
def damping(request: pytest.FixtureRequest) -> Damping:
    """Each damping in turn."""
    return DAMPINGS[request.param]


# ------------------------------------------------------------------------------------------------------------- formulas


def forces(law: Law, damping: Damping, state: State) -> tuple[Array, Array, Array]:
    """Force with damping, force without, velocity; each in C_F, shape (nc, 4)."""
    task = damped(law, damping)
    plain = Plant(task.world, [replace(tip, damping=Damping()) for tip in task.fingertips])
    plant = task.plant()
    for one in (plant, plain):
        one.update(state.q, state.v, np.ascontiguousarray(state.z[:, : one.n_memory]))
    return plant.contacts["force"].copy(), plain.contacts["force"].copy(), plant.contacts["velocity"].copy()


def test_kelvin_voigt_adds_c_times_the_velocity(law: Law) -> None:
    """f = f_e + c v, with a coefficient for each channel; a tip that is pressed deeper pushes more."""
    damping = DAMPINGS["kelvin-voigt"]
    found, elastic, velocity = forces(law, damping, pushed(damped(law, damping)))
    np.testing.assert_allclose(found, elastic + np.array([2.0, 2.0, 3.0, 2e-4]) * velocity, rtol=1e-12, atol=1e-14)
    deeper = velocity[:, 2] > 0.0
    assert deeper.any() and np.all(found[deeper, 2] > elastic[deeper, 2])


def test_hunt_crossley_scales_with_the_normal_force(law: Law) -> None:
    """f_n = F (1 + lambda d'); the tangential channels get lambda F times their own velocity."""
    damping = DAMPINGS["hunt-crossley"]
    found, elastic, velocity = forces(law, damping, pushed(damped(law, damping)))
    np.testing.assert_allclose(found[:, 2], elastic[:, 2] * (1.0 + 0.6 * velocity[:, 2]), rtol=1e-12)
    expected = elastic + np.array([0.4, 0.4, 0.6, 4e-5]) * elastic[:, 2:3] * velocity
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-14)


def test_damping_is_the_derivative_by_the_velocity(law: Law, damping: Damping) -> None:
    """`damping` of a contact is d force / d velocity."""
    task = damped(law, damping)
    state, plant = pushed(task), task.plant()
    plant.update(state.q, state.v, state.z)
    expected, jacobian = plant.contacts["damping"].copy(), plant.jacobian

    def force(move: Array) -> Array:
        plant.update(state.q, state.v + move, state.z)
        return plant.contacts["force"].copy()

    found = numerical_jacobian(force, len(state.v), 1e-3)
    np.testing.assert_allclose(found, expected[:, :, None] * jacobian, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", list(DAMPINGS))
def test_no_tip_ever_pulls(name: str, rng: np.random.Generator) -> None:
    """However fast a tip leaves, its normal force is not negative, and without contact there is no damping."""
    task = damped(LAWS["conservative"], DAMPINGS[name])
    plant, reached_zero = task.plant(), False
    for _ in range(50):
        state = task.grasp.state.copy()
        state.v[:] = rng.normal(0.0, 40.0, state.v.shape)
        state.q[: task.world.n_joints] += rng.normal(0.0, 0.02, task.world.n_joints)
        if state.z.shape[1] > 3:
            state.z[:, 3:] *= 4.0
        plant.update(state.q, state.v, state.z)
        force, depth = plant.contacts["force"], plant.contacts["deformation"][:, 0]
        assert np.all(force[:, 2] >= 0.0)
        np.testing.assert_array_equal(force[depth <= 0.0], 0.0)
        np.testing.assert_array_equal(plant.contacts["damping"][depth <= 0.0], 0.0)
        reached_zero = reached_zero or bool(np.any(force[depth > 0.0, 2] == 0.0))
    assert reached_zero


def test_fung_relaxes_as_its_series_says() -> None:
    """Held after a jump, the force is F_e {c_0 + sum c_k exp(-nu_k t)}, in all four channels."""
    from softhand.contact.damping import relax

    task = damped(LAWS["conservative"], DAMPINGS["fung"])
    plant, state = task.plant(), task.grasp.state.copy()
    state.z[:, 3:] = 0.0
    state.z[:, 2] = 0.1
    for t in (0.0, 0.002, 0.05):
        held = state.copy()
        plant.update(held.q, held.v, held.z)
        elastic = plant.contacts["deformation_force"].copy()[:, [1, 2, 0, 3]]
        relax(plant.pads, plant.contacts, t, held.z)
        plant.update(held.q, held.v, held.z)
        share = 0.6 + 0.25 * math.exp(-300.0 * t) + 0.15 * math.exp(-20.0 * t)
        np.testing.assert_allclose(plant.contacts["force"], share * elastic, rtol=1e-10, atol=1e-12)


def test_fung_is_the_equation_of_the_catalogue() -> None:
    """F - sum c_k w_k is c_0 F_e + sum q_k with q_k' = -nu_k q_k + c_k F_e', for a force that comes and goes."""
    shares, rates = np.array([0.25, 0.15]), np.array([300.0, 20.0])
    h = 1e-6
    q, w = np.zeros(2), np.zeros(2)
    for k in range(20000):
        t = k * h
        now, middle, rate = (math.sin(60.0 * t), math.sin(60.0 * (t + h / 2)), 60.0 * math.cos(60.0 * (t + h / 2)))
        q_middle = q + 0.5 * h * (-rates * q + shares * 60.0 * math.cos(60.0 * t))
        w_middle = w + 0.5 * h * rates * (now - w)
        q = q + h * (-rates * q_middle + shares * rate)
        w = w + h * rates * (middle - w_middle)
    elastic = math.sin(60.0 * 20000 * h)
    assert elastic - shares @ w == pytest.approx(0.6 * elastic + q.sum(), rel=1e-7)


def test_start_is_at_rest_with_every_damping(law: Law, damping: Damping) -> None:
    """The start balances the forces, with what has relaxed by then, and nothing moves."""
    np.testing.assert_allclose(start_acceleration(damped(law, damping)), 0.0, atol=1e-5)


# ---------------------------------------------------------------------------------------------------------------- steps


def ride(task: Task, stepper: Stepper, duration: float = 0.02) -> State:
    """The state some time after a push, under the torques that hold the start."""
    plant, state = task.plant(), pushed(task)
    torque = holding_torque(plant, task.grasp.state)
    integration = stepper.start(plant)
    for _ in range(round(duration / stepper.step)):
        integration.advance(state, torque)
    return state


@pytest.mark.parametrize(
    ("stepper", "order", "steps"),
    [("midpoint", 2, (2.5e-4, 1.25e-4, 6.25e-5)), ("rk4", 4, (5e-4, 2.5e-4, 1.25e-4)),
     ("semi-implicit-euler", 1, (5e-5, 2.5e-5, 1.25e-5))],
)  # fmt: skip
def test_steppers_keep_their_order(law: Law, damping: Damping, stepper: str, order: int, steps: tuple[float]) -> None:
    """With damping each stepper converges to the adaptive one with its order, velocities and memory."""
    task = damped(law, damping)
    exact = ride(task, STEPPERS["adaptive"](step=1e-3, rtol=1e-12, atol=1e-14))
    found = [ride(task, STEPPERS[stepper](step=step)) for step in steps]
    for part, scale in (("v", 1.0), ("z", np.maximum(np.abs(exact.z), 1e-4))):
        gaps = [np.max(np.abs((getattr(state, part) - getattr(exact, part)) / scale)) for state in found]
        assert np.polyfit(np.log(steps), np.log(gaps), 1)[0] > order - 0.3, part


STIFF = {
    "viscosity": KelvinVoigt(radial=300.0, tangential=300.0, torsional=0.03),
    "relaxation": Fung(shares=(0.3,), rates=(2e4,)),
}


@pytest.mark.parametrize("name", list(STIFF))
def test_midpoint_is_stable_with_fast_damping(name: str) -> None:
    """A damping that acts much faster than a step of 1 ms is followed by midpoint; it is too much for rk4."""
    task = damped(LAWS["conservative"], STIFF[name])
    n = task.world.n_joints
    exact = ride(task, STEPPERS["adaptive"](step=1e-3, rtol=1e-7, atol=1e-9), 0.03)
    found = ride(task, STEPPERS["midpoint"](step=1e-3), 0.03)
    moved = np.max(np.abs(exact.q[:n] - task.grasp.state.q[:n]))
    assert np.max(np.abs(found.q[:n] - exact.q[:n])) < 0.05 * moved
    with np.errstate(all="ignore"):
        assert not np.max(np.abs(ride(task, STEPPERS["rk4"](step=1e-3), 0.03).v)) < 10.0 * np.max(np.abs(exact.v))


@pytest.mark.parametrize("name", ["kelvin-voigt", "hunt-crossley"])
def test_viscosity_only_takes_energy(name: str) -> None:
    """A grasp that rings between lossless springs loses energy from sample to sample, and never gains any."""
    found = ring(damped(LAWS["conservative"], DAMPINGS[name]), STEPPERS["rk4"](step=2.5e-4), 0.3)
    assert np.max(np.diff(found.total)) < 1e-6 * found.exchanged
    assert found.total[0] - found.total[-1] > 0.3 * found.exchanged


# ------------------------------------------------------------------------------------------------------------ scenarios


@pytest.mark.parametrize("name", list(DAMPINGS))
@pytest.mark.parametrize("law_name", ["nakashima", "hertz"])
def test_target_a_runs_with_every_damping(name: str, law_name: str) -> None:
    """Each damping with its defaults carries target A to its end, with a polar and with a surface law."""
    scenario = load_scenario("target-a", {"fingertip.damping": {"name": name}})
    recording = simulate(scenario if law_name == "nakashima" else with_law(scenario, law_name))
    assert recording.complete
    assert np.linalg.norm(recording.object_position[-1] - recording.object_position_desired[-1]) < 1e-4


def test_damping_is_in_the_resolved_scenario() -> None:
    """The scenario of a recording has the damping with its defaults, and repeats it."""
    simulation = build(load_scenario("target-a", {"fingertip.damping.name": "hunt-crossley"}))
    assert "[fingertip.damping]" in simulation.scenario and "torsional = 2e-05" in simulation.scenario


def test_a_law_may_bring_its_own_damping() -> None:
    """`point` is damped by default, and a scenario may say otherwise."""
    scenario = with_law(load_scenario("target-a"), "point")
    np.testing.assert_array_equal(build(scenario).plant.pads["viscosity"][0], [10.0, 10.0, 1e-3])
    chosen = scenario.with_values({"fingertip.damping": {"name": "kelvin-voigt", "radial": 7.0}})
    assert build(chosen).plant.pads["viscosity"][0][0] == 7.0


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"name": "kelvin-voight"}, 'fingertip.damping.name: no damping is called "kelvin-voight".*"kelvin-voigt"'),
        ({"name": "kelvin-voigt", "radial": -1.0}, r"fingertip\.damping\.radial: got -1\.0.*>= 0"),
        ({"name": "fung", "shares": [0.7, 0.4]}, r"fingertip\.damping\.shares: got \[0\.7, 0\.4\].*sum < 1"),
        ({"name": "fung", "rates": [1.0, 0.0]}, r"fingertip\.damping\.rates: got \[1\.0, 0\.0\].*> 0"),
        ({"name": "fung", "shares": [0.1]}, "one length"),
        ({"radial": 1.0}, r"fingertip\.damping\.name: missing; it must be text"),
    ],
)
def test_wrong_settings_are_named(table: dict[str, object], words: str) -> None:
    """A wrong damping is an error with its key."""
    with pytest.raises(ScenarioError, match=words):
        build(load_scenario("target-a", {"fingertip.damping": table}))


def test_a_damping_of_its_own_channels() -> None:
    """Radial, tangential and torsional coefficients reach their own channels."""
    read = read_settings(KelvinVoigt, {"radial": 1.0, "tangential": 0.0, "torsional": 0.0}, "")
    task = damped(LAWS["nakashima"], read)
    plant, state = task.plant(), pushed(task)
    plant.update(state.q, state.v, state.z)
    np.testing.assert_array_equal(plant.contacts["damping"], [[0.0, 0.0, 1.0, 0.0]] * 3)
    assert isinstance(task.fingertips[0].law, Nakashima)
