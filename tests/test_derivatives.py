"""One control period as a linear model: against differences of the simulation, and where the answer is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hands import HAND_URDF
from scipy.linalg import expm

import softhand
from softhand import Linearization, RecordingError, ScenarioError, Simulation, State, linearize, load_scenario
from softhand.derivatives.differences import slopes
from softhand.derivatives.model import beyond, remembered_in
from softhand.scenario.scenario import Scenario

SLIPPERY = {"fingertip.contact": "coulomb", "fingertip.friction": 0.36}
BULK = {"law": "bulk", "radius": 0.010, "friction": 0.9, "contact": "coulomb"}
SCENARIOS = {
    "target-a": load_scenario("target-a"),
    "can": load_scenario("can"),
    "relaxing": load_scenario("target-a", {"fingertip.damping": {"name": "fung"}}),
    "grasp-and-lift": load_scenario("grasp-and-lift"),
    "slips": load_scenario("target-a", SLIPPERY),
    "leaning": load_scenario("can", {"fingertip": {**BULK, "damping": {"name": "fung"}}}),
}
"""Stick, round sides, memories, open fingers over a table, slip, and moments."""

NAMES = [pytest.param(name, marks=pytest.mark.slow if name in ("relaxing", "leaning") else ()) for name in SCENARIOS]


@cache
def simulation_of(name: str) -> Simulation:
    return softhand.build(SCENARIOS[name])


def random_state(name: str, seed: int) -> tuple[State, np.ndarray]:
    """A sample of the run, moved at random within what the contacts bear, and the torques there."""
    simulation, rng = simulation_of(name), np.random.default_rng(seed)
    simulation.reset()
    for _ in range(int(rng.integers(1, 40))):
        simulation.sample()
        simulation.step()
    simulation.sample()
    torque, saved = simulation.torque + 0.01 * rng.standard_normal(simulation.torque.shape), simulation.save()
    model, nv = simulation.plant.world.model, len(saved.v)
    q = pin.integrate(model, saved.q, 1e-4 * rng.standard_normal(nv))
    z = saved.z.copy()
    z[:, :3] += 1e-4 * rng.standard_normal(z[:, :3].shape) * (np.abs(z[:, :3]) > 0.0)
    state = State(q, saved.v + 0.02 * rng.standard_normal(nv), z, saved.time)
    if name == "slips":  # to where tips slide fast, on their limits
        state.v[-6:-3] += 0.3 * rng.standard_normal(3)
        simulation.reset(state)
        simulation.step(torque)
        state = State(*simulation.state.copy().arrays, time=saved.time)
    return state, torque


class Period:
    """The end of a period of a `Simulation`, as a function of x and u."""

    def __init__(self, simulation: Simulation, state: State, torque: np.ndarray) -> None:
        self.simulation, self.state, self.torque = simulation, state, torque
        self.plant = simulation.plant
        self.cells = remembered_in(self.plant)
        self.base = self.end(self.moved(0, 0.0), torque)

    def moved(self, k: int | np.ndarray, h: float) -> State:
        """Beside the state along entry k of x, or along any way."""
        nv, state = len(self.state.v), self.state
        x = np.zeros(2 * nv + len(self.cells))
        if isinstance(k, np.ndarray):
            x[:] = h * k
        else:
            x[k] = h
        z = state.z.copy()
        z[tuple(self.cells.T)] += x[2 * nv :]
        return State(pin.integrate(self.plant.world.model, state.q, x[:nv]), state.v + x[nv : 2 * nv], z, state.time)

    def end(self, state: State, torque: np.ndarray) -> np.ndarray:
        self.simulation.reset(state)
        self.simulation.step(torque)
        end = self.simulation.state
        return np.concatenate([end.q, end.v, end.z[tuple(self.cells.T)]])

    def at(self, k: int | np.ndarray, h: float) -> np.ndarray:
        """x' beside that of the state, with entry k of (x, u) moved, or x any way."""
        s, torque = 2 * len(self.state.v) + len(self.cells), self.torque.copy()
        if isinstance(k, np.ndarray) or k < s:
            state = self.moved(k, h)
        else:
            state = self.state
            torque[k - s] += h
        end, nq = self.end(state, torque), len(self.state.q)
        x = pin.difference(self.plant.world.model, self.base[:nq], end[:nq])
        return np.concatenate([x, end[nq:] - self.base[nq:]])

    def sides(self, k: int | np.ndarray, h: float) -> tuple[bool, ...]:
        """Which contacts touch and slip, where the period begins and where it ends."""
        plant, s = self.plant, 2 * len(self.state.v) + len(self.cells)
        state = self.moved(k, h) if isinstance(k, np.ndarray) or k < s else self.state
        found: list[np.ndarray] = []
        supports, can_slip = plant.pads["is_support"] > 0, plant.pads["can_slip"] > 0
        plant.update(state.q, state.v, state.z)
        for ends in (False, True):
            if ends:
                self.at(k, h)
            contacts = plant.contacts
            touches = np.where(supports, contacts["is_idle"] == 0, contacts["deformation"][:, 0] > 0.0)
            slips = contacts["is_slipping"] > 0 if ends else np.any(contacts["slip"] != 0.0, axis=1)
            found += [touches, touches & can_slip & slips, np.where(touches, contacts["feature"], 0)]
        return tuple(np.concatenate(found).tolist())

    def slope(self, k: int, h: float) -> tuple[np.ndarray, np.ndarray]:
        """The derivative along one entry on the side of all switches that the state is on, NaN if that is no way.

        And how sure that is: what its outermost points do.
        """
        here, function = self.sides(0, 0.0), lambda step: self.at(k, step)
        best, least = (np.full(len(self.at(0, 0.0)), np.nan),) * 2, np.inf
        for shorter in (1.0, 0.3, 0.1, 0.03, 0.01, 0.003):
            ahead, behind = (
                all(self.sides(k, sign * shorter * h * share) == here for share in (1.0, 0.5, 0.25)) for sign in (1, -1)
            )
            if ahead and behind:
                found, left = extrapolated(function, shorter * h)
            elif ahead or behind:
                found, left = forward(function, shorter * h if ahead else -shorter * h)
            else:
                continue
            if np.max(left) < least:
                best, least = (found, left), np.max(left)
        return best


