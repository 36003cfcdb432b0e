"""Identification: coefficients and intervals, what data cannot tell, files and their units, comparison of laws."""

from __future__ import annotations

import importlib.util
from itertools import product
from math import pi, sqrt
from typing import Annotated, ClassVar

import numpy as np
import pytest
from hands import REPOSITORY, make_law
from pydantic import Field
from scipy.stats import binom

from softhand.contact.kinematics import deformation_jacobian
from softhand.errors import MeasurementError
from softhand.identification.comparison import compare_laws
from softhand.identification.fit import fit_law
from softhand.identification.measurements import EXAMPLE, Measurements, read_length, read_measurements
from softhand.identification.polar import polar_force
from softhand.identification.report import toml_snippet
from softhand.identification.sweeps import find_sweeps
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.plots.angle_force import axial_force, draw_angle_force
from softhand.plots.identification import draw_fit
from softhand.plots.style import save_figure
from softhand.scenario.file import read_toml
from softhand.scenario.scenario import load_scenario
from softhand.settings.settings import Positive

RADIUS = 0.010  # [m]


class Power(Law):
    """A power of the compression, linear springs for the rest."""

    c: Positive
    zeta: Positive
    k: Positive

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, c, zeta, k):
        """See the class."""
        return c * (max(dr, 0.0) / radius) ** zeta, k * dtheta, k * dphi, k * dpsi


class Hertz(Law):
    """Sphere on a plane: the same two coefficients in all directions."""

    E: Positive
    """Modulus of elasticity [N/m^2]."""
    nu: float = 0.5

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, E, nu):
        """See the class."""
        depth = max(dr, 0.0)
        G, a = E / (2.0 * (1.0 + nu)), sqrt(radius * depth)
        tangential = 8.0 * a * G / (2.0 - nu) * radius**2
        normal = 4.0 / 3.0 * E / (1.0 - nu * nu) * sqrt(radius) * depth**1.5
        return normal, tangential * dtheta, tangential * dphi, 16.0 / 3.0 * G * a**3 * dpsi


class Pair(Law):
    """One coefficient in two components."""

    k: Positive

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k):
        """See the class."""
        return k * dr, k * radius**2 * dtheta, 0.0, 0.0


def measure(law: Law, settings: list[tuple[int, float, float, float]], noise=(0, 0, 0, 0), rng=None) -> Measurements:
    """Forces of a law: (component, phi [deg], dr [mm], angle [deg]) a row; only that component is measured."""
    count = len(settings)
    phi, deformation, force = np.zeros(count), np.zeros((count, 4)), np.full((count, 4), np.nan)
    for k, (component, angle, dr, turn) in enumerate(settings):
        phi[k], deformation[k, 0] = np.radians(angle), 1e-3 * dr
        if component:
            deformation[k, component] = np.radians(turn)
        exact = law.force(*deformation[k], phi[k], *law.parameters())[component]
        force[k, component] = exact + (noise[component] * rng.normal() if rng is not None else 0.0)
    return Measurements(phi, deformation, force, RADIUS)


ALL = [(c, phi, dr, turn) for c, phi, dr, turn in product(range(4), (80, 55), (1.5, 3.0), (6.0, -15.0))]
NAMES = ("k_r", "k_theta", "k_phi", "k_psi")


# --------------------------------------------------------------------------------------------------------- coefficients


def test_exact_data_give_back_the_coefficients(rng):
    """The four coefficients of the paper's law, random ones, from exact forces to 1e-10."""
    law = Nakashima(radius=RADIUS, **dict(zip(NAMES, 10.0 ** rng.uniform(4.0, 8.0, 4), strict=True)))
    fit = fit_law(measure(law, ALL), Nakashima, RADIUS)
    for name in NAMES:
        assert fit.estimate(name).value == pytest.approx(getattr(law, name), rel=1e-10)
    assert fit.law()(np.array([0.002, 0.1, 0.1, 0.1]), 1.0) == pytest.approx(law([0.002, 0.1, 0.1, 0.1], 1.0), rel=1e-9)


