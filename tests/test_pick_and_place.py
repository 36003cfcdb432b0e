"""The scenario `grasp-and-lift`: start with open fingers, order of events, what is carried, what goes wrong."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hands import write_box

import softhand
from softhand.analysis.energy import energy_ledger
from softhand.assembly.build import build
from softhand.errors import GraspError, ScenarioError, SimulationStopped
from softhand.margins.stability import stability
from softhand.recording.events import find_events, phases_of
from softhand.recording.recording import Recording
from softhand.viewer.scene.recorded import RecordedScene

NAME = "grasp-and-lift"
WEIGHT = 0.2 * 9.81  # [N]
OVER = np.array([0.0, 0.0, -1.0])  # upwards in the base frame of a hanging hand


def _load(values: dict[str, Any] | None = None) -> softhand.Scenario:
    return softhand.load_scenario(NAME, values)


@pytest.fixture(scope="module")
def lift() -> Recording:
    """The whole run."""
    return softhand.simulate(_load())


def _during(recording: Recording, phase: str) -> slice:
    """Samples of a phase."""
    ((begin, end),) = [(begin, end) for name, begin, end in phases_of(recording) if name == phase]
    first, last = np.searchsorted(recording.time, [begin - 1e-9, end + 1e-9])
    return slice(int(first), int(last))


def _carried(recording: Recording) -> np.ndarray:
    """Upward force of the tips on the object [N], shape (samples,)."""
    return np.einsum("tiab,tib,a->t", recording.contact_rotation, recording.contact_force[..., :3], OVER)


def _corners(recording: Recording) -> np.ndarray:
    """Normal forces of the corners on the table [N], shape (samples, 8)."""
    of_corner = [k for k, name in enumerate(recording.labels["support"]) if "corner" in name]
    return recording.support_force[:, of_corner, 2]


# ------------------------------------------------------------------------------------------------------------ the start


def _accelerations(values: dict[str, Any]) -> np.ndarray:
    """Of joints and object at the start, under the torques that hold the fingers."""
    simulation = build(_load(values))
    seen = simulation.sample()
    simulation.plant.update(simulation.state.q, simulation.state.v, simulation.state.z)
    return simulation.plant.acceleration(seen.N_F.copy(), np.zeros(simulation.plant.world.model.nv))


def test_all_is_at_rest_at_the_start() -> None:
    """No acceleration, nothing stored, and the corners carry the weight to equal parts."""
    assert np.abs(_accelerations({})).max() < 1e-9
    simulation = build(_load())
    assert not simulation.state.z.any() and not simulation.state.v.any()
    simulation.sample()
    forces = simulation.plant.support_contacts["force"][:, 2]
    np.testing.assert_allclose(np.sort(forces)[-4:], WEIGHT / 4, rtol=1e-9)
    assert np.count_nonzero(forces) == 4


@pytest.mark.parametrize("offset", [(0.006, 0.0, 0.0), (-0.004, 0.005, 0.01)])
def test_a_box_with_its_weight_off_the_middle_stands_a_little_tilted(offset: tuple[float, ...], tmp_path: Any) -> None:
    """Still no acceleration; it leans towards its weight, by the softness of the corners."""
    urdf = str(write_box(tmp_path, centre_of_mass=offset))
    assert np.abs(_accelerations({"object.urdf": urdf})).max() < 1e-9
    start = build(_load({"object.urdf": urdf})).sample().q_O
    assert np.sign(np.round(start[4], 12)) == -np.sign(
        offset[0]
    )  # pitch about y: +x goes towards -z, away from the table
    assert 1e-6 < np.abs(start[3:5]).max() < 1e-3


def test_the_tips_stand_off_their_contact_points() -> None:
    """Each by the opening, along the outward normal."""
    simulation = build(_load())
    seen = simulation.sample()
    np.testing.assert_allclose(seen.deformation[:, 0], -0.015, atol=1e-9)
    points = np.array(_load().grasp.contact_points)
    np.testing.assert_allclose(seen.contact_point - seen.object_position, points, atol=1e-7)


@pytest.mark.parametrize(
    ("values", "error", "words"),
    [
        ({"table": None}, GraspError, "add a .table."),
        ({"table.normal": [0.0, 0.1, -1.0]}, GraspError, "5.71 deg off"),
        ({"object.position": [0.0, 0.01, 0.139]}, GraspError, "3 mm above"),
        ({"object.rpy": [0.1, 0.0, 0.0]}, GraspError, "does not stand"),
        ({"object.position": [0.0, 0.2, 0.142]}, GraspError, "finger_1_tip: the contact point is out of reach"),
        ({"grasp.opening": 0.4}, GraspError, "finger_1_tip: the start 400 mm before its face is out of reach"),
        ({"grasp.internal_force": [1.0, 1.0, 1.0]}, ScenarioError, "it must be 0"),
        ({"fingertip.contact": "rolling", "table": None}, ScenarioError, "coulomb"),
    ],
)
def test_a_start_that_cannot_be_is_refused(values: dict[str, Any], error: type[Exception], words: str) -> None:
    """The message says which finger or what of the table."""
    with pytest.raises(error, match=words):
        build(_load(values))


# -------------------------------------------------------------------------------------------------------------- the run


def test_the_order_of_events(lift: Recording) -> None:
    """All tips touch before the squeeze; the box leaves the table in the lift and comes back; then the tips let go."""
    assert lift.complete
    events = find_events(lift)
    phases = {name: (begin, end) for name, begin, end in phases_of(lift)}
    assert [event.text for event in events if event.kind == "phase"] == list(phases)
    times = {
        kind: [event.time for event in events if event.kind == kind and event.finger in lift.labels["contact"]]
        for kind in ("touch", "lift-off")
    }
    assert len(times["touch"]) == len(times["lift-off"]) == 3
    assert max(times["touch"]) < phases["squeeze"][0]
    assert min(times["lift-off"]) > phases["retreat"][0]
    assert next(event.kind for event in events if event.finger == "table") == "lift-off"
    on_table = _corners(lift).max(axis=1) > 0.0
    in_air = lift.time[~on_table]
    assert phases["take the weight"][0] < in_air[0] < phases["lift"][0] + 0.3
    assert phases["lower"][0] < in_air[-1] < phases["release"][0]


def test_it_is_lifted_turned_and_held(lift: Recording) -> None:
    """30 mm up and 10 deg about the vertical, to a tenth of a millimetre and of a degree when it has settled."""
    last = _during(lift, "regulate").stop - 1
    rise = (lift.object_position[last] - lift.object_position[0]) @ OVER
    assert rise == pytest.approx(0.030, abs=1e-4)
    np.testing.assert_allclose(np.degrees(lift.object_rpy[last]), [0.0, 0.0, 10.0], atol=0.1)


def test_the_desired_pose_is_what_the_controller_pursues(lift: Recording) -> None:
    """From the lift to the release the box stays within 8 mm of it, at the end of each of these ways within 0.1 mm."""
    for phase in ("lift", "regulate", "lower", "put down"):
        samples = _during(lift, phase)
        away = np.linalg.norm(lift.object_position[samples] - lift.object_position_desired[samples], axis=1)
        assert away.max() < 8e-3
    assert away[-1] < 1e-4


def test_the_fingers_carry_the_weight_while_they_hold_it(lift: Recording) -> None:
    """Their forces add up to m g when the box hangs still, to nothing before and after; the table has the rest."""
    held, table = _carried(lift), _corners(lift).sum(axis=1)
    last = _during(lift, "regulate").stop - 1
    assert held[last] == pytest.approx(WEIGHT, rel=5e-3)
    assert table[last] == 0.0
    squeezed = _during(lift, "squeeze").stop - 1
    for sample in (0, squeezed, _during(lift, "put down").stop - 1, len(lift) - 1):
        assert held[sample] + table[sample] == pytest.approx(WEIGHT, rel=0.01)
        assert abs(held[sample]) < 0.05 * WEIGHT


def test_friction_is_enough_and_nothing_slips_in_the_air(lift: Recording) -> None:
    """Use of the limit surface below 0.8 from the squeeze to the release; no slip there."""
    samples = slice(_during(lift, "take the weight").start, _during(lift, "put down").stop)
    assert lift.limit_surface_use[samples].max() < 0.8
    assert not lift.is_slipping[samples].any()


def test_it_stands_where_it_stood(lift: Recording) -> None:
    """Within 0.2 mm and 0.1 deg, at rest, with the tips gone."""
    np.testing.assert_allclose(lift.object_position[-1], lift.object_position[0], atol=2e-4)
    np.testing.assert_allclose(np.degrees(lift.object_rpy[-1] - lift.object_rpy[0]), 0.0, atol=0.1)
    assert np.abs(lift.object_twist[-1]).max() < 1e-3
    assert lift.deformation[-1, :, 0].max() < -0.010


@pytest.mark.parametrize("duration", [1.9, pytest.param(6.0, marks=pytest.mark.slow)])
def test_the_energy_ledger_closes(duration: float) -> None:
    """Past the lift, or to the end: residual below 1e-4 of the largest account, a third or less with half the step."""
    law = {"fingertip.law": "conservative", "fingertip.k_theta": None, "controller.period": 0.001, "duration": duration}
    left = []
    for step in (1e-3, 5e-4):
        simulation = build(_load({**law, "stepper.step": step, "control_period": step}))
        recording = simulation.run()
        ledger = energy_ledger(recording, simulation.plant, range(0, len(recording), len(recording) // 12))
        left.append(np.abs(ledger.residual).max())
        assert left[-1] < 1e-4 * ledger.exchanged
    assert left[1] < left[0] / 3.0


# --------------------------------------------------------------------------------------------------------- how it looks


def test_the_picture_stands_with_gravity_downwards(lift: Recording) -> None:
    """The world is turned so that gravity points to -z: of the hanging hand, of a slanting one, and not of others."""
    for gravity in ([0.0, 0.0, 9.81], [3.0, -2.0, 4.0], [1.0, 0.0, -9.0]):
        scenario = _load({"gravity": gravity}).to_toml()
        upright = RecordedScene(replace(lift, scenario=scenario)).bounds.upright
        np.testing.assert_allclose(upright @ gravity, [0.0, 0.0, -np.linalg.norm(gravity)], atol=1e-12)
        np.testing.assert_allclose(upright @ upright.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(upright) == pytest.approx(1.0)
    ordinary = replace(lift, scenario=softhand.load_scenario("target-a").to_toml())
    np.testing.assert_array_equal(RecordedScene(ordinary).bounds.upright, np.eye(3))


def test_the_figure_names_the_phases(lift: Recording) -> None:
    """In a line below the title, with their numbers at the top of each panel; without phases there is no line."""
    figure = softhand.draw_run(lift)
    lines = [text.get_text() for text in figure.texts]
    assert any(line.startswith("phases: 1 close, 2 squeeze, 3 take the weight, 4 lift") for line in lines)
    assert [text.get_text() for text in figure.axes[0].texts] == [str(k) for k in range(1, 10)]
    without = softhand.draw_run(replace(lift, attributes={}))
    assert not any(text.get_text().startswith("phases") for text in without.texts)


def test_the_summary_has_no_false_alarm(lift: Recording) -> None:
    """Open tips do not press, and tips that let go slip at the limit: neither is a fiction."""
    assert softhand.summarize(lift).warnings() == []


# ------------------------------------------------------------------------------------------------------ what goes wrong


def _stopped(values: dict[str, Any]) -> SimulationStopped:
    with pytest.raises(SimulationStopped) as caught:
        softhand.simulate(_load(values))
    return caught.value


@pytest.mark.parametrize(("friction", "words"), [(0.1, "finger_3_tip"), (0.2, "the object slipped out")])
def test_with_too_little_friction_the_run_ends_with_the_reason_by_name(friction: float, words: str) -> None:
    """The tips slip in the squeeze; the recording is kept, and its events say which tip and why it ended."""
    stop = _stopped({"fingertip.friction": friction})
    recording: Recording = stop.recording  # type: ignore[attr-defined]
    events = find_events(recording)
    assert words in str(stop)
    assert events[-1].kind == "stopped" and events[-1].text == recording.reason
    assert {event.finger for event in events if "slip" in event.kind} >= {"finger_1_tip", "finger_2_tip"}
    assert np.isfinite(recording.object_position).all()


def test_a_finger_that_does_not_touch_is_named() -> None:
    """A box that is thinner than its contact points say would do; here the closing stops 2 mm before the face."""
    ways = [dict(row) for row in _load().model_dump(exclude_none=True)["reference"]["waypoints"]]
    ways[0]["opening"] = 0.002
    stop = _stopped({"reference.waypoints": ways})
    assert "finger_1_tip does not reach the object" in str(stop) and "2 mm off" in str(stop)
    assert stop.time > 0.8  # type: ignore[attr-defined]


def test_letting_go_in_the_air_is_refused() -> None:
    """The fingers still carry the weight: the run ends before they open."""
    ways = [dict(row) for row in _load().model_dump(exclude_none=True)["reference"]["waypoints"]]
    without = [row for row in ways if row["phase"] not in ("lower", "put down")]
    assert "does not stand" in str(_stopped({"reference.waypoints": without}))


def test_there_is_no_linear_loop_about_open_fingers() -> None:
    """`softhand stability` says so."""
    with pytest.raises(GraspError, match="start open"):
        stability(_load({"controller": {"name": "regulation"}}))


def test_in_a_grasp_it_is_regulation() -> None:
    """On target A, where the run starts in the grasp, its torques are those of (59)."""
    runs = [
        softhand.simulate(softhand.load_scenario("target-a", {"controller": {"name": name}, "duration": 0.1}))
        for name in ("regulation", "pick-and-place")
    ]
    np.testing.assert_array_equal(runs[0].joint_torque, runs[1].joint_torque)


@pytest.mark.parametrize(("name", "height"), [("ball", 0.030), ("can", 0.045), ("prism", 0.045)])
def test_other_shapes_are_lifted_as_well(name: str, height: float) -> None:
    """A ball stands on its own radius, a can on its rim; both are back where they stood."""
    other = softhand.load_scenario(name)
    values = {
        "object.urdf": other.object.urdf,
        "object.position": [0.0, 0.010, 0.142],
        "table.height": -(0.142 + height),
        "grasp.contact_points": other.grasp.contact_points,
    }
    assert np.abs(_accelerations(values)).max() < 1e-9
    run = softhand.simulate(_load(values))
    risen = (run.object_position - run.object_position[0]) @ OVER
    assert run.complete and 0.029 < risen.max() < 0.031
    back = 2e-4 if name == "ball" else 1e-4  # a ball is free to roll once the fingers have left it
    np.testing.assert_allclose(run.object_position[-1], run.object_position[0], atol=back)
    assert run.contact_force[-1, :, 2].max() == 0.0