def extrapolated(f: Callable[[float], np.ndarray], h: float) -> tuple[np.ndarray, np.ndarray]:
    """Central differences of three steps, extrapolated twice, of sixth order; and what the last time changed."""
    table = [(f(step) - f(-step)) / (2.0 * step) for step in (h, h / 2, h / 4)]
    table = [(4.0 * b - a) / 3.0 for a, b in pairwise(table)]
    slope = (16.0 * table[1] - table[0]) / 15.0
    return slope, np.abs(slope - table[1])


def forward(f: Callable[[float], np.ndarray], h: float) -> tuple[np.ndarray, np.ndarray]:
    """One-sided: the slope at 0 of the polynomial through f(0) = 0 and eight points, and what the last of them does."""
    found = []
    for n in (8, 7):
        nodes = h * np.arange(1, n + 1) / 8.0
        powers = (nodes[:, None] / h) ** np.arange(1, n + 1)
        found.append(np.linalg.solve(powers, np.array([f(node) for node in nodes]))[0] / h)
    return found[0], np.abs(found[0] - found[1])


def compare(name: str, state: State, torque: np.ndarray) -> Linearization:
    """A and B against differences of the simulation, each row to 1e-8 of its largest entry."""
    model = linearize(SCENARIOS[name], state=state, torque=torque)
    period = Period(simulation_of(name), state, torque)
    both = np.hstack([model.A, model.B])
    found = [period.slope(k, h) for k, h in enumerate(steps_of(model))]
    expected, unsure = np.column_stack([slope for slope, _ in found]), np.column_stack([left for _, left in found])
    told = np.isfinite(expected).all(axis=0)
    assert told.sum() >= len(told) - 3  # others go along a switch of one contact to beyond that of another
    row = np.abs(expected[:, told]).max(axis=1, initial=1e-12)[:, None]
    off = np.abs(both - expected)[:, told]
    bound = 1e-8 * row + 10.0 * unsure[:, told]  # a um from a second switch rounding leaves no more
    assert np.quantile(bound / row, 0.9) < 1.1e-8
    k, j = np.unravel_index(np.argmax(off / bound), off.shape)
    names = np.array([*model.states, *model.inputs])
    assert np.isfinite(both).all()
    assert off[k, j] < bound[k, j], (names[k], names[told][j], off[k, j] / row[k], bound[k, j] / row[k])
    return model


