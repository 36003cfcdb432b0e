"""What a controller sees through instruments, against formulas; what drives make of a command is in test_actuation."""

from __future__ import annotations

import json
import pickle
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hands import LAYOUTS, make_named_task, random_state
from numpy.typing import NDArray

import softhand
from softhand import Controller, Observation, Recording, ScenarioError, Simulation, build, load_scenario, simulate
from softhand.assembly.instruments import left_out, read_sensing
from softhand.assembly.probe import Probe, recorded_scenario
from softhand.checks.recording import check_recording
from softhand.checks.scenario import check_scenario
from softhand.contact.pairs import contact_pairs
from softhand.errors import ScenarioWarning
from softhand.numerics.philox import normal, philox
from softhand.numerics.rotations import rotation_vector
from softhand.numerics.spatial import rotation_of
from softhand.plant.state import State
from softhand.references.reference import Desired
from softhand.scenario.instruments import InstrumentSection, SensingSection
from softhand.scenario.schema import scenario_schema
from softhand.sensing.fields import FIELDS
from softhand.sensing.instruments import MEASURED, Instruments
from softhand.sensing.measuring import Chain, measure
from softhand.sensing.quantities import QUANTITIES, Channel, Sensing, components, counts, items_of
from softhand.sensing.sensor import Sensor

Array = NDArray[np.float64]

PERIOD = 0.001  # [s]
JOINTS, TIPS = 4, 2
ALL = {
    "joint_position": {"noise": 1e-4, "quantisation": 2e-4},
    "joint_velocity": {"noise": 1e-3, "filter": 100.0},
    "object_position": {"noise": [1e-4, 2e-4, 0.0], "delay": 0.002, "rate": 250.0, "bias": [1e-3, 0.0, 0.0]},
    "object_orientation": {"noise": 2e-3, "filter": 60.0, "quantisation": 1e-4},
    "object_angular_velocity": {"noise": 1e-3},
    "contact_force": {"noise": 0.02, "delay": 0.003},
    "contact_torsion": {"noise": 1e-5},
    "contact_normal": {"noise": 1e-3, "rate": 500.0},
    "contact_compression": {"noise": 1e-5},
}
"""Instruments of all kinds at once."""
DRIVES = {"delay": 0.001, "lag": 0.001, "noise": 1e-3, "rate_limit": 50.0, "seed": 5}


class Bench:
    """Instruments before things that are put there by hand."""

    def __init__(self, seed: int = 0, continuous: Sequence[int] = (), **channels: Channel) -> None:
        self.sensing = Sensing(channels, seed)
        is_continuous = np.isin(np.arange(JOINTS), continuous)
        items, memory = items_of(self.sensing, is_continuous, TIPS)
        sizes = counts(JOINTS, TIPS)
        size = sum(sizes.values())
        self.chain = Chain(items, np.zeros(size), np.zeros(size), np.zeros(memory), np.zeros(memory), np.full(1, -1),
                           np.array([seed]), np.zeros((2, 3, 3)))  # fmt: skip
        ends = np.cumsum([0, *sizes.values()])
        self.place = {name: slice(a, b) for name, a, b in zip(sizes, ends[:-1], ends[1:], strict=True)}
        self.set("object_orientation", np.eye(3))
        self.set("contact_normal", np.tile([0.0, 0.0, 1.0], TIPS))

    def set(self, name: str, values: Any) -> None:
        self.chain.truth[self.place[name]] = np.ravel(values)

    def read(self, name: str, period: int) -> Array:
        measure(self.chain, period)
        return self.chain.measured[self.place[name]].copy()


def channel(name: str, noise: Any = 0.0, bias: Any = 0.0, **more: Any) -> Channel:
    size = components(JOINTS, TIPS)[name]
    return Channel(np.broadcast_to(noise, size).astype(float), np.broadcast_to(bias, size).astype(float), **more)


def share(cutoff: float) -> float:
    return float(-np.expm1(-2.0 * np.pi * cutoff * PERIOD))


# --------------------------------------------------------------------------------------------------------------- chance


@pytest.mark.parametrize(
    ("counter", "key", "words"),
    [
        ((0, 0, 0, 0), (0, 0), (0x6627E8D5, 0xE169C58D, 0xBC57AC4C, 0x9B00DBD8)),
        ((0xFFFFFFFF,) * 4, (0xFFFFFFFF,) * 2, (0x408F276D, 0x41C83B0E, 0xA20BC7C6, 0x6D5451FD)),
        ((0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344), (0xA4093822, 0x299F31D0),
         (0xD16CFE09, 0x94FDCCEB, 0x5001E420, 0x24126EA1)),
    ],
)  # fmt: skip
def test_the_generator_gives_the_words_that_its_authors_publish(counter: Any, key: Any, words: Any) -> None:
    """The known answers of Random123 for philox4x32-10."""
    assert tuple(int(word) for word in philox(*map(np.uint64, (*counter, *key)))) == words


