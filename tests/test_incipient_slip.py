"""Incipient slip along a recording: which share of each contact slips, where half does, what it may not depend on."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import softhand
from softhand import QuadraticCost, Recording, RecordingError, ScenarioError, incipient_slip, load_scenario, simulate
from softhand.derivatives.costs import costs_of
from softhand.recording.events import find_events

KNOCKED = {
    "duration": 0.04,
    "fingertip.friction": 0.4,
    "push": [{"force": [0.0, 0.0, -6.0], "start": 0.01, "duration": 0.02}],
}
"""A push that friction does not hold."""


@pytest.fixture(scope="module")
def run() -> Recording:
    return simulate("target-a", overrides={"fingertip.contact": "coulomb", "duration": 0.2, "fingertip.friction": 0.6})


@pytest.fixture(scope="module")
def found(run: Recording) -> Recording:
    return incipient_slip(run)


def test_every_sample_of_every_contact_has_a_share(run: Recording, found: Recording) -> None:
    """From 0 to 1; the loss grows, but for the second order of a step, and nothing else changes."""
    share, loss = found.slipped_share, found.microslip_loss
    assert share.shape == loss.shape == run.friction_use.shape
    assert np.all((share >= 0.0) & (share <= 1.0)) and 0.0 < share.max() < 1.0
    assert np.all(np.diff(loss, axis=0) > -1e-9) and np.all(loss[-1] > 0.0) and np.all(loss[-1] < 1e-3)
    for name, array in run.variables.items():
        assert found[name] is array
    assert "slipped_share" not in run.variables


def test_more_friction_slips_less(found: Recording, run: Recording) -> None:
    """The same loads at mu 0.9 in place of 0.6."""
    rougher = replace(run, scenario=run.scenario.replace("friction = 0.6", "friction = 0.9"))
    assert np.all(incipient_slip(rougher).slipped_share <= found.slipped_share + 1e-12)


def test_a_tip_that_slips_as_a_whole_has_the_share_one() -> None:
    slipping = simulate("target-a", overrides={"fingertip.contact": "coulomb", **KNOCKED})
    found = incipient_slip(slipping)
    slips = (slipping.is_slipping != 0) & (slipping.contact_force[..., 2] > 0.0)
    assert slips.any() and np.all(found.slipped_share[slips] == 1.0)


def test_a_tip_that_may_not_slip_has_it_where_it_asks_for_too_much() -> None:
    """`rolling` at a mu that would not hold."""
    rolling = simulate("target-a", overrides=KNOCKED)
    found = incipient_slip(rolling)
    beyond = rolling.limit_surface_use > 1.01
    assert beyond.any() and np.all(found.slipped_share[beyond] == 1.0)


def test_axes_that_turn_about_the_normal_change_nothing(run: Recording, found: Recording) -> None:
    """The same forces told in contact frames that spin: those of the paper's law do, as Theta goes on."""
    angle = np.linspace(0.0, 2.0, len(run))[:, None]
    c, s = np.cos(angle), np.sin(angle)
    turn = np.zeros((len(run), 1, 3, 3))
    turn[..., 0, 0], turn[..., 0, 1], turn[..., 1, 0], turn[..., 1, 1], turn[..., 2, 2] = c, -s, s, c, 1.0
    force = run.contact_force.copy()
    force[..., :3] = (np.swapaxes(turn, -1, -2) @ run.contact_force[..., :3, None])[..., 0]
    spun = {**run.variables, "contact_rotation": run.contact_rotation @ turn, "contact_force": force}
    again = incipient_slip(replace(run, variables=spun))
    assert again.slipped_share == pytest.approx(found.slipped_share, abs=1e-9)
    assert again.microslip_loss == pytest.approx(found.microslip_loss, rel=1e-5)


def test_it_is_kept_in_files_with_units(found: Recording, tmp_path: Path) -> None:
    found.save(tmp_path / "run.nc")
    loaded = softhand.load_recording(tmp_path / "run.nc")
    assert np.array_equal(loaded.slipped_share, found.slipped_share)
    assert loaded.units("slipped_share") == ("1",) and loaded.units("microslip_loss") == ("J",)


def shared(shares: Any, slipping: Any = 0.0) -> Recording:
    """A contact whose share goes so."""
    n = len(shares)
    variables = {
        "time": 1e-3 * np.arange(n),
        "slipped_share": np.array(shares, dtype=float)[:, None],
        "is_slipping": np.broadcast_to(np.array(slipping, dtype=float), n)[:, None],
        "limit_surface_use": np.full((n, 1), 0.7),
    }
    return Recording(variables, {"contact": ("thumb",)}, "", "0", True, "", 1e-3 * (n - 1))


def test_half_of_a_contact_is_an_event() -> None:
    """Once, until it sticks again by more than half; not at the start, and not as the tip slips as a whole."""
    one = find_events(shared([0.1, 0.3, 0.52, 0.48, 0.6, 0.3, 0.1, 0.7]))
    assert [(event.time, event.kind, event.finger) for event in one] == [
        (0.002, "incipient slip", "thumb"),
        (0.007, "incipient slip", "thumb"),
    ]
    assert one[0].text == "52 % of the contact slips, at 0.7 of the limit"
    assert find_events(shared([0.9, 0.6, 0.45, 0.7])) == []
    assert find_events(shared([0.1, 1.0, 1.0], [0, 1, 1])) == []


def test_the_events_of_the_recording_are_kept(found: Recording) -> None:
    kept = json.loads(str(found.attributes["events"]))
    assert [event["kind"] for event in kept] == [event.kind for event in find_events(found)]


def test_no_run_records_it() -> None:
    """A scenario, a rollout, a cost and a linear model that ask for it are told where it comes from."""
    with pytest.raises(ScenarioError, match=r"found in a recording by softhand\.incipient_slip"):
        load_scenario("target-a", {"record.variables": ["slipped_share"]})
    with pytest.raises(ScenarioError, match=r"found in a recording by softhand\.incipient_slip"):
        softhand.rollout("target-a", {"mass": [0.2]}, variables=("microslip_loss",))
    with pytest.raises(ScenarioError, match=r"choose limit_surface_use"):
        costs_of(QuadraticCost("slipped_share"))
    with pytest.raises(ScenarioError, match=r"ask for limit_surface_use"):
        softhand.linearize("target-a", outputs=("slipped_share",))


def test_a_recording_without_a_scenario_is_refused(run: Recording) -> None:
    with pytest.raises(RecordingError, match="scenario"):
        incipient_slip(replace(run, scenario="= 1"))
    lacking = {name: array for name, array in run.variables.items() if name != "contact_rotation"}
    with pytest.raises(RecordingError, match="lacks contact_rotation"):
        incipient_slip(replace(run, variables=lacking))


def test_static_friction_holds_the_columns() -> None:
    """Until it slips a tip holds by the larger coefficient, on a face with its own mu by its ratio."""
    from softhand.analysis.incipient_slip import _friction

    plant = softhand.build(
        load_scenario(
            "target-a",
            {
                "fingertip.contact": "coulomb",
                "fingertip.friction": 0.5,
                "fingertip.static_friction": 0.6,
                "object.face_friction": {"-x": 0.4},
            },
        )
    ).plant
    tip, shape = plant.fingertips[0], plant.world.shape
    assert _friction(tip, shape, np.array([0.9, 0.1, 0.1])) == pytest.approx(0.6)
    assert _friction(tip, shape, np.array([-0.9, 0.1, 0.1])) == pytest.approx(0.4 * 1.2)
    assert math.isfinite(_friction(tip, shape, np.array([0.0, 0.0, 1.0])))