def steps_of(model: Linearization) -> np.ndarray:
    """Steps of the reference, others than those of the model."""
    by_unit = {"rad": 6e-5, "m": 6e-6, "rad/s": 6e-2, "m/s": 6e-3, "N": 3e-3, "N m": 3e-5}
    steps = [6e-4 if unit == "rad" and ", d" in name else by_unit[unit]
             for name, unit in zip(model.states, model.state_units, strict=True)]  # fmt: skip
    return np.array([*steps, *[3e-3] * len(model.inputs)])


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", NAMES)
def test_it_is_the_derivative_of_the_simulation(name: str, seed: int) -> None:
    """At random states, in stick and in slip."""
    compare(name, *random_state(name, seed))


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2, 7))
@pytest.mark.parametrize("name", NAMES)
def test_it_is_the_derivative_at_many_states(name: str, seed: int) -> None:
    """The same."""
    compare(name, *random_state(name, seed))


@pytest.mark.parametrize("seed", range(2))
def test_slip_is_at_its_switch(seed: int) -> None:
    """A tip that slips lies on its limit: the switch is named, and only that."""
    state, torque = random_state("slips", seed)
    contacts = simulation_of("slips").plant.tip_contacts
    slipping = {
        tip.name
        for tip, slips in zip(simulation_of("slips").plant.world.tips, contacts["is_slipping"], strict=True)
        if slips
    }
    assert slipping
    model = linearize(SCENARIOS["slips"], state=state, torque=torque)
    assert slipping <= {switch.where for switch in model.switches if switch.what == "slip"}
    assert {switch.what for switch in model.switches} == {"slip"}


@pytest.mark.parametrize("seed", range(3))
def test_in_slip_it_holds_for_any_move_to_within_the_limit(seed: int) -> None:
    """All entries of x at once, with shear let go: A x is the one-sided derivative, whichever tips slip."""
    state, torque = random_state("slips", seed)
    model, rng = linearize(SCENARIOS["slips"], state=state, torque=torque), np.random.default_rng(seed)
    period = Period(simulation_of("slips"), state, torque)
    here, s = period.sides(0, 0.0), len(model.states)
    for _ in range(3):
        x = 0.1 * steps_of(model)[:s] * rng.standard_normal(s)
        x[-9:] -= 0.01 * state.z[tuple(period.cells.T)]
        assert all(period.sides(x, share) == here for share in (1.0, 0.5, 0.25))
        expected, _ = forward(partial(period.at, x), 1.0)
        np.testing.assert_array_less(np.abs(model.A @ x - expected), 1e-7 * (np.abs(model.A) @ np.abs(x)))


def test_rolling_contacts_have_no_switch() -> None:
    """And the sizes are those of the reference hand."""
    model = linearize("target-a")
    assert model.switches == ()
    assert (model.A.shape, model.B.shape) == ((39, 39), (39, 9))
    assert len(set(model.states)) == 39


