"""The scenario `arm-pick-and-place`: where the box ends, what happens on the way, and the whole of it turned."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hands import ARM_IN_THE_AIR
from numpy.testing import assert_allclose
from numpy.typing import NDArray

import softhand
from softhand.analysis.energy import energy_ledger
from softhand.assembly.build import build
from softhand.assembly.collisions import collisions
from softhand.assembly.resolve import resolve
from softhand.batch.asked import Asked
from softhand.batch.run import CompiledRun
from softhand.numerics.spatial import rotation_of
from softhand.recording.events import find_events, phases_of
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, load_scenario
from softhand.simulation.keep import Keep

Array = NDArray[np.float64]

NAME = "arm-pick-and-place"
WEIGHT = 0.2 * 9.81  # [N]
TARGET = np.array([0.34, -0.20, 0.030])  # [m]


def scenario(**values: Any) -> Scenario:
    """The scenario that ships."""
    return load_scenario(NAME, values)


@pytest.fixture(scope="module")
def run() -> Recording:
    """The whole run."""
    return softhand.simulate(scenario())


def during(run: Recording, first: str, last: str) -> slice:
    """Samples from the begin of one phase to the end of another."""
    times = {name: (begin, end) for name, begin, end in phases_of(run)}
    begin, end = np.searchsorted(run.time, [times[first][0] - 1e-9, times[last][1] + 1e-9])
    return slice(int(begin), int(end))


def test_the_box_ends_where_it_should(run: Recording) -> None:
    """Within 0.2 mm and 0.1 deg, on the table, at rest, with the hand 100 mm above."""
    assert run.complete
    assert_allclose(run.object_position[-1], TARGET, rtol=0.0, atol=2e-4)
    assert_allclose(np.degrees(run.object_rpy[-1]), [0.0, 0.0, -45.0], rtol=0.0, atol=0.1)
    assert np.abs(run.object_twist[-1]).max() < 1e-6
    corners = [k for k, name in enumerate(run.labels["support"]) if "corner" in name]
    assert run.support_force[-1, corners, 2].sum() == pytest.approx(WEIGHT, rel=1e-6)
    assert np.count_nonzero(run.support_force[-1, corners, 2]) == 4
    assert run.contact_force[-1, :, 2].max() == 0.0
    assert run.tip_position[-1, :, 2].min() > 0.1


def test_it_is_carried_over_the_table(run: Recording) -> None:
    """80 mm above it, by the fingers alone, within 2 mm of where it is asked for."""
    carried = during(run, "carry", "carry")
    assert run.object_position[carried, 2].min() > 0.109
    assert run.support_force[carried, :, 2].max() == 0.0
    away = np.linalg.norm(run.object_position - run.object_position_desired, axis=1)
    assert away[during(run, "lift", "put down")].max() < 2e-3


def test_nothing_slips_and_nothing_is_at_its_limit(run: Recording) -> None:
    """From the squeeze to the release; efforts of arm and fingers are far from used up."""
    held = during(run, "squeeze", "put down")
    assert not run.is_slipping[held].any() and run.limit_surface_use[held].max() < 0.7
    assert not run.torque_limited.any()
    assert np.all(np.abs(run.joint_torque).max(axis=0) < 0.5 * np.array([150, 150, 80, 30, 30, 15, *[2.0] * 9]))
    assert softhand.summarize(run).warnings() == []


def test_nothing_collides(run: Recording) -> None:
    """Neither by the shapes for collisions, which the arm has, nor by those that are drawn, as of the fingers."""
    for shapes in ("collision", "visual"):
        found = collisions(run, every=0.05, shapes=shapes)
        assert not found.found and found.clearance > 5e-3


def test_what_happens_is_told_in_its_order(run: Recording) -> None:
    """All tips touch before the squeeze, and let go after the release, in which they may slip."""
    phases = [event.text for event in find_events(run) if event.kind == "phase"]
    assert phases == [
        "approach", "close", "squeeze", "take the weight", "lift", "carry", "lower", "put down", "release", "open",
        "retreat",
    ]  # fmt: skip
    assert run.contact_force[during(run, "squeeze", "put down"), :, 2].min() > 0.1
    assert run.contact_force[during(run, "approach", "approach"), :, 2].max() == 0.0
    assert run.contact_force[during(run, "retreat", "retreat"), :, 2].max() == 0.0


def test_the_palm_keeps_its_place_to_the_box_as_it_is_desired(run: Recording) -> None:
    """The finger joints, which hold the box to the palm, stay within 0.03 rad of those at the end of the squeeze."""
    held = during(run, "take the weight", "lower")
    assert np.abs(run.joint_position[held, 6:] - run.joint_position[held.start, 6:]).max() < 0.03
    assert np.ptp(run.joint_position[held, 0]) > 0.5


# ------------------------------------------------------------------------------------------------------ other runs


def compiled(task: Scenario) -> dict[str, Array]:
    """Some variables of a run in the compiled loop, every 50 ms."""
    keep = Keep.of(("object_position", "object_rpy", "joint_position", "contact_force"), 0.05, task.control_period)
    result = CompiledRun(resolve(task), keep, Asked()).go(lambda: False)
    assert result.outcome.reason == "finished", result.outcome.message
    return result.variables


def turned(task: Scenario, angle: float) -> Scenario:
    """All of it about the vertical through the foot of the arm."""
    Q = rotation_of((0.0, 0.0, angle))
    ways = [dict(way) for way in task.model_dump(exclude_none=True)["reference"]["waypoints"]]
    for way in ways:
        for key in ("object_position", "standoff"):
            if key in way:
                way[key] = (Q @ way[key]).tolist()
        if "object_rpy" in way:
            way["object_rpy"] = [*way["object_rpy"][:2], way["object_rpy"][2] + angle]
    return task.with_values({
        "hand.rpy": [0.0, 0.0, angle], "object.position": (Q @ task.object.position).tolist(),
        "object.rpy": [0.0, 0.0, angle], "grasp.standoff": (Q @ task.grasp.standoff).tolist(),
        "reference.waypoints": ways,
    })  # fmt: skip


@pytest.mark.slow
def test_the_whole_turned_about_the_vertical_is_the_same() -> None:
    """Joints and forces of arm and fingers, with an approach from the side; poses of the box are turned."""
    here = scenario(**{"grasp.standoff": [0.03, -0.02, 0.08]})
    angle = 0.7
    one, other = compiled(here), compiled(turned(here, angle))
    assert_allclose(other["joint_position"], one["joint_position"], rtol=0.0, atol=1e-7)
    assert_allclose(other["contact_force"], one["contact_force"], rtol=0.0, atol=1e-5)
    Q = rotation_of((0.0, 0.0, angle))
    assert_allclose(other["object_position"], one["object_position"] @ Q.T, rtol=0.0, atol=1e-8)
    assert np.ptp(one["object_position"], axis=0).max() > 0.3


def test_the_energy_ledger_closes() -> None:
    """What the drives of arm and fingers give is found in what moves; of what is missing a third with half the step."""
    ways = [
        {"duration": 0.15, "object_position": [0.37, 0.10, 0.14], "object_rpy": [0.1, -0.1, 0.2]},
    ]
    left = []
    for step in (1e-3, 5e-4):
        simulation = build(scenario(**{
            **ARM_IN_THE_AIR, "duration": 0.2, "stepper.step": step, "control_period": step,
            "controller.period": 1e-3, "fingertip.law": "conservative", "fingertip.k_theta": None,
            "reference": {"kind": "waypoints", "waypoints": ways},
        }))  # fmt: skip
        recording = simulation.run()
        ledger = energy_ledger(recording, simulation.plant, range(0, len(recording), len(recording) // 10))
        left.append(np.abs(ledger.residual).max())
        assert ledger.exchanged > 0.1 and left[-1] < 1e-4 * ledger.exchanged
    assert left[1] < left[0] / 3.0


def test_a_run_goes_on_from_where_it_was_cut() -> None:
    """What the law remembers of palm and feet is in the state: the rest of a run is the same to the last bit."""
    simulation = build(scenario(duration=0.06))
    for _ in range(30):
        simulation.sample()
        simulation.step()
    state = simulation.save()
    rest = simulation.run()
    other = build(scenario(duration=0.06))
    other.reset(state)
    again = other.run()
    for name in ("joint_position", "joint_torque", "tip_position"):
        np.testing.assert_array_equal(rest[name][-1], again[name][-1])


def ways(**changes: dict[str, Any] | None) -> list[dict[str, Any]]:
    """The waypoints with some of a phase changed, or without it."""
    rows = [dict(row) for row in scenario().model_dump(exclude_none=True)["reference"]["waypoints"]]
    named = [(row, changes.get(row["phase"].replace(" ", "_"), {})) for row in rows]
    return [{**row, **change} for row, change in named if change is not None]


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (ways(close={"opening": 0.002}), "finger_1_tip does not reach the object"),
        (ways(lower=None, put_down=None), "the object does not stand"),
        (ways(carry={"duration": 0.15}), "the object slipped out"),
    ],
)
def test_what_goes_wrong_is_told(rows: list[dict[str, Any]], words: str) -> None:
    """Tips that stop before the box, a release in the air, a way that is too fast: by the name of the controller."""
    task = scenario(**{"reference.waypoints": rows})
    result = CompiledRun(resolve(task), Keep.of(("object_position",), 0.05, task.control_period), Asked()).go(
        lambda: False
    )
    assert f"ArmPickAndPlace' gave up at t = {result.outcome.time:g}" in result.outcome.message
    assert words in result.outcome.message


@pytest.mark.long
def test_it_holds_the_box_for_ten_minutes() -> None:
    """600 s in the air: the box does not drift, the arm stays, nothing slips."""
    task = scenario(**ARM_IN_THE_AIR, duration=600.0)
    keep = Keep.of(("object_position", "object_rpy", "joint_position", "is_slipping"), 1.0, task.control_period)
    result = CompiledRun(resolve(task), keep, Asked()).go(lambda: False)
    assert result.outcome.reason == "finished"
    seen = result.variables
    assert np.abs(seen["object_position"][5:] - seen["object_position"][5]).max() < 1e-5
    assert np.abs(seen["joint_position"][5:] - seen["joint_position"][5]).max() < 1e-3
    assert not seen["is_slipping"].any()
