"""Thousands of grasps: each is at rest with the figures that are told, the same for the same seed, and none is lost."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray
from commands import run_command
from numpy.testing import assert_allclose, assert_array_equal

import softhand
from softhand import GraspCache, GraspError, RecordingError, ScenarioError, SimulationStopped, sample_grasps
from softhand.studies.grasps import sample as module
from softhand.studies.grasps.sampling import Sampler, Spread
from softhand.studies.grasps.squeezing import Contacts
from softhand.studies.grasps.variables import KEPT, LABELS


@pytest.fixture(scope="module")
def cache() -> GraspCache:
    return sample_grasps("target-a", 14, seed=3)


def same(one: GraspCache, other: GraspCache) -> None:
    """All but what nobody asks the order of."""
    assert list(one.variables) == list(other.variables)
    for name in one.variables:
        assert_array_equal(one[name], other[name], err_msg=name)
    assert (one.labels, one.scenario, one.seed, one.spread, one.poses, one.refused) == (
        other.labels, other.scenario, other.seed, other.spread, other.poses, other.refused,
    )  # fmt: skip


def test_each_grasp_is_what_grasp_quality_says(cache: GraspCache) -> None:
    """Solved anew from its contact points and squeeze alone."""
    assert len(cache) == 14 and cache.poses >= 1
    for k in (0, 6, 13):
        quality = softhand.grasp_quality(cache.grasp(k))
        assert quality.refusal is None
        assert quality.margin == pytest.approx(cache.margin[k], rel=1e-6)
        for i, finger in enumerate(quality.fingers):
            assert finger.friction_use == pytest.approx(cache.friction_use[k, i], rel=1e-5)
            assert_allclose(finger.force, cache.contact_force[k, i], atol=1e-6)
        angles = np.concatenate([finger.angles for finger in quality.fingers])
        assert_allclose(angles, cache.joint_position[k], atol=1e-6)
        assert_allclose(
            np.abs(quality.least_internal_force).sum(), np.abs(cache.least_internal_force[k]).sum(), rtol=1e-4
        )


def test_forces_balance_the_weight(cache: GraspCache) -> None:
    """Of the object, from what is in the file alone: forces and moments about its frame, whose origin is its centre."""
    from softhand.grasping.wrenches import tangents
    from softhand.numerics.spatial import rotation_of

    for k in range(len(cache)):
        R = rotation_of(cache.object_rpy[k])
        force, moment = np.zeros(3), np.zeros(3)
        for i in range(3):
            n = cache.contact_normals[k, i]
            own = np.array([*tangents(n), n]).T @ cache.contact_force[k, i, :3]
            force += own
            moment += np.cross(R @ cache.contact_points[k, i], own) + cache.contact_force[k, i, 3] * n
        assert_allclose(force, [0.0, 0.0, 0.2 * 9.81], atol=2e-4)
        assert_allclose(moment, 0.0, atol=1e-5)


def test_conditions_are_kept_and_grasps_differ(cache: GraspCache) -> None:
    assert np.all(cache.friction_use < 0.96) and np.all(cache.torque_use <= 1.0) and np.all(cache.joint_reserve > 0.0)
    assert np.all(cache.margin > 0.0) and np.all(cache.contact_force[..., 2] >= 0.499)
    start = softhand.load_scenario("target-a").object.position
    assert np.all(np.abs(cache.object_position - start) <= 0.01 + 1e-9)
    points = cache.contact_points.reshape(len(cache), -1)
    assert len({tuple(row) for row in points.tolist()}) == len(cache)
    assert np.all(np.diff(cache.pose) >= 0.0)


def test_a_grasp_stays_where_it_is(cache: GraspCache) -> None:
    """In a run with the torques of its rest, the object does not move."""
    k = int(cache.margin.argmax())
    scenario = cache.grasp(k).with_values({"reference": {"kind": "hold"}, "duration": 0.05})
    run = softhand.simulate(scenario)
    assert_allclose(run.joint_position[0], cache.joint_position[k], atol=1e-6)
    assert np.ptp(run.object_position, axis=0).max() < 1e-6


@pytest.mark.parametrize("use", [0.5, 0.9])
def test_the_cone_program_finds_the_least_squeeze(cache: GraspCache, use: float) -> None:
    """As the planes do, with another share of the friction; and where none holds, both say so."""
    from softhand.assembly.plant import read_world
    from softhand.grasping.situation import situation_of

    found = 0
    for k in (0, 5, 10):
        scenario = cache.grasp(k)
        here = situation_of(scenario, read_world(scenario))
        points, normals = here.to_world(cache.contact_points[k]), cache.contact_normals[k]
        for mu in (0.5, 0.2):
            friction = np.full(3, mu)
            one = Contacts(here, points, normals, friction).least(use, 0.7)
            other = here.squeeze(points, normals, friction, use, 0.7)
            assert (one is None) == (other is None)
            if one is not None and other is not None:
                found += 1
                assert np.abs(one).sum() == pytest.approx(np.abs(other).sum(), rel=1e-5)
    assert found >= 3


def test_poses_are_turned_about_random_axes_up_to_the_angle() -> None:
    """From an object that is turned already."""
    from softhand.numerics.rotations import rotation_vector
    from softhand.numerics.spatial import rotation_of

    base = softhand.load_scenario("target-a", {"object.rpy": [0.2, -0.3, 0.5]})
    sampler = Sampler(base, Spread(0.0, 0.4))
    turns = [
        rotation_vector(rotation_of(base.object.rpy), sampler._posed(np.random.default_rng(k)).rotation)
        for k in range(60)
    ]
    angles = np.linalg.norm(turns, axis=1)
    assert angles.max() <= 0.4 + 1e-5 and angles.max() > 0.35 and angles.min() < 0.05
    assert np.all(np.abs(np.mean(turns / angles[:, None], axis=0)) < 0.3)


def test_interrupted_and_continued_is_the_same(
    cache: GraspCache, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is done is in the file, and the same call goes on from there, also to more grasps."""
    file, work = tmp_path / "grasps.nc", module._work

    def interrupted(text: str, seed: int, spread: Spread, index: int) -> object:
        if index == 1:
            raise KeyboardInterrupt
        return work(text, seed, spread, index)

    monkeypatch.setattr(module, "_work", interrupted)
    with pytest.raises(SimulationStopped, match="the same call goes on") as caught:
        sample_grasps("target-a", 14, seed=3, file=file)
    assert caught.value.reason == "interrupted" and 0 < len(caught.value.rows) < 14
    assert len(GraspCache.load(file)) == len(caught.value.rows)
    monkeypatch.setattr(module, "_work", work)
    few = sample_grasps("target-a", len(caught.value.rows) + 1, seed=3, file=file)
    assert len(few) == len(caught.value.rows) + 1
    same(sample_grasps("target-a", 14, seed=3, file=file), cache)
    with pytest.raises(ScenarioError, match="another seed, 3 and not 4"):
        sample_grasps("target-a", 14, seed=4, file=file)
    with pytest.raises(ScenarioError, match="another scenario"):
        sample_grasps("hold", 14, seed=3, file=file)


