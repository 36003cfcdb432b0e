"""From a material to a tip: finite elements against exact solutions, hardness, tables, the command."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from commands import run_command
from hands import numerical_jacobian

from softhand.errors import MeasurementError, ScenarioError, SofthandError
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.tabulated import Tabulated
from softhand.material.hardness import young_of_hardness
from softhand.material.modulus import Material, material_of, read_modulus
from softhand.material.neo_hookean import NeoHookean
from softhand.material.snippet import read_relaxation, snippet, stiffening
from softhand.material.table_file import read_tip_table, tip_table
from softhand.scenario.scenario import load_scenario
from softhand.settings.toml import parse_toml

# ------------------------------------------------------------------------------------------------------ finite elements


@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_the_material_is_the_slope_of_an_energy(nu: float, rng: np.random.Generator) -> None:
    """First and second derivatives of W by F and p, at a state in general position; at rest it is Hooke's."""
    material, state = NeoHookean(nu), np.append(0.2 * rng.normal(size=9), 0.3)

    def W(move: np.ndarray) -> float:
        F, p = np.eye(3) + (state + move)[:9].reshape(3, 3), (state + move)[9]
        J = float(np.linalg.det(F))
        return 0.5 * (np.sum(F * F) - 3.0) - math.log(J) + p * (J - 1.0) - 0.5 * material.softness * p * p

    slope, bend = material.expand(state)
    np.testing.assert_allclose(slope, numerical_jacobian(W, 10, 1e-5), rtol=1e-6, atol=1e-8)
    expected = numerical_jacobian(lambda move: material.expand(state + move)[0], 10, 1e-6)
    np.testing.assert_allclose(bend, expected, rtol=1e-6, atol=1e-8)


def cylinder(nu: float, depth: float, radius: float = 0.5, height: float = 2.0):
    """A cylinder on a plate, pressed at its top by a plane."""
    skfem = pytest.importorskip("skfem", reason="needs the extra softhand[material]")
    from softhand.material.press import press
    from softhand.material.section import Section

    mesh = skfem.MeshTri.init_tensor(np.linspace(0.0, radius, 4), np.linspace(0.0, height, 7))
    section = Section(mesh)
    (pressed,) = press(section, nu, np.array([depth]))
    return section, pressed


def test_a_bar_is_compressed_as_a_neo_hookean_bar() -> None:
    """Without sideways strain, nu = 0, to a length share l it pushes with pi a^2 G (1 / l - l)."""
    _, pressed = cylinder(1e-9, 0.3)
    length = 1.7 / 2.0
    assert pressed.force == pytest.approx(math.pi * 0.25 * (1.0 / length - length), rel=1e-3)


def test_a_cylinder_is_twisted_with_its_polar_moment() -> None:
    """K = G pi a^4 / (2 h), that of the height left where nothing moves sideways."""
    from softhand.material.stuck import stuck

    section, pressed = cylinder(1e-9, 1e-6)
    assert stuck(section, 1e-9, pressed).twist == pytest.approx(math.pi * 0.5**4 / 4.0, rel=1e-3)


def test_a_short_cylinder_is_sheared_and_tilted_as_a_beam() -> None:
    """A thin bar: tilt E I 4 / L, coupling -E I 6 / L^2 and shear E I 12 / L^3 of a beam clamped at both ends."""
    from softhand.material.stuck import stuck

    section, pressed = cylinder(1e-9, 1e-6, radius=0.1)
    found, EI = stuck(section, 1e-9, pressed), 2.0 * math.pi * 0.1**4 / 4.0
    soft = 12.0 * EI / (2.0**2 * 0.9 * math.pi * 0.01)  # Timoshenko's share of shear
    assert found.shear == pytest.approx(12.0 * EI / 2.0**3 / (1.0 + soft), rel=0.02)
    assert abs(found.coupling) == pytest.approx(6.0 * EI / 2.0**2 / (1.0 + soft), rel=0.02)
    assert found.tilt == pytest.approx((4.0 + soft) * EI / 2.0 / (1.0 + soft), rel=0.02)


def pressed_tips(nu: float, depths: list[float]):
    pytest.importorskip("skfem", reason="needs the extra softhand[material]")
    from softhand.material.half_section import half_section
    from softhand.material.press import press
    from softhand.material.section import Section

    section = Section(half_section(0))
    return section, list(press(section, nu, np.array(depths)))


