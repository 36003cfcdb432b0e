"""The laws beside the paper's: analytic cases, limits, energies, and target A with each of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hands import Array, make_law, numerical_jacobian
from scipy.integrate import quad

from softhand.assembly.build import simulate
from softhand.errors import ScenarioError, SimulationStopped
from softhand.laws.conservative import Conservative
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.parallel_distributed import ParallelDistributed
from softhand.laws.planar import Planar
from softhand.laws.point import Point
from softhand.laws.power import Power, pressure
from softhand.laws.radial import Radial
from softhand.plugins import SHIPPED, find_plugin
from softhand.scenario.scenario import load_scenario, with_law
from softhand.settings.settings import read_settings

R = 0.010  # [m]
NAMES = [name for name in SHIPPED["laws"] if name != "nakashima"]
LAWS: dict[str, Law] = {name: find_plugin("laws", name, "law")(radius=R) for name in NAMES}
SIZES = np.array([R, R, R, 1.0])


def deformations(law: Law, rng: np.random.Generator, count: int = 8) -> list[tuple[Array, float, float]]:
    """Deformation, Phi and bearing of pressed tips."""
    tangential = R if law.coordinates == "surface" else 1.0
    return [
        (
            np.array([rng.uniform(0.08, 0.4) * R, *rng.normal(0.0, 0.1 * tangential, 2), rng.normal(0.0, 0.02)]),
            rng.uniform(0.9, 1.4),
            rng.uniform(-3.0, 3.0),
        )
        for _ in range(count)
    ]


# ------------------------------------------------------------------------------------------------------ what all share


@pytest.mark.parametrize("name", [name for name in NAMES if LAWS[name].energy is not None])
def test_force_is_the_slope_of_the_energy(name: str, rng: np.random.Generator) -> None:
    """Where a law has an energy, its four forces are the derivatives of it, with their signs."""
    law = LAWS[name]
    if isinstance(law, Point):
        law = law.model_copy(update={"gamma": 1.0})
    for deformation, Phi, bearing in deformations(law, rng):

        def energy(move: Array, law: Law = law, at: tuple[Array, float, float] = (deformation, Phi, bearing)) -> float:
            assert law.energy is not None
            return law.energy(*law.arguments(at[0] + SIZES * move, *at[1:]))

        expected = numerical_jacobian(energy, 4, 1e-5) / SIZES
        np.testing.assert_allclose(law(deformation, Phi, bearing), expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_each_force_has_the_sign_of_its_displacement(name: str, rng: np.random.Generator) -> None:
    """A compressed tip pushes, and a larger displacement is answered by more force against it."""
    law = LAWS[name]
    for deformation, Phi, bearing in deformations(law, rng):
        assert law(deformation, Phi, bearing)[0] > 0.0
        for k in (1, 2, 3):
            move = np.eye(4)[k] * deformation[0] * (1.0 / R if SIZES[k] == 1.0 or law.coordinates == "polar" else 1.0)
            more, less = law(deformation + 0.1 * move, Phi, bearing), law(deformation - 0.1 * move, Phi, bearing)
            assert more[k] >= less[k]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("dr", [0.0, -1e-6, -2e-3])
def test_a_tip_that_does_not_touch_gives_no_normal_force_and_no_torsion(name: str, dr: float) -> None:
    """Without compression a law neither presses nor pulls; those in surface coordinates give nothing at all."""
    law = LAWS[name]
    force = law([dr, 0.001, -0.001, 0.2], 1.1)
    assert force[0] == 0.0 and force[3] == 0.0
    if law.coordinates == "surface":
        np.testing.assert_array_equal(force, 0.0)


@pytest.mark.parametrize("name", NAMES)
def test_no_law_sees_a_direction_in_the_face(name: str, rng: np.random.Generator) -> None:
    """Turning displacement and tip about the normal turns the force along, in surface coordinates."""
    law = LAWS[name]
    if law.coordinates == "polar":
        return
    for deformation, Phi, bearing in deformations(law, rng):
        angle = 0.7
        turn = np.eye(4)
        turn[1:3, 1:3] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
        expected = turn @ law(deformation, Phi, bearing)
        np.testing.assert_allclose(law(turn @ deformation, Phi, bearing + angle), expected, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("name", NAMES)
def test_target_a_runs_with_every_law(name: str) -> None:
    """Each law with its defaults carries target A to its end, within 0.1 mm and 0.1 deg.

    But where tips have moments, of which the controller knows nothing: see `test_moments`.
    """
    recording = simulate(with_law(load_scenario("target-a"), name))
    assert recording.complete
    if LAWS[name].moment is not None:
        assert np.linalg.norm(recording.contact_moment[-1], axis=1).max() > 1e-3
        return
    assert np.linalg.norm(recording.object_position[-1] - recording.object_position_desired[-1]) < 1e-4
    assert np.max(np.abs(recording.object_rpy[-1] - recording.object_rpy_desired[-1])) < math.radians(0.1)


@pytest.mark.parametrize("name", NAMES)
def test_defaults_answer_like_the_reference_tip(name: str) -> None:
    """At dr = 2.3 mm and Phi = 90 deg the default normal force is the paper's within 2 %, but for `point`."""
    expected = make_law()([0.0023, 0.0, 0.0, 0.0], 0.5 * math.pi)[0]
    found = LAWS[name]([0.0023, 0.0, 0.0, 0.0], 0.5 * math.pi)[0]
    if name == "point":
        assert found > 10.0 * expected
    else:
        assert found == pytest.approx(expected, rel=0.02)


