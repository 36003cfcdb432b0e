"""Fingertip laws: the paper's integrals, the derivatives, and what compiling does to a formula."""

from __future__ import annotations

import ctypes
import importlib
import subprocess
import sys
from fractions import Fraction
from math import acos, cos, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from hands import make_law
from scipy.integrate import dblquad

from softhand.errors import LawError
from softhand.laws.law import Law, compile_law
from softhand.laws.nakashima import Nakashima

FINGERTIPS = [
    make_law(),
    Nakashima(radius=0.013, k_r=0.21e6, k_phi=0.31e6, k_theta=0.071e9, k_psi=0.018e9),
]


@pytest.fixture(params=FINGERTIPS, ids=["reference", "other"])
def tip(request: pytest.FixtureRequest) -> Nakashima:
    """Two materials in turn."""
    return request.param


def call(function: object, law: Law, deformation: tuple[float, ...], phi: float, count: int) -> np.ndarray:
    """What the machine code of a law returns."""
    arguments = np.array([*deformation, phi, *law.parameters()])
    results = np.full(count, np.nan)
    pointers = [values.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for values in (arguments, results)]
    function.ctypes(*pointers)
    return results


def random_deformations(law: Law, count: int) -> list[tuple[tuple[float, ...], float]]:
    """Pressed deformations and angles phi from 20 to 160 deg."""
    rng = np.random.default_rng(4)
    depths = rng.uniform(0.02, 0.5, count) * law.radius
    angles = rng.uniform(-0.3, 0.3, (count, 3))
    phis = np.radians(np.concatenate([rng.uniform(20, 85, count // 2), rng.uniform(95, 160, count - count // 2)]))
    return [((depth, *angle), phi) for depth, angle, phi in zip(depths, angles, phis, strict=True)]


# ------------------------------------------------------------------------------------------------- the paper's formulas


@pytest.mark.parametrize("depth", [0.02, 0.1, 0.3, 0.6])
def test_radial_force_is_the_integral_of_eq_3(tip: Nakashima, depth: float) -> None:
    """Fr of (4) is the integral of the columns' normal forces (3) over the contact surface."""
    r, dr = tip.radius, depth * tip.radius

    def integrand(_gamma: float, beta: float) -> float:
        return 2.0 * tip.k_r * (1.0 - (r - dr) / (r * cos(beta))) * r**2 * sin(beta) * cos(beta)

    expected, _ = dblquad(integrand, 0.0, acos((r - dr) / r), 0.0, pi, epsabs=0.0, epsrel=1e-10)
    assert tip([dr, 0.0, 0.0, 0.0], 1.0)[0] == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("phi_deg", [20, 60, 90, 125, 160])
def test_phi_moment_is_the_integral_of_eq_5(tip: Nakashima, phi_deg: float) -> None:
    """Fphi of (6) is the integral of the moments (5) over the half disc."""
    r, phi, dphi = tip.radius, np.radians(phi_deg), 0.07

    def integrand(lever: float, _z: float) -> float:
        return lever * tip.k_phi * (dphi / (pi - phi) + dphi / phi)

    expected, _ = dblquad(integrand, -r, r, 0.0, lambda z: sqrt(max(r * r - z * z, 0.0)), epsabs=0.0, epsrel=1e-8)
    assert tip([0.001, 0.0, dphi, 0.0], phi - dphi)[2] == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("phi_deg", [15, 40, 60, 75, 90, 105, 120, 150])
def test_theta_moment_is_the_integral_of_eq_8(tip: Nakashima, phi_deg: float) -> None:
    """Ftheta of (9) is the integral of the shear (8), also beyond 90 deg, with |cos phi|.

    The torsion angle (7) reaches dtheta at x = r sin phi; beyond 90 deg it does so only with the absolute value.
    """
    r, phi, dtheta = tip.radius, np.radians(phi_deg), 0.05
    top = r * sin(phi)
    whole_angle = (r - sqrt(r * r - top * top)) / (r * (1.0 - abs(cos(phi)))) * dtheta
    assert whole_angle == pytest.approx(dtheta, rel=1e-9)

    def integrand(ring: float, x: float) -> float:
        strain_over_ring = dtheta / (r * (1.0 - abs(cos(phi)))) * x / sqrt(max(r * r - x * x, 1e-300))
        return 2.0 * pi * ring**3 * tip.k_theta * strain_over_ring

    expected, _ = dblquad(integrand, 0.0, top, 0.0, lambda x: sqrt(max(r * r - x * x, 0.0)), epsabs=0.0, epsrel=1e-9)
    assert tip([0.001, dtheta, 0.0, 0.0], phi)[1] == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("depth", [0.05, 0.2, 0.4, 0.8])
def test_torsion_moment_is_the_integral_of_eq_11(tip: Nakashima, depth: float) -> None:
    """Fpsi of (12) is the integral of the shear (11) over the flattened cap."""
    r, dr, dpsi = tip.radius, depth * tip.radius, 0.2
    disc = sqrt(r**2 - (r - dr) ** 2)

    def ring_radius(x: float) -> float:
        return sqrt(max(r**2 - (r - dr + x) ** 2, 0.0))

    def integrand(ring: float, x: float) -> float:
        return 2.0 * pi * ring**3 * tip.k_psi * dpsi / disc * (r - dr + x) / max(ring_radius(x), 1e-300)

    expected, _ = dblquad(integrand, 0.0, dr, 0.0, ring_radius, epsabs=0.0, epsrel=1e-9)
    assert tip([dr, 0.0, 0.0, dpsi], 1.0)[3] == pytest.approx(expected, rel=1e-7)


@pytest.mark.parametrize("dr", [0.0, -1e-6, -2e-3])
def test_separated_tip_neither_pulls_nor_twists(tip: Nakashima, dr: float) -> None:
    """Without compression there is no normal force and no torsion moment."""
    force = tip([dr, 0.1, 0.1, 0.3], 1.0)
    assert force[0] == 0.0
    assert force[3] == 0.0


def test_law_is_given_the_undeformed_angle(tip: Nakashima) -> None:
    """Calling a law with Phi evaluates the formula at phi = Phi + dphi."""
    deformation = (0.002, 0.05, 0.11, -0.2)
    expected = tip.force(*deformation, 0.9 + 0.11, *tip.parameters())
    np.testing.assert_array_equal(tip(deformation, 0.9), expected)


# ---------------------------------------------------------------------------------------------------------- derivatives


def test_stiffness_is_the_derivative_of_the_force(tip: Nakashima) -> None:
    """`stiffness` agrees with central differences at fixed Phi, where phi moves with dphi."""
    steps = np.array([1e-5 * tip.radius, 1e-5, 1e-5, 1e-5])
    for deformation, phi in random_deformations(tip, 12):
        contact_angle = phi - deformation[2]
        columns = []
        for j in range(4):
            move = np.eye(4)[j] * steps[j]
            columns.append((tip(deformation + move, contact_angle) - tip(deformation - move, contact_angle)) / 2.0)
        expected = np.array(columns).T
        analytic = np.reshape(tip.stiffness(*deformation, phi, *tip.parameters()), (4, 4)) * steps
        scale = np.max(np.abs(expected), axis=1, keepdims=True)
        np.testing.assert_allclose(analytic / scale, expected / scale, rtol=1e-7, atol=1e-8)


def test_missing_stiffness_is_taken_by_differences(tip: Nakashima) -> None:
    """A law without `stiffness` compiles, and its compiled differences meet the analytic derivatives to 1e-6."""

    class Bare(Law):
        """The paper's law, derivatives left out."""

        k_r: float
        k_phi: float
        k_theta: float
        k_psi: float

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius, k_r, k_phi, k_theta, k_psi):  # type: ignore[override,no-untyped-def]
            c = abs(cos(phi))
            depth = max(dr, 0.0)
            disc = depth * (2.0 * radius - depth)
            return (
                pi * k_r * depth**2,
                pi / 10.0 * k_theta * radius**4 * (1.0 + c + c**2 + c**3 + c**4) * dtheta,
                2.0 / 3.0 * k_phi * radius**3 * (1.0 / phi + 1.0 / (pi - phi)) * dphi,
                pi / 10.0 * k_psi * disc**2 * dpsi,
            )

    bare = Bare(**dict(tip))
    assert bare.stiffness is None
    code = compile_law(bare)
    for deformation, phi in random_deformations(tip, 12):
        expected = np.array(tip.stiffness(*deformation, phi, *tip.parameters()))
        differences = call(code.stiffness, bare, deformation, phi, 16)
        np.testing.assert_allclose(differences, expected, rtol=1e-6, atol=0.0)


# ------------------------------------------------------------------------------------------------------------ compiling


@pytest.mark.parametrize(("name", "count"), [("force", 4), ("stiffness", 16)])
def test_machine_code_equals_the_formula(tip: Nakashima, name: str, count: int) -> None:
    """The compiled code gives what the same formula gives in plain Python."""
    code = compile_law(tip)
    for deformation, phi in random_deformations(tip, 12):
        expected = getattr(tip, name)(*deformation, phi, *tip.parameters())
        np.testing.assert_allclose(call(getattr(code, name), tip, deformation, phi, count), expected, rtol=1e-14)


def test_parameters_follow_the_declaration(tip: Nakashima) -> None:
    """A law's parameters come in the order of its fields, the radius first."""
    np.testing.assert_array_equal(tip.parameters(), [tip.radius, tip.k_r, tip.k_phi, tip.k_theta, tip.k_psi])


def test_equal_formulas_of_two_laws_do_not_share_machine_code() -> None:
    """Two laws that differ in one number of their formula compile to different code."""

    class Soft(Law):
        """Ten newtons a metre."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
            return 10.0 * dr, 0.0, 0.0, 0.0

    class Hard(Law):
        """Twenty newtons a metre."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
            return 20.0 * dr, 0.0, 0.0, 0.0

    for law, expected in ((Soft(radius=0.01), 0.01), (Hard(radius=0.01), 0.02)):
        assert call(compile_law(law).force, law, (1e-3, 0.0, 0.0, 0.0), 1.0, 4)[0] == pytest.approx(expected)


def test_changed_constant_of_a_law_module_is_compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """When a constant that the formula reads from its module changes, the code kept on disk is not used again."""
    file = tmp_path / "law_with_a_constant.py"
    text = (
        "from softhand.laws.law import Law\n"
        "GAIN = {gain}\n"
        "class Constant(Law):\n"
        "    @staticmethod\n"
        "    def force(dr, dtheta, dphi, dpsi, phi, radius):\n"
        "        return GAIN * dr, 0.0, 0.0, 0.0\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    for gain in (100.0, 300.0):
        file.write_text(text.format(gain=gain))
        importlib.invalidate_caches()
        sys.modules.pop("law_with_a_constant", None)
        law = importlib.import_module("law_with_a_constant").Constant(radius=0.01)
        result = call(compile_law(law).force, law, (1e-3, 0.0, 0.0, 0.0), 1.0, 4)
        assert result[0] == pytest.approx(gain * 1e-3)


def test_wrong_argument_count_is_named() -> None:
    """A formula that does not take the law's fields is refused with the arguments that it must take."""

    class Short(Law):
        """Forgets its field."""

        k: float

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
            return dr, 0.0, 0.0, 0.0

    with pytest.raises(
        LawError, match=r"law 'Short': force must take dr, dtheta, dphi, dpsi, phi, radius, k \(7 numbers\)"
    ) as caught:
        compile_law(Short(radius=0.01, k=1.0))
    assert caught.value.law == "Short"


@pytest.mark.parametrize("count", [3, 5])
def test_wrong_result_count_is_named(count: int) -> None:
    """A formula that returns another count than four numbers is refused with the count that it must return."""

    class Wrong(Law):
        """Three or five numbers."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
            return (dr,) * count

    with pytest.raises(LawError, match=r"law 'Wrong': force must return 4 finite numbers, got \[0\.0001, "):
        compile_law(Wrong(radius=0.01))


def test_wrong_stiffness_count_is_named() -> None:
    """A `stiffness` that returns four numbers in place of sixteen is refused."""

    class Diagonal(Law):
        """Only the diagonal."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
            return dr, dtheta, dphi, dpsi

        @staticmethod
        def stiffness(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
            return 1.0, 1.0, 1.0, 1.0

    with pytest.raises(LawError, match="law 'Diagonal': stiffness must return 16 finite numbers"):
        compile_law(Diagonal(radius=0.01))


def test_formula_that_gives_nan_is_refused() -> None:
    """A formula without a finite value at a small deformation is refused."""

    class Undefined(Law):
        """Not a number."""

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
            return float("nan"), 0.0, 0.0, 0.0

    with pytest.raises(LawError, match="law 'Undefined': force must return 4 finite numbers"):
        compile_law(Undefined(radius=0.01))


class Exact(Law):
    """Plain Python runs it, the compiler does not."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius):  # type: ignore[override,no-untyped-def]
        """A third of the depth."""
        return dr * float(Fraction(1, 3)), 0.0, 0.0, 0.0


def test_uncompilable_formula_is_named() -> None:
    """A formula beyond plain numbers is refused by the law's name, with what to write instead."""
    with pytest.raises(LawError, match=r"law 'Exact': its formula cannot be compiled: .*plain numbers") as caught:
        compile_law(Exact(radius=0.01))
    assert caught.value.law == "Exact"


def test_uncompilable_formula_is_told_why() -> None:
    """The message quotes what the compiler stumbled over."""
    with pytest.raises(LawError, match="Fraction"):
        compile_law(Exact(radius=0.01))


_WITHOUT_MODULE = """
import softhand
from softhand.laws.law import compile_law

class Gel(softhand.Law):
    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius):
        return 4567.0 * dr, dtheta, dphi, dpsi

compile_law(Gel(radius=0.01))
"""


@pytest.mark.parametrize("name", [pytest.param("no_such_module", marks=pytest.mark.slow), "__main__"])
def test_a_law_typed_in_can_be_used_again_by_another_process(name: str) -> None:
    """Code that has no file compiles in each of two processes; what the first kept is no trap for the second."""
    program = f"exec(compile({_WITHOUT_MODULE!r}, '<typed>', 'exec'), {{'__name__': {name!r}}})"
    for _ in range(2):
        result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
        assert result.returncode == 0, result.stderr
