"""A loop that grows is told as such: by check, by simulate, by the error of a lost run, with a remedy that works."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np
import pytest
from commands import run_command

import softhand
from softhand.assembly.resolve import resolve
from softhand.checks.scenario import check_scenario
from softhand.margins.growing import growing, growing_run
from softhand.recording.recording import Recording
from softhand.scenario.file import parse_override
from softhand.scenario.scenario import Scenario, load_scenario

HELD = {"reference": {"kind": "hold"}, "duration": 10.0}
NUDGE = 'push=[{on="object", force=[0.0, 0.02, 0.01], start=0.0, duration=0.01}]'
LOST = ("--set", "controller.K_N=3.0", "--set", NUDGE, "--duration", "2.0")
"""Of the scenario `hold`: +24 1/s, which loses a box that was touched within two seconds."""


def held(**changes) -> Scenario:
    """Target A asked to stay at its start for ten seconds."""
    return load_scenario("target-a", HELD).with_values(changes)


def growth_told(scenario: Scenario) -> list[str]:
    return [text for text in check_scenario(scenario).warnings if "closed loop" in text]


@lru_cache(1)
def target_b() -> Recording:
    """Long enough at its target for the slow growth there to be seen."""
    return softhand.simulate("target-b", duration=8.0, overrides={"stepper.step": 2.5e-4})


@lru_cache(1)
def lost_run(folder) -> tuple[str, str]:
    """What is printed of a run that is lost."""
    result = run_command("simulate", "hold", *LOST, "--no-plot", "--out", "lost", folder=folder)
    assert result.returncode == 1
    return result.stdout, result.stderr


# ------------------------------------------------------------------------------------------------------------- check


def test_check_names_the_growth_and_the_control_period() -> None:
    """The rate of `softhand stability`, for how long a torque is held, how much and until when."""
    (told,) = growth_told(held())
    rate = softhand.stability(held(), with_scan=False).held_growth
    assert f"{rate:+.3g} 1/s" in told and "held for 1 ms" in told and "from t = 0 to 10 s" in told
    fold = float(re.search(r"more than (\S+)-fold", told)[1])
    assert fold <= np.exp(10.0 * rate) < 10.0 * fold


@pytest.mark.parametrize("which", [0, 1])
def test_a_remedy_that_is_told_makes_the_check_silent_and_the_motion_die_out(which: int) -> None:
    """Followed to the letter: no warning any more, and what a push leaves behind dies out in place of growing."""
    remedies = re.findall(r"with (\S+ = .+?) \([+-]", growth_told(held())[0])
    assert len(remedies) == 2
    remedy = dict([parse_override(remedies[which].replace(" = ", "=", 1))])
    better = held(**remedy)
    assert check_scenario(better).warnings == []
    left = []
    for scenario in (held(), better):
        push = {"force": [1e-5, 1e-5, 1e-5], "duration": 0.02}
        run = softhand.simulate(scenario.with_values({"duration": 2.5, "push": [push]}))
        speed = np.max(np.abs(run.joint_velocity), axis=1)
        left.append(np.max(speed[-200:]) / np.max(speed[200:400]))
    assert left[0] > 3.0 and left[1] < 0.7


def test_a_shorter_control_period_is_told_where_it_helps() -> None:
    """With far too much feedback of the force; followed to the letter, nothing is told any more."""
    scenario = load_scenario("hold", {"controller.K_N": 3.0})
    (told,) = growth_told(scenario)
    period = float(re.search(r"with control_period = (\S+) and stepper\.step = \1 ", told)[1])
    assert period < 1e-3 and growth_told(scenario.with_values({"control_period": period, "stepper.step": period})) == []


def test_a_short_run_is_not_doubted() -> None:
    """Less than a thousandfold; and a pose that is left for one where all dies out."""
    assert growing(resolve(held(duration=1.2))) is None and growing(resolve(held(duration=1.4)))
    assert growing(resolve(load_scenario("target-a", {"duration": 60.0}))) is None


def test_open_fingers_and_references_of_unknown_rest_are_not_doubted() -> None:
    """Nothing is known of them before a run."""
    assert growing(resolve(load_scenario("grasp-and-lift"))) is None


def test_a_pose_that_is_passed_for_long_is_known_too() -> None:
    """Waypoints at the start: what grows there grows although the run ends where all dies out."""
    target = load_scenario("target-a").reference
    goal = {key: getattr(target, key) for key in ("object_position", "object_rpy", "internal_force")}
    ways = [{"duration": 5.0}, {"duration": 1.0, **goal}]
    found = growing(resolve(held(reference={"kind": "waypoints", "waypoints": ways}, duration=20.0)))
    assert found is not None and (found.begin, found.end) == (0.0, 5.0)
    assert found.exponent == pytest.approx(5.0 * found.rate)


# ----------------------------------------------------------------------------------------------------------- a run


def test_the_error_of_a_lost_run_names_growth_and_remedy(tmp_path_factory) -> None:
    """In place of advice about the step, which changes nothing."""
    _, errors = lost_run(tmp_path_factory.getbasetemp())
    rate = softhand.stability(load_scenario("hold", {"controller.K_N": 3.0}), with_scan=False).held_growth
    error = errors.partition("error:")[2]
    assert rate > 20.0 and f"{rate:+.3g} 1/s" in error and "held for 1 ms" in error
    assert "They grow no more with " in error and " or with controller.K_N = 0.75" in error
    assert "step is too large" not in error


def test_simulate_warns_once_and_in_short(tmp_path_factory) -> None:
    """On the other console, without the remedies, and not if quiet."""
    folder = tmp_path_factory.getbasetemp()
    out, errors = lost_run(folder)
    (warning,) = (line for line in errors.splitlines() if line.startswith("warning:"))
    assert "closed loop is unstable" in warning and "softhand check" in warning and "K_N" not in warning
    quiet = run_command("simulate", "hold", *LOST, "--no-plot", "-q", "--out", "quiet", folder=folder)
    assert "warning:" not in quiet.stderr and "closed loop" not in out


def test_simulate_is_silent_where_all_is_well(tmp_path) -> None:
    """A run that ends well has neither warning nor note of it."""
    result = run_command("simulate", "hold", "--duration", "2.0", "--no-plot", "--out", "run", folder=tmp_path)
    assert result.returncode == 0 and "closed loop" not in result.stdout + result.stderr


def test_the_summary_names_what_grows_at_the_end_pose(tmp_path) -> None:
    """Target B, whose target is known to rest only from the run: it ends, but vibrates."""
    result = run_command("simulate", "target-b", "--duration", "9.0", "--no-plot", "--out", "run", folder=tmp_path)
    assert result.returncode == 0 and "closed loop" not in result.stderr
    told = " ".join(result.stdout.split())
    assert re.search(r"note: the closed loop is unstable: .* from t = 1 to 9 s\. They grow no more with", told)


def test_the_rate_at_the_end_pose_is_that_of_the_run() -> None:
    """The internal force about its desired value, over the later half of target B: the same rate, to 4 %.

    With steps of 0.25 ms, as midpoint at 1 ms makes it 1.4 1/s.
    """
    run = target_b()
    found = growing_run(run)
    force = np.max(np.abs(run.internal_force - run.internal_force_desired), axis=1)
    windows = force[5000:8000].reshape(6, 500).max(axis=1)
    measured = np.polyfit(0.5 * np.arange(6), np.log(windows), 1)[0]
    assert found is not None and found.rate == pytest.approx(measured, rel=0.04)


def test_a_run_without_samples_or_scenario_has_nothing_to_tell() -> None:
    """As one with a controller that no scenario can name."""
    run = target_b()
    assert growing_run(Recording(**{**vars(run), "scenario": "", "attributes": {}})) is None


# ------------------------------------------------------------------------------------------- stability of a run's end


@pytest.mark.parametrize("damping", [None, {"name": "fung", "shares": (0.3, 0.2), "rates": (20.0, 300.0)}])
def test_the_end_of_a_run_that_stays_is_its_start(damping) -> None:
    """State, memory of the dampings and reference are found in the recording."""
    scenario = load_scenario("hold", {"duration": 0.01, "fingertip.damping": damping})
    end, start = (softhand.stability(one, with_scan=False) for one in (softhand.simulate(scenario), scenario))
    assert end.held_growth == pytest.approx(start.held_growth, rel=1e-4)
    assert end.growth == pytest.approx(start.growth, rel=1e-4) and end.use == pytest.approx(start.use, rel=1e-6)


def test_the_command_takes_a_recording(tmp_path) -> None:
    """Rates and the time of the sample, the figure beside it; --set is refused."""
    target_b().save(tmp_path / "run.nc")
    result = run_command("stability", "run.nc", folder=tmp_path)
    told, found = " ".join(result.stdout.split()), softhand.stability(target_b())
    assert 1.0 < found.time < 8.0 and f"the sample at t = {found.time:g} s" in told
    assert f"{found.held_growth:+.3g} 1/s (unstable)" in told and (tmp_path / "stability.png").is_file()
    refused = run_command("stability", "run.nc", "--set", "duration=1", folder=tmp_path)
    assert refused.returncode == 1 and "--set changes a scenario" in refused.stderr


# ----------------------------------------------------------------------------------------------- the scenario `hold`


def test_hold_dies_out_and_stays_within_a_micrometre() -> None:
    """Its fastest motion dies out; alone it does not move, and a push of 0.1 N is forgotten after 4 s."""
    assert softhand.stability(load_scenario("hold"), with_scan=False).held_growth < -1.5
    still = softhand.simulate("hold", duration=2.0)
    assert np.max(np.abs(still.object_position - still.object_position[0])) < 1e-9
    push = {"force": [0.1, 0.1, -0.1], "duration": 0.05}
    run = softhand.simulate("hold", overrides={"duration": 4.0, "push": [push]})
    away = np.linalg.norm(run.object_position - run.object_position[0], axis=1)
    assert away.max() > 1e-5 and away[-1] < 1e-6
    assert np.array_equal(run.object_position_desired[-1], load_scenario("hold").object.position)


@pytest.mark.parametrize("key", ["object_position", "internal_force", "duration", "orientation_path", "waypoints"])
def test_hold_has_no_target(key: str) -> None:
    """It keeps the start: a key that says otherwise is an error with the remedy."""
    values = {"duration": 1.0, "orientation_path": "euler", "waypoints": [{"duration": 1.0}]}
    with pytest.raises(softhand.ScenarioError, match=rf'reference\.{key}: "hold" keeps the start.*--set') as caught:
        load_scenario("hold", {f"reference.{key}": values.get(key, [0.0, 0.0, 0.1])})
    assert caught.value.key == f"reference.{key}"


# ------------------------------------------------------------------------------------- what friction with torsion takes


def test_the_use_of_the_limit_surface_explains_itself() -> None:
    """Target A: by the force alone no tip would slip, with torsion finger 2 would; where, when, by which limit."""
    for limit in ("exact", "ellipse"):
        run = softhand.simulate("target-a", overrides={"fingertip.limit": limit})
        summary = softhand.summarize(run)
        sample, finger = np.unravel_index(np.argmax(run.limit_surface_use), run.limit_surface_use.shape)
        use, where = (
            run.limit_surface_use[sample, finger],
            f"{run.labels['contact'][finger]}, t = {run.time[sample]:.3g} s",
        )
        assert summary.friction_use < 1.0 < use
        assert dict(summary.rows())["largest limit-surface use"] == f"{use:.3g}  ({where}; > 1 slips)"
        (note,) = (text for text in summary.warnings() if text.startswith("Limit-surface use"))
        assert f"{use:.3g} ({where})" in note and f"the {limit} limit" in note and "above 1 a real tip slips" in note
    assert not [text for text in softhand.summarize(target_hold()).warnings() if "use reached" in text]


@lru_cache(1)
def target_hold() -> Recording:
    """A run far from any limit."""
    return softhand.simulate("hold", duration=0.1)