# -------------------------------------------------------------------------------------------------------- conservative


@pytest.mark.parametrize("growth", [0.0, 5.1])
def test_conservative_has_the_papers_stiffness(growth: float) -> None:
    """It gives (4); the stiffness of (6) at phi = 90 deg and dr = 0.3 r; and (12), at any growth."""
    paper, law = make_law(), Conservative(radius=R, growth=growth)
    up = 0.5 * math.pi
    assert law([0.002, 0.0, 0.0, 0.0], up)[0] == pytest.approx(paper([0.002, 0.0, 0.0, 0.0], up)[0], rel=1e-14)
    dphi = 1e-4
    moment = paper([0.3 * R, 0.0, dphi, 0.0], up - dphi)[2]
    distance = 0.7 * R
    assert law([0.3 * R, 0.0, distance * dphi, 0.0], up)[2] * distance == pytest.approx(moment, rel=1e-8)
    assert law([0.002, 0.0, 0.0, 0.1], up)[3] == pytest.approx(paper([0.002, 0.0, 0.0, 0.1], up)[3], rel=1e-14)


def test_conservative_has_the_normal_force_that_the_paper_lacks() -> None:
    """Torsion adds (pi / 5) k_psi dpsi^2 dr (r - dr)(2 r - dr) to Fr."""
    law, dr, psi = Conservative(radius=R), 0.003, math.radians(20.0)
    added = law([dr, 0.0, 0.0, psi], 1.0)[0] - law([dr, 0.0, 0.0, 0.0], 1.0)[0]
    assert added == pytest.approx(math.pi / 5.0 * law.k_psi * psi**2 * dr * (R - dr) * (2.0 * R - dr), rel=1e-12)


@pytest.mark.parametrize("growth", [0.0, 5.1])
def test_conservative_stiffness_is_the_derivative_of_the_force(growth: float, rng: np.random.Generator) -> None:
    """`stiffness` agrees with differences, is symmetric, and vanishes where the tip does not touch."""
    law = Conservative(radius=R, growth=growth)
    for deformation, Phi, bearing in deformations(law, rng):

        def force(move: Array, at: tuple[Array, float, float] = (deformation, Phi, bearing)) -> Array:
            return law(at[0] + SIZES * move, *at[1:]) * SIZES

        expected = numerical_jacobian(force, 4, 1e-6)
        found = np.reshape(law.stiffness(*law.arguments(deformation, Phi, bearing)), (4, 4)) * np.outer(SIZES, SIZES)
        np.testing.assert_allclose(found, found.T, rtol=1e-14)
        np.testing.assert_allclose(found, expected, rtol=1e-6, atol=1e-9 * np.max(np.abs(expected)))
    np.testing.assert_array_equal(law.stiffness(*law.arguments([-0.001, 0.001, 0.002, 0.1], 1.0)), 0.0)