@cache
def falling() -> Linearization:
    """The box of grasp-and-lift 12 mm off its table, between open fingers; gravity along +z."""
    scenario = load_scenario("grasp-and-lift", {"object.mass": 0.3})
    state = softhand.build(scenario).save()
    q = state.q.copy()
    q[-5] -= 0.012
    return linearize(
        scenario,
        state=State(q, state.v, state.z),
        parameters=["gravity", "mass", "wrench"],
        outputs=["object_position", "joint_torque"],
    )


def test_a_falling_object() -> None:
    """v' = v + g T, whatever the mass; a force does F T / m; the place is T off the velocity."""
    model = falling()
    T, row = model.period, model.states.index
    up = row("object z, rate")
    by = dict(zip(model.parameters, model.E[up], strict=True))
    np.testing.assert_allclose(by["gravity[2]"], T, rtol=1e-9)
    np.testing.assert_allclose(by["object.mass"], 0.0, atol=1e-12)
    np.testing.assert_allclose(by["wrench force z"], T / 0.3, rtol=1e-9)
    np.testing.assert_allclose(by["wrench force x"], 0.0, atol=1e-12)
    np.testing.assert_allclose(model.E[row("object z"), model.parameters.index("gravity[2]")], T * T / 2, rtol=1e-6)
    np.testing.assert_allclose(model.A[row("object z"), up], T, rtol=1e-9)
    np.testing.assert_allclose(model.A[up, up], 1.0, rtol=1e-9)
    z = model.C[model.outputs.index("object_position z")]
    np.testing.assert_allclose(z, np.eye(len(z))[row("object z")], atol=1e-9)
    np.testing.assert_allclose(model.D[-9:], np.eye(9))


def test_an_unforced_turn_keeps_its_momentum() -> None:
    """A free box that turns: the derivative keeps R I w, which a wrong sign of the gyroscopic terms would not."""
    scenario = load_scenario("grasp-and-lift", {"table": None, "gravity": [0.0, 0.0, 0.0]})
    simulation = softhand.build(scenario)
    start = simulation.save()
    v = start.v.copy()
    v[-3:] = [3.0, -5.0, 4.0]
    model = linearize(scenario, state=State(start.q, v, start.z), torque=np.zeros(9))
    rates = slice(len(v) + 12, len(v) + 15)
    A = model.A[rates, rates]
    body = simulation.plant.world.model.inertias[simulation.plant.world.object_joint]
    J, w, T = body.inertia, v[-3:], model.period
    cross = lambda a: np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])  # noqa: E731
    # w' = w + T J^-1 (J w x w), to first order in T
    gyroscopic = np.linalg.solve(J, cross(J @ w) - cross(w) @ J)
    np.testing.assert_allclose(A, np.eye(3) + T * gyroscopic, atol=5e-5)
    assert np.abs(T * gyroscopic).max() > 1e-3


def test_a_turned_world_has_the_same_model() -> None:
    """Hand and object turned about gravity by a right angle: joints, tips and the axes of the object see no change."""
    scenario = SCENARIOS["target-a"]
    turn = pin.rpy.rpyToMatrix(0.0, 0.0, np.pi / 2)
    turned = scenario.replace(
        {"hand.rpy": [0.0, 0.0, np.pi / 2], "object.rpy": [0.0, 0.0, np.pi / 2],
         "object.position": (turn @ scenario.object.position).tolist()}
    )  # fmt: skip
    torque = np.linspace(-0.01, 0.01, 9)
    first, second = (linearize(one, torque=torque) for one in (scenario, turned))
    for a, b in ((first.A, second.A), (first.B, second.B)):
        np.testing.assert_allclose(a, b, atol=1e-6 * np.abs(a).max())