def test_a_number_depends_on_each_of_its_four_places() -> None:
    """Seed, stream, component and index, also a negative one."""
    numbers = [normal(*place) for place in ((1, 2, 3, 4), (0, 2, 3, 4), (1, 0, 3, 4), (1, 2, 0, 4), (1, 2, 3, -4))]
    assert len(set(numbers)) == 5
    assert normal(1, 2, 3, 4) == numbers[0]


@cache
def noisy_errors(samples: int = 4000) -> tuple[Array, Array]:
    """Errors of all components of all quantities, shape (samples, m), and the deviations that were asked for."""
    rng = np.random.default_rng(1)
    deviations = {name: rng.uniform(0.5, 2.0, size) * 1e-3 for name, size in components(JOINTS, TIPS).items()}
    bench = Bench(seed=4, **{name: channel(name, noise=own) for name, own in deviations.items()})
    R = rotation_of(np.array([0.4, -1.1, 2.0]))
    n = np.array([[0.6, 0.0, 0.8], [0.0, -0.6, 0.8]])
    bench.set("object_orientation", R)
    bench.set("contact_normal", n)
    rows = []
    for k in range(samples):
        measure(bench.chain, k)
        row = []
        for name, place in bench.place.items():
            true, seen = bench.chain.truth[place], bench.chain.measured[place]
            is_turn = name == "object_orientation"
            row.append(rotation_vector(R, seen.reshape(3, 3)) if is_turn else seen - true)
        rows.append(np.concatenate(row))
    return np.array(rows), np.concatenate(list(deviations.values()))


def plain_columns() -> list[int]:
    """Of `noisy_errors`: all but those of the normals, which turn."""
    columns, end = [], 0
    for name, size in components(JOINTS, TIPS).items():
        columns += [] if name == "contact_normal" else list(range(end, end + size))
        end += size
    return columns


def test_noise_has_the_mean_and_the_deviation_that_are_asked_for_in_each_component() -> None:
    """Within five deviations of what so many samples tell."""
    errors, deviations = noisy_errors()
    columns, count = plain_columns(), len(errors)
    errors, deviations = errors[:, columns], deviations[columns]
    assert np.all(np.abs(errors.mean(axis=0)) < 5.0 * deviations / np.sqrt(count))
    assert np.all(np.abs(errors.std(axis=0) / deviations - 1.0) < 5.0 / np.sqrt(2.0 * count))


def test_noise_is_normal() -> None:
    """Its fourth moment is three squares of the variance: uniform noise would have 1.8."""
    errors, deviations = noisy_errors()
    columns = plain_columns()
    kurtosis = np.mean((errors[:, columns] / deviations[columns]) ** 4)
    assert abs(kurtosis - 3.0) < 5.0 * np.sqrt(96.0 / errors[:, columns].size)


def test_noise_is_independent_between_quantities_components_and_samples() -> None:
    """No correlation beyond chance between any two columns, nor from a sample to the next."""
    errors, deviations = noisy_errors()
    columns = plain_columns()
    units = errors[:, columns] / deviations[columns]
    count = len(units)
    beside = units.T @ units / count - np.diag(np.mean(units**2, axis=0))
    after = units[1:].T @ units[:-1] / count
    assert max(np.abs(beside).max(), np.abs(after).max()) < 5.5 / np.sqrt(count)


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (0.3, np.pi / 2, -0.4), (np.pi, 0.0, 0.0), (2.0, -1.2, 3.0)])
def test_noise_of_the_orientation_is_the_same_about_all_axes_at_any_attitude(rpy: tuple[float, float, float]) -> None:
    """The covariance of the rotation vector is sigma^2 times one: also at pitch 90 deg and half a turn."""
    sigma, count = 0.05, 4000
    bench = Bench(object_orientation=channel("object_orientation", noise=sigma))
    R = rotation_of(np.array(rpy))
    bench.set("object_orientation", R)
    errors = np.array([rotation_vector(R, bench.read("object_orientation", k).reshape(3, 3)) for k in range(count)])
    assert np.all(np.abs(errors.mean(axis=0)) < 5.0 * sigma / np.sqrt(count))
    assert np.abs(errors.T @ errors / count / sigma**2 - np.eye(3)).max() < 5.0 * np.sqrt(2.0 / count)


def test_noise_of_a_normal_turns_it_alike_in_all_directions() -> None:
    """Two errors across the normal of sigma each, none along it, and the length stays."""
    sigma, count = 0.02, 4000
    bench = Bench(contact_normal=channel("contact_normal", noise=sigma))
    n = np.array([0.48, -0.6, 0.64])
    bench.set("contact_normal", np.tile(n, TIPS))
    seen = np.array([bench.read("contact_normal", k)[:3] for k in range(count)])
    assert np.allclose(np.linalg.norm(seen, axis=1), 1.0, atol=1e-14)
    across = np.linalg.svd(n[None])[2][1:]
    errors = seen @ across.T
    assert np.abs(errors.T @ errors / count / sigma**2 - np.eye(2)).max() < 5.0 * np.sqrt(2.0 / count)


