"""The limit surface: the lever of the spin, the ellipse, and the exact limit of a pressure."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad

from softhand.contact.limit import limit_of, limit_use, set_limit, spin_length
from softhand.contact.records import COLUMNS, CONTACT, OWN_PRESSURE, PAD
from softhand.laws.hertz import Hertz
from softhand.validation.pressures import Pressure, columns, lever, limit_curve, power

R = 0.010  # [m]
CENTRES = np.tan(0.5 * np.pi * np.linspace(0.0, 1.0, 25, endpoint=False))


def pad_of(radius: float = R, **fields: float) -> np.void:
    pad = np.zeros(1, PAD)
    pad["radius"] = radius
    for name, value in fields.items():
        pad[name] = value
    return pad[0]


def limited(depth: float, **fields: float) -> np.void:
    """A contact at a depth [m], with its limit."""
    contact = np.zeros(1, CONTACT)
    contact["distance"] = R - depth
    set_limit(pad_of(**fields), contact[0])
    return contact[0]


# ------------------------------------------------------------------------------------------------------ lever, ellipse


@pytest.mark.parametrize("depth", [1e-6, 2e-5, 4.9e-5, 5.1e-5, 1e-3, 2e-3, 3e-3, 4e-3])
def test_spin_length_is_the_mean_lever_of_the_columns(depth: float) -> None:
    """The columns of the paper's Fig. 4, dN = k_r (cos b - c) r^2 sin b db dg, press at R tan b from the middle."""
    c = 1.0 - depth / R
    top = np.arccos(c)
    force = quad(lambda b: (np.cos(b) - c) * np.sin(b), 0.0, top, epsabs=0.0, epsrel=1e-12)[0]
    moment = quad(lambda b: (np.cos(b) - c) * np.sin(b) * R * c * np.tan(b), 0.0, top, epsabs=0.0, epsrel=1e-12)[0]
    assert spin_length(pad_of(), R - depth) == pytest.approx(moment / force, rel=2e-8)


def test_spin_length_of_hertz() -> None:
    """The pressure p_0 sqrt(1 - (rho / a)^2) acts at 3 pi / 16 of the contact radius on average."""
    force = quad(lambda x: 2.0 * np.pi * x * np.sqrt(1.0 - x * x), 0.0, 1.0)[0]
    moment = quad(lambda x: 2.0 * np.pi * x * x * np.sqrt(1.0 - x * x), 0.0, 1.0)[0]
    assert Hertz.torsion_share == pytest.approx(moment / force, rel=1e-10)
    a = np.sqrt(R * 0.002)  # that of Hertz, a^2 = r dr
    assert spin_length(pad_of(torsion_share=Hertz.torsion_share), 0.008) == pytest.approx(moment / force * a, rel=1e-10)


def test_without_a_curve_the_limit_is_an_ellipse() -> None:
    """1 at (mu f_z, 0), at (0, mu f_z l) and on the ellipse between; a load without normal force is beyond it."""
    contact = limited(1e-3, torsion_length=0.003)
    for angle in np.linspace(0.0, 0.5 * np.pi, 7):
        s = 0.6 * 4.0 * np.cos(angle), -0.8 * 4.0 * np.cos(angle), -4.0 * np.sin(angle)
        assert limit_use(contact, s, 4.0) == pytest.approx(1.0, rel=1e-12)
    assert limit_use(contact, (0.0, 0.0, 0.0), 1.0) == 0.0
    assert limit_use(contact, (1e-9, 0.0, 0.0), 0.0) == np.inf


# --------------------------------------------------------------------------------------------------------- exact limit


def worst_use(contact: np.void, pressure: Pressure) -> float:
    """How far from 1 the use of the limit is on the exact curve, its forces in a general direction."""
    length = lever(pressure)
    return max(
        abs(limit_use(contact, (0.28 * f_t, -0.96 * f_t, -tau / length), 1.0) - 1.0)
        for f_t, tau in limit_curve(pressure, CENTRES)
    )


@pytest.mark.parametrize("depth", [2e-5, 5e-4, 1e-3, 2e-3, 3e-3, 4e-3, 4.9e-3])
def test_the_exact_limit_of_columns(depth: float) -> None:
    """Within 0.05 % of the integral over the pressure, at all ratios of force and torsion; the ellipse is 4 % off."""
    assert worst_use(limited(depth, limit=COLUMNS), columns(depth, R)) < 5e-4
    assert worst_use(limited(depth), columns(depth, R)) > 0.035


