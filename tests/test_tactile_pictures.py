"""Taxels in the film and in the report."""

from __future__ import annotations

import re

import numpy as np
import pytest

import softhand
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
