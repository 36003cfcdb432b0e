"""Markers and depth pictures: an analytic press, symmetry, and the same deformation in both kinds of coordinates."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import softhand
from softhand.errors import RecordingError, ScenarioError
from softhand.tactile.camera import indentation_of, seen_depth, seen_markers
from softhand.tactile.pattern import taxel_pattern
from softhand.tactile.tip_shape import Indentation, contact_axes, contact_turn

R = 0.01  # [m]
PRESS = Indentation(R, 0.008, (0.0, 0.5 * np.pi), (0.0, 0.0, 0.0))
"""At the apex."""


def test_a_press_at_the_apex_moves_markers_outwards_alike_on_all_sides():
    """Radial displacements, the same for all markers of a ring, none at the apex and at the rim."""
    angle = np.arange(8) * 0.25 * np.pi
    for x in (0.3, 0.6, 0.9):
        ring = np.column_stack([np.full(8, x), *(np.sqrt(1.0 - x * x) * np.array([np.cos(angle), np.sin(angle)]))])
        moved = seen_markers(PRESS, ring)
        out = np.column_stack([np.cos(angle), np.sin(angle)])
        radial = np.sum(moved * out, axis=1)
        np.testing.assert_allclose(moved, radial[:, None] * out, atol=1e-12)
        np.testing.assert_allclose(radial, radial[0], atol=1e-12)
    assert np.abs(seen_markers(PRESS, np.array([[1.0, 0.0, 0.0]]))).max() < 1e-12
    beside = seen_markers(PRESS, np.array([[0.5, np.sqrt(0.75), 0.0]]))
    assert beside[0, 0] > 1e-4  # the bulge goes outwards


def test_shear_and_twist_move_markers_their_own_ways():
    """Under shear those at the contact go along, under twist around it."""
    places = taxel_pattern(127, "rings")
    near = np.arccos(places[:, 0]) < 0.4
    slid = seen_markers(PRESS._replace(angles=(0.0, 1.4), shear=(0.0, 0.1, 0.0)), places)[near]
    base = seen_markers(PRESS._replace(angles=(0.0, 1.4)), places)[near]
    assert np.all((slid - base)[:, 0] > 0.3e-3)  # phi was larger, so the material came towards y
    turned = (seen_markers(PRESS._replace(shear=(0.0, 0.0, 0.2)), places) - seen_markers(PRESS, places))[near]
    y, z = places[near, 1], places[near, 2]
    off = np.hypot(y, z) > 0.1
    around = (y * turned[:, 1] - z * turned[:, 0])[off]
    assert np.all(around < 0.0)  # dpsi turns the contact by -dpsi about the normal, here x


def test_a_picture_turns_with_the_tip():
    """About x of the tip: Theta turned by an angle turns all displacements by it."""
    places, shape = taxel_pattern(60), Indentation(R, 0.008, (0.3, 1.0), (0.08, -0.05, 0.1))
    Q = Rotation.from_rotvec([0.7, 0.0, 0.0]).as_matrix()
    turned = seen_markers(shape._replace(angles=(1.0, 1.0)), places @ Q.T)
    expected = seen_markers(shape, places) @ Q[1:, 1:].T  # but for the bulge, whose volume is summed over some points
    np.testing.assert_allclose(turned, expected, atol=1e-6)


def test_the_depth_picture_of_a_press_is_the_cap_that_is_cut_off():
    """sqrt(r^2 - y^2 - z^2) - R within a^2 = r^2 - R^2 and 0 beside it; the volume of the cap."""
    pixels = 200
    picture = seen_depth(PRESS, pixels)
    middle = R * ((np.arange(pixels) + 0.5) * 2.0 / pixels - 1.0)
    y, z = np.meshgrid(middle, middle)
    expected = np.maximum(np.sqrt(np.maximum(R * R - y * y - z * z, 0.0)) - 0.008, 0.0)
    np.testing.assert_allclose(picture, expected, atol=1e-15)
    volume = np.pi * 0.002**2 * (3.0 * R - 0.002) / 3.0
    assert picture.sum() * (2.0 * R / pixels) ** 2 == pytest.approx(volume, rel=1e-3)


def test_a_depth_picture_lies_where_the_contact_is():
    """Its middle is on the side of the contact: columns along y, rows along z."""
    picture = seen_depth(PRESS._replace(angles=(0.5, 1.1)), 64)
    rows, columns = (np.sum(picture * grid) / picture.sum() for grid in np.meshgrid(*[np.arange(64) - 31.5] * 2)[::-1])
    assert columns > 5.0 and rows / columns == pytest.approx(np.tan(0.5), rel=0.05)


@pytest.mark.parametrize("shear", [(0.1, 0.0, 0.0), (0.0, -0.12, 0.0), (0.05, 0.1, 0.2), (0.0, 0.0, -0.3)])
def test_a_law_in_surface_coordinates_is_seen_as_it_has_moved(shear):
    """From the turn of a polar deformation to s1, s2, psi and back: the same places of the material."""
    shape = Indentation(R, 0.008, (0.4, 0.9), shear)
    tip = Rotation.from_rotvec([0.4, -0.3, 1.0]).as_matrix()
    spin = Rotation.from_rotvec([0.0, 0.0, 0.6]).as_matrix()  # the axes of a face lie otherwise than those of (17)
    contact = tip @ contact_axes(0.4, 0.9) @ spin
    turn = tip @ contact_turn(shape) @ tip.T
    w = contact.T @ Rotation.from_matrix(turn).as_rotvec()
    deformation = np.array([0.002, -0.008 * w[1], 0.008 * w[0], -w[2]])
    found = indentation_of(R, deformation, True, contact, tip)
    np.testing.assert_allclose(contact_turn(found), contact_turn(shape), atol=1e-12)
    places = taxel_pattern(60)
    np.testing.assert_allclose(seen_markers(found, places), seen_markers(shape, places), atol=1e-12)


def test_pictures_of_a_run_are_those_of_its_tips():
    """From a recording as from an observation; taxels lie on the tips; pressure is force over area."""
    simulation = softhand.build("target-a", overrides={"duration": 0.02, "tactile.count": 40})
    recording, live = simulation.run(), simulation.observation
    for name in ("marker_displacements", "depth_image", "taxel_points"):
        seen, told = getattr(softhand, name)(live), getattr(softhand, name)(recording)
        np.testing.assert_allclose(np.array(seen), np.array(told), atol=1e-9)
    assert softhand.depth_image(recording, at=0.01).shape == (3, 64, 64)
    assert softhand.depth_image(recording).max() == pytest.approx(2.3e-3, rel=0.3)
    away = np.linalg.norm(softhand.taxel_points(recording) - recording.tip_position[-1][:, None], axis=2)
    assert away.min() > 0.006 and away.max() < 0.0115
    area = 2.0 * np.pi * 0.01**2 / 40
    np.testing.assert_allclose(softhand.tactile_pressure(recording) * area, recording.tactile_normal_force, rtol=1e-12)


@pytest.mark.parametrize(("ask", "names"), [
    (lambda run: softhand.depth_image(run, at=1.0), "at: got 1 s, but the recording goes from 0 to 0.001 s"),
    (lambda run: softhand.depth_image(run, pixels=0), "pixels: got 0"),
    (lambda run: softhand.marker_displacements(run, count=3), "got 3; a tip has 12 to 2000"),
    (lambda run: softhand.marker_displacements("run.nc"), "give an observation or a recording"),
    (lambda run: softhand.tactile_pressure(run), r"no taxels; give its scenario the section \[tactile\]"),
    (lambda run: softhand.taxel_points(run), r"the section \[tactile\]"),
])  # fmt: skip
def test_what_there_is_not_is_named(ask, names):
    """Times, pictures, markers and taxels."""
    recording = softhand.simulate("target-a", duration=0.001)
    with pytest.raises((ScenarioError, RecordingError), match=names):
        ask(recording)
