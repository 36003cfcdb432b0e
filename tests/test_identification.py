"""Identification: coefficients, what data cannot tell, comparison of laws, results, the command."""

from __future__ import annotations

import json
from math import pi
from typing import Annotated, ClassVar

import numpy as np
import pytest
from commands import run_command
from hands import make_law
from measured import ALL, RADIUS, Exponent, Sphere, measure
from pydantic import Field

import softhand
from softhand.contact.kinematics import deformation_jacobian
from softhand.errors import LawError, MeasurementError
from softhand.identification import identify as identify_module
from softhand.identification.comparison import compare_laws
from softhand.identification.fit import fit_law
from softhand.identification.measurements import EXAMPLE, Measurements, read_measurements
from softhand.identification.polar import polar_force
from softhand.identification.report import toml_snippet
from softhand.identification.sweeps import find_sweeps
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.laws.nakashima import Nakashima
from softhand.plots.angle_force import axial_force, draw_angle_force
from softhand.plots.identification import draw_fit
from softhand.plots.style import save_figure
from softhand.scenario.file import read_toml
from softhand.scenario.scenario import load_scenario
from softhand.settings.settings import Positive

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
    [Exponent(radius=RADIUS, c=40.0, zeta=1.6, k=0.12), Exponent(radius=RADIUS, c=700.0, zeta=3.4, k=2.0),
     Sphere(radius=RADIUS, E=2.1e5, nu=0.41)],
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
    data = measure(Sphere(radius=RADIUS, E=2.1e5, nu=0.41), ALL)
    fit = fit_law(data, Sphere, RADIUS, {"nu": 0.41})
    assert (fit.estimate("nu").value, fit.estimate("nu").is_fitted) == (0.41, False)
    assert fit.estimate("E").value == pytest.approx(2.1e5, rel=1e-10)
    with pytest.raises(MeasurementError, match=r'no coefficient "mu".*E, nu'):
        fit_law(data, Sphere, RADIUS, {"mu": 1.0})


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
    """Sphere from radial forces: only E/(1 - nu^2) is told; nu stays at its default, and E is fitted beside it."""
    data = measure(Sphere(radius=RADIUS, E=3e5, nu=0.5), [row for row in ALL if row[0] == 0])
    fit = fit_law(data, Sphere, RADIUS)
    assert fit.estimate("nu").value == 0.5 and "E and nu only together" in fit.estimate("nu").note
    assert fit.estimate("E").value == pytest.approx(3e5, rel=1e-9)


def test_a_badly_told_coefficient_is_marked(rng):
    """An interval wider than its value is said to be so."""
    data = measure(make_law(), [(0, 80, dr, 0.0) for dr in (0.1, 0.12, 0.14)], (1.0, 0, 0, 0), np.random.default_rng(1))
    estimate = fit_law(data, Nakashima, RADIUS).estimate("k_r")
    assert "badly told" in estimate.note and estimate.low < 0.0 < estimate.high


def test_a_value_at_a_limit_that_the_law_takes_is_held_there():
    """Data of nu = 0.5 and more: nu is held at the limit 0.5, marked, and E is the best beside it."""

    class Bounded(Sphere):
        """As Sphere, nu up to 0.5."""

        nu: Annotated[float, Field(ge=0, le=0.5)] = 0.4

    data = measure(Sphere(radius=RADIUS, E=3e5, nu=0.6), ALL)
    fit = fit_law(data, Bounded, RADIUS)
    assert (fit.estimate("nu").value, fit.estimate("nu").note) == (0.5, "held at 0.5, a limit of the law")
    assert fit.estimate("E").value == pytest.approx(fit_law(data, Sphere, RADIUS, {"nu": 0.5}).estimate("E").value)


@pytest.mark.parametrize("component", range(4))
def test_a_wrong_sign_is_refused(component):
    """Forces or moments of the wrong sign would need a negative coefficient: refused, with its name and the remedy."""
    data, sign = measure(make_law(), ALL), np.ones(4)
    sign[component] = -1.0
    flipped = Measurements(data.phi, data.deformation, data.force * sign, RADIUS)
    with pytest.raises(MeasurementError, match=rf"{NAMES[component]}.*more than 0.*sign") as caught:
        fit_law(flipped, Nakashima, RADIUS)
    assert caught.value.column == NAMES[component]


def test_a_limit_that_the_law_does_not_take_is_refused_wherever_it_is():
    """An exponent that would have to go beyond its open limit, from below and from above; a closed one is held."""

    class Low(Exponent):
        """The exponent below 1."""

        zeta: Annotated[float, Field(gt=0, lt=1)]

    class High(Exponent):
        """The exponent above 2."""

        zeta: Annotated[float, Field(gt=2)]

    class Held(Exponent):
        """The exponent 2 or more."""

        zeta: Annotated[float, Field(ge=2)]

    data = measure(Exponent(radius=RADIUS, c=40.0, zeta=1.6, k=0.12), ALL)
    for law, words in ((Low, "less than 1"), (High, "more than 2")):
        with pytest.raises(MeasurementError, match=f"zeta.*{words}"):
            fit_law(data, law, RADIUS)
    assert fit_law(data, Held, RADIUS).estimate("zeta").value == 2.0