def test_a_light_touch_of_the_elements_goes_to_hertz() -> None:
    """The nearer the lighter; within 8 % at d = 0.01 r, where the base adds a few of them."""
    _, tips = pressed_tips(0.4, [0.01, 0.1])
    far = [tip.force / (8.0 / 3.0 / 0.6 * tip.depth**1.5) - 1.0 for tip in tips]
    assert abs(far[0]) < 0.08 and abs(far[0]) < 0.35 * far[1]


# the last lines of finite elements from elsewhere, nearly incompressible: F / (G r^2), K / (G r^3)
ELSEWHERE = {0.1: (0.220, 0.180), 0.2: (0.778, 0.517), 0.3: (1.834, 0.999), 0.4: (3.72, 1.62)}


def test_the_elements_are_those_from_elsewhere() -> None:
    """Force within 3 %, torsion within 7 %, on the coarse mesh; the other rows in the slow test."""
    from softhand.material.stuck import stuck

    section, tips = pressed_tips(0.49, [0.1, 0.3])
    for tip in tips:
        force, torsion = ELSEWHERE[round(tip.depth, 3)]
        assert tip.force == pytest.approx(force, rel=0.03)
        assert stuck(section, 0.49, tip).twist == pytest.approx(torsion, rel=0.07)


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.1, 0.3, 0.5])
def test_the_law_is_near_the_elements(nu: float) -> None:
    """Within 10 % in force and torsion and 15 % in shear up to 0.3 r, and the mesh leaves less than that open.

    The elements are those from elsewhere within 4 % in force and 3 % in torsion.
    """
    pytest.importorskip("skfem", reason="needs the extra softhand[material]")
    from softhand.material.tip import material_tip

    tip = material_tip(Material(6e4, nu, 0.0, ""), 0.01)
    shallow = tip.depth < 0.3001 * tip.radius
    for name, allowed in (("normal", 0.10), ("shear", 0.15), ("torsion", 0.10)):
        assert np.max(np.abs(tip.misses[name][shallow])) < allowed, name
        assert np.median(tip.mesh[name]) < 0.03, name
    if nu == 0.5:
        for share, (force, torsion) in ELSEWHERE.items():
            row = int(np.argmin(np.abs(tip.depth - share * tip.radius)))
            assert tip.normal[row] / (6e4 * tip.radius**2) == pytest.approx(force, rel=0.04)
            assert tip.torsion[row] / (6e4 * tip.radius**3) == pytest.approx(torsion, rel=0.03)


# ------------------------------------------------------------------------------------------------- a tip that leans


def test_half_a_ball_is_one() -> None:
    """Volume and area of the curved tetrahedra within 0.1 %, finer where the tip is pressed."""
    pytest.importorskip("skfem", reason="needs the extra softhand[material]")
    from softhand.material.half_ball import half_ball
    from softhand.material.solid import Solid

    towards = np.array([math.sin(0.6), 0.0, math.cos(0.6)])
    solid = Solid(half_ball(0, towards))
    assert solid.body.weights.sum() == pytest.approx(2.0 / 3.0 * math.pi, rel=1e-3)
    assert solid.areas.sum() == pytest.approx(2.0 * math.pi, rel=1e-3)
    np.testing.assert_allclose(np.linalg.norm(solid.places, axis=0), 1.0, atol=2e-3)
    near = np.linalg.norm(solid.places - towards[:, None], axis=0) < 0.5
    assert solid.areas[near].mean() < 0.7 * solid.areas[~near].mean()


def test_a_light_touch_that_leans_is_that_of_the_law() -> None:
    """Smooth, at 30 deg, a few facets touching: force within 12 %, none along, through the middle of the tip."""
    pytest.importorskip("skfem", reason="needs the extra softhand[material]")
    from softhand.material.leaning import LeaningTip

    found = LeaningTip(0.3, math.radians(30.0), sticks=False).press(0.05)
    law = Hemisphere(radius=1.0, G=1.0, nu=0.3)
    assert found.normal == pytest.approx(law([0.05, 0.0, 0.0, 0.0], 0.5 * math.pi)[0], rel=0.12)
    assert abs(found.along) < 1e-8
    assert abs(found.moment) < 0.02 * found.normal


