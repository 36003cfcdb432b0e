"""Noise in, scatter out: against noisy runs, and against derivatives."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import softhand
from softhand.margins.loop import close_loop
from softhand.margins.place import find_place
from softhand.scenario.scenario import load_scenario

NOISE = {
    "sensing.object_position.noise": 2e-5,
    "sensing.object_orientation.noise": 2e-4,
    "sensing.joint_position.noise": 1e-4,
    "sensing.joint_velocity.noise": 2e-3,
    "sensing.contact_force.noise": 0.01,
    "actuation.noise": 2e-4,
}
"""Of the scenario `hold`: every term counts but the force, which is not fed back with K_N = 1."""


@pytest.mark.parametrize(
    ("seeds", "within"), [(24, 0.15), pytest.param(200, 0.10, marks=pytest.mark.slow)], ids=["24 runs", "200 runs"]
)
def test_noisy_runs_scatter_as_told(seeds: int, within: float) -> None:
    """Position, attitude and internal force of runs with as many seeds, each axis, from the second second on."""
    scenario = load_scenario("hold", {**NOISE, "duration": 2.0})
    told = softhand.stability(scenario).scatter
    every = {"sensing.seed": range(1, seeds + 1), "actuation.seed": range(1, seeds + 1)}
    runs = softhand.rollout(scenario, every, every=0.05, variables=["object_position", "object_rpy", "internal_force"])
    assert runs.finished.all()
    for name, expected in (("position", told.position), ("rpy", told.turn)):
        measured = getattr(runs, f"object_{name}")[:, 20:].std(axis=(0, 1))
        assert_allclose(measured, expected, rtol=within)
    assert_allclose(runs.internal_force[:, 20:].std(axis=(0, 1)), told.internal_force, rtol=within)


def test_scatter_is_in_proportion_to_noise_and_the_sources_add_up() -> None:
    """Twice the noise, twice the scatter; shares are those of variances; nothing without noise."""
    place = find_place(load_scenario("hold", NOISE))
    one, twice = (
        softhand.stability(load_scenario("hold", {key: k * value for key, value in NOISE.items()})).scatter
        for k in (1.0, 2.0)
    )
    assert_allclose(twice.position, 2.0 * one.position, rtol=1e-6)
    assert_allclose(np.sum(list(one.sources.values()), axis=0), 1.0, rtol=1e-9)
    assert one.sources["contact_force"][0] < 1e-6 < one.sources["joint_position"][0]
    alone = softhand.stability("hold", at=None)
    assert alone.scatter is None and place.setup.sensing is not None


def test_scatter_of_the_commanded_torque_is_that_of_its_derivative() -> None:
    """A loop that noise enters for the first time: by `linearize` with the biases as parameters."""
    scenario = load_scenario("hold", {"sensing.object_position.noise": 1e-5})
    noise = softhand.measurement_noise(scenario)
    model = softhand.linearize(
        scenario, overrides=noise.biases, parameters=noise.biases, closed=True, outputs=["joint_torque"]
    )
    place = find_place(scenario)
    ((name, answer),) = close_loop(place).by_error.items()
    assert name == "object_position"
    assert_allclose(answer[:9], model.closed.F, rtol=1e-5, atol=1e-6 * np.abs(model.closed.F).max())


def test_noise_in_a_loop_that_grows_has_no_bound() -> None:
    """Said in words, and rounding of instruments as what the loop has not."""
    found = softhand.stability(
        load_scenario("target-a", {"sensing.object_position": {"noise": 1e-5, "quantisation": 1e-6}})
    )
    rows = dict(found.rows())
    assert rows["scatter by noise"].startswith("without bound")
    assert rows["left out of the loop"] == "sensing.object_position.quantisation"
    assert json.loads(found.to_json())["scatter"]["position"] == [None, None, None]