def test_a_small_coefficient_is_no_limit():
    """A coefficient a million times smaller than others, but told, is fitted."""
    law = Exponent(radius=RADIUS, c=4e5, zeta=1.6, k=1e-7)
    assert fit_law(measure(law, ALL), Exponent, RADIUS).estimate("k").value == pytest.approx(1e-7, rel=1e-6)


def test_one_of_two_coefficients_with_defaults_is_fitted_where_they_are_told_together():
    """The Hertz law that ships, from radial forces: nu stays at its default, E is told beside it."""
    data = measure(Hertz(radius=RADIUS, E=2e5, nu=0.5), [row for row in ALL if row[0] == 0])
    fit = fit_law(data, Hertz, RADIUS)
    assert fit.estimate("E").value == pytest.approx(2e5, rel=1e-9) and fit.estimate("E").is_fitted
    assert (fit.estimate("nu").value, fit.estimate("nu").is_fitted) == (0.5, False)


@pytest.mark.parametrize(("options", "words"), [
    ({"fixed": {"k_r": -5.0}}, ["k_r", "-5", "more than 0"]),
    ({"fixed": {"k_r": float("nan")}}, ["k_r", "nan"]),
    ({"fixed": {"k_r": 1e308}}, ["Nakashima", "no coefficients", "number"]),
    ({"fixed": dict.fromkeys(NAMES, 1e5)}, ["Nakashima", "nothing is left to fit"]),
    ({"level": 1.0}, ["level", "1.0", "between 0 and 1"]),
    ({"radius": 0.0}, ["radius", "0.0"]),
    ({"radius": 12.0}, ["radius", "12.0 m"]),
    ({"radius": 0.002}, ["dr", "3 mm", "2 mm", "unit"]),
])  # fmt: skip
def test_what_cannot_be_is_refused(options, words):
    """Values that a law does not take, all of them fixed, a level of 1, a radius that is none."""
    options = {"radius": RADIUS, **options}
    with pytest.raises(MeasurementError) as caught:
        fit_law(measure(make_law(), ALL), Nakashima, **options)
    for word in words:
        assert word in str(caught.value)


class Three(Law):
    """Three numbers."""

    k: float

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k):
        """See the class."""
        return k * dr, 0.0, 0.0


class Unknown(Law):
    """A name that is not there."""

    coordinates: ClassVar[str] = "surface"
    k: float

    @staticmethod
    def force(dr, s1, s2, psi, lean1, lean2, radius, k):
        """See the class."""
        return stiffness * dr, 0.0, 0.0, 0.0  # noqa: F821


@pytest.mark.parametrize(("law", "words"), [(Three, "four numbers"), (Unknown, "'stiffness' is not defined")])
def test_a_mistake_in_a_law_is_named(law, words):
    """By the name of the law; in a comparison the others go on."""
    with pytest.raises(LawError, match=f"{law.__name__}.*{words}"):
        fit_law(measure(make_law(), ALL), law, RADIUS)
    scores = compare_laws(measure(make_law(), ALL), {"mine": law, "nakashima": Nakashima}, RADIUS)
    assert [score.name for score in scores] == ["nakashima", "mine"] and words in scores[1].failure


# ------------------------------------------------------------------------------------------------------------- outcomes


@pytest.mark.parametrize(
    ("law", "best"),
    [(make_law(), "nakashima"), (Sphere(radius=RADIUS, E=3e5, nu=0.45), "hertz")],
    ids=["paper", "sphere"],
)
def test_the_law_that_made_the_data_foretells_them_best(law, best):
    """Cross-validation finds the law behind the data, with an error of the size of the noise."""
    rng, noise = np.random.default_rng(5), (0.2, 1e-3, 1e-3, 5e-4)
    data = measure(law, ALL * 3, noise, rng)
    scores = compare_laws(data, {"hertz": Sphere, "nakashima": Nakashima, "power": Exponent}, RADIUS)
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
    scores = compare_laws(flipped, {"nakashima": Nakashima, "power": Exponent}, RADIUS)
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


# -------------------------------------------------------------------------------------------------- call and command


def test_the_call_returns_a_record(tmp_path):
    """`softhand.identify`: from a file, several, or measurements, by name or class; values, rows, TOML and JSON."""
    found = softhand.identify(EXAMPLE, friction=0.5)
    for other in (softhand.identify([EXAMPLE], law=Nakashima), softhand.identify(read_measurements([EXAMPLE]))):
        assert other.coefficients["k_r"] == found.coefficients["k_r"] and other.scores == ()
    assert (
        found.coefficients["k_r"].value
        == fit_law(read_measurements([EXAMPLE]), Nakashima, RADIUS).estimate("k_r").value
    )
    assert [row[0] for row in found.rows()] == ["k_r", "k_phi", "k_theta", "k_psi", "dr_offset"]
    assert all(isinstance(text, str) for rows in (found.rows(), found.scatter_rows(), found.score_rows())
               for row in rows for text in row)  # fmt: skip
    assert found.law().k_r == found.coefficients["k_r"].value and found.score_rows() == []
    assert "friction = 0.5" in found.to_toml() and found.to_toml() == toml_snippet(found.fit, "nakashima", 0.5)
    with pytest.raises(AttributeError):
        found.friction = 0.6


