"""The linear model again and again: the same as `linearize`, and where the period ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import softhand
from softhand import ScenarioError

OUTPUTS = ["object_position", "internal_force", "limit_surface_use", "contact_force", "deformation", "joint_torque"]
SLIPPERY = {"fingertip.contact": "coulomb", "fingertip.friction": 0.36}


@pytest.mark.slow
@pytest.mark.parametrize("overrides", [{}, SLIPPERY], ids=["sticks", "slips"])
def test_it_is_what_linearize_gives_at_each_state_of_a_run(overrides: dict) -> None:
    """On the way there and back; y as the sensor has it, and by x as asked through the sensor."""
    scenario = softhand.load_scenario("target-a", overrides)
    linearizer = softhand.Linearizer(scenario, outputs=OUTPUTS)
    simulation = softhand.build(scenario)
    places = []
    for k in range(25):
        simulation.sample()
        if k % 12 == 0:
            places.append((simulation.save(), simulation.torque.copy()))
        simulation.step()
    for state, torque in [*places, places[0]]:
        found = linearizer.at(state, torque)
        fresh = softhand.linearize(scenario, state=state, torque=torque, outputs=OUTPUTS)
        through = softhand.linearize(scenario, state=state, torque=torque, outputs=OUTPUTS, closed=True)
        for name in ("A", "C", "D"):
            own, other = getattr(found, name), getattr(fresh, name)
            assert np.all(np.abs(own - other) < 1e-8 * np.abs(other).max(axis=1, keepdims=True) + 1e-12), name
        scale = np.abs(np.hstack([fresh.A, fresh.B])).max(axis=1, keepdims=True)
        assert np.all(np.abs(found.B - fresh.B) < 1e-8 * scale)
        np.testing.assert_allclose(found.drift, fresh.drift, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(found.output, fresh.output, rtol=1e-12, atol=1e-12)
        assert found.switches == fresh.switches and found.outputs == fresh.outputs
        row = np.abs(through.C).max(axis=1, keepdims=True) + 1e-12
        assert np.all(np.abs(found.C - through.C) < 1e-9 * row)
        np.testing.assert_allclose(found.output, through.output, rtol=1e-12, atol=1e-12)


def test_the_drift_is_where_the_simulation_ends() -> None:
    """From the state, in its own tangent coordinates; and the model tells where small torques lead."""
    simulation = softhand.build("target-a")
    for _ in range(30):
        simulation.sample()
        simulation.step()
    simulation.sample()
    state, torque, model = simulation.save(), simulation.torque.copy(), simulation.plant.world.model
    found = softhand.Linearizer("target-a").at(state, torque)

    def end(u: np.ndarray) -> np.ndarray:
        simulation.reset(softhand.State(state.q, state.v, state.z, state.time))
        simulation.step(torque + u)
        now = simulation.state
        return np.concatenate([pin.difference(model, state.q, now.q), now.v - state.v, (now.z - state.z).ravel()])

    # pin has the logarithm of the whole pose, and the model the translation beside the turn: alike for a small turn
    np.testing.assert_allclose(found.drift, end(np.zeros(9)), rtol=1e-6, atol=1e-9)
    u = 1e-4 * np.random.default_rng(0).standard_normal(9)
    np.testing.assert_allclose(found.drift + found.B @ u, end(u), rtol=1e-5, atol=1e-9)


def test_parameters_are_those_of_linearize() -> None:
    """The wrench with the joints, others from plants beside."""
    state = softhand.build("target-a").save()
    torque = np.full(9, 0.1)
    given = {"parameters": ["wrench", "mass"], "outputs": ["object_position"]}
    found = softhand.Linearizer("target-a", **given).at(state, torque)
    fresh = softhand.linearize("target-a", state=state, torque=torque, **given)
    np.testing.assert_allclose(found.E, fresh.E, rtol=1e-7, atol=1e-9 * np.abs(fresh.E).max())
    assert np.array_equal(found.F, fresh.F)
    assert found.parameters == fresh.parameters and len(found.parameters) == 7


def test_mistakes_are_told_in_one_line() -> None:
    """At once where it is made, or where it is asked."""
    with pytest.raises(ScenarioError, match=r"outputs: 'speed' is no variable of a recording"):
        softhand.Linearizer("target-a", outputs=["speed"])
    linearizer = softhand.Linearizer("target-a")
    state = softhand.build("target-a").save()
    with pytest.raises(ScenarioError, match=r"torque: got \[0\.0\]; the hand has 9 joints"):
        linearizer.at(state, [0.0])
    with pytest.raises(ScenarioError, match=r"state\.v: it has shape \(3,\), but that of this plant is \(15,\)"):
        linearizer.at(replace(state, v=np.zeros(3)), np.zeros(9))
