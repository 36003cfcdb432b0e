"""Many runs at once: each is what it would be alone, in any company, and nothing is lost."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import softhand
from softhand import Controller, RolloutStopped, Runs, ScenarioError, load_scenario, rollout, simulate
from softhand.batch import memory
from softhand.batch import rollout as module

SHORT = load_scenario("target-a", {"duration": 0.04})
VARIED = {
    "object.mass": [0.2, 0.25, 0.2, 0.18],
    "fingertip.friction": [0.8, 0.7, 0.9, 0.8],
    "k_r": [3.77e5, 3.5e5, 4e5, 3.77e5],
    "controller.K_O_position": [100.0, 80.0, (90.0, 100.0, 110.0), 100.0],
    "reference.kind": ["minimum-jerk", "step", "minimum-jerk", "minimum-jerk"],
    "push": [[], [], [], [{"on": "object", "force": [0.0, 0.1, 0.0], "start": 0.01, "duration": 0.01}]],
}


class PlainDamping(Controller):
    """A law without compiled code."""

    K: float = 0.02

    def torque(self, observation: Any, memory: Any) -> Any:
        return observation.gravity_torque - self.K * observation.joint_velocity, memory


def of_run(index: int) -> dict[str, Any]:
    """Values of one run."""
    return {key: values[index] for key, values in VARIED.items()}


def test_each_run_is_that_of_its_values() -> None:
    """As `simulate` gives it, for all that a scenario holds."""
    runs = rollout(SHORT, VARIED, every=0.01)
    assert len(runs) == 4 and runs.finished.all() and runs.compiled.all()
    assert_allclose(runs.time, [0.0, 0.01, 0.02, 0.03, 0.04])
    for index in range(4):
        values = {key if "." in key or key == "push" else "fingertip.k_r": v for key, v in of_run(index).items()}
        alone = simulate(SHORT.with_values(values))
        for name in runs.variables:
            scale = max(1.0, np.abs(alone[name]).max())
            assert_allclose(runs[name][index], alone[name][::10], rtol=0.0, atol=1e-10 * scale, err_msg=name)
    assert np.ptp(runs.object_position[:, -1], axis=0).max() > 1e-6


@pytest.mark.parametrize("threads", [1, 3])
def test_runs_do_not_depend_on_company(threads: int) -> None:
    """To the last bit, for any number of threads and any other runs."""
    all_four = rollout(SHORT, VARIED, threads=2)
    alone = rollout(SHORT, [of_run(2)], threads=threads)
    for name in all_four.variables:
        assert_array_equal(all_four[name][2], alone[name][0], err_msg=name)


def test_laws_in_plain_python_run_too() -> None:
    """Slower, and the record says so."""
    runs = rollout(SHORT, {"mass": [0.2, 0.22]}, controller=PlainDamping(), every=0.02)
    assert not runs.compiled.any() and runs.finished.all()
    alone = simulate(SHORT, controller=PlainDamping(), mass=0.22)
    assert_allclose(runs.object_position[1], alone.object_position[::20], rtol=0.0, atol=1e-12)


def test_steppers_of_variable_step_run_too() -> None:
    """Through Python."""
    runs = rollout(SHORT.with_values({"duration": 0.01}), {"stepper.name": ["midpoint", "adaptive"]})
    assert list(runs.compiled) == [True, False] and runs.finished.all()


def test_structures_may_differ() -> None:
    """Another hand in another run: names of both, and nothing where a run has no such contact."""
    pinch = load_scenario("pinch", {"duration": 0.04})
    sections = {"hand", "object", "grasp", "fingertip", "controller", "reference"}
    table = {key: value for key, value in pinch.model_dump(exclude_none=True).items() if key in sections}
    runs = rollout(SHORT, [{}, table], variables=("contact_force", "object_position"), every=0.02)
    assert runs.finished.all() and runs.compiled.all()
    alone = simulate(pinch)
    its = [runs.labels["contact"].index(name) for name in alone.labels["contact"]]
    others = [k for k in range(len(runs.labels["contact"])) if k not in its]
    assert others and np.isnan(runs.contact_force[1][:, others]).all()
    assert_allclose(runs.contact_force[1][:, its], alone.contact_force[::20], rtol=0.0, atol=1e-10)
    assert np.isfinite(runs.contact_force[0][:, :3]).all()


def test_a_run_that_ends_early_keeps_its_samples_and_disturbs_no_other() -> None:
    """NaN behind its end, its reason with it; so does one that cannot begin."""
    long = SHORT.with_values({"duration": 0.4})
    runs = rollout(long, {"controller.K_v": [0.005, 5.0, 0.005], "friction": [0.8, 0.8, 0.1]}, every=0.001)
    assert runs.outcomes[0].reason == "finished"
    lost, impossible = runs.outcomes[1:]
    assert lost.reason not in ("finished", "grasp") and 0.0 < lost.time < 0.4 and lost.message
    ended = round(1e3 * lost.time)
    assert np.isfinite(runs.object_position[1, :ended]).all() and np.isnan(runs.object_position[1, ended + 1 :]).all()
    assert impossible.reason == "grasp" and "friction" in impossible.message
    assert np.isnan(runs.object_position[2]).all()
    whole = rollout(long, {"controller.K_v": [0.005]}, every=0.001)
    assert_array_equal(runs.object_position[0], whole.object_position[0])


class Fragile(Controller):
    """Fails at its start for some settings."""

    K: float = 0.02

    def start(self, observation: Any) -> Any:
        return np.array([1.0 / self.K])

    @staticmethod
    def formula(observed: Any, settings: Any, memory: Any, torque: Any) -> None:
        for j in range(torque.shape[0]):
            torque[j] = observed.gravity_torque[j] - settings.K * observed.joint_velocity[j]


def test_a_controller_that_cannot_begin_ends_its_run_only() -> None:
    """Constants that do not fit the hand, and whatever the start of a law of one's own raises."""
    runs = rollout(SHORT, {"controller.K_v": [0.005, (0.005, 0.005), 0.006]}, threads=1)
    assert [outcome.reason for outcome in runs.outcomes] == ["finished", "scenario", "finished"]
    assert "K_v" in runs.outcomes[1].message and np.isnan(runs.object_position[1]).all()
    alone = rollout(SHORT, {"controller.K_v": [0.006]})
    assert_array_equal(runs.object_position[2], alone.object_position[0])
    (lost,) = rollout(SHORT, [{}], controller=Fragile(K=0.0)).outcomes
    assert lost.reason == "controller" and "ZeroDivisionError" in lost.message and "Fragile" in lost.message