@pytest.mark.slow
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_upright_it_is_the_half_section(nu: float) -> None:
    """Force within 2 % of axisymmetric elements, which slide; 5 % with nu = 0.3, where it matters that these stick.

    Rolled, it has the force that their coupling and tilt say: f_t = (f_n - C) l within 7 %, and m = (k_b - f_n R) l
    within 10 % of k_b l.
    """
    pytest.importorskip("skfem", reason="needs the extra softhand[material]")
    from softhand.material.half_section import half_section
    from softhand.material.leaning import LeaningTip
    from softhand.material.press import press
    from softhand.material.section import Section
    from softhand.material.stuck import stuck

    section = Section(half_section(1))
    (pressed,) = press(section, nu, np.array([0.2]))
    own, tip = stuck(section, nu, pressed), LeaningTip(nu, 0.0, sticks=True)
    upright = tip.press(0.2)
    assert upright.normal == pytest.approx(pressed.force, rel=0.02 if nu == 0.5 else 0.05)
    assert abs(upright.along) < 2e-3 * upright.normal and abs(upright.moment) < 2e-3 * upright.normal
    rolled = list(tip.roll(math.radians(5.0)))[-1]
    lean = math.sin(rolled.lean)
    assert rolled.along == pytest.approx((upright.normal - own.coupling) * lean, rel=0.07)
    assert rolled.moment == pytest.approx((own.tilt - 0.8 * upright.normal) * lean, abs=0.1 * own.tilt * lean)


@pytest.mark.slow
def test_the_table_of_leaning_tips_is_that_of_the_elements() -> None:
    """Two rows of tests/data/leaning.csv to their last digit."""
    pytest.importorskip("skfem", reason="needs the extra softhand[material]")
    from softhand.material.leaning import LeaningTip

    file = (Path(__file__).parent / "data" / "leaning.csv").read_text(encoding="utf-8").splitlines()
    for contact in ("sticking", "smooth"):
        found = LeaningTip(0.3, math.radians(30.0), contact == "sticking").press(0.1)
        (row,) = [line.split(",") for line in file if line.startswith(f"{contact},0.3,30,30,0.10")]
        kept = [float(value) for value in row[5:8]]
        np.testing.assert_allclose([found.normal, found.along, found.moment], kept, atol=1.1e-4)


# ------------------------------------------------------------------------------------------------------------ materials


def test_hardness_is_the_published_relation() -> None:
    """Gent's numbers by hand, and both scales grow."""
    assert young_of_hardness("shore-a", 50.0)[0] == pytest.approx(1e6 * 0.0981 * 437.168 / 17.463135, rel=1e-9)
    for scale in ("shore-a", "shore-00"):
        values = [young_of_hardness(scale, S)[0] for S in range(20, 81)]
        assert np.min(np.diff(values)) > 0.0
    # 00-80 is about 30 A, as charts of durometers have it
    assert young_of_hardness("shore-00", 80.0)[0] == pytest.approx(young_of_hardness("shore-a", 30.0)[0], rel=0.3)


@pytest.mark.parametrize(
    ("scale", "reading", "nu", "words"),
    [
        ("shore-a", 10.0, 0.5, r"Shore A 10 is outside of 20 to 80.*--shore-00"),
        ("shore-00", 95.0, 0.5, r"Shore 00 95 is outside of 20 to 80"),
        ("shore-a", 50.0, 0.3, r"nu = 0\.3: Shore A tells the modulus of rubber"),
    ],
)
def test_no_hardness_is_told_by_scale_and_value(scale: str, reading: float, nu: float, words: str) -> None:
    """Outside of the scale, and for what is no rubber."""
    with pytest.raises(SofthandError, match=words):
        young_of_hardness(scale, reading, nu)


def test_a_modulus_has_a_unit() -> None:
    """Texts with units; Young's modulus becomes that of shear."""
    assert read_modulus("0.18 MPa", "--young") == pytest.approx(1.8e5)
    assert read_modulus("60kPa", "--shear") == pytest.approx(6e4)
    assert pytest.approx(4e5) == material_of(0.25, young="1N/mm^2").G
    for text, words in (("1", "unit"), ("1 psi", "unit"), ("-1MPa", "fingertip has"), ("5GPa", "fingertip has")):
        with pytest.raises(SofthandError, match=words):
            read_modulus(text, "--young")
    with pytest.raises(SofthandError, match=r"got --young and --shore-a"):
        material_of(0.5, young="1MPa", shore_a=20.0)
    with pytest.raises(SofthandError, match=r"--nu: got 0\.7"):
        material_of(0.7, young="1MPa")