@pytest.mark.slow
def test_processes_change_nothing(cache: GraspCache) -> None:
    same(sample_grasps("target-a", 14, seed=3, jobs=2), cache)


def test_the_file_is_the_cache_and_xarray_opens_it(cache: GraspCache, tmp_path: Path) -> None:
    cache.save(tmp_path / "grasps.nc")
    same(GraspCache.load(tmp_path / "grasps.nc"), cache)
    for data in (xarray.open_dataset(tmp_path / "grasps.nc", engine="h5netcdf"), cache.to_xarray()):
        assert data.sizes["grasp"] == 14
        assert_array_equal(data.margin, cache.margin)
        for name, kept in KEPT.items():
            assert data[name].dims == ("grasp", *kept.dims) and data[name].attrs["units"] == kept.units
        assert list(data.finger.values) == ["finger_1_tip", "finger_2_tip", "finger_3_tip"]
        assert set(LABELS) <= set(data.sizes)
    (tmp_path / "damaged.nc").write_bytes((tmp_path / "grasps.nc").read_bytes()[:3000])
    with pytest.raises(RecordingError, match="cannot be read as grasps"):
        GraspCache.load(tmp_path / "damaged.nc")


@pytest.mark.parametrize(
    ("values", "words"),
    [({"count": 0}, "count: got 0"), ({"seed": -1}, "seed: got -1"), ({"turn": 4.0}, "turn: got 4.0"),
     ({"position": float("nan")}, "position: got nan"), ({"jobs": 0}, "jobs: got 0")],
)  # fmt: skip
def test_wrong_arguments_are_told(values: dict[str, float], words: str) -> None:
    with pytest.raises(ScenarioError, match=words):
        sample_grasps("target-a", **values)  # type: ignore[arg-type]


def test_an_object_out_of_reach_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_BARREN", 3)
    far = softhand.load_scenario("target-a", {"object.position": [0.0, 0.5, 0.5]})
    with pytest.raises(GraspError, match=r"3 poses of the object in a row.*reach 3 times"):
        sample_grasps(far, 5)


def test_the_command_writes_one_file_and_one_error(tmp_path: Path) -> None:
    ended = run_command("grasps", "--count", "3", "--out", "some.nc", folder=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert "3 grasps from" in ended.stdout and len(GraspCache.load(tmp_path / "some.nc")) == 3
    ended = run_command("grasps", "--count", "3", "--seed", "1", "--out", "some.nc", folder=tmp_path)
    assert ended.returncode == 1 and ended.errors.count("\n") == 1 and "another seed" in ended.errors
