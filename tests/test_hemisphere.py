"""The law of one material: its limits, its energy, its scaling, and what it makes of the paper's coefficients."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hands import Array, make_law, numerical_jacobian
from scipy.integrate import quad

from softhand.errors import ScenarioError
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.hertz import Hertz
from softhand.settings.settings import read_settings

R, G = 0.010, 5e4  # [m], [N/m^2]
SIZES = np.array([R, R, R, 1.0])
UP = 0.5 * math.pi


def general(rng: np.random.Generator, count: int = 12) -> list[Array]:
    """Deformations with all four parts, from shallow to deep."""
    return [
        np.array([R * depth, *rng.normal(0.0, 0.1 * R, 2), rng.normal(0.0, 0.2)])
        for depth in np.linspace(0.01, 0.6, count)
    ]


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_stiffness_is_the_second_derivative_of_the_energy(nu: float, rng: np.random.Generator) -> None:
    """Against differences of the force, itself against differences of the energy; symmetric, so free of curl."""
    law = Hemisphere(radius=R, G=G, nu=nu)
    for deformation in general(rng):

        def force(move: Array, at: Array = deformation) -> Array:
            return law(at + SIZES * move, 1.0, 0.3) * SIZES

        def energy(move: Array, at: Array = deformation) -> float:
            return law.energy(*law.arguments(at + SIZES * move, 1.0, 0.3))

        size = float(np.max(np.abs(force(np.zeros(4)))))
        np.testing.assert_allclose(force(np.zeros(4)), numerical_jacobian(energy, 4, 1e-5), rtol=1e-5, atol=1e-5 * size)
        found = np.reshape(law.stiffness(*law.arguments(deformation, 1.0, 0.3)), (4, 4)) * np.outer(SIZES, SIZES)
        np.testing.assert_allclose(found, found.T, rtol=1e-14)
        expected = numerical_jacobian(force, 4, 1e-6)
        np.testing.assert_allclose(found, expected, rtol=1e-5, atol=1e-7 * np.max(np.abs(expected)))


def test_no_work_is_won_around_a_loop(rng: np.random.Generator) -> None:
    """Around a closed way through all four coordinates the law does no work; the paper's law does."""
    law, middle = Hemisphere(radius=R, G=G), np.array([0.25 * R, 0.05 * R, -0.03 * R, 0.1])
    first, second = rng.normal(0.0, 0.05, (2, 4)) * SIZES

    def power(t: float) -> float:
        at = middle + math.cos(t) * first + math.sin(t) * second
        return float(law(at, 1.0) @ (math.cos(t) * second - math.sin(t) * first))

    work, _ = quad(power, 0.0, 2.0 * math.pi, epsabs=1e-15)
    there, _ = quad(lambda t: abs(power(t)), 0.0, 2.0 * math.pi, limit=200)
    assert abs(work) < 1e-9 * there


@pytest.mark.parametrize("nu", [0.1, 0.3, 0.5])
def test_a_light_touch_is_hertz_with_the_disc(nu: float) -> None:
    """As d goes to 0 force and torsion are those of `hertz` with E = 2 (1 + nu) G."""
    law, hertz = Hemisphere(radius=R, G=G, nu=nu), Hertz(radius=R, E=2.0 * (1.0 + nu) * G, nu=nu)
    for depth, share in ((1e-3, 4e-3), (1e-5, 4e-5)):
        touch = [depth * R, 0.0, 0.0, 1e-6]
        assert np.max(np.abs(law(touch, UP)[[0, 3]] / hertz(touch, UP)[[0, 3]] - 1.0)) < share


@pytest.mark.parametrize("nu", [0.1, 0.3, 0.5])
@pytest.mark.parametrize("depth", [0.15, 0.3, 0.5])
def test_shear_is_the_disc_and_the_slices_behind_it(depth: float, nu: float) -> None:
    """1 / k_t is that of Mindlin's disc and the limit of the slices in series at the apex, by quadrature."""
    law, phi = Hemisphere(radius=R, G=G, nu=nu), math.radians(89.99)
    # of dx / (r^2 - x^2)^2 from 0 to r sin phi, with x = r tanh w
    twists, _ = quad(lambda w: math.cosh(w) ** 2 / R**3, 0.0, math.atanh(math.sin(phi)), epsrel=1e-10)
    lever = (1.0 - depth) * R * math.cos(phi)
    slices = lever**2 / (0.5 * math.pi * G / twists)
    disc = (2.0 - nu) / (8.0 * G * math.sqrt(R * depth * R))
    assert law([depth * R, 1e-6, 0.0, 0.0], UP)[1] == pytest.approx(1e-6 / (disc + slices), rel=1e-5)