def linear_parameter(scenario: Scenario, key: str, model: Linearization, state: State, torque: np.ndarray) -> None:
    """A column of E against runs of scenarios beside."""
    whole: Any = scenario.model_dump()
    for part in key.split("."):
        whole = whole[part]
    h = 1e-3 * whole
    ends = [Period(softhand.build(scenario.replace({key: whole + step})), state, torque).base
            for step in (h, -h, h / 2, -h / 2)]  # fmt: skip
    plant = simulation_of("target-a").plant
    base = Period(simulation_of("target-a"), state, torque).base
    x = beyond(plant, np.array(ends), base)
    wide, narrow = (x[0] - x[1]) / (2 * h), (x[2] - x[3]) / h
    expected = (4 * narrow - wide) / 3
    column = model.E[:, model.parameters.index(key)]
    np.testing.assert_allclose(column, expected, atol=1e-8 * np.abs(expected).max())
    assert np.abs(expected).max() > 0.0


def test_parameters_are_those_of_runs_beside() -> None:
    """Mass of the object and stiffness of the tips."""
    state, torque = random_state("target-a", 3)
    keys = ["object.mass", "fingertip.k_r"]
    scenario = SCENARIOS["target-a"].replace({"object.mass": 0.2})
    model = linearize(scenario, state=state, torque=torque, parameters=keys)
    for key in keys:
        linear_parameter(scenario, key, model, state, torque)


@pytest.mark.parametrize("name", ["hold", "finger-only", "computed-torque"])
def test_the_loop_is_that_of_the_simulation(name: str) -> None:
    """(x, m) after one sample and step, with the controller in between, and its memory."""
    scenario = load_scenario(name)
    simulation = softhand.build(scenario)
    for _ in range(5):
        simulation.sample()
        simulation.step()
    carried = simulation.save()
    model = linearize(scenario, state=carried, closed=True)
    assert model.closed is not None
    s = len(model.states)
    np.testing.assert_allclose(model.closed.A[:s], np.hstack([model.A, np.zeros((s, len(model.closed.A) - s))])
                               + model.B @ model.closed.K, atol=1e-12)  # fmt: skip
    assert carried.carried is not None
    period = Period(simulation, State(carried.q, carried.v, carried.z, carried.time), np.zeros(9))

    def end(state: State) -> np.ndarray:
        simulation.reset(replace(state, carried=None))
        simulation._asking.restart(carried.carried.memory, True)  # type: ignore[union-attr]
        simulation.sample()
        simulation.step()
        found = simulation.state
        return np.concatenate([found.q, found.v, found.z[tuple(period.cells.T)]])

    base = end(period.state)
    expected = np.empty((s, s))
    for k, h in enumerate(steps_of(model)[:s]):
        function = lambda step, k=k: beyond(simulation.plant, end(period.moved(k, step))[None], base)[0]  # noqa: E731
        expected[:, k], _ = extrapolated(function, h / 3.0)
    worst = np.abs(model.closed.A[:s, :s] - expected).max(axis=1) / np.abs(expected).max(axis=1)
    assert worst.max() < 1e-7, model.states[int(np.argmax(worst))]
    assert np.all(np.diff(np.abs(model.closed.eigenvalues())) <= 0.0)


def test_the_growth_is_that_of_stability() -> None:
    """The loop of `hold` at rest: the same slowest motion as `stability` finds in continuous time."""
    model = linearize("hold", closed=True)
    assert model.closed is not None
    growth = np.log(np.abs(model.closed.eigenvalues())) / model.period
    expected = softhand.stability(load_scenario("hold"), with_scan=False).held_growth
    assert growth[0] < 1e-3  # what the contacts store beside a motion that rolls stays as it is
    np.testing.assert_allclose(np.max(growth[growth < -1e-3]), expected, rtol=1e-3)


def test_a_recording_is_as_its_run() -> None:
    """The model of a sample is that of the scenario at that sample."""
    recording = softhand.simulate("target-a", overrides={"duration": 0.03, "reference.duration": 0.02})
    ours = linearize(recording, 20)
    run = linearize(load_scenario("target-a", {"duration": 0.03, "reference.duration": 0.02}), 20)
    assert ours.time == run.time == 0.02
    np.testing.assert_allclose(ours.A, run.A, atol=1e-7 * np.abs(run.A).max())
    assert linearize(recording, -1).time == 0.03


