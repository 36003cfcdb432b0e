"""`Linearizer`, by the derivatives of the sums, against `linearize`, by differences, and against the simulation."""

from __future__ import annotations

from functools import cache, partial
from typing import Any

import numpy as np
import pytest
from test_derivatives import SCENARIOS, Period, extrapolated, forward, random_state, simulation_of, steps_of

import softhand
from softhand import Linearization, Linearizer, State, linearize

OUTPUTS = ["object_position", "object_rpy", "internal_force", "limit_surface_use", "contact_force", "tip_position",
           "deformation", "contact_coordinates", "joint_torque"]  # fmt: skip
COMMON = ["target-a"]
OTHERS = [pytest.param(name, marks=pytest.mark.slow) for name in SCENARIOS if name not in COMMON]


@cache
def linearizer_of(name: str) -> Linearizer:
    return Linearizer(SCENARIOS[name], outputs=OUTPUTS)


def by_sums(name: str, state: State, torque: np.ndarray) -> Linearization:
    """The model, and that it did not come from differences, but for outputs over a table."""
    linearizer = linearizer_of(name)
    model = linearizer.at(state, torque)
    work = linearizer._work
    assert work._tangents[False] is not None and not work._tangents[False].is_lost
    assert work._looks is not None
    tangent = work._looks._tangent
    assert (tangent is None) == (name == "grasp-and-lift") and (tangent is None or not tangent.is_lost)
    return model


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", [*COMMON, *OTHERS])
def test_it_is_what_differences_give(name: str, seed: int) -> None:
    """Each entry of A, B and C to 1e-8 of the largest of its row; the same switches on the same sides."""
    state, torque = random_state(name, seed)
    found = by_sums(name, state, torque)
    wanted = linearize(SCENARIOS[name], state=state, torque=torque, outputs=OUTPUTS)
    pairs = ((np.hstack([found.A, found.B]), np.hstack([wanted.A, wanted.B])), (found.C, wanted.C), (found.D, wanted.D))
    for own, other in pairs:
        row = np.abs(other).max(axis=1, keepdims=True) + 1e-12 * np.abs(other).max(initial=1e-300)
        np.testing.assert_array_less(np.abs(own - other) / row, 1e-8)
    np.testing.assert_allclose(found.drift, wanted.drift, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found.output, wanted.output, rtol=1e-12, atol=1e-12)
    assert found.switches == wanted.switches
    assert (found.states, found.inputs, found.outputs) == (wanted.states, wanted.inputs, wanted.outputs)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", ["target-a", *OTHERS[:1]])
def test_along_any_way_it_is_where_the_simulation_goes(name: str, seed: int) -> None:
    """All entries of x at once, by amounts of their own: a sign, a swap of two or a missing column would show."""
    state, torque = random_state(name, seed)
    model, rng = by_sums(name, state, torque), np.random.default_rng(seed)
    period, s = Period(simulation_of(name), state, torque), len(model.states)
    for _ in range(2):
        x = 0.3 * steps_of(model)[:s] * rng.uniform(0.5, 1.5, s) * rng.choice([-1.0, 1.0], s)
        expected, _ = extrapolated(partial(period.at, x), 1.0)
        np.testing.assert_array_less(np.abs(model.A @ x - expected), 1e-8 * (np.abs(model.A) @ np.abs(x)))


@pytest.mark.slow  # compiles for half a minute
@pytest.mark.parametrize("seed", range(2))
def test_in_slip_it_holds_for_moves_to_within_the_limit(seed: int) -> None:
    """With shear let go, the one-sided derivative of the simulation itself."""
    state, torque = random_state("slips", seed)
    model, rng = by_sums("slips", state, torque), np.random.default_rng(seed)
    period = Period(simulation_of("slips"), state, torque)
    here, s = period.sides(0, 0.0), len(model.states)
    x = 0.1 * steps_of(model)[:s] * rng.standard_normal(s)
    x[-9:] -= 0.01 * state.z[tuple(period.cells.T)]
    assert all(period.sides(x, share) == here for share in (1.0, 0.5, 0.25))
    expected, _ = forward(partial(period.at, x), 1.0)
    np.testing.assert_array_less(np.abs(model.A @ x - expected), 1e-7 * (np.abs(model.A) @ np.abs(x)))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("target-a", {"stepper.name": "rk4"}),
        ("target-a", {"stepper.step": 5e-4}),
        ("target-a", {"hand.joints.damping": 0.01}),
        ("insertion", {}),
        ("insertion", {"stepper.name": "rk4"}),
    ],
    ids=str,
)
def test_what_cannot_be_followed_is_differenced(name: str, changes: dict[str, Any]) -> None:
    """Another stepper, periods of two steps, joints with damping, obstacles: then it is `linearize`, bit for bit."""
    scenario, outputs = softhand.load_scenario(name, changes), ["object_position", "contact_force"]
    simulation = softhand.build(scenario)
    state, torque = simulation.save(), np.full(len(simulation.torque), 0.05)
    found = Linearizer(scenario, outputs=outputs if name == "insertion" else ()).at(state, torque)
    wanted = linearize(scenario, state=state, torque=torque, outputs=outputs)
    assert np.array_equal(found.A, wanted.A) and np.array_equal(found.B, wanted.B)
    assert name != "insertion" or np.array_equal(found.C, wanted.C)


@pytest.mark.slow
def test_the_wrench_is_that_of_differences() -> None:
    """Force and moment on the object, which torques are held beside."""
    state, torque = random_state("target-a", 5)
    found = Linearizer("target-a", parameters=["wrench"]).at(state, torque)
    wanted = linearize("target-a", state=state, torque=torque, parameters=["wrench"])
    row = np.abs(np.hstack([wanted.A, wanted.E])).max(axis=1, keepdims=True)
    assert np.max(np.abs(found.E - wanted.E) / row) < 1e-8
    assert np.all(np.abs(wanted.E).max(axis=0) > 0.0)