# ----------------------------------------------------------------------------------------------------------- the others


def test_radial_law_is_eq_4_with_its_k() -> None:
    """f_n = K dr^2, which is (4) for K = pi k_r; the stand-ins for rolling act alone."""
    law = Radial(radius=R, K=2e5, k_tangential=1e3, k_torsional=0.03)
    np.testing.assert_allclose(law([0.002, 0.0, 0.0, 0.0], 1.0), [0.8, 0.0, 0.0, 0.0], rtol=1e-14)
    np.testing.assert_allclose(law([0.002, 1e-3, -2e-3, 0.1], 1.0), [0.8, 1.0, -2.0, 0.003], rtol=1e-14)
    assert LAWS["radial"]([0.002, 0, 0, 0], 1.0)[0] == pytest.approx(make_law()([0.002, 0, 0, 0], 1.0)[0], rel=1e-14)


def test_parallel_distributed_at_the_apex_is_eq_4() -> None:
    """At thp = 0 and without shear F_n is (4) with k_r = E, and there is no tangential force."""
    law = ParallelDistributed(radius=R, E=make_law().k_r)
    expected = [make_law()([0.002, 0.0, 0.0, 0.0], 1.0)[0], 0.0, 0.0, 0.0]
    np.testing.assert_allclose(law([0.002, 0.0, 0.0, 0.0], 0.5 * math.pi), expected, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize("thp", [0.0, 0.3, 0.7])
def test_parallel_distributed_is_the_planar_law_in_its_plane(thp: float) -> None:
    """F_n, F_t and M are those of Inoue and Hirai; F_t is positive towards the apex, M turns the tip from it."""
    d, d_t, E = 0.002, 0.0004, 2.1e5
    law = ParallelDistributed(radius=R, E=E)
    cosine, tangent = math.cos(thp), math.tan(thp)
    F_n = math.pi * E * (d**2 / cosine**2 + 2.0 * d * d_t * tangent + d_t**2)
    F_t = math.pi * E * (d**2 * tangent + 2.0 * d * d_t)
    np.testing.assert_allclose(
        law([d, 0.0, d_t, 0.0], 0.5 * math.pi - thp), [F_n, 0.0, F_t, 0.0], rtol=1e-12, atol=1e-12
    )

    M = math.pi * E * (2.0 * d**3 * math.sin(thp) / (3.0 * cosine**3) + d**2 * d_t / cosine**2)

    def P(move: Array) -> float:
        return ParallelDistributed.energy(*law.arguments([d, 0.0, d_t, 0.0], 0.5 * math.pi - thp - float(move[0])))

    assert float(numerical_jacobian(P, 1)[0]) == pytest.approx(M, rel=1e-7, abs=1e-12)
    moment = law.moment(*law.arguments([d, 0.0, d_t, 0.0], 0.5 * math.pi - thp))
    np.testing.assert_allclose(moment, [-M, 0.0], rtol=1e-12, atol=1e-16)


def test_parallel_distributed_springs_push_along_the_axis_of_the_tip() -> None:
    """The tangential force on the object without shear lies along the lean of the tip's axis: towards the apex."""
    law, bearing = LAWS["parallel-distributed"], 0.4
    force = law([0.002, 0.0, 0.0, 0.0], 1.0, bearing)
    assert math.atan2(force[2], force[1]) == pytest.approx(bearing)


def test_planar_law_is_the_papers_in_its_plane() -> None:
    """Without dtheta and dpsi it is (4) and (6); with both stand-ins 0 it knows nothing else."""
    deformation = [0.002, 0.0, 0.07, 0.0]
    np.testing.assert_allclose(LAWS["planar"](deformation, 1.1), make_law()(deformation, 1.1), rtol=1e-14)
    bare = Planar(radius=R, k_tangential=0.0, k_torsional=0.0)
    np.testing.assert_array_equal(bare([0.002, 0.1, 0.07, 0.2], 1.1)[[1, 3]], 0.0)


def test_planar_stand_in_is_a_spring_across_the_plane() -> None:
    """Its stiffness in x_C is k_tangential: Ftheta over (R cosPhi)^2 dtheta."""
    law, Phi, dr = Planar(radius=R, k_tangential=1234.0), 1.1, 0.002
    lever = (R - dr) * math.cos(Phi)
    assert law([dr, 0.01, 0.05, 0.0], Phi)[1] == pytest.approx(1234.0 * lever**2 * 0.01, rel=1e-12)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_hertz_force_and_mindlin_stiffness(nu: float) -> None:
    """F = (4/3) E / (1 - nu^2) sqrt(r) d^1.5, k_t = 8 a G / (2 - nu), K = (16/3) G a^3, to 1e-12."""
    E, d = 3e5, 0.0007
    law = Hertz(radius=R, E=E, nu=nu)
    a, G = math.sqrt(R * d), E / (2.0 * (1.0 + nu))
    expected = [4.0 / 3.0 * E / (1.0 - nu**2) * math.sqrt(R) * d**1.5, 8.0 * a * G / (2.0 - nu) * 2e-4,
                -8.0 * a * G / (2.0 - nu) * 1e-4, 16.0 / 3.0 * G * a**3 * 0.1]  # fmt: skip
    np.testing.assert_allclose(law([d, 2e-4, -1e-4, 0.1], 1.0), expected, rtol=1e-12)


@pytest.mark.parametrize("zeta", [1.5, 1.7, 2.0])
def test_power_law_has_its_exponent(zeta: float) -> None:
    """Twice the depth is 2^zeta times the force."""
    law = Power(radius=R, c_d=2e4, zeta=zeta)
    ratio = law([0.002, 0.0, 0.0, 0.0], 1.0)[0] / law([0.001, 0.0, 0.0, 0.0], 1.0)[0]
    assert ratio == pytest.approx(2.0**zeta, rel=1e-13)


def test_power_law_is_hertz_and_the_paper_at_its_ends() -> None:
    """zeta = 1.5 with Hertz's coefficient is Hertz; zeta = 2 with pi k_r is (4)."""
    hertz = LAWS["hertz"]
    assert isinstance(hertz, Hertz)
    c_d = 4.0 / 3.0 * hertz.E / (1.0 - hertz.nu**2) * math.sqrt(R)
    deformation = [0.002, 0.0, 0.0, 0.0]
    assert Power(radius=R, c_d=c_d, zeta=1.5)(deformation, 1.0)[0] == pytest.approx(hertz(deformation, 1.0)[0])
    assert LAWS["power"](deformation, 1.0)[0] == pytest.approx(make_law()(deformation, 1.0)[0], rel=1e-14)


def test_power_law_below_hertz_is_refused() -> None:
    """gamma above 1/3 is no material: zeta below 1.5 is an error with the key."""
    with pytest.raises(ScenarioError, match=r"fingertip\.zeta.*1\.2.*>= 1\.5"):
        read_settings(Power, {"radius": R, "zeta": 1.2}, "fingertip")


@pytest.mark.parametrize("k", [1.8, 2.0, 4.0])
def test_pressure_of_the_power_law_carries_the_force(k: float) -> None:
    """The pressure integrates to N, and is Hertz's for k = 2: 1.5 N / (pi a^2) in the middle."""
    a, N = 0.004, 6.0
    total, _ = quad(lambda rho: 2.0 * math.pi * rho * float(pressure(rho, a, N, k)), 0.0, a, epsrel=1e-10)
    assert total == pytest.approx(N, rel=1e-7)
    assert float(pressure(0.0, a, N, 2.0)) == pytest.approx(1.5 * N / (math.pi * a**2), rel=1e-12)


def test_point_contact_is_stiff_and_limits_its_torsion() -> None:
    """Four penalties; the torsion moment stays within gamma times the normal force, on both sides."""
    law = Point(radius=R, k=4e4, k_tangential=3e4, k_torsional=0.5, gamma=1e-3)
    np.testing.assert_allclose(law([1e-4, 2e-5, -1e-5, 1e-3], 1.0), [4.0, 0.6, -0.3, 5e-4], rtol=1e-12)
    for sign in (1.0, -1.0):
        assert law([1e-4, 0.0, 0.0, sign * 0.5], 1.0)[3] == pytest.approx(sign * 4e-3, rel=1e-12)


# --------------------------------------------------------------------------------------------------------- out of range


class Adhesive(Law):
    """Pulls when it is pressed by more than 2 mm."""

    coordinates = "surface"

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius):  # type: ignore[no-untyped-def,override]
        """Radial springs with a fault."""
        normal = 1.2e6 * dr * dr if dr < 2.45e-3 else -1.0
        return max(dr, 0.0) / max(dr, 1e-9) * normal, 2500.0 * s1, 2500.0 * s2, 0.02 * psi


