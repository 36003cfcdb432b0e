"""Logs in which tips slip: pieces that go on as the run does, and ten parameters, friction among them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from test_calibration_coverage import truth

import softhand
from softhand.assembly.probe import recorded_state
from softhand.assembly.resolve import resolve
from softhand.calibration.fit import begin_of, fit
from softhand.calibration.intervals import half_widths
from softhand.calibration.parameters import choose, keyed
from softhand.calibration.problem import Problem
from softhand.calibration.recorded_log import log_of_recording
from softhand.calibration.search import defects_of
from softhand.calibration.weights import slack_of

NAMES = [
    "fingertip.friction", "fingertip.k_r", "fingertip.k_phi", "fingertip.radius", "fingertip.damping.tangential",
    "object.mass", "object.inertia[1]", "sensing.object_position.bias[0]", "sensing.object_position.bias[2]",
    "sensing.object_position.delay",
]  # fmt: skip
AXES = ((0, 0, -1), (0, 0, 1), (0, 1, 0), (0, 0, -1), (0, -1, 0), (0, 0, 1))


def slipping(duration: float) -> softhand.Scenario:
    """The pinched box of the coverage, which is pushed by 2.5 N for 80 ms each, so that tips slip."""
    pushes = [
        {"force": [2.5 * part for part in axis], "start": 0.3 + 0.4 * k, "duration": 0.08}
        for k, axis in enumerate(AXES) if 0.5 + 0.4 * k < duration
    ]  # fmt: skip
    return truth().replace({"duration": duration, "fingertip.contact": "coulomb", "push": pushes})


@pytest.fixture(scope="module")
def run():
    """Scenario and recording of 1.8 s."""
    scenario = slipping(1.8)
    return scenario, softhand.simulate(scenario)


def test_pieces_go_on_as_the_run_does(run):
    """With the kicks handed on, through pushes and slip; a start afresh is off by a hundred times the slack there."""
    scenario, recording = run
    assert np.asarray(recording.is_slipping).any(axis=0).all()
    setup, log = resolve(scenario), log_of_recording(recording, scenario)
    problem = Problem(log, setup, choose(setup.scenario, setup.world, ["mass"], {}), 0.05, 1)
    plant, which = problem._benches[0].plant, range(len(problem.pieces))
    states = [
        replace(recorded_state(plant, recording, problem.pieces[k].first), time=problem.time(k)) for k in which
    ]  # fmt: skip
    worst = []
    for _ in range(5):
        runs = problem.runs(states, which)
        worst.append(max(np.abs(one / slack_of(problem)).max() for one in defects_of(problem, runs, which, states)))
        problem.hand_on(runs, which)
    assert worst[0] > 100.0 and worst[-1] < 0.1


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_ten_parameters_where_tips_slip(seed: int):
    """From values 5 to 10 % off, each of them, to the truth by the measure of the intervals."""
    scenario = slipping(2.0)
    setup = resolve(scenario)
    exact = choose(setup.scenario, setup.world, NAMES, {})
    x, rng = begin_of(exact), np.random.default_rng(seed)
    begin = x + rng.choice([-1, 1], len(x)) * rng.uniform(0.05, 0.1, len(x))
    values = [max(one.to_value(there), one.lower) for one, there in zip(exact, begin, strict=True)]
    asked = resolve(scenario.replace(keyed(exact[:7], values[:7])))
    parameters = [one._replace(value=value) for one, value in zip(exact, values, strict=True)]
    log = log_of_recording(softhand.simulate(scenario.replace({"sensing.seed": seed})), scenario)
    found = fit(log, asked, parameters, 0.05, 0.0, 1, 0, 1)
    errors = (found.solution.x - x) / half_widths(found.spread, 0.95)
    assert np.abs(errors).max() < 2.0, errors  # four standard deviations
    assert np.abs(found.solution.x - x)[0] < 1e-3, "friction"
