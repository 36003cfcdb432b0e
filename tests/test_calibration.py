"""Numbers of a scenario from a log: known truth, what a log does not tell, logs that cannot be used."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from commands import run_command

import softhand
from softhand.assembly.probe import recorded_state
from softhand.assembly.resolve import resolve
from softhand.calibration.instruments import Instrument, measured_values, off, quaternion_by, quaternion_product
from softhand.calibration.recorded_log import log_of_recording, quaternions_of
from softhand.calibration.replay import Replay
from softhand.calibration.triangle import triangle
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant

NOISE = {"sensing.joint_position.noise": 1e-4, "sensing.object_position.noise": 1e-4,
         "sensing.object_orientation.noise": 1e-3, "sensing.contact_force.noise": 0.02}  # fmt: skip


@pytest.fixture(scope="module")
def scenario():
    """Two fingers that shift and pitch a box, with a camera that is off and late."""
    more = {"sensing.object_position.delay": 0.002, "sensing.object_position.bias": (0.0, 0.0, 0.0008)}
    return softhand.load_scenario("pinch", {"duration": 0.4, "reference.duration": 0.3, **NOISE, **more})


@pytest.fixture(scope="module")
def recording(scenario):
    """Its run."""
    return softhand.simulate(scenario)


@pytest.fixture(scope="module")
def log(recording, scenario):
    """The log of it."""
    return log_of_recording(recording, scenario)


def test_a_replay_is_the_run(recording, scenario):
    """Joints, object, forces in axes of the tip: within what a start afresh is off by."""
    setup = resolve(scenario)
    plant = Plant(setup.world, setup.fingertips, setup.supports, "compiled")
    k, n = 100, 20
    seen = Replay(plant, setup.stepper, 1, [], n).samples(
        recorded_state(plant, recording, k), recording.joint_torque[k : k + n], np.array([-1]), np.zeros(1)
    )[0]
    joints = plant.world.n_joints
    assert np.abs(seen[:, :joints] - recording.joint_position[k : k + n + 1]).max() < 2e-5
    assert np.abs(seen[:, joints : joints + 3] - recording.object_position[k : k + n + 1]).max() < 1e-6
    forces = seen[:, plant.world.nq + plant.world.nv :][:, :10].reshape(n + 1, 2, 5)
    in_tips = log_of_recording(recording, scenario).measured["contact_force"].reshape(-1, 2, 3)[k : k + n + 1]
    assert np.abs(np.mean(forces[..., :3] - in_tips, axis=0)).max() < 5 * 0.02 / np.sqrt(n)
    assert np.abs(np.mean(in_tips, axis=0)).max() > 1.0


@pytest.mark.slow
def test_a_fit_comes_to_rest_where_the_object_turns_unseen():
    """Its orientation is not measured, so that the sum of squares is flat along a bent valley; the intervals hold."""
    held = []
    for seed in range(1, 11):
        values = {"sensing.joint_position.noise": 1e-4, "sensing.object_position.noise": 1e-4, "duration": 0.6}
        run = softhand.simulate(softhand.load_scenario("pinch", {**values, "sensing.seed": seed}))
        off_by = {"fingertip.k_r": 4.0e5, "object.mass": 0.21}
        found = softhand.calibrate(run, ["k_r", "mass"], overrides=off_by, threads=1)
        for name, truth in (("k_r", 3.77e5), ("mass", 0.2)):
            low, high = found.interval(name)
            held.append(low < truth < high)
    assert sum(held) >= 17, "of 20; fewer in 2 of 100 cases if each holds in 95 of 100"


def test_values_come_back(recording, log, scenario):
    """Law, mass, bias and delay from values that are off: the truth is near, by the measure of the intervals."""
    off_by = {"fingertip.k_r": 4.0e5, "object.mass": 0.21, "sensing.object_position": {"noise": 1e-4}}
    names = ["k_r", "mass", "sensing.object_position.bias[2]", "sensing.object_position.delay"]
    found = softhand.calibrate(log, names, scenario, overrides=off_by, held_out=0.2, threads=1)
    truth = {"fingertip.k_r": 3.77e5, "object.mass": 0.2, names[2]: 8e-4, names[3]: 2e-3}
    for name, value in truth.items():
        low, high = found.interval(name)
        assert abs(found.value(name) - value) < 2.0 * (high - low), name  # eight standard deviations
    assert abs(found.value("mass") / 0.2 - 1.0) < 1e-3 and abs(found.value("k_r") / 3.77e5 - 1.0) < 0.02
    for one in found.residuals:
        assert abs(one.held_out - 1.0) < 0.25 and abs(one.alike) < 0.1
    assert found.is_noise and found.scenario.sensing.object_position.delay == 0.002
    softhand.check(found.scenario)


@pytest.mark.slow
def test_what_is_not_told_is_refused_by_name(recording, scenario):
    """Friction of tips that do not slip has no column; a motion that makes them slip is proposed, and tells it."""
    with pytest.raises(softhand.SofthandError, match=r"does not tell fingertip\.friction") as raised:
        softhand.calibrate(recording, ["friction", "mass"], scenario, threads=1)
    assert raised.value.untold == ("fingertip.friction",)
    assert "until tips slip" in str(raised.value)
    motion = raised.value.motion
    again = softhand.simulate(motion)
    assert again.is_slipping.any() and motion.fingertip.contact == "coulomb"


@pytest.mark.slow
def test_held_instead(recording, scenario):
    """It stays, and is told."""
    found = softhand.calibrate(recording, ["friction", "mass"], scenario, untold="hold", held_out=0.0, threads=1)
    assert [one.name for one in found.estimates] == ["object.mass"]
    assert "friction" in found.findings[0]


def test_triangle():
    """R^T R = A^T A, for tall, flat and deficient ones."""
    rng = np.random.default_rng(0)
    for shape in ((30, 7), (5, 7), (7, 7)):
        A = rng.standard_normal(shape)
        A[:, 3] = A[:, 1]
        R = triangle(A)
        assert R.shape == (min(shape), 7) and np.allclose(R.T @ R, A.T @ A) and np.allclose(R, np.triu(R))


def test_quaternions_are_those_of_rotations():
    """Of roll, pitch, yaw; and the turn between two in axes of the world."""
    rpy = np.array([[0.3, -0.7, 1.9], [-2.0, 0.4, 0.1]])
    a, b = quaternions_of(rpy)
    v = np.array([0.2, -1.0, 0.5])
    turned = quaternion_product(quaternion_product(a, np.append(v, 0.0)), a * [-1, -1, -1, 1])[:3]
    assert np.allclose(turned, rotation_of(rpy[0]) @ v)
    turn = off("object_orientation", a, b, None)
    assert np.allclose(np.abs(quaternion_product(quaternion_by(turn), b) @ a), 1.0)


def test_a_late_instrument():
    """A cubic is delayed exactly, and the bias added."""
    t = np.arange(12.0)[:, None]
    seen = measured_values("object_position", t**3, Instrument(np.array([2.0]), 1.3e-3), 1e-3)
    assert np.allclose(seen[4:], (t - 1.3)[4:] ** 3 + 2.0)


def _cut(log, **changed):
    return replace(log, **changed)


def test_logs_that_cannot_be_used(log, scenario):
    """Each by its sample or joint, with a remedy."""
    time = log.time.copy()
    back, gap, twice = time.copy(), time.copy(), time.copy()
    back[200:] -= 0.05
    gap[200:] += 0.0123
    twice[200] = twice[199]
    for times, words in ((back, "goes back"), (gap, "gap of 12"), (twice, "remove what is there twice")):
        with pytest.raises(softhand.SofthandError, match=words) as raised:
            _cut(log, time=times)
        assert "sample 200" in str(raised.value)
    holed = {**log.measured, "joint_position": log.measured["joint_position"].copy()}
    holed["joint_position"][7, 2] = np.nan
    with pytest.raises(softhand.SofthandError, match=rf"sample 7 .*{log.joints[2]} is no number"):
        _cut(log, measured=holed)
    degrees = {**log.measured, "joint_position": np.degrees(log.measured["joint_position"])}
    with pytest.raises(softhand.SofthandError, match="as degrees they would"):
        softhand.calibrate(_cut(log, measured=degrees), ["mass"], scenario)
    with pytest.raises(softhand.SofthandError, match="hand of the scenario has 9 joints"):
        softhand.calibrate(log, ["mass"], "hold")
    for key, words in (
        ("K_v", "torques of a log"),
        ("mas", "mass"),
        ("sensing.contact_normal.bias", "holds no contact"),
    ):
        with pytest.raises(softhand.SofthandError, match=words):
            softhand.calibrate(log, [key], scenario)


def _as_csv(log, scenario, unit="deg", scale=180.0 / np.pi):
    names = [f"q.{joint} [{unit}]" for joint in log.joints] + [f"tau.{joint} [N mm]" for joint in log.joints]
    names += [f"object.{axis} [mm]" for axis in "xyz"] + [f"object.q{part}" for part in "xyzw"]
    table = np.hstack([
        1e3 * log.time[:, None], scale * log.measured["joint_position"], 1e3 * log.joint_torque,
        1e3 * log.measured["object_position"], log.measured["object_orientation"],
    ])  # fmt: skip
    rows = [",".join(f"{value:.12g}" for value in row) for row in table]
    return "\n".join([",".join(["time [ms]", *names]), *rows]) + "\n"


def test_csv_is_the_same_log(tmp_path: Path, log, scenario):
    """Whatever the units are; the line of what is wrong is told."""
    from softhand.calibration.reading import read_log

    text = _as_csv(log, scenario)
    file = tmp_path / "log.csv"
    file.write_text(text)
    read = read_log(file, scenario)
    assert np.allclose(read.time, log.time) and np.allclose(read.joint_torque, log.joint_torque)
    for name in ("joint_position", "object_position", "object_orientation"):
        assert np.allclose(read.measured[name], log.measured[name], atol=1e-9)
    lines = text.splitlines()
    for change, words in (
        (lambda: [lines[0].replace(" [deg]", "", 1), *lines[1:]], "has no unit"),
        (lambda: [lines[0].replace("[deg]", "[mm]", 1), *lines[1:]], r"angle and must be in one of"),
        (lambda: [lines[0].replace("tau.", "torque.", 1), *lines[1:]], "is not known"),
        (lambda: [lines[0].replace(log.joints[0], "elbow"), *lines[1:]], "no joint"),
        (lambda: [*lines[:9], lines[9].replace(",", ",x", 1), *lines[10:]], "line 10.*is no number"),
        (lambda: [*lines[:9], *lines[20:]], "line 10 .*gap of 11"),
    ):
        file.write_text("\n".join(change()) + "\n")
        with pytest.raises(softhand.SofthandError, match=words):
            read_log(file, scenario)


def test_the_command(tmp_path: Path, recording):
    """Writes what it says; a mistake is one line."""
    recording.save(tmp_path / "run.nc")
    done = run_command("calibrate", "run.nc", "--fit", "mass=0.1..0.4", "--out", "found", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "object.mass" in done.stdout and {"calibration.png", "fitted.toml"} == {
        file.name for file in (tmp_path / "found").iterdir()
    }
    softhand.load_scenario(tmp_path / "found" / "fitted.toml")
    wrong = run_command("calibrate", "run.nc", "--fit", "mass=0.1", folder=tmp_path)
    assert wrong.returncode == 1 and "LOW..HIGH" in wrong.stderr and "Traceback" not in wrong.stderr
    missing = run_command("calibrate", "rum.nc", "--fit", "mass", folder=tmp_path)
    assert missing.returncode == 1 and "rum.nc: no such file" in missing.stderr
    none = run_command("calibrate", "run.nc", folder=tmp_path)
    assert none.returncode == 1 and "nothing is to be fitted" in none.stderr


def test_inertia_of_an_object():
    """Moments in place of those of the URDF; what no body has is refused."""
    given = (7e-5, 9e-5, 6e-5)
    world = softhand.build("hold", overrides={"object.inertia": given, "object.mass": 0.3}).plant.world
    inertia = world.model.inertias[world.object_joint]
    assert np.allclose(inertia.inertia, np.diag(given)) and inertia.mass == pytest.approx(0.3)
    with pytest.raises(softhand.SofthandError, match="sum of the two others"):
        softhand.load_scenario("hold", {"object.inertia": (1e-5, 2e-5, 4e-5)})


def test_the_place_of_a_tip():
    """Half a millimetre along the axis of a tip is found, within some standard deviations of micrometres."""
    tips = [{"frame": "finger_1_tip", "name": "tip_1", "position": [0.0005, 0.0, 0.0]},
            {"frame": "finger_2_tip", "name": "tip_2"}]  # fmt: skip
    scenario = softhand.load_scenario("pinch", {"hand.tips": tips, "duration": 0.4, "reference.duration": 0.3, **NOISE})
    begin = {"hand.tips": [{**tips[0], "position": [0.0, 0.0, 0.0]}, tips[1]]}
    recording = softhand.simulate(scenario)
    found = softhand.calibrate(
        recording, ["hand.tips[0].position[0]"], scenario, overrides=begin, held_out=0.0, threads=1
    )
    (one,) = found.estimates
    assert abs(one.value - 5e-4) < 2.0 * (one.high - one.low) < 5e-5
    assert found.scenario.hand.tips[0].position[0] == one.value