def test_the_section_is_read_as_it_is_written() -> None:
    """Law, coefficients, friction and the Prony series as `fung`; a scenario takes it."""
    relaxing = [read_relaxation("0.2@50ms"), read_relaxation("0.1@2s")]
    assert relaxing == [(0.2, 0.05), (0.1, 2.0)] and stiffening(relaxing) == pytest.approx(1.0 / 0.7)
    for law in (Hemisphere(radius=0.01, G=7e4, nu=0.45), Tabulated(radius=0.01)):
        table = parse_toml(snippet(law, 0.6, relaxing, ["a remark"]))["fingertip"]
        tip = load_scenario("target-a", {"fingertip": table}).fingertip
        assert tip.friction == 0.6 and tip.damping.name == "fung"
        assert tip.damping.parameters == {"shares": (0.2, 0.1), "rates": (20.0, 0.5)}
        assert type(law)(**tip.parameters) == law
    for text in ("0.2", "0.2@50", "2@1s", "0.1@-1s", "x@1s"):
        with pytest.raises(SofthandError, match=r"--relaxes: got"):
            read_relaxation(text)
    with pytest.raises(SofthandError, match=r"add up to 1\.1"):
        stiffening([(0.6, 1.0), (0.5, 1.0)])


# --------------------------------------------------------------------------------------------------------------- tables

HEADER = "depth [mm],force [N],shear [N/mm],torsion [N mm/rad]\n"


def test_a_table_is_read_as_it_is_written(tmp_path: Path) -> None:
    """And units are told apart."""
    law = Tabulated(radius=0.01)
    (tmp_path / "tip.csv").write_text(tip_table(law))
    found = read_tip_table(tmp_path / "tip.csv", 0.01)
    for name in ("depths", "normal", "shear", "torsion"):
        np.testing.assert_allclose(getattr(found, name), getattr(law, name), rtol=1e-5)
    other = "depth [m],force [mN],shear [N/m],torsion [N mm/deg]\n"
    (tmp_path / "other.csv").write_text(other + "0.001,500,700,1\n0.002,900,800,2\n0.003,1900,900,3\n")
    found = read_tip_table(tmp_path / "other.csv", 0.01)
    assert found.normal[0] == pytest.approx(0.5) and found.torsion[0] == pytest.approx(1e-3 * 180.0 / math.pi)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (HEADER + "1,2,1,1\n2,1,1,1\n3,4,1,1\n", r"normal does not grow from row 1 to row 2: 2, 1 N"),
        ("depth [mm],force [N],shear [N/mm]\n1,2,1\n2,3,1\n", r"the column torsion is missing"),
        ("depth [mm],force,shear [N/mm],torsion [N mm/rad]\n1,2,1,1\n", r'"force" must have one of the units \[N\]'),
        (HEADER + "1,2,x,1\n2,3,1,1\n", r'line 2, column "shear \[N/mm\]": got "x"'),
        (HEADER.replace("force", "push") + "1,2,1,1\n", r'"push \[N\]" is no column of a tip'),
    ],
)
def test_no_table_is_told_with_its_file(text: str, words: str, tmp_path: Path) -> None:
    """File, line or row, and column."""
    (tmp_path / "tip.csv").write_text(text)
    with pytest.raises((MeasurementError, ScenarioError), match=rf"tip\.csv.*{words}"):
        read_tip_table(tmp_path / "tip.csv", 0.01)


def test_the_command_makes_a_tip_of_a_table(tmp_path: Path) -> None:
    """Section, table and figure; the scenario takes the section. Without a modulus it says what to give."""
    (tmp_path / "tip.csv").write_text(tip_table(Tabulated(radius=0.01)))
    done = run_command("material", "--table", "tip.csv", "--radius", "10mm", "--out", "tip", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert {file.name for file in (tmp_path / "tip").iterdir()} == {"fingertip.toml", "table.csv", "material.png"}
    assert parse_toml((tmp_path / "tip/fingertip.toml").read_text())["fingertip"]["law"] == "tabulated"
    wrong = run_command("material", "--radius", "10mm", folder=tmp_path)
    assert wrong.returncode == 1 and "give exactly one of --shear, --young, --shore-a, --shore-00" in wrong.stderr