def test_the_radial_coefficient_minimises_the_papers_J(rng):
    """k_r from noisy data is that of the normal equation of J_r: sum F x / sum x^2 with x = pi dr^2."""
    data = measure(make_law(), ALL, (0.5, 2e-3, 2e-3, 1e-3), rng)
    pressed = data.force[:, 0][np.isfinite(data.force[:, 0])]
    x = pi * data.deformation[np.isfinite(data.force[:, 0]), 0] ** 2
    assert fit_law(data, Nakashima, RADIUS).estimate("k_r").value == pytest.approx(np.sum(pressed * x) / np.sum(x**2))


@pytest.mark.parametrize(
    "law",
    [Power(radius=RADIUS, c=40.0, zeta=1.6, k=0.12), Power(radius=RADIUS, c=700.0, zeta=3.4, k=2.0),
     Hertz(radius=RADIUS, E=2.1e5, nu=0.41)],
)  # fmt: skip
def test_a_law_with_exponents_and_ratios_is_fitted_too(law):
    """Coefficients that the force is not linear in come back to 1e-8, without a start being given."""
    fit = fit_law(measure(law, ALL), type(law), RADIUS)
    for name, value in dict(law).items():
        if name != "radius":
            assert fit.estimate(name).value == pytest.approx(value, rel=1e-8)


class Sheet(Law):
    """Springs along the face, in surface coordinates."""

    coordinates: ClassVar[str] = "surface"
    k: Positive
    k_turn: Positive

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, k, k_turn):
        """See the class."""
        return 2.0 * k * dr, k * s1, 1.5 * k * (1.0 + lean1 + 2.0 * lean2) * s2, k_turn * psi


def test_laws_in_surface_coordinates_answer_to_the_papers_deformation():
    """Displacement J_delta delta, force J_delta^T C_F, with J_delta of (37), (42); x_F leans along y_C by cos Phi."""
    delta, Phi, J_delta = np.array([0.002, 0.1, -0.2, 0.15]), 0.9, np.zeros((4, 4))
    deformation_jacobian(RADIUS - delta[0], np.sin(Phi), np.cos(Phi), J_delta)
    s_x, s_y, _, psi = J_delta @ delta
    f_n, f_x, f_y, tau = Sheet.force(delta[0], s_x, s_y, psi, 0.0, np.cos(Phi), RADIUS, 500.0, 0.02)
    expected = J_delta.T @ [f_x, f_y, f_n, tau]
    found = polar_force(Sheet, (RADIUS, 500.0, 0.02), (*delta, Phi + delta[2]))
    assert found == pytest.approx(expected, rel=1e-12)


def test_a_law_in_surface_coordinates_is_fitted(rng):
    """Its coefficients come back from forces about the paper's deformation."""
    data = measure(make_law(), ALL)
    imposed = np.column_stack([data.deformation, data.phi])
    exact = np.array([polar_force(Sheet, (RADIUS, 2500.0, 0.03), row) for row in imposed.tolist()])
    fit = fit_law(
        Measurements(data.phi, data.deformation, np.where(np.isnan(data.force), np.nan, exact)), Sheet, RADIUS
    )
    assert fit.estimate("k").value == pytest.approx(2500.0, rel=1e-10)
    assert fit.estimate("k_turn").value == pytest.approx(0.03, rel=1e-10)


def test_coefficients_can_be_fixed(rng):
    """A fixed coefficient keeps its value, and the others are fitted beside it."""
    data = measure(Hertz(radius=RADIUS, E=2.1e5, nu=0.41), ALL)
    fit = fit_law(data, Hertz, RADIUS, {"nu": 0.41})
    assert (fit.estimate("nu").value, fit.estimate("nu").is_fitted) == (0.41, False)
    assert fit.estimate("E").value == pytest.approx(2.1e5, rel=1e-10)
    with pytest.raises(MeasurementError, match=r'no coefficient "mu".*E, nu'):
        fit_law(data, Hertz, RADIUS, {"mu": 1.0})


# ------------------------------------------------------------------------------------------------------------ intervals