def test_the_apex_is_an_angle_like_any_other(rng: np.random.Generator) -> None:
    """Neither the angle nor the bearing changes the force: no pole, and rolling at fixed s and psi does no work."""
    law = Hemisphere(radius=R, G=G)
    for deformation in general(rng, 4):
        for Phi in (0.3, 1.5, UP, 1.6):
            np.testing.assert_array_equal(law(deformation, Phi, rng.uniform(-3, 3)), law(deformation, UP))


def test_it_scales_as_a_material_must(rng: np.random.Generator) -> None:
    """Force goes with G r^2, torsion with G r^3, at equal depth and shear over r; energy with G r^3."""
    law, other = Hemisphere(radius=R, G=G, nu=0.4), Hemisphere(radius=2.5 * R, G=7.0 * G, nu=0.4)
    for deformation in general(rng, 5):
        larger = deformation * [2.5, 2.5, 2.5, 1.0]
        expected = 7.0 * 2.5**2 * law(deformation, 1.0) * [1.0, 1.0, 1.0, 2.5]
        np.testing.assert_allclose(other(larger, 1.0), expected, rtol=1e-12)
        found = other.energy(*other.arguments(larger, 1.0)) / law.energy(*law.arguments(deformation, 1.0))
        assert found == pytest.approx(7.0 * 2.5**3, rel=1e-12)


@pytest.mark.parametrize("mirrored", [[1.0, -1.0, 1.0, -1.0], [1.0, 1.0, -1.0, -1.0]])
def test_a_mirror_image_answers_in_the_mirror(mirrored: list[float], rng: np.random.Generator) -> None:
    """A mirror across the face turns the displacement along one axis and the twist."""
    law = Hemisphere(radius=R, G=G)
    for deformation in general(rng, 4):
        np.testing.assert_allclose(law(deformation * mirrored, 1.0), law(deformation, 1.0) * mirrored, rtol=1e-14)


def test_it_becomes_the_papers_4_and_12() -> None:
    """One G stands for k_r = 6.8 G in (4), and for k_psi = 12.3 G / r in (12) from d = 0.2 r on, within 10 %.

    At 0.1 r (12) is a fifth softer, since its torsion goes with d^2 and that of a disc with d^1.5.
    """
    law = Hemisphere(radius=R, G=G)
    paper = make_law().model_copy(update={"k_r": 6.8 * G, "k_psi": 12.3 * G / R})
    for depth in (0.1, 0.2, 0.3, 0.4):
        found, expected = (one([depth * R, 0.0, 0.0, 1e-6], UP) for one in (law, paper))
        assert found[0] == pytest.approx(expected[0], rel=0.11)
        assert expected[3] / found[3] == pytest.approx(0.8 if depth == 0.1 else 1.0, abs=0.02 if depth == 0.1 else 0.1)


# C, G of the finite elements of a bonded neo-Hookean hemisphere from outside: F / (G r^2), K / (G r^3)
ELSEWHERE = {0.1: (0.220, 0.180), 0.2: (0.778, 0.517), 0.3: (1.834, 0.999)}


@pytest.mark.parametrize("depth", ELSEWHERE)
def test_it_is_near_finite_elements_from_elsewhere(depth: float) -> None:
    """Normal force and torsion within 5 % of a run that the law was not fitted to."""
    force, torsion = ELSEWHERE[depth]
    found = Hemisphere(radius=R, G=G)([depth * R, 0.0, 0.0, 1e-6], UP)
    assert found[0] / (G * R**2) == pytest.approx(force, rel=0.05)
    assert found[3] / (1e-6 * G * R**3) == pytest.approx(torsion, rel=0.05)


def test_a_material_that_cannot_be_is_refused() -> None:
    """Poisson's ratio above 0.5 names the key and the value."""
    with pytest.raises(ScenarioError, match=r"fingertip\.nu.*0\.6.*<= 0\.5"):
        read_settings(Hemisphere, {"radius": R, "nu": 0.6}, "fingertip")
