"""Events: from arrays with known answers, and of real runs."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from softhand import Recording, build, load_scenario, simulate
from softhand.controllers.controller import Controller
from softhand.numerics.spatial import rotation_of
from softhand.recording.events import Event, find_events

N = 200
TIME = np.arange(N) * 1e-3


def recording(reason: str = "", **arrays: Any) -> Recording:
    """0.2 s of two pressing tips and one joint, but for the arrays given."""
    force = np.tile([1.0, 0.0, 4.0, 0.002], (N, 2, 1))
    still: dict[str, Any] = {
        "time": TIME,
        "contact_force": force,
        "contact_angles": np.tile([0.1, 1.4], (N, 2, 1)),
        "deformation": np.tile([1e-3, 0.0, 0.0, 0.0], (N, 2, 1)),
        "joint_torque": np.full((N, 1), 0.3),
        "torque_limited": np.zeros((N, 1)),
        "friction_use": np.full((N, 2), 0.9),
        "limit_surface_use": np.ones((N, 2)),
        "is_slipping": np.zeros((N, 2)),
    }
    still |= {name: np.zeros((N, 2)) for name in ("slip_travel", "slip_twist", "slip_loss")}
    labels = {"joint": ("knuckle",), "contact": ("left", "right")}
    return Recording({**still, **arrays}, labels, "", "0", not reason, reason, float(TIME[-1]))


def test_nothing_happens_at_rest() -> None:
    assert find_events(recording()) == []


def test_lift_off_and_touch() -> None:
    """The first sample without, and the first with, a normal force."""
    force = recording().contact_force.copy()
    force[50:80, 1] = 0.0
    assert find_events(recording(contact_force=force)) == [
        Event(0.050, "lift-off", "right", "f_z was 4 N the sample before"),
        Event(0.080, "touch", "right", "f_z = 4 N"),
    ]


def test_noise_is_no_event_and_no_number() -> None:
    """A force of 1e-23 N touches nothing; what a slip did not lose is 0."""
    force, slipping, loss = recording().contact_force.copy(), np.zeros((N, 2)), np.zeros((N, 2))
    force[50:80, 1] = 0.0
    force[60, 1, 2] = force[20, 0, 3] = 1e-23
    slipping[20:40, 0] = 1
    loss[30:, 0] = 1e-23
    found = find_events(recording(contact_force=force, is_slipping=slipping, slip_loss=loss))
    assert [event.kind for event in found] == ["slip", "slip ends", "lift-off", "touch"]
    assert found[0].text.endswith("tau = 0 N mm") and found[1].text == "0 mm, 0 deg, 0 mJ"


@pytest.mark.parametrize(("use", "kind"), [(0.75, "slip"), (0.65, "torsional slip")])
def test_slip_has_figures_and_bridges_short_gaps(use: float, kind: str) -> None:
    """A gap of 5 ms parts nothing; torsion has the larger share below a friction use of 0.707."""
    slipping, travel = np.zeros((N, 2)), np.zeros((N, 2))
    slipping[20:40, 0] = slipping[44:60, 0] = 1
    slipping[100:110, 0] = 1
    travel[:, 0] = 1e-3 * np.cumsum(slipping[:, 0]) / 36
    found = find_events(recording(is_slipping=slipping, slip_travel=travel, friction_use=np.full((N, 2), use)))
    assert [(event.time, event.kind) for event in found] == [
        (0.020, kind), (0.060, "slip ends"), (0.100, kind), (0.110, "slip ends"),
    ]  # fmt: skip
    assert found[0].text == "f_t = 1 N, f_z = 4 N, tau = 2 N mm" and found[0].finger == "left"
    assert found[1].text == "1 mm, 0 deg, 0 mJ"


def test_slip_that_ends_within_the_limit_is_judged_by_the_shares() -> None:
    """A light touch: use 0.03, all of it tangential, is no torsional slip; use 0.03 with 0.01 of it tangential is."""
    for tangential, kind in ((0.03, "slip"), (0.01, "torsional slip")):
        uses = {"limit_surface_use": np.full((N, 2), 0.03), "friction_use": np.full((N, 2), tangential)}
        found = find_events(recording(is_slipping=np.ones((N, 2)), **uses))
        assert [event.kind for event in found] == [kind, kind]


def test_slip_at_the_end_does_not_end() -> None:
    slipping = np.zeros((N, 2))
    slipping[150:, 1] = 1
    assert [event.kind for event in find_events(recording(is_slipping=slipping))] == ["slip"]


def test_apex_torque_limit_and_stop() -> None:
    """Theta turns over by half a turn; a joint is cut for three samples; the run stops."""
    angles, limited = recording().contact_angles.copy(), np.zeros((N, 1))
    angles[90:, 0, 0] -= np.pi
    limited[30:33] = 1
    found = find_events(recording("flat", contact_angles=angles, torque_limited=limited))
    assert found == [
        Event(0.030, "torque limit", "knuckle", "0.3 N m, 3 samples"),
        Event(0.090, "apex", "left", "Phi = 80.2 deg"),
        Event(0.199, "stopped", "", "flat"),
    ]


def rolled_over(features: dict[int, int], over: int) -> Recording:
    """The left tip on the face -x until a sample, then on -y, with other features at some samples."""
    feature, turned = np.ones((N, 2)), np.tile(np.eye(3)[:, [1, 2, 0]], (N, 2, 1, 1))  # z_C = x
    for sample, number in features.items():
        feature[sample, 0] = number
    turned[over:, 0] = np.eye(3)[:, [2, 0, 1]]  # z_C = y
    rpy = np.linspace((0.1, -0.2, 0.3), (0.5, 0.6, -0.7), N)  # the object turns, the normal in it does not
    turned = np.einsum("kij,kcjl->kcil", np.array([rotation_of(angles) for angles in rpy]), turned)
    return recording(contact_feature=feature, contact_rotation=turned, object_rpy=rpy)


@pytest.mark.parametrize(
    ("features", "over", "expected"),
    [
        ({k: 2 for k in range(50, 54)}, 54, (0.050, "edge", "90 deg in 5 ms, then on a face")),
        ({50: 2, 51: 3, 52: 2}, 52, (0.050, "vertex", "90 deg in 4 ms, then on a face")),
        ({}, 70, (0.070, "edge", "90 deg in 1 ms, then on a face")),
        ({k: 2 for k in range(190, N)}, N, (0.190, "edge", "0 deg in 10 ms, then still there")),
    ],
    ids=["edge", "vertex", "between samples", "to the end"],
)
def test_rolling_off_a_face(features: dict[int, int], over: int, expected: tuple[float, str, str]) -> None:
    """One event for the way over an edge, at its first sample, with how far the normal turns."""
    (event,) = find_events(rolled_over(features, over))
    assert (event.time, event.kind, event.finger) == (*expected[:2], "left")
    assert event.text == f"f_z = 4 N, the normal turns by {expected[2]}"


def test_no_edge_in_the_air() -> None:
    """A tip that does not press may pass any edge."""
    flying = rolled_over({50: 2}, 51)
    deformation = flying.deformation.copy()
    deformation[:, 0, 0] = -1e-3
    arrays = {**flying.variables, "deformation": deformation, "contact_force": 0.0 * flying.contact_force}
    assert find_events(recording(**arrays)) == []


def test_a_joint_beyond_its_stop() -> None:
    """Named with its angle and the farthest one, either side."""
    angle, limited = np.zeros((N, 1)), np.zeros((N, 1))
    angle[30:40, 0], limited[30:40, 0] = np.linspace(-1.1, -1.2, 10), -1
    assert find_events(recording(joint_position=angle, joint_limited=limited)) == [
        Event(0.030, "joint limit", "knuckle", "at -1.1 rad beyond the lower limit, at most -1.2 rad")
    ]


def test_a_run_past_a_joint_limit_says_so() -> None:
    """A hand that is let go falls through its stops, which a run does not hold."""

    class Limp(Controller):
        def torque(self, observation: Any, memory: Any) -> Any:
            return np.zeros_like(observation.joint_position), memory

    run = build(load_scenario("target-a", {"fingertip.contact": "coulomb", "duration": 0.17}), Limp()).run()
    found = [event for event in find_events(run) if event.kind == "joint limit"]
    assert found
    for event in found:
        joint, sample = run.labels["joint"].index(event.finger), round(event.time / 1e-3)
        assert run.joint_limited[sample, joint] != 0 and run.joint_limited[sample - 1, joint] == 0
        assert event.text.startswith(f"at {run.joint_position[sample, joint]:.4g} rad beyond")


def test_a_turn_of_theta_over_pi_is_no_apex() -> None:
    angles = recording().contact_angles.copy()
    angles[:90, 0, 0], angles[90:, 0, 0] = np.pi - 0.01, -np.pi + 0.01
    assert find_events(recording(contact_angles=angles)) == []


def test_target_a_slips_a_little_at_one_finger() -> None:
    """At mu 0.5 finger 2 alone passes the coupled limit; the recording says so."""
    run = simulate(load_scenario("target-a", {"fingertip.contact": "coulomb"}))
    found = find_events(run)
    assert {event.finger for event in found} == {"finger_2_tip"} and found[0].kind == "slip"
    assert 0.6 < found[0].time < 0.8
    assert json.loads(run.attributes["events"])[0] == vars(found[0])
    assert 1e-4 < run.slip_travel[-1, 1] < 1e-3


@pytest.fixture(scope="module")
def torn_off() -> Recording:
    """The step of target B, which asks for several times the friction, until all tips have let go."""
    values = {"fingertip.contact": "coulomb", "reference.kind": "step", "duration": 0.1}
    return simulate(load_scenario("target-b", values))


def test_the_step_of_target_b_slips_and_lets_go(torn_off: Recording) -> None:
    """Slip at all fingers, then lift-off of each."""
    found = find_events(torn_off)
    for finger in torn_off.labels["contact"]:
        slips, leaves = (next(event.time for event in found if (event.kind, event.finger) == (kind, finger))
                         for kind in ("slip", "lift-off"))  # fmt: skip
        assert slips < leaves


def test_nothing_is_stored_in_the_air(torn_off: Recording) -> None:
    """A finger that lets go: no shear or torsion is left, and no slip is counted until it touches again."""
    away = torn_off.deformation[:, :, 0] <= 0.0
    assert np.count_nonzero(away) > 30 and not away[0].any()
    assert np.all(torn_off.deformation[away][:, 1:] == 0.0)
    still = away[1:] & away[:-1]
    assert still.any() and np.all(np.diff(torn_off.slip_travel, axis=0)[still] == 0.0)
