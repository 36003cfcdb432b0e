"""The margin to slip along a recording: its numbers, its forecast, its warnings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from commands import run_command
from hands import Array
from numpy.testing import assert_allclose

import softhand
from softhand.recording.recording import Recording


def recording(use: Array, pressing: float = 1.0, step: float = 0.01) -> Recording:
    """A run in which the tips use so much of their limit surfaces."""
    base = softhand.simulate("hold", duration=0.002)
    nc = base.limit_surface_use.shape[1]
    use = np.broadcast_to(np.asarray(use)[:, None], (len(use), nc)).copy()
    force = np.zeros((len(use), nc, 4))
    force[:, :, 2] = pressing
    time = step * np.arange(len(use))
    arrays = {"time": time, "limit_surface_use": use, "contact_force": force}
    return Recording(
        arrays, {"contact": base.labels["contact"]}, base.scenario, base.version, True, "", float(time[-1])
    )


def test_margin_and_factor_are_of_the_limit_surface() -> None:
    """1 - use, and the factor 1 / use on the friction load."""
    found = softhand.slip_margin(recording(np.array([0.2, 0.5, 0.8])))
    assert_allclose(found.least, [0.8, 0.5, 0.2])
    assert_allclose(found.factor, [5.0, 2.0, 1.25])


def test_a_margin_that_falls_evenly_is_foreseen_exactly() -> None:
    """use = 0.2 + 0.5 t is 1 at t = 1.6 s, whenever one asks; a margin that rises lasts."""
    time = 0.01 * np.arange(100)
    found = softhand.slip_margin(recording(0.2 + 0.5 * time), window=0.1)
    assert_allclose((found.time + found.hold_time)[5:], 1.6, atol=1e-9)
    assert np.all(np.isinf(softhand.slip_margin(recording(0.9 - 0.5 * time)).hold_time[5:]))


def test_each_tip_warns_once_when_it_goes_below() -> None:
    """At the first sample below, again after it was above for a while."""
    use = np.concatenate([np.full(10, 0.5), np.full(10, 0.85), np.full(10, 0.5), np.full(10, 0.9)])
    found = softhand.slip_margin(recording(use), warning=0.2)
    assert [round(event.time, 6) for event in found.events] == [0.1] * 3 + [0.3] * 3
    assert "has 15 % of its limit surface left, below 20 %" in found.events[0].text
    assert not softhand.slip_margin(recording(use), warning=0.05).events


def test_a_tip_off_the_object_has_no_margin() -> None:
    """NaN, and no warning."""
    found = softhand.slip_margin(recording(np.full(5, 0.9), pressing=0.0))
    assert np.all(np.isnan(found.least)) and not found.events
    assert found.rows() == [("least margin", "no tip touches")]


def test_a_run_that_slips_was_warned_of_before() -> None:
    """target-a with tips that can slip: the first slip of `is_slipping` is where the margin is used up."""
    run = softhand.simulate(softhand.load_scenario("target-a", {"fingertip.contact": "coulomb", "duration": 0.8}))
    found = softhand.slip_margin(run)
    first = run.time[np.argmax(np.any(run.is_slipping > 0, axis=1))]
    gone = found.time[np.argmax(found.least <= 1e-9)]
    assert abs(gone - first) < 0.003
    assert found.events[0].time < first - 0.1
    k = int(np.argmin(np.abs(found.time - (first - 0.1))))
    assert 0.02 < found.hold_time[k] < 0.4  # foreseen 0.1 s before


def test_mistakes_are_told(tmp_path: Path) -> None:
    """A warning above 1; a run without what is needed."""
    run = recording(np.array([0.2, 0.3]))
    with pytest.raises(softhand.ScenarioError, match="warning: got 2"):
        softhand.slip_margin(run, warning=2.0)
    with pytest.raises(softhand.ScenarioError, match="window: got 0"):
        softhand.slip_margin(run, window=0.0)
    bare = Recording({"time": np.arange(2.0)}, run.labels, run.scenario, run.version, True, "", 1.0)
    with pytest.raises(softhand.RecordingError, match="lacks limit_surface_use and contact_force"):
        softhand.slip_margin(bare)


def test_the_command_draws_the_margin_of_a_run(tmp_path: Path) -> None:
    """Table, figure beside the recording, JSON of both."""
    run_command("simulate", "hold", "--duration", "0.05", "--out", "run", "-q", folder=tmp_path)
    shown = run_command("squeeze", "run", "--warning", "0.4", folder=tmp_path)
    assert shown.returncode == 0, shown.stderr
    assert "margin to slip" in shown.stdout and "slip warning" in shown.stdout
    assert (tmp_path / "run" / "squeeze.png").is_file()
