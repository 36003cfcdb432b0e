"""The limit surface in all six directions: normality, the flat contact, a ball about its middle, turns and mirrors."""

from __future__ import annotations

import math

import numpy as np
import pytest

from softhand import CurvedLimit, SofthandError
from softhand.validation.pressures import limit_curve, power

MU, N, A = 0.6, 4.0, 0.005
CURVATURES = (0.0, 120.0, -80.0)
UNIT = np.array([1.0, 1.0, 1.0, 1.0 / A, 1.0 / A, 1.0 / A])
TWISTS = UNIT * np.random.default_rng(7).normal(size=(20, 6))


def limit(curvature: float) -> CurvedLimit:
    return CurvedLimit.of(MU, N, A, curvature)


@pytest.mark.parametrize("curvature", CURVATURES)
def test_the_wrench_is_the_slope_of_the_power(curvature: float) -> None:
    """By central differences, in general position; and the power is that of the wrench."""
    one = limit(curvature)
    for twist in TWISTS:
        steps = 1e-5 * np.diag(UNIT)
        slope = [(one.power(twist + step) - one.power(twist - step)) / 2e-5 for step in steps]
        wrench = one.wrench(twist)
        assert wrench * UNIT == pytest.approx(np.array(slope), abs=2e-6 * MU * N)
        assert wrench @ twist == pytest.approx(one.power(twist), rel=1e-12)


@pytest.mark.parametrize("curvature", CURVATURES)
def test_no_wrench_within_the_limit_takes_more_power(curvature: float) -> None:
    """Of any twist than the one that it drags along: the flow is associated, and the surface is convex."""
    one = limit(curvature)
    wrenches = np.array([one.wrench(twist) for twist in TWISTS])
    for twist, own in zip(TWISTS, wrenches, strict=True):
        assert np.all(wrenches @ twist <= own @ twist * (1.0 + 1e-12))
    assert one.power(3.0 * TWISTS[0]) == pytest.approx(3.0 * one.power(TWISTS[0]))
    assert one.power(TWISTS[0] + TWISTS[1]) <= one.power(TWISTS[0]) + one.power(TWISTS[1])


@pytest.mark.parametrize("centre", [0.1, 0.5, 1.0, 3.0])
def test_flat_it_is_the_limit_of_force_and_torsion(centre: float) -> None:
    """That of the quadrature of Hertz's pressure; no force along the normal, no moment about the tangents."""
    f_t, tau = limit_curve(power(2.0), [centre])[0]
    found = limit(0.0).wrench([0.0, centre * A, 0.0, 0.0, 0.0, -1.0]) * UNIT / (MU * N)
    assert found == pytest.approx([0.0, f_t, 0.0, 0.0, 0.0, -tau], abs=1e-3)
    assert limit(0.0).power([0.0, 0.0, 1.0, 300.0, -200.0, 0.0]) == 0.0
    assert limit(0.0).use([0.1, 0.0, 0.0, 1e-3, 0.0, 0.0]) == math.inf


@pytest.mark.parametrize("curvature", [120.0, -80.0])
def test_turned_about_the_middle_of_the_ball_every_place_slides(curvature: float) -> None:
    """Over |w x (r - c)|, with c = (0, 0, R) in the object where that bulges: none of it is across the surface."""
    one, centre = limit(curvature), np.array([0.0, 0.0, 1.0 / curvature])
    assert np.linalg.norm(one.places - centre, axis=1) == pytest.approx(1.0 / abs(curvature))
    assert one.normals == pytest.approx((centre - one.places) * curvature)
    for w in (np.array([7.0, 0.0, 0.0]), np.array([3.0, -5.0, 2.0])):
        slide = np.cross(w, one.places - centre)
        expected = float(one.limits @ np.linalg.norm(slide, axis=1))
        assert one.power([*-np.cross(w, centre), *w]) == pytest.approx(expected, rel=1e-12)


def test_it_bears_the_normal_force() -> None:
    """The pressure along the normals sums to f_z, on a bulging face as on a hollow one."""
    for curvature in CURVATURES:
        one = limit(curvature)
        assert np.sum(one.limits * one.normals[:, 2]) == pytest.approx(MU * N)


def test_a_bulging_face_gives_a_moment_against_the_roll() -> None:
    """Dragged along x the places lie in front of the plane of the contact, z > 0, so the moment about y is that."""
    bulging, hollow = limit(120.0).wrench([1.0, *[0.0] * 5]), limit(-80.0).wrench([1.0, *[0.0] * 5])
    assert bulging[4] > 1e-3 * MU * N * A and hollow[4] < -1e-3 * MU * N * A
    assert bulging[[1, 2, 3, 5]] == pytest.approx(np.zeros(4), abs=1e-12)


@pytest.mark.parametrize("curvature", CURVATURES)
def test_it_has_no_direction(curvature: float) -> None:
    """Turned about the normal; and in the mirror, where forces keep the sign across it and moments change it."""
    one = limit(curvature)
    c, s = math.cos(0.7), math.sin(0.7)
    R = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    turn = np.block([[R, np.zeros((3, 3))], [np.zeros((3, 3)), R]])
    mirror = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])
    for twist in TWISTS[:6]:
        assert turn @ one.wrench(twist) * UNIT == pytest.approx(one.wrench(turn @ twist) * UNIT, abs=2e-3 * MU * N)
        assert mirror * one.wrench(twist) * UNIT == pytest.approx(one.wrench(mirror * twist) * UNIT, abs=1e-11 * MU * N)


@pytest.mark.parametrize("curvature", CURVATURES)
def test_use_is_one_on_the_surface(curvature: float) -> None:
    one = limit(curvature)
    assert one.use(np.zeros(6)) == 0.0
    for twist in TWISTS[:2]:
        for share in (0.3, 1.0):
            assert one.use(share * one.wrench(twist)) == pytest.approx(share, rel=1e-6)


@pytest.mark.parametrize("curvature", CURVATURES)
def test_the_ellipsoid_meets_it_along_the_axes(curvature: float) -> None:
    """And is symmetric, convex, and off by less than 15 % elsewhere."""
    one = limit(curvature)
    E = one.ellipsoid()
    assert pytest.approx(E.T) == E and np.linalg.eigvalsh(E * np.outer(UNIT, UNIT)).min() > -1e-12
    for axis in np.diag(UNIT):
        assert axis @ E @ axis == pytest.approx(one.power(axis) ** 2, abs=1e-12)
    ratios = [math.sqrt(twist @ E @ twist) / one.power(twist) for twist in TWISTS]
    assert min(ratios) > 0.85 and max(ratios) < 1.15


def test_wrong_numbers_are_told() -> None:
    with pytest.raises(SofthandError, match="normal is -1"):
        CurvedLimit.of(MU, -1.0, A)
    with pytest.raises(SofthandError, match="exponent 0"):
        CurvedLimit.of(MU, N, A, exponent=0.0)
    with pytest.raises(SofthandError, match="must be below 1"):
        CurvedLimit.of(MU, N, A, 250.0)