def test_gains_are_parameters_of_the_loop() -> None:
    """They move nothing while the torque is held; u by K_v is minus the velocity of the joints, as it is fed back."""
    state, torque = random_state("target-a", 4)
    model = linearize(SCENARIOS["target-a"], state=state, torque=torque, parameters=["K_v"], closed=True)
    assert model.closed is not None
    np.testing.assert_array_equal(model.E, 0.0)
    np.testing.assert_allclose(model.closed.E[:39, 0], model.B @ -state.v[:9], atol=1e-9 * np.abs(model.B).max())


class _Commanded(softhand.Controller):
    """The law of a scenario, and something added to its command."""

    added: tuple[float, ...]

    def torque(self, observation: softhand.Observation, memory: Any) -> tuple[np.ndarray, Any]:
        return LOOP_LAW.torque(observation, memory)[0] + self.added, memory


LOOP_LAW = softhand.controllers.Regulation(K_v=2.0)


def test_what_is_added_to_a_command_that_is_cut_does_nothing(tmp_path: Path) -> None:
    """B of the loop against runs whose command is moved: the columns of the limited joints are zero, the others not."""
    urdf = HAND_URDF.read_text()
    (tmp_path / "weak.urdf").write_text(urdf.replace('effort="2"', 'effort="0.45"'))
    scenario = load_scenario(
        "hold", {"hand.urdf": str(tmp_path / "weak.urdf"), "controller": {"name": "regulation", "K_v": 2.0}}
    )
    start = softhand.build(scenario).save()
    v = start.v + np.concatenate([0.05 * np.random.default_rng(2).standard_normal(9), np.zeros(6)])
    state = State(start.q, v, start.z)
    model = linearize(scenario, state=state, closed=True)
    assert model.closed is not None
    limited = {switch.where for switch in model.switches if switch.what == "effort limit"}
    assert 0 < len(limited) < 9

    def end(added: np.ndarray) -> np.ndarray:
        simulation = softhand.build(scenario, _Commanded(added=tuple(added)))
        simulation.reset(state)
        simulation.sample()
        simulation.step()
        return simulation.state.v.copy()

    h = 1e-3
    for j, name in enumerate(model.inputs):
        way = h * np.eye(9)[j]
        expected = (end(way) - end(-way)) / (2.0 * h)
        nv = len(expected)
        np.testing.assert_allclose(model.closed.B[nv : 2 * nv, j], expected, atol=1e-4 * np.abs(model.B).max())
        assert np.any(model.closed.B[:, j]) == (name not in limited)