def forbidden(text):
    raise AssertionError(f"{text} is no JSON")


def test_the_record_goes_out_as_json():
    """Numbers to the last digit with their units; null for what is not told."""
    found = softhand.identify(
        measure(make_law(), [row for row in ALL if row[0] == 0], (0.3, 0, 0, 0), np.random.default_rng(0))
    )
    read = json.loads(found.to_json(), parse_constant=forbidden)
    k_r = read["coefficients"]["k_r"]
    assert k_r["value"] == found.coefficients["k_r"].value and k_r["units"]["value"] == "N/m^2"
    assert read["coefficients"]["k_psi"]["value"] is None and read["units"]["radius"] == "m"
    assert read["noise"][0] == found.noise[0] and read["noise"][1:] == [None] * 3
    assert read["findings"][0]["text"] == found.findings[0].text and read["dr_offset"]["units"]["low"] == "m"


@pytest.mark.parametrize(("options", "words"), [
    ({"radius": "3"}, ["radius", "10 mm"]), ({"friction": float("nan")}, ["friction", "nan"]),
    ({"friction": -5.0}, ["friction", "-5"]), ({"radius": float("nan")}, ["radius", "nan"]),
])  # fmt: skip
def test_arguments_that_cannot_be_are_refused(options, words):
    """Each by its name and value."""
    with pytest.raises(MeasurementError) as caught:
        softhand.identify(EXAMPLE, **options)
    for word in words:
        assert word in str(caught.value)


def test_measurements_without_a_radius_ask_for_one():
    """Both ways to give it are named."""
    data = read_measurements([EXAMPLE])
    with pytest.raises(MeasurementError, match=r"--radius 10mm.*# radius"):
        softhand.identify(Measurements(data.phi, data.deformation, data.force))


def test_the_command_prints_what_the_call_returns(tmp_path, monkeypatch):
    """Rows, findings and comparison of the record."""
    records, call = [], identify_module.identify
    monkeypatch.setattr(
        identify_module, "identify", lambda *files, **options: records.append(call(*files, **options)) or records[0]
    )
    file = tmp_path / "press.csv"
    rows = [(phi, dr, 0.3 * dr * dr + 0.01 * (-1) ** dr) for dr in (1, 2, 3, 4, 5) for phi in (60, 75, 90)]
    file.write_text(
        "# radius [mm] = 10\nphi [deg],dr [mm],Fr [N]\n" + "".join(f"{phi},{dr},{force}\n" for phi, dr, force in rows)
    )
    result = run_command("identify", "press.csv", folder=tmp_path)
    (found,) = records
    assert found.scores and found.findings
    printed = " ".join(result.stdout.split())
    rows = [" ".join(row) for row in (*found.rows(), *found.scatter_rows(), *found.score_rows())]
    for text in (*rows, *(finding.text for finding in found.findings)):
        assert " ".join(text.split()) in printed
    assert (tmp_path / "runs/identify/fingertip.toml").read_text() == found.to_toml()


NEGATIVE = "# radius [mm] = 10\nphi [deg],dr [mm],Fr [N]\n" + "".join(
    f"{phi},{dr},{-0.295 * (2 * dr) ** 2:.3f}\n" for phi in (60, 75) for dr in (0.5, 1.0, 1.5, 2.0, 2.5)
)


def test_a_load_cell_that_counts_compression_as_negative_is_met_with_the_remedy(tmp_path):
    """One error, exit code 1, no fingertip.toml."""
    (tmp_path / "press.csv").write_text(NEGATIVE)
    result = run_command("identify", "press.csv", "--out", "out", folder=tmp_path)
    assert result.returncode == 1 and result.stdout == "" and not (tmp_path / "out/fingertip.toml").exists()
    for word in ("error:", "k_r", "sign", "positive Fr"):
        assert word in result.stderr


@pytest.mark.parametrize("text", ["k_r", "k_r=", "=3", "k_r=soft", "k_r=nan", "k_r=" + "9" * 5000])
def test_a_fix_that_is_none_is_met_with_the_form_of_one(tmp_path, text):
    """The form or the number that it needs, of a coefficient, not of a scenario."""
    result = run_command("identify", "--example", "--fix", text, folder=tmp_path)
    assert result.returncode == 1 and "--fix" in result.stderr and "object.mass" not in result.stderr
    assert "NAME=VALUE, such as k_r=" in result.stderr or "number" in result.stderr
    assert len(result.stderr) < 500
