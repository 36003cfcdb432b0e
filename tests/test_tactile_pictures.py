"""Taxels in the film, in the report and in environments."""

from __future__ import annotations

import re

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import softhand
import softhand.envs
from softhand.viewer.live.newest import Newest
from softhand.viewer.report.pads import pad_map, pads_html
from softhand.viewer.scene.parts.taxels import BANDS, band_of
from softhand.viewer.scene.recorded import RecordedScene


@pytest.fixture(scope="module")
def run():
    """Of the main job, with 40 taxels on each tip."""
    return softhand.simulate("target-a", overrides={"duration": 0.02, "tactile.count": 40})


def test_each_taxel_has_one_dot_in_the_colour_of_its_force(run):
    """An item a band and tip; a dot has a size in the band of its force, and none in the others."""
    scene = RecordedScene(run)
    updates = dict(zip((item.name for item in scene.items), scene.frame(-1), strict=True))
    assert scene.layers["taxels"] == "Taxels" and any(entry.layer == "taxels" for entry in scene.legend)
    for i, tip in enumerate(run.labels["contact"]):
        sizes = np.array([
            np.ptp(updates[f"taxels/{tip}_{k}"].vertices.reshape(40, -1, 3), axis=1).max(axis=1)
            for k in range(len(BANDS) + 1)
        ])  # fmt: skip
        assert np.array_equal((sizes > 1e-5).sum(axis=0), np.ones(40))
        most = run.tactile_normal_force.max()
        assert np.array_equal(np.argmax(sizes, axis=0), band_of(run.tactile_normal_force[-1, i], most))


def test_bands_begin_at_their_shares():
    """0 below the first, the last at its share and above."""
    assert band_of(np.array([0.0, 0.019, 0.02, 0.31, 0.75, 1.2]), 1.0).tolist() == [0, 0, 1, 3, 5, 5]


def test_dots_lie_on_the_tips(run):
    """At the places of the taxels, a little above the skin."""
    scene = RecordedScene(run)
    updates = dict(zip((item.name for item in scene.items), scene.frame(-1), strict=True))
    points = softhand.taxel_points(run)
    for i, tip in enumerate(run.labels["contact"]):
        pose, vertices = updates[f"taxels/{tip}_0"].pose, updates[f"taxels/{tip}_0"].vertices
        middle = vertices.reshape(40, -1, 3).mean(axis=1) @ pose[:3, :3].T + pose[:3, 3]
        assert np.linalg.norm(middle - points[i], axis=1).max() < 4e-4


def test_a_live_picture_has_taxels_and_others_have_none():
    """In the scene of a simulation with them; no layer, no item without."""
    for settings, there in (({"tactile.count": 12}, True), ({}, False)):
        newest = Newest(softhand.build("target-a", overrides=settings))
        assert ("taxels" in newest.scene.layers) is there
        time, updates = newest.draw()
        assert time == 0.0 and len(updates) == len(newest.scene.items)


def test_the_report_has_a_map_of_each_pad_at_its_highest_and_at_the_end(run):
    """Two of each tip, a circle for each taxel and one for the rim; nothing for a run without taxels."""
    text = pads_html([run])
    assert text.count("<svg") == 6 and text.count("<circle") == 6 * 41 and "finger 1: highest" in text
    plain = softhand.simulate("target-a", duration=0.001)
    assert pads_html([plain]) == "" and pads_html([plain, run]).count("<svg") == 6


def test_a_map_shows_y_to_the_right_and_z_up():
    """A taxel at +y is right of the middle, one at +z above it; the strongest is the darkest."""
    places = np.array([[0.8, 0.6, 0.0], [0.8, 0.0, 0.6], [1.0, 0.0, 0.0]])
    circles = re.findall(
        r'cx="([\d.]+)" cy="([\d.]+)" r="[\d.]+" fill="(#\w+)"', pad_map(places, np.array([0.0, 1.0, 0.5]), 1.0)
    )
    (y, z, apex) = [(float(a), float(b)) for a, b, _ in circles[1:]]
    assert y[0] > 60.0 and y[1] == 50.0 and z[0] == 50.0 and z[1] < 40.0 and apex == (50.0, 50.0)
    assert circles[1][2] == "#ffffff" and circles[2][2] == "#0b2a5b"


def test_an_environment_has_the_forces_of_all_taxels():
    """Their sums are those of the contacts; one world and several; checked by gymnasium."""
    options = {"overrides": {"tactile.count": 12}, "randomise": {}}
    env = gymnasium.make("softhand/HoldBoxTactile-v0", **options)
    check_env(env.unwrapped, skip_render_check=True)
    seen, _ = env.reset(seed=0)
    for _ in range(2):
        seen, *_ = env.step(env.action_space.sample())
    plain = gymnasium.make("softhand/HoldBox-v0", randomise={})
    assert len(seen["observation"]) == plain.observation_space["observation"].shape[0] + 3 * 12 * 3
    worlds = env.unwrapped.episodes.worlds.seen
    np.testing.assert_allclose(worlds["tactile_normal_force"].sum(axis=2), worlds["contact_force"][..., 2], atol=1e-12)
    assert np.isin(worlds["tactile_shear_force"][0].ravel(), seen["observation"]).all()
    several = gymnasium.make_vec("softhand/HoldBoxTactile-v0", num_envs=2, **options)
    first, _ = several.reset(seed=0)
    alone, _ = env.reset(seed=1)
    assert np.array_equal(first["observation"][1], alone["observation"])
    for one in (env, plain, several):
        one.close()