def coverage_limits(level, runs):
    """Counts that a right interval leaves only once in ten thousand."""
    return binom.interval(1.0 - 1e-4, runs, level)


@pytest.mark.parametrize("level", [0.8, 0.95])
def test_intervals_cover_at_the_stated_rate(level):
    """Seeded experiments of five rows a component: each interval holds the truth as often as it says.

    With normal quantiles in place of Student's, 95 % would be 88 %, far out of the limits.
    """
    law, rng, runs = make_law(), np.random.default_rng(7), 200
    settings = [(c, 60, dr, 12.0) for c, dr in product(range(4), (1.0, 2.0, 3.0, 4.0, 5.0))]
    hits = dict.fromkeys(NAMES, 0)
    for _ in range(runs):
        fit = fit_law(measure(law, settings, (0.6, 2e-3, 3e-3, 1e-3), rng), Nakashima, RADIUS, level=level)
        for name in NAMES:
            hits[name] += fit.estimate(name).low <= getattr(law, name) <= fit.estimate(name).high
    low, high = coverage_limits(level, runs)
    assert all(low <= count <= high for count in hits.values()), hits


def test_intervals_cover_where_two_components_tell_of_one_coefficient():
    """One coefficient from forces and moments of very different scatter: 95 % holds within three per cent."""
    law, rng, runs = Pair(radius=RADIUS, k=3000.0), np.random.default_rng(3), 300
    settings = [(c, 60, dr, 3.0 * dr) for c, dr in product((0, 1), np.linspace(1.0, 5.0, 20))]
    hits = 0
    for _ in range(runs):
        estimate = fit_law(measure(law, settings, (0.8, 4e-3, 0, 0), rng), Pair, RADIUS).estimate("k")
        hits += estimate.low <= law.k <= estimate.high
    assert 0.92 * runs <= hits <= 0.98 * runs


def test_scatter_of_residuals_and_repeats_is_that_of_the_noise():
    """Both standard deviations of the example are those that it was made with, to a tenth."""
    fit = fit_law(read_measurements([EXAMPLE]), Nakashima, RADIUS)
    assert fit.noise == pytest.approx([0.4, 1e-3, 0.8e-3, 0.4e-3], rel=0.12)
    assert fit.repeats == pytest.approx([0.4, 1e-3, 0.8e-3, 0.4e-3], rel=0.2)


# --------------------------------------------------------------------------------------------- what data do not tell


def test_a_coefficient_without_its_measurement_is_not_told():
    """From radial forces alone k_r is told, and of the others it is said that no number depends on them."""
    fit = fit_law(measure(make_law(), [row for row in ALL if row[0] == 0]), Nakashima, RADIUS)
    assert fit.estimate("k_r").value == pytest.approx(0.377e6, rel=1e-10)
    for name in NAMES[1:]:
        assert np.isnan(fit.estimate(name).value) and "no measured number depends on it" in fit.estimate(name).note
    with pytest.raises(MeasurementError, match="k_phi, k_theta, k_psi"):
        fit.law()


def test_coefficients_that_are_told_only_together_are_named():
    """Hertz from radial forces: only E/(1 - nu^2) is told; nu stays at its default, and E is fitted beside it."""
    data = measure(Hertz(radius=RADIUS, E=3e5, nu=0.5), [row for row in ALL if row[0] == 0])
    fit = fit_law(data, Hertz, RADIUS)
    assert fit.estimate("nu").value == 0.5 and "E and nu only together" in fit.estimate("nu").note
    assert fit.estimate("E").value == pytest.approx(3e5, rel=1e-9)


def test_a_badly_told_coefficient_is_marked(rng):
    """An interval wider than its value is said to be so."""
    data = measure(make_law(), [(0, 80, dr, 0.0) for dr in (0.1, 0.12, 0.14)], (1.0, 0, 0, 0), np.random.default_rng(1))
    estimate = fit_law(data, Nakashima, RADIUS).estimate("k_r")
    assert "badly told" in estimate.note and estimate.low < 0.0 < estimate.high