@pytest.mark.parametrize("k", [1.5, 2.0, 2.5, 4.0, 10.0])
def test_the_exact_limit_of_power_pressures(k: float) -> None:
    """p = (1 - x^k)^(1/k): within 0.05 %, by kappa alone; the ellipse is 5 % off."""
    kappa = lever(power(k))
    assert worst_use(limited(1e-3, limit=OWN_PRESSURE, kappa=kappa), power(k)) < 5e-4
    assert worst_use(limited(1e-3), power(k)) > 0.045


def test_a_given_lever_scales_the_torsion_and_keeps_the_curve() -> None:
    """`torsion_length` changes how much torsion there is, not the shape of the pressure."""
    own, given = limited(2e-3, limit=COLUMNS), limited(2e-3, limit=COLUMNS, torsion_length=0.007)
    assert given["lever"] == 0.007 and own["lever"] != given["lever"]
    np.testing.assert_array_equal(own["curve"], given["curve"])


def test_a_tip_pressed_flat_has_a_limit_that_is_a_number() -> None:
    """Without a disc to hold a spin with, the lever is not zero, so that nothing is divided by it."""
    contact = limited(1.1 * R, limit=COLUMNS)
    assert 0.0 < contact["lever"] < 1e-8
    assert np.isfinite(limit_use(contact, (0.3, -0.4, 0.1), 2.0))


@pytest.mark.parametrize("fields", [{}, {"limit": COLUMNS}, {"limit": OWN_PRESSURE, "kappa": 0.62}])
def test_normal_and_curvature_are_derivatives(fields: dict[str, float]) -> None:
    """e is half the gradient of H and e' its derivative, by differences, in general position and near both ends."""
    contact, rng = limited(1.7e-3, **fields), np.random.default_rng(2)
    points = [*rng.normal(size=(20, 3)), np.array([1e-4, 2e-4, -1.3]), np.array([0.9, -0.4, 1e-4])]

    def half(s: np.ndarray) -> float:
        return 0.5 * limit_of(contact["curve"], tuple(s))[0]

    def normal(s: np.ndarray) -> np.ndarray:
        return np.array(limit_of(contact["curve"], tuple(s))[1])

    step = 1e-6
    for s in points:
        e, by_s = normal(s), np.reshape(limit_of(contact["curve"], tuple(s))[2], (3, 3))
        moves = step * np.eye(3)
        np.testing.assert_allclose([(half(s + d) - half(s - d)) / (2 * step) for d in moves], e, atol=1e-8)
        found = np.column_stack([(normal(s + d) - normal(s - d)) / (2 * step) for d in moves])
        np.testing.assert_allclose(found, by_s, atol=2e-7 * max(1.0, 1.0 / np.linalg.norm(s)))


@pytest.mark.parametrize("depth", [1e-5, 1e-3, 3e-3, 5e-3, 9e-3])
def test_the_limit_is_convex(depth: float) -> None:
    """e' has no negative eigenvalue anywhere: friction of most dissipation is defined."""
    contact = limited(depth, limit=COLUMNS)
    for angle in np.linspace(0.0, 0.5 * math.pi, 181):
        s = (0.6 * math.cos(angle), 0.8 * math.cos(angle), math.sin(angle))
        by_s = np.reshape(limit_of(contact["curve"], s)[2], (3, 3))
        assert np.min(np.linalg.eigvalsh(by_s)) > 0.05


@pytest.mark.parametrize("ratio", [0.1, 0.5, 1.0, 2.0, 8.0])
def test_the_normal_is_the_motion(ratio: float) -> None:
    """On the exact curve at a centre d the normal points along (v, w l) = (d, l) within 0.2 deg."""
    pressure, contact = columns(1e-3, R), limited(1e-3, limit=COLUMNS)
    length = lever(pressure)
    f_t, tau = limit_curve(pressure, [ratio * length])[0]
    _, e, _ = limit_of(contact["curve"], (f_t, 0.0, tau / length))
    assert math.degrees(math.atan2(e[2], e[0]) - math.atan2(1.0, ratio)) == pytest.approx(0.0, abs=0.2)
