"""Ellipsoids of the compliance of a held object: in figures, in the viewer, of recordings in the command."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from commands import run_command
from numpy.testing import assert_allclose

import softhand
from softhand import Recording
from softhand.numerics.spatial import rotation_of
from softhand.plots.grasp_stiffness import ellipse_of, semi_axes
from softhand.viewer.scene.ellipsoids import ellipsoids_of
from softhand.viewer.scene.recorded import RecordedScene


@cache
def run() -> Recording:
    return softhand.simulate("target-a", overrides={"duration": 0.2, "reference.duration": 0.2})


def test_the_outline_is_the_shadow_of_the_ellipsoid() -> None:
    """No point of the surface lies outside, and each point of the outline is one of the surface."""
    semi, R = np.array([3.0, 2.0, 0.5]), rotation_of((0.4, -0.7, 1.1))
    flat = R.T[:, :2]
    outline = ellipse_of(semi, flat)
    rng = np.random.default_rng(1)
    ball = rng.normal(size=(20000, 3))
    ball /= np.linalg.norm(ball, axis=1)[:, None]
    shadow = (ball * semi) @ flat
    angles = np.linspace(0.0, np.pi, 19)
    ways = np.column_stack([np.cos(angles), np.sin(angles)])
    assert_allclose((outline @ ways.T).max(axis=0), (shadow @ ways.T).max(axis=0), rtol=3e-3)
    assert np.all((shadow @ ways.T).max(axis=0) <= (outline @ ways.T).max(axis=0) * (1.0 + 1e-3))


def test_the_softest_axis_is_the_longest_and_a_negative_stiffness_has_none() -> None:
    assert_allclose(semi_axes(np.array([2.0, 4.0, 8.0]), 40.0), [40.0, 20.0, 10.0])
    assert semi_axes(np.array([-1.0, 4.0, 8.0]), 40.0) is None


def test_the_viewer_draws_both_about_the_object() -> None:
    """Semi-axes as the compliances, one scale for all times, at the origin of the object."""
    found = ellipsoids_of(run(), samples=3)
    scene = RecordedScene(run(), stiffness=found)
    assert "stiffness" in scene.layers and "stiffness" not in RecordedScene(run()).layers
    assert {entry.layer for entry in scene.legend} >= {"stiffness"}
    frame = len(run()) - 1
    places = [k for k, item in enumerate(scene.items) if item.layer == "stiffness"]
    pose = scene.frame(frame)[places[0]].pose
    assert pose is not None and len(places) == 4
    assert_allclose(pose[:3, 3], run().object_position[frame])
    held = softhand.grasp_stiffness(run(), at=float(run().time[frame]))
    lengths = np.linalg.norm(pose[:3, :3], axis=0)
    assert_allclose(lengths * held.translation, lengths[0] * held.translation[0], rtol=1e-9)
    assert_allclose(np.abs(pose[:3, 0] / lengths[0]), np.abs(held.translation_directions[0]), atol=1e-9)
    largest = max(float(np.max(np.linalg.norm(one.shift, axis=0))) for one in found if one.shift is not None)
    assert_allclose(lengths[0], 0.04 / largest / held.translation[0], rtol=1e-6)


def test_open_fingers_have_no_ellipsoid() -> None:
    opened = softhand.simulate("grasp-and-lift", overrides={"duration": 0.02})
    found = ellipsoids_of(opened, samples=2)
    assert all(one.shift is None and one.turn is None for one in found)
    scene = RecordedScene(opened, stiffness=found)
    hidden = [
        update.visible for update, item in zip(scene.frame(0), scene.items, strict=True) if item.layer == "stiffness"
    ]
    assert hidden == [False] * 4


def test_a_recording_is_a_source_of_the_command(tmp_path: Path) -> None:
    run().save(tmp_path / "run.nc")
    result = run_command("grasp", "run.nc", "--stiffness", "--at", "0.1", "--json", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    assert json.loads(result.stdout)["time"] == pytest.approx(0.1)
    assert (tmp_path / "grasp.png").is_file()
    for words, message in (
        (["run.nc"], "is a recording, which has no start to judge; add --stiffness"),
        (["run.nc", "--stiffness", "--at", "9"], "at: got 9 s, but the recording goes from 0 to 0.2 s"),
        (["run.nc", "--stiffness", "--set", "object.mass=1"], "--set changes a scenario"),
        (["target-a", "--at", "0.1"], "--at: is a time in a recording"),
    ):
        result = run_command("grasp", *words, folder=tmp_path)
        assert result.returncode == 1 and message in result.errors, result.stderr
    result = run_command("view", "run.nc", "--meshcat", "--stiffness", folder=tmp_path)
    assert result.returncode == 1 and "is not drawn in meshcat" in result.errors