def test_a_value_at_a_limit_that_the_law_takes_is_held_there():
    """Data of nu = 0.5 and more: nu is held at the limit 0.5, marked, and E is the best beside it."""

    class Bounded(Hertz):
        """As Hertz, nu up to 0.5."""

        nu: Annotated[float, Field(ge=0, le=0.5)] = 0.4

    data = measure(Hertz(radius=RADIUS, E=3e5, nu=0.6), ALL)
    fit = fit_law(data, Bounded, RADIUS)
    assert (fit.estimate("nu").value, fit.estimate("nu").note) == (0.5, "held at 0.5, a limit of the law")
    assert fit.estimate("E").value == pytest.approx(fit_law(data, Hertz, RADIUS, {"nu": 0.5}).estimate("E").value)


def test_a_wrong_sign_is_refused():
    """Moments of the wrong sign would need a negative coefficient: refused, with its name and the remedy."""
    data = measure(make_law(), ALL)
    flipped = Measurements(data.phi, data.deformation, data.force * [1, 1, -1, 1], RADIUS)
    with pytest.raises(MeasurementError, match=r"k_phi.*sign") as caught:
        fit_law(flipped, Nakashima, RADIUS)
    assert caught.value.column == "k_phi"


# ---------------------------------------------------------------------------------------------------------------- files


def write(folder, text):
    file = folder / "data.csv"
    file.write_text(text, encoding="utf-8")
    return file


def test_units_are_those_of_the_header(tmp_path):
    """The same row in two sets of units is the same measurement; the radius too."""
    one = read_measurements(
        [write(tmp_path, "# radius [mm] = 12\nphi [deg],dr [mm],dphi [deg],Fphi [N mm]\n60,3,10,25\n")]
    )
    two = read_measurements(
        [write(tmp_path, f"# radius = 0.012 m\nFphi [Nm];dphi [rad];dr [m];phi [rad]\n.025;{pi / 18};.003;{pi / 3}\n")]
    )
    for data in (one, two):
        assert data.deformation[0] == pytest.approx([0.003, 0.0, pi / 18, 0.0])
        assert (data.phi[0], data.force[0, 2], data.radius) == pytest.approx((pi / 3, 0.025, 0.012))
        assert np.isnan(data.force[0, [0, 1, 3]]).all()


def test_force_and_moment_are_short_names(tmp_path):
    """`force` is Fr; `moment` is the moment about the only angle of deformation."""
    data = read_measurements([write(tmp_path, "phi [deg],dr [mm],dpsi [deg],force [N],moment [N mm]\n90,3,10,11,7\n")])
    assert (data.force[0, 0], data.force[0, 3]) == pytest.approx((11.0, 0.007))


def test_files_are_joined(tmp_path):
    """Several files are one set of measurements, each with its own columns."""
    press, twist = tmp_path / "press.csv", tmp_path / "twist.csv"
    press.write_text("phi [deg],dr [mm],force [N]\n90,2,5\n")
    twist.write_text("phi [rad],dr [cm],dpsi [rad],moment [mN m]\n1.5,0.4,0.1,12\n")
    data = read_measurements([press, twist])
    assert data.deformation[:, 0] == pytest.approx([0.002, 0.004]) and len(data) == 2