def test_the_seed_is_all_that_differs_between_two_runs_of_the_same_instruments() -> None:
    """The same seed gives the same bits, another one other numbers; a period can be measured again."""

    def readings(seed: int, again: bool = False) -> Array:
        bench = Bench(seed, joint_position=channel("joint_position", noise=1.0, delay=2, stride=3, share=0.3))
        found = []
        for k in range(20):
            found.append(bench.read("joint_position", k))
            if again:
                assert np.array_equal(bench.read("joint_position", k), found[-1])
        return np.array(found)

    assert np.array_equal(readings(3), readings(3))
    assert np.array_equal(readings(3), readings(3, again=True))
    assert not np.any(readings(3) == readings(4))


# ------------------------------------------------------------------------------------------- rounding, time, and frames


def test_rounding_gives_whole_multiples_no_further_than_half_a_step() -> None:
    """Of all plain quantities, with the bias rounded too."""
    bench = Bench(joint_position=channel("joint_position", bias=0.013, quantum=0.01))
    for k, value in enumerate(np.linspace(-0.3, 0.3, 50)):
        bench.set("joint_position", np.full(JOINTS, value))
        seen = bench.read("joint_position", k)
        assert np.allclose(seen / 0.01, np.rint(seen / 0.01), atol=1e-9)
        assert np.all(np.abs(seen - value - 0.013) <= 0.005 + 1e-12)


def test_a_rounded_orientation_has_no_seam() -> None:
    """Along two whole turns the error stays below what rounding of a quaternion can do, and it stays a rotation."""
    quantum = 0.02
    bench = Bench(object_orientation=channel("object_orientation", quantum=quantum))
    axis = np.array([0.48, -0.6, 0.64])
    found = set()
    for k, angle in enumerate(np.linspace(0.0, 4.0 * np.pi, 3000)):
        half = 0.5 * angle
        x, y, z, w = *(np.sin(half) * axis), np.cos(half)
        R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                      [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                      [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])  # fmt: skip
        bench.set("object_orientation", R)
        seen = bench.read("object_orientation", k).reshape(3, 3)
        assert np.allclose(seen.T @ seen, np.eye(3), atol=1e-13)
        assert np.linalg.norm(rotation_vector(R, seen)) <= quantum + 1e-9  # 2 * sqrt(4) * (quantum / 2) / 2
        found.add(seen.tobytes())
    assert len(found) < 1500


def test_a_delay_is_so_many_control_periods() -> None:
    """And before the run all stood as at its first sample."""
    bench = Bench(object_position=channel("object_position", delay=3))
    for k in range(10):
        bench.set("object_position", np.full(3, float(k)))
        assert np.all(bench.read("object_position", k) == max(0.0, k - 3.0))