class Undefined(Adhesive):
    """Is no number when it is pressed by more than 2 mm."""

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius):  # type: ignore[no-untyped-def,override]
        """Radial springs with another fault."""
        normal = 1.2e6 * dr * dr if dr < 2.45e-3 else math.nan
        return max(dr, 0.0) / max(dr, 1e-9) * normal, 2500.0 * s1, 2500.0 * s2, 0.02 * psi


@pytest.mark.parametrize("stepper", ["midpoint", "rk4", "adaptive"])
@pytest.mark.parametrize(("law", "words"), [(Adhesive, "pulls with 1 N"), (Undefined, "NaN or infinity")])
def test_a_law_that_fails_on_the_way_is_stopped_by_name(law: type[Law], words: str, stepper: str) -> None:
    """NaN, or a pull while compressed, ends the run with the law, the finger and the time."""
    scenario = load_scenario("target-a", {"stepper": {"name": stepper, "step": 0.001}, "duration": 0.5})
    with pytest.raises(SimulationStopped, match=rf"'{law.__name__}' .*{words}.*at finger_._tip after t = 0\.") as stop:
        simulate(scenario, law=law(radius=R))
    assert stop.value.reason == "law" and stop.value.law == law.__name__
    assert not stop.value.recording.complete


def test_a_law_beyond_its_range_is_told_in_the_recording() -> None:
    """A run that leaves what its law is meant for goes on; the recording and the summary say where, once."""
    import softhand

    recording = simulate(with_law(load_scenario("target-a", {"duration": 0.1}), "hertz"))
    assert recording.complete
    note = recording.attributes["out_of_range"]
    assert "finger_1_tip goes to dr = 0.2" in note and "beyond dr = 0.1 r at t = 0 s" in note and "'Hertz'" in note
    assert softhand.summarize(recording).warnings().count(note) == 1


def test_a_law_within_its_range_has_no_note() -> None:
    """Nothing is said where nothing is to say."""
    assert "out_of_range" not in simulate(with_law(load_scenario("target-a", {"duration": 0.1}), "radial")).attributes


def test_a_law_that_pulls_from_the_start_is_refused() -> None:
    """The wrong sign of the normal force is found before a run."""
    from softhand.errors import LawError
    from softhand.laws.law import compile_law

    class Turned(Law):
        """Pulls."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[no-untyped-def,override]
            return -100.0 * dr, dtheta, dphi, dpsi

    with pytest.raises(LawError, match=r"'Turned': its normal force is -0\.01 N at dr = 0\.1 mm"):
        compile_law(Turned(radius=R))