HEAD = "phi [deg],dr [mm],Fr [N]\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("phi [deg],dr,Fr [N]\n90,1,1\n", ['"dr"', "no unit", "[mm]"]),
        ("phi [deg],dr [],Fr [N]\n90,1,1\n", ['"dr []"', "no unit"]),
        ("phi [deg],dr [mm],dphi [rad],Fr [N]\n90,1,0,1\n", ['"dphi [rad]"', '"phi [deg]"', "one unit"]),
        ("phi [deg],dr [mm],Fphi [N mm],Fpsi [N m]\n90,1,1,1\n", ['"Fpsi [N m]"', '"Fphi [N mm]"', "one unit"]),
        ("phi [deg],dr [mm],Fphi [N]\n90,1,1\n", ['"Fphi [N]"', "moment", "[N mm]"]),
        ("phi [deg],dr [inch],Fr [N]\n90,1,1\n", ['"dr [inch]"', "length", "[mm]"]),
        ("phi [deg],dr [mm],Fx [N]\n90,1,1\n", ['"Fx [N]"', "no known column"]),
        ("phi [deg],dr [mm],dr [mm],Fr [N]\n90,1,1,1\n", ['"dr [mm]"', "twice"]),
        ("dr [mm],Fr [N]\n1,1\n", ['"phi"', "missing"]),
        ("phi [deg],dr [mm]\n90,1\n", ["Fr, Ftheta, Fphi, Fpsi", "missing"]),
        ("phi [deg],dr [mm],moment [N mm]\n90,1,1\n", ['"moment"', "no angle"]),
        (HEAD + "90,1 mm,1\n", ["line 2", '"dr"', "1 mm"]),
        (HEAD + "90,,1\n", ["line 2", '"dr"', "empty cell"]),
        (HEAD + "90,1,nan\n", ["line 2", '"Fr"', "nan"]),
        (HEAD + "90,1\n", ["line 2", "2 cells", "3 columns"]),
        (HEAD + "1.5,1,1\n190,1,1\n", ["line 3", '"phi"', "190"]),
        ("# radius [mm] = 10\n" + HEAD + "90,12,1\n", ["line 3", '"dr"', "12"]),
        (HEAD, ["at least one row"]),
    ],
)
def test_a_file_that_is_not_clear_is_refused(tmp_path, text, words):
    """Each refusal names the file and the column or line."""
    with pytest.raises(MeasurementError) as caught:
        read_measurements([write(tmp_path, text)])
    for word in ["data.csv", *words]:
        assert word in str(caught.value)


@pytest.mark.parametrize("text", ["10", "-1 mm", "ten mm", "10 N", ""])
def test_a_radius_without_a_length_is_refused(text):
    """A radius is a positive number with a unit of length."""
    with pytest.raises(MeasurementError, match="--radius"):
        read_length(text, "--radius")


def test_the_example_is_what_its_script_makes_and_says_so():
    """The shipped file is the output of the script, and begins by saying that it was not measured."""
    spec = importlib.util.spec_from_file_location("make", REPOSITORY / "scripts/make_identification_data.py")
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    text = EXAMPLE.read_text(encoding="utf-8")
    assert text == script.generate() and text.startswith("# GENERATED, NOT MEASURED")


# ------------------------------------------------------------------------------------------------------------- outcomes


@pytest.mark.parametrize(
    ("law", "best"),
    [(make_law(), "nakashima"), (Hertz(radius=RADIUS, E=3e5, nu=0.45), "hertz")],
    ids=["paper", "Hertz"],
)
def test_the_law_that_made_the_data_foretells_them_best(law, best):
    """Cross-validation finds the law behind the data, with an error of the size of the noise."""
    rng, noise = np.random.default_rng(5), (0.2, 1e-3, 1e-3, 5e-4)
    data = measure(law, ALL * 3, noise, rng)
    scores = compare_laws(data, {"hertz": Hertz, "nakashima": Nakashima, "power": Power}, RADIUS)
    assert scores[0].name == best and scores[0].is_best
    assert not any(score.is_best for score in scores[1:])
    assert scores[0].error == pytest.approx(noise, rel=0.5)


def test_a_law_is_tested_on_settings_that_it_has_not_seen():
    """A law that fits each setting by itself would win on its own rows; held-out settings give it no number."""

    class Table(Law):
        """Right at dr = 1, 2, 3, 4, 5 mm, with one coefficient each."""

        a: float
        b: float
        c: float
        d: float
        e: float

        @staticmethod
        def force(dr, dtheta, dphi, dpsi, phi, radius, a, b, c, d, e):
            """See the class."""
            return (a, b, c, d, e)[round(1e3 * dr) - 1], 0.0, 0.0, 0.0

    data = measure(
        make_law(), [(0, 80, dr, 0.0) for dr in (1, 2, 3, 4, 5)] * 3, (0.1, 0, 0, 0), np.random.default_rng(0)
    )
    scores = {score.name: score for score in compare_laws(data, {"table": Table, "nakashima": Nakashima}, RADIUS)}
    assert scores["nakashima"].total < 0.05 < 0.9 < scores["table"].total


