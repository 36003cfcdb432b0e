"""The compiled loop gives what the loop through Python gives, for every stepper of fixed step, with slip and pushes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from softhand import Recording, SimulationStopped, load_scenario
from softhand.assembly.build import assemble
from softhand.assembly.resolve import resolve
from softhand.batch.asked import PERIODS, Asked
from softhand.batch.run import CompiledRun, Result
from softhand.recording.variables import VARIABLES
from softhand.simulation.keep import Keep

EVERYTHING = tuple(name for name in VARIABLES if name != "time")
SLIP = {"fingertip.contact": "coulomb", "fingertip.friction": 0.42, "fingertip.static_friction": 0.5}
POWER = {"law": "power", "radius": 0.01, "friction": 0.8, "contact": "coulomb"}
LEANING = {"law": "bulk", "radius": 0.01, "friction": 0.6, "static_friction": 0.7, "contact": "coulomb"}
STEP = {"reference.kind": "step"}
PUSHED = {
    "push": [
        {"on": "object", "force": [0.4, -0.3, 0.2], "moment": [0.004, 0.002, -0.003], "point": [0.01, 0.0, 0.02],
         "start": 0.0105, "duration": 0.02},
        {"on": "finger_1_tip", "force": [0.0, 0.2, -0.1], "moment": [0.0, 0.0, 0.0], "point": [0.0, 0.0, 0.0],
         "start": 0.02, "duration": 0.03},
    ]
}  # fmt: skip


def both(scenario: str, values: dict[str, Any]) -> tuple[Result, Recording]:
    """The same run in the compiled loop and through Python."""
    setup = resolve(load_scenario(scenario, {"duration": 0.06, "stepper.terms": "compiled", **values}))
    period = setup.scenario.control_period
    run = CompiledRun(setup, Keep.of(EVERYTHING, period, period), Asked())
    assert run.law is not None
    result = run.go(lambda: False)
    try:
        recording = assemble(setup).run()
    except SimulationStopped as stop:
        recording = stop.recording
        assert (result.outcome.reason, result.outcome.time) == (stop.reason, stop.time)
    return result, recording


@pytest.mark.parametrize(
    ("scenario", "values"),
    [
        ("target-a", {"duration": 1.2, "stepper.terms": "pinocchio"}),  # three calls of the loop
        ("target-a", {"stepper.name": "rk4"}),
        ("target-a", {"stepper.name": "semi-implicit-euler", "stepper.step": 0.0005}),
        ("target-a", {**SLIP, **STEP}),
        ("target-a", {**SLIP, **STEP, "stepper.name": "rk4"}),
        ("target-a", {**SLIP, **STEP, "stepper.name": "semi-implicit-euler", "stepper.step": 0.0005}),
        ("target-a", {"fingertip": {**POWER, "damping": {"name": "fung"}}, **STEP}),
        ("target-a", {**SLIP, **STEP, "fingertip.slip_elements": 5}),
        ("target-a", {**SLIP, **STEP, "fingertip.slip_elements": 4, "stepper.name": "rk4"}),
        (
            "target-a",
            {
                "fingertip": {**POWER, "damping": {"name": "fung"}, "slip_elements": 4},
                **STEP,
                "stepper.name": "semi-implicit-euler",
                "stepper.step": 0.0005,
            },
        ),
        ("target-a", {"fingertip": {**LEANING, "damping": {"name": "fung"}}, **STEP}),
        ("target-a", {"fingertip": LEANING, "stepper.name": "rk4"}),
        ("target-a", {"fingertip": {**LEANING, "damping": {"name": "fung"}, "slip_elements": 4}, **STEP}),
        ("can", {"fingertip": LEANING}),
        ("target-a", {**PUSHED, "stepper.step": 0.0005}),
        ("target-a", {"controller.period": 0.004, "control_period": 0.002, "stepper.step": 0.001}),
        ("pinch", {}),
        ("can", {}),
        ("ball", {}),
    ],
    ids=str,
)
def test_the_loops_agree(scenario: str, values: dict[str, Any]) -> None:
    """All variables at all samples, within 1e-10 of their largest."""
    result, recording = both(scenario, values)
    assert set(recording.variables) <= {*result.variables}
    for name, expected in recording.variables.items():
        scale = max(1.0, float(np.abs(expected).max()))
        assert_allclose(result.variables[name], expected, rtol=0.0, atol=1e-10 * scale, err_msg=name)
    if "duration" in values:
        assert len(recording) > 2 * PERIODS
    if "push" in values:
        assert np.abs(recording.external_force).max() > 0.1
    if values.get("fingertip", {}).get("law") == "bulk":
        assert np.abs(recording.contact_moment).max() > 1e-3
    if values.items() >= SLIP.items():
        assert recording.is_slipping.any()


@pytest.mark.parametrize(
    "values",
    [
        {"controller.K_O_position": 20000.0, "duration": 1.0},  # rolls over an apex or a rim
        {"controller.K_v": 0.5, "duration": 1.0, **STEP},  # diverges, from the step and not from rounding
    ],
    ids=str,
)
def test_a_run_ends_for_the_same_reason(values: dict[str, Any]) -> None:
    """Both name the reason and the time, and have the same samples until then."""
    result, recording = both("target-a", values)
    assert not recording.complete and result.outcome.reason != "finished" and result.outcome.message
    assert len(result.variables["time"]) == len(recording)
    few = slice(0, max(len(recording) // 2, 1))  # before all is chaos
    assert_allclose(result.variables["object_position"][few], recording.object_position[few], rtol=0.0, atol=1e-8)


def test_only_some_samples_and_variables() -> None:
    """Kept are those that were asked for, at the times that were asked for."""
    setup = resolve(load_scenario("target-a", {"duration": 0.05}))
    whole = assemble(setup).run()
    result = CompiledRun(setup, Keep.of(("deformation", "joint_torque"), 0.02, 0.001), Asked()).go(lambda: False)
    assert list(result.variables) == ["time", "deformation", "joint_torque"]
    assert_allclose(result.variables["time"], [0.0, 0.02, 0.04])
    for name in ("deformation", "joint_torque"):
        assert_allclose(result.variables[name], whole[name][::20], rtol=0.0, atol=1e-12)


def test_a_run_can_be_stopped() -> None:
    """Asked between two calls; what was done is there."""
    setup = resolve(load_scenario("target-a", {"duration": 2.0}))
    asked: list[int] = []

    def stop() -> bool:
        asked.append(1)
        return len(asked) == 3

    result = CompiledRun(setup, Keep.of(("object_position",), 0.1, 0.001), Asked()).go(stop)
    assert result.outcome.reason == "interrupted"
    assert len(result.variables["time"]) == 2 * PERIODS // 100