def test_a_sample_is_held_until_the_next_one() -> None:
    """A rate of a quarter of the loop's, at whole multiples of its own period."""
    bench = Bench(object_position=channel("object_position", stride=4))
    for k in range(13):
        bench.set("object_position", np.full(3, float(k)))
        assert np.all(bench.read("object_position", k) == 4.0 * (k // 4))


def test_noise_is_drawn_once_a_sample() -> None:
    """While a sample is held its noise is held, through a delay too."""
    bench = Bench(object_position=channel("object_position", noise=1.0, stride=5, delay=2))
    seen = np.array([bench.read("object_position", k)[0] for k in range(22)])
    assert np.flatnonzero(np.diff(seen)).tolist() == [1, 6, 11, 16]


def test_the_filter_answers_a_step_as_a_low_pass_of_first_order() -> None:
    """1 - exp(-2 pi f t), t to the end of the period that has the step in it."""
    cutoff = 25.0
    bench = Bench(object_position=channel("object_position", share=share(cutoff)))
    bench.read("object_position", 0)
    for k in range(1, 40):
        bench.set("object_position", np.ones(3))
        expected = 1.0 - np.exp(-2.0 * np.pi * cutoff * k * PERIOD)
        assert bench.read("object_position", k) == pytest.approx(expected, abs=1e-13)


def test_the_filter_turns_an_orientation_about_the_axis_of_the_step() -> None:
    """The angle answers as a number does, from an attitude on the seam of roll, pitch and yaw."""
    cutoff, step = 25.0, 1.3
    bench = Bench(object_orientation=channel("object_orientation", share=share(cutoff)))
    start, axis = rotation_of(np.array([np.pi, 0.2, np.pi])), np.array([0.48, -0.6, 0.64])
    end = turned(start, step * axis)
    bench.set("object_orientation", start)
    bench.read("object_orientation", 0)
    bench.set("object_orientation", end)
    for k in range(1, 30):
        seen = bench.read("object_orientation", k).reshape(3, 3)
        angle = step * (1.0 - np.exp(-2.0 * np.pi * cutoff * k * PERIOD))
        assert rotation_vector(start, seen) == pytest.approx(angle * axis, abs=1e-12)


def turned(R: Array, w: Array) -> Array:
    """exp([w]x) R, by the series."""
    cross = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    power, total = np.eye(3), np.eye(3)
    for k in range(1, 30):
        power = power @ cross / k
        total = total + power
    return total @ R


def test_a_joint_without_end_is_filtered_across_its_seam() -> None:
    """From just below pi to just above, the short way."""
    bench = Bench(continuous=[1], joint_position=channel("joint_position", share=0.5))
    bench.set("joint_position", np.full(JOINTS, np.pi - 0.1))
    bench.read("joint_position", 0)
    bench.set("joint_position", np.full(JOINTS, -np.pi + 0.1))
    seen = bench.read("joint_position", 1)
    assert abs(abs(seen[1]) - np.pi) < 1e-12
    assert abs(seen[0]) < 1e-12  # a joint with an end is a number


def test_a_bias_of_the_orientation_is_a_turn_about_axes_of_the_world() -> None:
    """R_seen = exp(b) R."""
    b = np.array([0.1, -0.2, 0.3])
    bench = Bench(object_orientation=channel("object_orientation", bias=b))
    R = rotation_of(np.array([1.0, 0.5, -2.0]))
    bench.set("object_orientation", R)
    assert bench.read("object_orientation", 0).reshape(3, 3) == pytest.approx(turned(R, b), abs=1e-13)


# ---------------------------------------------------------------------------------------- what a controller makes of it


@cache
def moving() -> tuple[Simulation, State]:
    """Target A on its way, with everything in motion."""
    simulation = build("target-a")
    for _ in range(200):
        simulation.sample()
        simulation.step()
    return simulation, simulation.save()


def seen_with(instruments: dict[str, Any], scenario: str = "target-a") -> tuple[Observation, Observation]:
    """What is true at `moving`, and what is seen there."""
    simulation = build(load_scenario(scenario, {f"sensing.{name}": one for name, one in instruments.items()}))
    saved = moving()[1]
    simulation.reset(State(saved.q, saved.v, saved.z, saved.time))
    seen = simulation.sample()
    assert seen is simulation.observation
    assert seen is not simulation.truth
    return simulation.truth, seen


def test_ideal_instruments_show_the_truth_in_all_fields() -> None:
    """Each field of an observation, computed anew from what is measured, is what it was."""
    truth, seen = seen_with({name: {} for name in QUANTITIES})
    for name in FIELDS:
        true, own = getattr(truth, name), getattr(seen, name)
        assert np.allclose(own, true, rtol=0.0, atol=1e-12 * max(1.0, np.abs(true).max(initial=0.0))), name
    assert seen.time == truth.time


@pytest.mark.parametrize("layout", list(LAYOUTS))
def test_ideal_instruments_show_the_truth_of_any_hand(layout: str, tmp_path: Path) -> None:
    """A wrist, joints without end, canted tips, two and four fingers: in motion, the object turned."""
    task = make_named_task(layout, tmp_path)
    plant, pairs = task.plant(), len(contact_pairs(task.world.n_tips))
    desired = Desired(*np.zeros((3, 6)), np.zeros(pairs))
    state = random_state(task, np.random.default_rng(5))
    truth = Sensor(plant, desired).observe(state, 0.0)
    sizes = components(task.world.n_joints, task.world.n_tips)
    sensing = Sensing({name: Channel(np.zeros(size), np.zeros(size)) for name, size in sizes.items()})
    seen = Instruments(plant, truth, sensing, desired).see(0)
    for name in FIELDS:
        true, own = getattr(truth, name), getattr(seen, name)
        assert np.allclose(own, true, rtol=0.0, atol=1e-12 * max(1.0, np.abs(true).max(initial=0.0))), name


@pytest.mark.parametrize("law", ["hertz", "conservative"])
def test_ideal_instruments_show_the_truth_of_laws_in_surface_coordinates(law: str) -> None:
    """Whose contact axes are those of the object."""
    changes = {"fingertip": {"law": law, "radius": 0.01, "friction": 0.6, "contact": "coulomb"}}
    simulation = build(load_scenario("target-a", {**changes, **{f"sensing.{name}": {} for name in QUANTITIES}}))
    for _ in range(5):
        simulation.sample()
        simulation.step()
    seen, truth = simulation.sample(), simulation.truth
    for name in FIELDS:
        true, own = getattr(truth, name), getattr(seen, name)
        assert np.allclose(own, true, rtol=0.0, atol=1e-11 * max(1.0, np.abs(true).max(initial=0.0))), name


def test_kinematics_are_those_of_the_measured_joints() -> None:
    """Tips, Jacobians and gravity as the plant has them where the joints are measured, not where they are."""
    n = moving()[0].plant.world.n_joints
    bias = np.linspace(-0.02, 0.03, n)
    truth, seen = seen_with({"joint_position": {"bias": bias.tolist()}})
    saved = moving()[1]
    there = saved.q.copy()
    there[:n] += bias
    elsewhere = Probe.of_scenario(load_scenario("target-a")).at(State(there, saved.v, saved.z), saved.time)
    for name in ("joint_position", "tip_position", "tip_rotation", "tip_jacobian", "gravity_torque", "configuration"):
        assert np.allclose(getattr(seen, name), getattr(elsewhere, name), rtol=0.0, atol=1e-13), name
        assert not np.allclose(getattr(seen, name), getattr(truth, name), rtol=0.0, atol=1e-4), name
    assert seen.object_coordinates == pytest.approx(truth.object_coordinates, abs=1e-14)


def test_contacts_lie_on_the_measured_tips() -> None:
    """At R along the normal from the tip's middle, with the normal that the tip feels, and the grasp map follows."""
    bias = np.linspace(-0.02, 0.03, moving()[0].plant.world.n_joints)
    truth, seen = seen_with({"joint_position": {"bias": bias.tolist()}, "contact_compression": {"bias": 2e-4},
                             "object_position": {"bias": [0.001, 0.002, -0.003]}})  # fmt: skip
    for i, tip in enumerate(seen.fingertips):
        R = tip.law.radius - truth.deformation[i, 0] - 2e-4
        normal = seen.tip_rotation[i] @ truth.tip_rotation[i].T @ truth.contact_rotation[i, :, 2]
        assert seen.contact_rotation[i, :, 2] == pytest.approx(normal, abs=1e-12)
        assert seen.contact_point[i] == pytest.approx(seen.tip_position[i] + R * normal, abs=1e-12)
    arms = seen.contact_point - seen.object_position
    force = np.einsum("irk,ik->ir", seen.contact_rotation, seen.contact_force[:, :3])
    wrench = seen.grasp_matrix @ seen.contact_force.ravel()
    assert wrench[:3] == pytest.approx(force.sum(axis=0), abs=1e-12)
    torsion = np.einsum("ir,i->r", seen.contact_rotation[:, :, 2], seen.contact_force[:, 3])
    assert wrench[3:] == pytest.approx(np.cross(arms, force).sum(axis=0) + torsion, abs=1e-12)


def test_a_bias_of_the_force_is_in_axes_of_the_tip() -> None:
    """As of a sensor that is fixed in it, and the internal force follows."""
    bias = np.array([0.3, -0.2, 0.1])
    truth, seen = seen_with({"contact_force": {"bias": bias.tolist()}, "contact_torsion": {"bias": 1e-3}})
    for i in range(len(seen.contact_force)):
        there = seen.contact_rotation[i] @ seen.contact_force[i, :3]
        true = truth.contact_rotation[i] @ truth.contact_force[i, :3]
        assert truth.tip_rotation[i].T @ (there - true) == pytest.approx(bias, abs=1e-12)
    assert seen.contact_force[:, 3] == pytest.approx(truth.contact_force[:, 3] + 1e-3, abs=1e-15)
    expected = np.linalg.pinv(truth.internal_force_basis) @ seen.contact_force[:, :3].ravel()
    assert seen.internal_force == pytest.approx(expected, abs=1e-10)


def test_a_bias_of_the_normal_is_a_turn_in_axes_of_the_tip() -> None:
    """One for each tip if so many are given."""
    biases = np.array([[0.05, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, -0.03]])
    truth, seen = seen_with({"contact_normal": {"bias": biases.ravel().tolist()}})
    for i, b in enumerate(biases):
        before, after = (one.tip_rotation[i].T @ one.contact_rotation[i, :, 2] for one in (truth, seen))
        assert after == pytest.approx(turned(np.eye(3), b) @ before, abs=1e-13)


class Spying(Controller):
    """A law of a user in plain Python: its torque tells what it was shown."""

    def torque(self, observation: Observation, memory: Any) -> Any:
        return 0.01 * observation.joint_position, memory


def test_a_law_in_plain_python_sees_what_is_measured_and_the_recording_has_both() -> None:
    """Its torque is that of the measured positions; the true ones are beside them."""
    scenario = load_scenario("target-a", {"sensing.joint_position": {"noise": 1e-3, "delay": 0.002}}, duration=0.008)
    run = build(scenario, Spying()).run()
    assert np.array_equal(run.joint_torque, 0.01 * run.measured_joint_position)
    assert np.std(run.measured_joint_position - run.joint_position) > 5e-4


@cache
def noisy(name: str, controller: str = "") -> Recording:
    """A run of 0.06 s with all instruments and drives."""
    given = {
        "sensing": {**ALL, "seed": 1},
        "actuation": DRIVES,
        **({"controller": {"name": controller}} if controller else {}),
    }
    return build(load_scenario(name, given, duration=0.06)).run()


def test_different_controllers_meet_the_same_noise() -> None:
    """The errors of what is measured at the same true values, bit by bit: those of the start."""
    first, second = noisy("target-a"), noisy("target-a", "computed-torque")
    for name in ("joint_velocity", "contact_force", "object_twist"):
        errors = [run[f"measured_{name}"][0] - run[name][0] for run in (first, second)]
        assert np.array_equal(*errors), name
        assert np.any(errors[0] != 0.0), name
    later = [(run.measured_object_twist - run.object_twist)[:, 3:] for run in (first, second)]
    assert np.allclose(*later, rtol=0.0, atol=1e-14)
    assert not np.allclose(first.object_twist, second.object_twist, rtol=0.0, atol=1e-6)


def test_compare_shows_all_controllers_the_same_noise() -> None:
    """Row by row: the recordings have one error."""
    task = load_scenario("target-a", {"sensing.object_angular_velocity.noise": 0.01, "sensing.seed": 9}, duration=0.02)
    rows = softhand.compare(task, controllers=["regulation", "object-impedance"])
    errors = [(row.recording.measured_object_twist - row.recording.object_twist)[:, 3:]
              for row in rows if row.recording]  # fmt: skip
    assert len(errors) == 2
    assert np.allclose(*errors, rtol=0.0, atol=1e-14)
    assert np.std(errors[0]) > 0.005


# --------------------------------------------------------------------------------------------------- runs in two pieces


@pytest.mark.parametrize("cut", [0, 1, 2, 5, 18])
def test_a_run_that_is_cut_in_two_goes_on_to_the_last_bit(cut: int) -> None:
    """Delay lines, held samples, filters, rate limits, lags, noise: through a file, before the sample or after it."""
    whole = noisy("target-a")
    first = build(recorded_scenario(whole))
    for _ in range(cut):
        first.sample()
        first.step()
    before = first.save()
    first.sample()
    first.sample()  # asked twice
    saved = pickle.loads(pickle.dumps(first.save()))
    for state in (before, saved):
        rest = build(recorded_scenario(whole)).run(start=state)
        for name in whole.variables:
            if name not in ("slip_travel", "slip_twist", "slip_loss"):
                assert np.array_equal(rest[name], whole[name][cut:], equal_nan=True), name


def test_a_recording_through_instruments_is_beyond_doubt_and_one_without_lacks_none() -> None:
    """What is there under the sections alone is missing only where some of it is there."""
    noisy_run, plain = noisy("target-a"), build("target-a", duration=0.01).run()
    assert not check_recording(plain).errors
    for run in (noisy_run, plain):
        assert not [text for text in check_recording(run).warnings if "it has no" in text]
    less = replace(noisy_run, variables={k: v for k, v in noisy_run.variables.items() if k != "measured_object_rpy"})
    assert [text for text in check_recording(less).warnings if "it has no measured_object_rpy" in text]


def test_a_state_of_other_instruments_is_refused() -> None:
    """It names them, and how to begin afresh."""
    state = build(load_scenario("target-a", {"sensing.joint_position.delay": 0.002})).save()
    with pytest.raises(ScenarioError, match=r"another \[sensing\], \[actuation\] or \[tactile\]; State\("):
        build("target-a").reset(state)


# ---------------------------------------------------------------------------------------------------- the compiled loop


@pytest.mark.parametrize("name", ["target-a", "finger-only", "computed-torque"])
def test_the_compiled_loop_gives_what_the_loop_in_python_gives(name: str) -> None:
    """Noise, holds, delays, filters and drives included; seeds are varied, and runs take turns in one memory."""
    kept = ["joint_position", "object_rpy", "contact_force", "joint_torque", "joint_torque_commanded", "torque_limited"]
    kept += [f"measured_{field}" for field in MEASURED]
    scenario = load_scenario(name, {"sensing": ALL, "actuation": DRIVES}, duration=0.06)
    runs = softhand.rollout(scenario, {"sensing.seed": [7, 1, 1]}, variables=kept, every=0.002, threads=1)
    assert runs.compiled.all()
    recording = noisy(name)
    for variable in kept:
        limit = 1e-10 * max(1.0, float(np.abs(recording[variable]).max()))
        assert np.allclose(runs[variable][1], recording[variable][::2], rtol=0.0, atol=limit), variable
        assert np.array_equal(runs[variable][1], runs[variable][2]), variable
    assert not np.any(runs.measured_joint_velocity[0] == runs.measured_joint_velocity[1])


class Sprung(Controller):
    """A formula of a user."""

    K: float = 0.02

    @staticmethod
    def formula(observed: Any, settings: Any, memory: Any, torque: Any) -> None:
        for j in range(torque.shape[0]):
            torque[j] = settings.K * (observed.joint_velocity[j] + observed.clock[0])


def test_a_formula_of_a_user_sees_what_is_measured_in_both_loops() -> None:
    """Also the clock, and with a sampling of its own."""
    scenario = load_scenario("target-a", {"sensing.joint_velocity": {"noise": 0.05, "delay": 0.003}}, duration=0.008)
    run = build(scenario, Sprung(period=0.002)).run()
    expected = 0.02 * (run.measured_joint_velocity + run.time[:, None])[::2]
    assert np.allclose(run.joint_torque, np.repeat(expected, 2, axis=0)[: len(run)], rtol=0.0, atol=1e-15)
    runs = softhand.rollout(scenario, {"sensing.seed": [0, 3]}, Sprung(period=0.002), every=0.001,
                            variables=["joint_torque", "measured_joint_velocity"])  # fmt: skip
    assert runs.compiled.all()
    assert np.allclose(runs.joint_torque[0], run.joint_torque, rtol=0.0, atol=1e-12)
    assert np.abs(runs.joint_torque[1] - run.joint_torque).max() > 1e-3


def test_a_law_in_plain_python_runs_in_the_loop_in_python_with_the_same_noise() -> None:
    """And the record says so."""
    scenario = load_scenario("target-a", {"sensing.joint_position.noise": 1e-3}, duration=0.008)
    runs = softhand.rollout(
        scenario, {"sensing.seed": [2]}, Spying(), variables=["measured_joint_position"], every=0.001
    )
    assert not runs.compiled.any()
    single = build(scenario.replace({"sensing.seed": 2}), Spying()).run()
    assert np.array_equal(runs.measured_joint_position[0], single.measured_joint_position)


# ----------------------------------------------------------------------------------------------------- without sections


def test_without_the_sections_nothing_is_there_of_them() -> None:
    """Neither in the recording nor in its scenario; a seed alone is no instrument and changes no bit."""
    plain = simulate("target-a", duration=0.02)
    assert not [name for name in plain.variables if name.startswith("measured_") or "commanded" in name]
    assert "sensing" not in plain.scenario
    assert "actuation" not in plain.scenario
    seeded = simulate("target-a", overrides={"sensing.seed": 3}, duration=0.02)
    assert seeded.variables.keys() == plain.variables.keys()
    for name, array in plain.variables.items():
        assert np.array_equal(array, seeded[name], equal_nan=True), name


def test_ideal_instruments_and_drives_change_nothing_but_rounding() -> None:
    """A run through all of them."""
    plain = simulate("target-a", duration=0.05)
    given = {"sensing": {name: {} for name in QUANTITIES}, "actuation": {}}
    ideal = build("target-a", overrides=given, duration=0.05).run()
    for name in ("object_position", "joint_position", "contact_force", "joint_torque"):
        assert np.allclose(plain[name], ideal[name], rtol=0.0, atol=1e-9), name
    assert np.allclose(ideal.measured_object_rpy, ideal.object_rpy, rtol=0.0, atol=1e-14)
    assert np.array_equal(ideal.joint_torque, ideal.joint_torque_commanded)


# -------------------------------------------------------------------------------------------------------- linear models


def test_the_torque_by_the_error_of_each_component_is_that_of_the_controller() -> None:
    """`measurement_noise` names them, `linearize` has them in that order."""
    given = {"sensing.object_position": {"noise": [1e-4, 2e-4, 3e-4]}, "sensing.joint_velocity": {"noise": 1e-3}}
    noise = softhand.measurement_noise("hold", given)
    n = 9
    assert noise.names[n:] == ("object_position x", "object_position y", "object_position z")
    assert noise.units == ("rad/s",) * n + ("m",) * 3
    assert np.diag(noise.covariance) == pytest.approx([1e-6] * n + [1e-8, 4e-8, 9e-8])
    model = softhand.linearize("hold", closed=True, parameters=noise.biases, outputs=["joint_torque"],
                               overrides={**given, **noise.biases})  # fmt: skip
    assert model.closed is not None
    assert model.parameters[-1] == "sensing.object_position.bias[2]"

    def torque(y: float) -> Array:
        simulation = build(load_scenario("hold", {"sensing.object_position.bias": [0.0, y, 0.0]}))
        simulation.sample()
        return simulation.torque.copy()

    expected = (torque(1e-5) - torque(-1e-5)) / 2e-5
    assert np.abs(expected).max() > 1.0
    assert model.closed.F[:, n + 1] == pytest.approx(expected, abs=1e-7)


def test_a_closed_loop_says_which_dynamics_it_leaves_out() -> None:
    """Delays, holds, filters, rounding and drives; noise has none."""
    given = {"sensing.object_position": {"delay": 0.002, "noise": 1e-4}, "actuation": {"lag": 0.001, "noise": 1e-3}}
    scenario = load_scenario("hold", given)
    assert left_out(scenario) == ["sensing.object_position.delay", "actuation.lag"]
    with pytest.warns(ScenarioWarning, match=r"without sensing\.object_position\.delay, actuation\.lag"):
        softhand.linearize(scenario, closed=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        softhand.linearize(scenario)


def test_what_is_measured_is_no_output_of_a_linear_model() -> None:
    """The message names what is."""
    with pytest.raises(ScenarioError, match=r"outputs: measured_object_rpy .* ask for object_rpy\."):
        softhand.linearize("hold", outputs=["measured_object_rpy"])


# ------------------------------------------------------------------------------------------------------------- mistakes


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("joint_positon.noise", 1e-3, r"joint_positon: unknown key .* Did you mean sensing\.joint_position\?"),
        ("joint_position.nois", 1e-3, r"joint_position\.nois: unknown key .*sensing\.joint_position\.noise\?"),
        ("joint_position.noise", -1e-3, r"noise: got -0\.001, but it must be .*>= 0"),
        ("joint_position.noise", [1e-3, 1e-3], r"noise: got \[0\.001, 0\.001\] of length 2, but 9 joints need"),
        ("object_position.bias", [0.1], r"bias: got \[0\.1\] of length 1, but 3 axes need one number, or 3"),
        ("contact_force.bias", [0.1] * 4, r"length 4, but 3 fingertips with 3 axes each need one number, 3 or 9"),
        ("object_position.delay", 0.0014, r"delay: got 0\.0014 s, .* whole number .* value is 0\.001\."),
        ("object_position.delay", 20.0, r"delay: got 20 s, but it may be at most 10 s"),
        ("object_position.rate", 2000.0, r"rate: got 2000 Hz, but the controller asks 1000 times a second"),
        ("object_position.rate", 300.0, r"rate: got 300 Hz, .* the nearest good value is 333\.3"),
        ("object_position.filter", 500.0, r"filter: got 500 Hz, .* no frequencies above 500 Hz"),
        ("object_orientation.quantisation", 2.0, r"quantisation is 2 rad, but it must be at most 1"),
        ("seed", -1, r"sensing\.seed: got -1, but it must be a whole number >= 0"),
        ("seed", 0.5, r"sensing\.seed: got 0\.5, but it must be a whole number"),
    ],
)  # fmt: skip
def test_a_mistake_is_one_line_with_key_value_and_remedy(key: str, value: Any, message: str) -> None:
    """And nothing runs."""
    with pytest.raises(ScenarioError, match=message) as caught:
        build(load_scenario("target-a", {f"sensing.{key}": value}))
    assert "\n" not in str(caught.value)


def test_a_variable_that_no_instrument_gives_cannot_be_recorded() -> None:
    """The message says what it needs."""
    with pytest.raises(
        ScenarioError, match=r"record\.variables: 'measured_object_rpy' is there under \[sensing\] alone"
    ):
        load_scenario("target-a", {"record.variables": ["time", "measured_object_rpy"]})


def test_runs_that_do_not_measure_have_no_measured_variables() -> None:
    """Refused before anything runs."""
    with pytest.raises(ScenarioError, match=r"variables: 'measured_joint_position' is there under \[sensing\] alone"):
        softhand.rollout("target-a", {"mass": [0.2]}, variables=["measured_joint_position"])


def test_an_instrument_that_the_controller_does_not_read_is_told() -> None:
    """The law that goes without the object's pose; one that has it says nothing."""
    given = {"sensing.object_velocity.noise": 0.01, "sensing.joint_position.noise": 1e-4}
    with pytest.warns(ScenarioWarning, match=r"sensing\.object_velocity: the controller 'finger-only' does not read"):
        simulate("finger-only", overrides=given, duration=0.002)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        simulate("target-a", overrides={"sensing.joint_position.noise": 1e-4}, duration=0.002)


# ---------------------------------------------------------------------------------------------------------------- words


def test_the_section_has_all_quantities_and_no_others() -> None:
    """In the order of their random streams; so has the schema, with all keys of an instrument."""
    assert [name for name in SensingSection.model_fields if name != "seed"] == list(QUANTITIES)
    schema = json.loads(json.dumps(scenario_schema()))
    table = schema["properties"]["sensing"]["properties"]
    assert set(table) == {"seed", *QUANTITIES}
    assert set(table["contact_force"]["properties"]) == set(InstrumentSection.model_fields)


def test_every_value_of_an_instrument_has_the_unit_of_its_quantity() -> None:
    """In the table that `softhand check` prints."""
    given = {"sensing.joint_position.noise": 1e-3, "sensing.contact_torsion": {"bias": 1e-4, "delay": 0.001}}
    rows = {key: unit for key, _, unit in check_scenario(load_scenario("target-a", given)).values}
    assert rows["sensing.joint_position.noise"] == "rad"
    assert rows["sensing.contact_torsion.bias"] == "N m"
    assert rows["sensing.contact_torsion.delay"] == "s"


def test_instruments_are_read_for_the_hand_that_there_is() -> None:
    """One number for all components, three for all tips, or one for each."""
    simulation = build("target-a")
    given = {"sensing.contact_force": {"noise": [1.0, 2.0, 3.0], "bias": 0.5}}
    sensing = read_sensing(load_scenario("target-a", given), simulation.plant.world)
    assert sensing is not None
    assert sensing.channels["contact_force"].noise.tolist() == [1.0, 2.0, 3.0] * 3
    assert sensing.channels["contact_force"].bias.tolist() == [0.5] * 9
    assert read_sensing(load_scenario("target-a"), simulation.plant.world) is None
