"""Closed loops along a run, at its start and its end, and what is no place."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

import softhand
from softhand.controllers.controller import Controller
from softhand.errors import ControllerError, RecordingError, ScenarioError, SimulationStopped
from softhand.margins.loop import close_loop
from softhand.margins.place import Place, find_place
from softhand.scenario.scenario import load_scenario


@lru_cache(1)
def holding() -> Place:
    return find_place(load_scenario("hold"))


def test_along_a_run_the_recording_tells_what_the_scenario_does() -> None:
    """(59) remembers nothing that changes, so both have the same rates; those of single samples too."""
    scenario = load_scenario("target-a", {"duration": 0.2})
    run = softhand.simulate(scenario)
    computed, recorded = softhand.stability_along(scenario, 5), softhand.stability_along(run, 5)
    assert_allclose(computed.time, [0.0, 0.05, 0.1, 0.15, 0.2])
    assert_allclose(recorded.growth, computed.growth, rtol=1e-4, atol=1e-4)
    alone = softhand.stability(run, at=0.1)
    assert alone.time == 0.1 and alone.held_growth == pytest.approx(recorded.growth[2, 0], abs=1e-6)
    assert alone.modes[0].name == recorded.names[2]
    labels = dict(alone.rows())
    assert "not at rest there" in labels and "beside the motion" in labels["the rates are those"]


def test_start_and_end_of_a_run_stay_at_rest() -> None:
    """Of a scenario and its recording; where all rests, no row says otherwise."""
    scenario = load_scenario("hold", {"duration": 0.05})
    start, end = softhand.stability(scenario), softhand.stability(scenario, at="end")
    assert end.time == 0.05 and end.held_growth == pytest.approx(start.held_growth, rel=1e-5)
    assert softhand.stability(softhand.simulate(scenario), at="start").time == 0.0
    assert not {"not at rest there"} & {label for found in (start, end) for label, _ in found.rows()}


def test_phases_are_those_of_the_run() -> None:
    """As the reference has them, and a row for each that was looked at."""
    run = softhand.simulate("grasp-and-lift", duration=1.5)
    found = softhand.stability_along(run, 7)
    assert [name for name, _ in found.phases] == ["close", "squeeze", "take the weight"]
    assert "largest in phase squeeze" in dict(found.rows()) and np.all(found.growth[:, 0] < 0.0)


def test_a_lost_run_is_looked_at_as_far_as_it_goes() -> None:
    """Of its recording and of its scenario, which say why it ended; a time beyond is refused with the last good one."""
    push = [{"on": "object", "force": [0.0, 2.0, 1.0], "start": 0.0, "duration": 0.2}]
    scenario = load_scenario("hold", {"controller.K_N": 3.0, "duration": 2.0, "push": push})
    with pytest.raises(SimulationStopped) as stopped:
        softhand.simulate(scenario)
    run = stopped.value.recording
    found = softhand.stability_along(run, 4)
    assert len(found.time) == 4 and "the run ended early" in found.notes[0]
    computed = softhand.stability_along(scenario, 81)
    assert computed.time[-1] <= run.stop_time and str(stopped.value)[:30] in computed.notes[0]
    with pytest.raises(SimulationStopped, match=r"Samples up to t = .* give such a time with `at`"):
        softhand.stability(scenario, at=1.9)


class Raising(Controller):
    """It raises."""

    def torque(self, observation: Any, memory: Any) -> Any:
        raise ZeroDivisionError("no gain")


class Rooted(Controller):
    """Its torque has no derivative at rest, but NaN beside it."""

    def torque(self, observation: Any, memory: Any) -> Any:
        turned = np.sum(observation.joint_velocity)
        return observation.gravity_torque + np.sqrt(-abs(turned)), memory


def test_mistakes_are_named() -> None:
    """A time outside the run, no place, no mode, no count, a recording without samples or of a mode."""
    run = softhand.simulate("hold", duration=0.02)
    with pytest.raises(ScenarioError, match=r"at: got 3; .* times of the recording, 0 to 0.02 s; the nearest is 0.02"):
        softhand.stability(run, at=3)
    with pytest.raises(ScenarioError, match=r"at: got 'middle'; allowed are 'start', 'end' and times of the run"):
        softhand.stability("hold", at="middle")
    with pytest.raises(ScenarioError, match=r"at: got nan"):
        softhand.stability(run, at=float("nan"))
    with pytest.raises(ScenarioError, match=r"count: got 1"):
        softhand.stability_along(run, 1)
    with pytest.raises(ScenarioError, match=r"mode: got 40; this loop has modes 1"):
        softhand.stability("hold").mode_recording(40)
    with pytest.raises(ScenarioError, match=r"with_scan: .* about the start of a scenario"):
        softhand.stability(run, with_scan=True)
    with pytest.raises(RecordingError, match="shows a mode"):
        softhand.stability(softhand.stability("hold").mode_recording(1))


@pytest.mark.filterwarnings("ignore:invalid value")
def test_a_controller_at_fault_is_named() -> None:
    """One that raises, and one without a derivative."""
    with pytest.raises(ControllerError, match=r"controller 'Raising' raised ZeroDivisionError: no gain"):
        close_loop(holding().with_controller(Raising()))
    with pytest.raises(ControllerError, match=r"'Rooted' has a torque without a derivative along 'finger_1_abd"):
        close_loop(holding().with_controller(Rooted()))