@pytest.mark.parametrize(("x", "expected", "crossed"), [(0.0, -1.0, 1), (0.5, 1.0, 0), (1e-5, 1.0, 1)])
def test_a_kink_is_differenced_on_the_side_of_the_base(x: float, expected: float, crossed: int) -> None:
    """|x| + sin y; x = 0 is taken for the side x <= 0."""

    def function(index: np.ndarray, amount: np.ndarray, _: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        a, b = x + np.where(index == 0, amount, 0.0), 1.0 + np.where(index == 1, amount, 0.0)
        return np.column_stack([np.abs(a) + np.sin(b)]), (a > 0.0).astype(np.int64)[:, None]

    found = slopes(function, np.array([1e-3, 1e-3]))
    np.testing.assert_allclose(found.columns, [[expected, np.cos(1.0)]], rtol=1e-10)
    assert found.crossed.tolist() == [crossed]


MISTAKES = [
    ({"parameters": ["fingertip.frction"]}, "is no key of the scenario; did you mean 'fingertip.friction'"),
    ({"parameters": ["frction"]}, "parameters: frction: no key of the scenario ends so. Did you mean friction"),
    ({"parameters": ["fingertip.law"]}, 'parameters: fingertip.law is "nakashima", which is no number'),
    ({"parameters": ["stepper.step"]}, "parameters: stepper.step counts the steps of a period"),
    ({"outputs": ["contact_forc"]}, "outputs: 'contact_forc' is no variable of a recording; did you mean '"),
    ({"outputs": ["support_force"]}, "outputs: support_force: this scenario has no supports"),
    ({"sample": 100_000}, "sample: got 100000; the run has samples 0 to 2000"),
    ({"sample": 1.5}, "sample: got 1.5"),
    ({"torque": [0.0, 1.0]}, "torque: got"),
]  # fmt: skip


@pytest.mark.parametrize(("given", "message"), MISTAKES)
def test_mistakes_are_told_in_one_line(given: dict, message: str) -> None:
    """Each names the thing, its value and the remedy."""
    with pytest.raises(ScenarioError) as error:
        linearize("target-a", **given)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_state_must_be_numbers() -> None:
    """Of one's own, and of a recording."""
    saved = simulation_of("target-a").save()
    q = saved.q.copy()
    q[3] = np.nan
    with pytest.raises(ScenarioError, match=r"state\.q: it has nan at \(3,\), which is no number"):
        linearize("target-a", state=State(q, saved.v, saved.z))
    with pytest.raises(ScenarioError, match=r"state\.v: it has shape \(3,\), but that of this plant is \(15,\)"):
        linearize("target-a", state=State(saved.q, np.zeros(3), saved.z))
    recording = softhand.simulate("target-a", overrides={"duration": 0.01, "reference.duration": 0.01})
    recording.variables["joint_velocity"][4, 2] = np.inf
    with pytest.raises(RecordingError, match=r"sample 4 \(t = 0\.004 s\): joint_velocity has inf, which is no number"):
        linearize(recording, 4)


def test_it_tells_what_it_is() -> None:
    """Sizes and switches in one line, and JSON with names."""
    model = falling()
    assert repr(model).startswith(
        "<Linearization: 0.001 s from t = 0 s, 72 states, 9 inputs, 10 parameters, 12 outputs"
    )
    assert '"states"' in model.to_json()


# ------------------------------------------------------------------------------------------------ continuous time


def test_the_continuous_model_comes_to_that_of_the_plant_as_the_square_of_the_step() -> None:
    """Its rates against those of the plant without steps, and its exponential is the period again."""
    off = []
    for step in (5e-4, 2.5e-4):
        scenario = load_scenario("target-a", {"stepper.step": step, "control_period": step})
        simulation = softhand.build(scenario)
        simulation.sample()
        state, torque = simulation.save(), simulation.torque.copy()
        model = linearize(scenario, state=state, torque=torque)
        A, B = model.continuous()
        s, n = B.shape
        again = expm(np.block([[A, B], [np.zeros((n, s + n))]]) * step)
        np.testing.assert_allclose(again[:s], np.hstack([model.A, model.B]), atol=1e-9 * np.abs(model.A).max())
        rates = np.linalg.eigvals(A)
        wanted = np.linalg.eigvals(softhand.linearize_plant(simulation.plant, state, torque).A)
        off.append(max(np.min(np.abs(rates - one)) for one in wanted if abs(one) > 1e-2))
    assert off[0] < 0.02 * 650.0 and off[1] == pytest.approx(0.25 * off[0], rel=0.05)


@pytest.mark.parametrize(("value", "what"), [(0.0, "forgets a motion"), (-0.5, "turns a motion around")])
def test_a_period_without_a_continuous_model_is_told(value: float, what: str) -> None:
    model = linearize("hold")
    A = model.A.copy()
    A[:, 0], A[0] = 0.0, 0.0
    A[0, 0] = value
    with pytest.raises(softhand.GraspError, match=f"{what} within 0.001 s, so that no model of continuous time"):
        replace(model, A=A).continuous()
