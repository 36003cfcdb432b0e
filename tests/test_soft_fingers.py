"""The laws of whole fingers, `fingerpad` and `bulk`: what their sources say, derivatives, and a pinch by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hands import numerical_jacobian
from scipy.integrate import quad
from scipy.optimize import brentq

import softhand
from softhand.contact.limit import limit_use, set_limit
from softhand.contact.records import CONTACT, OWN_PRESSURE
from softhand.contact.records import PAD as PAD_ROW
from softhand.laws.bulk import Bulk
from softhand.laws.fingerpad import Fingerpad
from softhand.laws.law import Law
from softhand.validation.pressures import limit_curve

R = 0.010  # [m]
UP = 0.5 * math.pi
LAWS: list[Law] = [Fingerpad(radius=R, b=310.0, m=1100.0, c=0.7), Bulk(radius=R, k_along=3100.0, k_across=1900.0)]
PAD = LAWS[0]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_stiffness_is_the_second_derivative_of_the_energy(law: Law, rng: np.random.Generator) -> None:
    """In general position, symmetric, and nothing where the tip does not touch."""
    sizes = np.array([R, R, R, 1.0])
    assert law.stiffness is not None and law.energy is not None
    for depth in (2e-4, 4e-4, 1e-3, 3e-3):
        at = np.array([depth, *rng.normal(0.0, 1e-3, 2), rng.normal(0.0, 0.2)])
        Phi, bearing = rng.uniform(0.9, 1.5), rng.uniform(-3.0, 3.0)

        def force(move: Any, at: Any = at, Phi: float = Phi, bearing: float = bearing) -> Any:
            return law(at + sizes * move, Phi, bearing) * sizes

        def energy(move: Any, at: Any = at, Phi: float = Phi, bearing: float = bearing) -> float:
            assert law.energy is not None
            return law.energy(*law.arguments(at + sizes * move, Phi, bearing))

        found = np.reshape(law.stiffness(*law.arguments(at, Phi, bearing)), (4, 4)) * np.outer(sizes, sizes)
        expected = numerical_jacobian(force, 4, 1e-6)
        np.testing.assert_array_equal(found, found.T)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-8 * np.max(np.abs(expected)))
        slope, size = numerical_jacobian(energy, 4, 1e-5), np.max(np.abs(force(np.zeros(4))))
        np.testing.assert_allclose(force(np.zeros(4)), slope, rtol=1e-5, atol=1e-5 * size)
    np.testing.assert_array_equal(law.stiffness(*law.arguments([-1e-3, 1e-3, 2e-3, 0.1], 1.0)), 0.0)


# ----------------------------------------------------------------------------------------------------------- fingerpad


def test_a_pad_gets_stiffer_by_its_force() -> None:
    """dF/dd = b + m F at any depth, from nothing at touch: the equation of which the exponential is the solution."""
    for depth in (1e-5, 5e-4, 2e-3, 4e-3):
        at = PAD.arguments([depth, 0.0, 0.0, 0.0], UP)
        assert PAD.stiffness is not None
        assert PAD.stiffness(*at)[0] == pytest.approx(310.0 + 1100.0 * PAD.force(*at)[0], rel=1e-12)
    assert PAD([1e-7, 0.0, 0.0, 0.0], UP)[0] == pytest.approx(310.0 * 1e-7, rel=1e-3)


def test_the_shear_of_a_pad_is_linear_in_its_force() -> None:
    """k_t = c (b + m F) and K_psi = k_t r d from 1 mm on; at a tenth of that it lets go."""
    for depth in (1e-3, 2e-3, 3e-3):
        normal, f_1, f_2, tau = PAD([depth, 1e-9, -2e-9, 1e-9], 1.2, 0.4)
        k_t = 0.7 * (310.0 + 1100.0 * normal)
        assert [f_1, f_2, tau] == pytest.approx([1e-9 * k_t, -2e-9 * k_t, 1e-9 * k_t * R * depth], rel=1e-6)
    assert PAD([1e-4, 1e-9, 0.0, 0.0], UP)[1] < 0.2 * 0.7 * 310.0 * 1e-9 * 1.2


def test_the_torsion_of_a_pad_is_that_of_an_inverted_paraboloid() -> None:
    """Mean distance of 1 - rho^2 / a^2 from its middle; a deeper pad holds more of it by one newton."""
    moment, _ = quad(lambda x: x * x * (1.0 - x * x), 0.0, 1.0)
    force, _ = quad(lambda x: x * (1.0 - x * x), 0.0, 1.0)
    assert Fingerpad.torsion_share == pytest.approx(moment / force, rel=1e-12)


def test_the_limit_of_a_pad_is_that_of_its_pressure() -> None:
    """Within 0.3 % of the integral over the paraboloid at all ratios of force and torsion, the ellipse is 5.6 % off."""
    pad, contact = np.zeros(1, PAD_ROW), np.zeros(1, CONTACT)
    pad["radius"], pad["torsion_share"], pad["kappa"], pad["limit"] = R, 8.0 / 15.0, 8.0 / 15.0, OWN_PRESSURE
    contact["distance"] = R - 1e-3
    set_limit(pad[0], contact[0])
    curve = limit_curve(lambda x: 1.0 - x * x, np.tan(0.5 * math.pi * np.linspace(0.0, 0.98, 30)))
    uses = [limit_use(contact[0], (0.6 * f, -0.8 * f, tau * 15.0 / 8.0), 1.0) for f, tau in curve]
    assert np.abs(np.array(uses) - 1.0).max() < 3e-3


def test_a_pad_turns_on_its_plate_when_the_torsion_is_used_up() -> None:
    """Two pads of 8 N at mu = 0.6, twisted by a moment that grows: they go at 2 (8/15) mu N sqrt(r d), to a step."""
    depth = math.log1p(8.0 * 900.0 / 700.0) / 900.0
    most = 2.0 * 8.0 / 15.0 * 0.6 * 8.0 * math.sqrt(R * depth)
    moments = np.linspace(0.8, 1.2, 41) * most
    pushes = [{"moment": [float(x), 0.0, 0.0], "start": 0.01 * k, "duration": 0.01} for k, x in enumerate(moments)]
    damping = {"name": "kelvin-voigt", "radial": 5.0, "tangential": 10.0, "torsional": 4e-3}
    run = softhand.simulate(
        pinched({"law": "fingerpad", "b": 700.0, "m": 900.0, "damping": damping}).replace(
            {"push": pushes, "duration": 0.41}
        )
    )
    twist = run.slip_twist.max(axis=1)
    began = run.time[np.argmax(twist > 0.0)]
    assert moments[int(began / 0.01 - 1e-9)] == pytest.approx(most, rel=0.03)


def test_how_much_shear_a_pad_bears() -> None:
    """With y = F + b/m the pressing force under a shear f is y + f^2 / (2 c y) - b/m: its least, f sqrt(2/c) - b/m, is
    what it takes to keep the pad from peeling off, at y = f / sqrt(2 c)."""
    for shear in (1.0, 3.0, 6.0):  # [N]

        def pressing(depth: float, shear: float = shear) -> float:
            s = shear / PAD([depth, 1.0, 0.0, 0.0], UP)[1]
            return float(PAD([depth, s, 0.0, 0.0], UP)[0])

        depths = np.linspace(8e-4, 4e-3, 2000)
        found = [pressing(depth) for depth in depths]
        assert min(found) == pytest.approx(shear * math.sqrt(2.0 / 0.7) - 310.0 / 1100.0, rel=1e-5)
        F = PAD([depths[np.argmin(found)], 0.0, 0.0, 0.0], UP)[0]
        assert pytest.approx(shear / math.sqrt(2.0 * 0.7), rel=5e-3) == F + 310.0 / 1100.0


# ---------------------------------------------------------------------------------------------------------------- bulk


def test_a_finger_has_the_stiffness_of_a_turned_spring(rng: np.random.Generator) -> None:
    """f = Q diag(k_along, k_across, k_across) Q^T u, Q with the axis of the finger in its first column."""
    law = Bulk(radius=R, k_along=3100.0, k_across=1900.0, k_torsional=0.04)
    for _ in range(6):
        Phi, bearing = rng.uniform(0.8, 1.5), rng.uniform(-3.0, 3.0)
        u = np.array([*rng.normal(0.0, 1e-3, 2), rng.uniform(1e-3, 3e-3)])  # along x_C, y_C, z_C
        axis = np.array([math.cos(Phi) * math.cos(bearing), math.cos(Phi) * math.sin(bearing), math.sin(Phi)])
        Q, _ = np.linalg.qr(np.column_stack([axis, rng.normal(size=(3, 2))]))
        f_1, f_2, f_n = Q @ np.diag([3100.0, 1900.0, 1900.0]) @ Q.T @ u
        found = law([u[2], u[0], u[1], 0.3], Phi, bearing)
        np.testing.assert_allclose(found, [f_n, f_1, f_2, 0.04 * 0.3], rtol=1e-12)


def pinched(law: dict[str, Any]) -> softhand.Scenario:
    """A box between two jaws that press with 8 N at its middle, without gravity."""
    return softhand.load_scenario(
        "gripper",
        {
            "fingertip": {**law, "radius": R, "friction": 0.6, "contact": "coulomb"},
            "gravity": [0.0, 0.0, 0.0],
            "object.position": [0.0, 0.0, 0.080],
            "grasp.contact_points": [[-0.028, 0.0, 0.0], [0.028, 0.0, 0.0]],
            "reference": {"kind": "hold"},
        },
    )


def pinch(law: dict[str, Any]) -> np.ndarray:
    """Stiffness of the box between the jaws, these locked, shape (6, 6)."""
    return softhand.grasp_stiffness(pinched(law), joints="locked").stiffness


def test_a_pinch_with_bulk_stiffness_is_as_stiff_as_by_hand() -> None:
    """A turn about an axis across the squeeze shifts the faces over the tips, moves the line of the squeeze, and leans
    the tips: K = 2 (k_across l^2 + N (l + r - d) - (k_along - k_across) d (2 l + d)), l half the width of the box."""
    k_along, k_across, N, half = 3400.0, 1500.0, 8.0, 0.028
    found = pinch({"law": "bulk", "k_along": k_along, "k_across": k_across, "k_torsional": 0.03})
    d = N / k_along
    turn = 2.0 * (k_across * half**2 + N * (half + R - d) - (k_along - k_across) * d * (2.0 * half + d))
    expected = [2.0 * k_along, 2.0 * k_across, 2.0 * k_across, 2.0 * 0.03, turn, turn]
    np.testing.assert_allclose(found, np.diag(expected), rtol=1e-6, atol=1e-6 * 2.0 * k_along)
    assert found[4, 4] == pytest.approx(turn, rel=1e-6)


def test_a_pinch_of_fingerpads_is_as_stiff_as_by_hand() -> None:
    """As above, of a law that knows no lean: K = 2 (k_t l^2 + N (l + r - d)), and 2 k_t r d about the squeeze."""
    b, m, c, N, half = 700.0, 900.0, 0.6, 8.0, 0.028
    found = pinch({"law": "fingerpad", "b": b, "m": m, "c": c})
    d = brentq(lambda x: b / m * math.expm1(m * x) - N, 1e-4, 5e-3, xtol=1e-15)
    k_n = b + m * N
    turn = 2.0 * (c * k_n * half**2 + N * (half + R - d))
    expected = [2.0 * k_n, 2.0 * c * k_n, 2.0 * c * k_n, 2.0 * c * k_n * R * d, turn, turn]
    np.testing.assert_allclose(np.diag(found), expected, rtol=1e-6)