def test_runs_of_one_thread_leave_nothing_to_the_next() -> None:
    """After a run that was lost, and after others of another structure, to the last bit."""
    long, kept = SHORT.with_values({"duration": 0.4}), ("contact_force", "joint_torque", "external_force")
    values: list[dict[str, Any]] = [
        {"object.mass": 0.2},
        {"controller.K_v": 100.0},  # lost
        {"object.mass": 0.22, "fingertip.k_r": 3.3e5, "gravity": (0.0, 0.1, -9.7)},
        {"push": [{"force": [0.0, 0.1, 0.0], "start": 0.01, "duration": 0.02}]},
        {"push": [{"force": [0.1, 0.0, 0.0], "start": 0.03, "duration": 0.02}], "object.mass": 0.21},
        {"fingertip.contact": "coulomb"},
        {"reference.duration": 0.5, "fingertip.contact": "coulomb", "fingertip.friction": 0.9},
        {"object.position": [0.0, 0.0005, 0.127]},
    ]
    runs = rollout(long, values, threads=1, variables=kept, every=0.001)
    assert runs.compiled.all() and runs.outcomes[1].reason != "finished"
    for index in range(len(values)):
        alone = rollout(long, values[index : index + 1], variables=kept, every=0.001)
        assert alone.outcomes[0] == runs.outcomes[index]
        for name in runs.variables:
            shared = alone[name][0]
            assert_array_equal(runs[name][index][: len(shared)], shared, err_msg=f"{index} {name}")