def test_a_law_that_cannot_be_fitted_is_listed_with_its_reason():
    """The comparison goes on without it."""
    data = measure(make_law(), ALL)
    flipped = Measurements(data.phi, data.deformation, data.force * [1, 1, -1, 1], RADIUS)
    scores = compare_laws(flipped, {"nakashima": Nakashima, "power": Power}, RADIUS)
    assert "k_phi" in next(score for score in scores if score.name == "nakashima").failure


def test_the_snippet_is_a_section_of_a_scenario(tmp_path):
    """fingertip.toml goes into a scenario as it stands, with the fitted numbers to the last digit."""
    fit = fit_law(read_measurements([EXAMPLE]), Nakashima, RADIUS)
    file = tmp_path / "fingertip.toml"
    file.write_text(toml_snippet(fit, "nakashima", friction=0.5))
    scenario = load_scenario("target-a", {"fingertip": read_toml(file)["fingertip"]})
    assert scenario.fingertip.parameters["k_r"] == fit.estimate("k_r").value
    assert "friction =" not in toml_snippet(fit, "nakashima")


def test_what_is_not_told_stays_out_of_the_snippet():
    """A coefficient that is not told is a comment with its reason."""
    fit = fit_law(measure(make_law(), [row for row in ALL if row[0] == 0]), Nakashima, RADIUS)
    assert "# k_phi = ...  # [N/m^2] not told" in toml_snippet(fit, "nakashima")


def test_the_figure_has_the_layout_of_the_papers(tmp_path):
    """Panels of four, four, three and two series, as Figs. 9, 10, 11 and 12, each with its residuals below."""
    data = read_measurements([EXAMPLE])
    assert [len(find_sweeps(data, component)) for component in (0, 2, 1, 3)] == [4, 4, 3, 2]
    figure = draw_fit(fit_law(data, Nakashima, RADIUS), "nakashima")
    assert len(figure.axes) == 2 * 13
    line = figure.axes[0].lines[0]
    k_r = fit_law(data, Nakashima, RADIUS).estimate("k_r").value
    assert line.get_ydata()[50] == pytest.approx(pi * k_r * (1e-3 * line.get_xdata()[50]) ** 2)
    save_figure(figure, tmp_path / "fit.png")


def test_measurements_without_a_series_are_drawn_against_the_fit():
    """Settings that all differ in everything are drawn as measured against fitted."""
    rng = np.random.default_rng(2)
    settings = [(0, phi, dr, 0.0) for phi, dr in zip(rng.uniform(50, 90, 12), rng.uniform(1, 4, 12), strict=True)]
    figure = draw_fit(fit_law(measure(make_law(), settings), Nakashima, RADIUS), "nakashima")
    assert [axes.get_xlabel() for axes in figure.axes] == ["fitted", "fitted"]


def test_the_axial_force_is_the_contact_force_along_the_finger():
    """F_x of Remark 3 is the x component in F of the force that (48) and (17) give."""
    law, dr, dphi, tilt = make_law(), 0.003, 0.15, 0.4
    Phi = pi / 2 - tilt - dphi
    Fr, _, Fphi, _ = law([dr, 0.0, dphi, 0.0], Phi)
    c, s = np.cos(-Phi), np.sin(-Phi)
    R_F_CF = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) @ np.array([[0, 1, 0], [0, 0, 1], [1, 0, 0]])
    force = R_F_CF @ [0.0, Fphi / (RADIUS - dr), Fr]
    assert axial_force(law, dr, dphi, tilt) == pytest.approx(force[0])
    assert axial_force(law, dr, 0.0, [0.0, 0.4]) == pytest.approx(pi * 0.377e6 * dr**2 * np.cos([0.0, 0.4]))
    assert len(draw_angle_force(law).axes) == 2
