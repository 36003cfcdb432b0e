"""softhand check RUN.nc: what it says of recordings whole, stopped and spoilt."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from commands import Outcome, run_command

from softhand.assembly.build import simulate
from softhand.checks.recording import RecordingCheckup, check_recording
from softhand.errors import RecordingError, SimulationStopped
from softhand.recording.recording import Recording
from softhand.scenario.scenario import load_scenario, with_law


@pytest.fixture(scope="module")
def whole() -> Recording:
    """A short run of target A."""
    return simulate(load_scenario("target-a", {"duration": 0.1}))


@pytest.fixture(scope="module")
def stopped() -> Recording:
    """Target A at once, with little friction: it ends at a rim before 0.1 s."""
    with pytest.raises(SimulationStopped) as caught:
        changes = {"reference.kind": "step", "fingertip.contact": "coulomb", "fingertip.friction": 0.4}
        simulate(load_scenario("target-a", changes))
    recording: Recording = caught.value.recording  # type: ignore[attr-defined]
    return recording


def spoilt(recording: Recording, name: str, where: Any, value: float) -> RecordingCheckup:
    """What is said of a recording with one value changed."""
    array = recording[name].copy()
    array[where] = value
    return check_recording(replace(recording, variables={**recording.variables, name: array}))


def test_a_whole_recording_is_beyond_doubt(whole: Recording) -> None:
    """No errors, no warnings, and the rows say so."""
    checkup = check_recording(whole)
    rows = dict(checkup.rows)
    assert (checkup.errors, checkup.warnings) == ([], [])
    assert rows["ended"] == "complete" and rows["samples"] == "101, 0 to 0.1 s"
    assert rows["of"] == "9 joints, 3 contacts, 3 pairs" and rows["lift-off"] == rows["slip"] == "never"
    assert "no spring" in rows["energy"] and rows["scenario"].startswith("can be read: Box lowered")


def test_the_energy_of_a_spring_is_accounted_for() -> None:
    """A conservative law leaves next to nothing."""
    run = simulate(with_law(load_scenario("target-a", {"duration": 0.1}), "conservative"))
    text = dict(check_recording(run).rows)["energy"]
    assert text.startswith("residual, error of steps and samples") and float(text.split()[-6]) < 0.1  # [%]


def test_a_stopped_run_is_a_warning(stopped: Recording) -> None:
    """Where it ended and why; slip is counted with its first time."""
    checkup = check_recording(stopped)
    rows = dict(checkup.rows)
    assert not checkup.errors and rows["ended"] == f"early, at {stopped.stop_time:g} s"
    why = f"incomplete, it goes to {stopped.stop_time:g} s: finger_2_tip rolls over its rim"
    assert any(why in text for text in checkup.warnings)
    slips = stopped.is_slipping.any(axis=1)
    assert rows["slip"].startswith(
        f"{np.count_nonzero(slips)} samples, first at {stopped.time[np.argmax(slips)]:.4g} s"
    )


@pytest.mark.parametrize(("value", "kind"), [(np.nan, "NaN"), (np.inf, "infinity")])
def test_what_is_no_number_is_an_error(whole: Recording, value: float, kind: str) -> None:
    """With array, count and first time."""
    errors = spoilt(whole, "joint_torque", (slice(40, 43), 2), value).errors
    assert errors == [f"joint_torque is {kind} in 3 samples, first at 0.04 s."]


def test_friction_without_pressing_may_be_infinite(whole: Recording) -> None:
    """A tip in the air has no friction to use; one that presses has."""
    force = whole.contact_force.copy()
    force[30:35, 1, 2] = 0.0
    lifted = replace(whole, variables={**whole.variables, "contact_force": force})
    checkup = spoilt(lifted, "friction_use", (slice(30, 35), 1), np.inf)
    assert checkup.errors == []
    assert dict(checkup.rows)["lift-off"] == "5 samples, first at 0.03 s (finger_2_tip)"
    assert dict(checkup.rows)["friction use above 1"] == "never"
    assert spoilt(whole, "friction_use", (30, 1), np.inf).errors == [
        "friction_use is infinity in 1 sample, first at 0.03 s."
    ]


def test_more_friction_than_there_is_is_a_warning(whole: Recording) -> None:
    """With the first time and the finger."""
    checkup = spoilt(whole, "friction_use", (slice(50, 60), 2), 1.2)
    assert checkup.warnings == ["friction use above 1: 10 samples, first at 0.05 s (finger_3_tip)."]


def test_torque_limits_are_counted(whole: Recording) -> None:
    """With the joint."""
    rows = dict(spoilt(whole, "torque_limited", (7, 4), 1).rows)
    assert rows["torque at its limit"] == "1 sample, first at 0.007 s (finger_2_proximal_flexion)"


@pytest.mark.parametrize(
    ("sample", "time", "words"),
    [(50, 0.049, "does not rise at sample 50"), (50, 0.0503, "not even: 0.0013 s to the sample at 0.0503 s")],
)
def test_time_must_be_even(whole: Recording, sample: int, time: float, words: str) -> None:
    """A sample that is out of order or out of step."""
    errors = spoilt(whole, "time", sample, time).errors
    assert len(errors) == 1 and words in errors[0]


def test_a_rotation_that_is_none_is_an_error(whole: Recording) -> None:
    """Stretched, or mirrored."""
    assert "no rotation in 1 sample, first at 0.02 s" in spoilt(whole, "contact_rotation", (20, 0, 0, 0), 2.0).errors[0]
    mirrored = spoilt(whole, "contact_rotation", (20, 0), np.diag([1.0, 1.0, -1.0]))  # type: ignore[arg-type]
    assert len(mirrored.errors) == 1 and "no rotation" in mirrored.errors[0]


def test_missing_arrays_and_samples_are_warnings(whole: Recording) -> None:
    """By name; and fewer samples than the scenario asks for."""
    kept = {name: array[:-1] for name, array in whole.variables.items() if name != "slip_loss"}
    warnings = check_recording(replace(whole, variables=kept)).warnings
    assert any("it has no slip_loss:" in text for text in warnings)
    assert any("it has 100 samples, but its scenario asks for 101" in text for text in warnings)


@pytest.mark.parametrize(
    ("old", "new"), [("duration", "durration"), ('law = "nakashima"', 'law = "gone"'), ("[hand]", "[hand")]
)
def test_a_scenario_of_another_version_is_a_warning(whole: Recording, old: str, new: str) -> None:
    """A key, a law, or a text that cannot be read any more: the arrays are good all the same."""
    checkup = check_recording(replace(whole, scenario=whole.scenario.replace(old, new, 1)))
    assert not checkup.errors and len(checkup.warnings) == 1 and "scenario cannot be used" in checkup.warnings[0]


def test_a_recording_without_samples_is_an_error(whole: Recording) -> None:
    """Nothing can be done with it."""
    empty = {name: array[:0] for name, array in whole.variables.items()}
    assert check_recording(replace(whole, variables=empty)).errors == ["it has no samples."]


# -------------------------------------------------------------------------------------------------- the command


def run(*arguments: str, folder: Path) -> Outcome:
    return run_command("check", *arguments, folder=folder)


def test_the_command_gives_a_verdict(whole: Recording, tmp_path: Path) -> None:
    """One line, exit code 0; nothing if quiet."""
    whole.save(tmp_path / "run.nc")
    result = run("run.nc", folder=tmp_path)
    assert result.returncode == 0 and "run.nc: no errors, 0 warnings" in result.stdout
    assert (run("run.nc", "--quiet", folder=tmp_path).stdout, result.stderr) == ("", "")


def test_the_command_refuses_a_spoilt_recording(whole: Recording, tmp_path: Path) -> None:
    """The table, then one error, exit code 1."""
    array = whole.joint_torque.copy()
    array[3:] = np.nan
    replace(whole, variables={**whole.variables, "joint_torque": array}).save(tmp_path / "run.nc")
    result = run("run.nc", folder=tmp_path)
    assert result.returncode == 1 and "samples" in result.stdout and "Traceback" not in result.stderr
    assert "error: run.nc: joint_torque is NaN in 98 samples, first at 0.003 s." in result.stderr


@pytest.mark.parametrize(
    ("content", "words"),
    [(None, "no such file"), (b"", "no NetCDF-4 file"), (b"\x89HDF\r\n\x1a\n" + bytes(100), "cannot be read")],
)
def test_a_broken_file_is_one_error(content: bytes | None, words: str, tmp_path: Path) -> None:
    """Not there, empty, damaged."""
    if content is not None:
        (tmp_path / "run.nc").write_bytes(content)
    result = run("run.nc", folder=tmp_path)
    assert result.returncode == 1 and result.stderr.count("error:") == 1
    assert words in result.stderr and "Traceback" not in result.stderr


def test_a_recording_takes_no_changes(tmp_path: Path) -> None:
    """--set is for scenarios."""
    assert "--set changes a scenario" in run("run.nc", "--set", "duration=1", folder=tmp_path).stderr


def test_errors_carry_the_file(whole: Recording) -> None:
    """For programs."""
    with pytest.raises(RecordingError) as caught:
        spoilt(whole, "joint_torque", 5, np.nan).raise_errors("run.nc")
    assert caught.value.file == "run.nc"  # type: ignore[attr-defined]


def test_tips_that_let_go_by_right_are_no_warning(whole: Recording) -> None:
    """With `coulomb` lift-off is told and not warned of; a tip that has not touched yet has not let go."""
    force = whole.contact_force.copy()
    force[:5, 0, 2] = force[30:35, 1, 2] = 0.0
    scenario = whole.scenario.replace('contact = "rolling"', 'contact = "coulomb"')
    assert scenario != whole.scenario
    variables = {**whole.variables, "contact_force": force}
    for text, warned in ((whole.scenario, True), (scenario, False)):
        checkup = check_recording(replace(whole, variables=variables, scenario=text))
        assert dict(checkup.rows)["lift-off"] == "5 samples, first at 0.03 s (finger_2_tip)"
        assert any("lift-off" in warning for warning in checkup.warnings) == warned