@pytest.mark.parametrize(
    ("variations", "told"),
    [
        ({"object.mas": [0.2, 0.3]}, ["object.mas", "object.mass"]),
        ({"mas": [0.2]}, ["mas", "mass"]),
        ({"object.mass": [0.2, -0.3]}, ["run 1", "object.mass", "-0.3"]),
        ({"object.mass": [0.2, float("nan")]}, ["run 1", "object.mass"]),
        ({"object.position": [[0.0, 0.0]]}, ["run 0", "object.position"]),
        ({"object.mass": [0.2, 0.3], "fingertip.friction": [0.8]}, ["object.mass has 2", "fingertip.friction has 1"]),
        ({"object.mass": 0.2}, ["object.mass", "list"]),
        ({"controller.K_v": [0.01, -1.0]}, ["run 1", "K_v"]),
        ({"fingertip.k_r": [1e5, -1.0]}, ["run 1", "k_r"]),
        ({"reference.kind": ["stepp"]}, ["run 0", "stepp", "step"]),
        ([], ["no run"]),
    ],
    ids=str,
)
def test_what_is_wrong_is_told_before_anything_runs(
    variations: Any, told: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the key and the number of the run."""
    monkeypatch.setattr(module.Series, "run", lambda *_: pytest.fail("a run began"))
    with pytest.raises(ScenarioError) as error:
        rollout(SHORT, variations)
    for text in told:
        assert text in str(error.value)


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"variables": ["object_positon"]}, "object_position"),
        ({"every": 0.0015}, "every"),
        ({"every": float("nan")}, "every"),
        ({"threads": 0}, "threads"),
    ],
    ids=str,
)
def test_wrong_options_are_told(options: dict[str, Any], told: str) -> None:
    """By name."""
    with pytest.raises(ScenarioError, match=told):
        rollout(SHORT, {"mass": [0.2]}, **options)


def test_memory_is_foreseen(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Before anything runs."""
    file = tmp_path / "meminfo"
    file.write_text("MemTotal: 99999999 kB\nMemAvailable: 4 kB\n")
    monkeypatch.setattr(memory, "_MEMORY", file)
    with pytest.raises(ScenarioError, match="memory"):
        rollout(SHORT, {"mass": [0.2, 0.21]})


def test_an_interrupted_rollout_keeps_what_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C after the second run."""

    def interrupt(done: int, total: int) -> None:
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(RolloutStopped, match="runs are done") as stop:
        rollout(SHORT.with_values({"duration": 2.0}), {"mass": np.linspace(0.15, 0.25, 40)}, threads=1,
                progress=interrupt)  # fmt: skip
    runs = stop.value.runs
    assert 2 <= runs.finished.sum() < 40 and len(runs) == 40
    assert {outcome.reason for outcome in runs.outcomes} == {"finished", "interrupted"}
    assert np.isfinite(runs.object_position[runs.finished]).all()


def test_runs_are_saved_and_opened_elsewhere(tmp_path: Path) -> None:
    """All of it comes back, and xarray reads the file."""
    xarray = pytest.importorskip("xarray", reason="needs the extra test: xarray")
    runs = rollout(SHORT, {**VARIED, "friction": [0.8, 0.7, 0.1, 0.8]}, every=0.02)
    runs.save(tmp_path / "runs.nc")
    again = Runs.load(tmp_path / "runs.nc")
    assert again.outcomes == runs.outcomes and again.labels == runs.labels and again.scenario == runs.scenario
    for name, array in runs.variables.items():
        assert_array_equal(again[name], array)
    with xarray.open_dataset(tmp_path / "runs.nc") as dataset:
        assert dataset.object_position.dims == ("run", "time", "xyz")
        assert_array_equal(dataset["object.mass"], VARIED["object.mass"])
        assert list(dataset.outcome) == [outcome.reason for outcome in runs.outcomes]
        assert_array_equal(dataset.object_position, runs.to_xarray().object_position)
    with pytest.raises(softhand.RecordingError, match="no runs"):
        simulate(SHORT).save(tmp_path / "run.nc")
        Runs.load(tmp_path / "run.nc")


def test_runs_say_what_is_in_them() -> None:
    """A row a run; a name that is not there gets the nearest."""
    runs = rollout(SHORT, {"mass": [0.2, 0.21]}, variables=("object_position",))
    assert [row["object.mass"] for row in runs.rows()] == [0.2, 0.21]
    assert "2 finished" in repr(runs)
    with pytest.raises(AttributeError, match="object_position"):
        runs.object_positon  # noqa: B018
