"""The law of a table: through its rows, from an energy, with exact derivatives, and no table that is none."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hands import Array, numerical_jacobian

from softhand.errors import MeasurementError, ScenarioError
from softhand.laws.hemisphere import Hemisphere
from softhand.laws.law import compile_law
from softhand.laws.smooth_table import COEFFICIENTS, curve, fit, spline, work
from softhand.laws.tabulated import Tabulated
from softhand.settings.settings import read_settings

R = 0.010  # [m]
SIZES = np.array([R, R, R, 1.0])
UP = 0.5 * np.pi
LAW = Tabulated(radius=R)


def test_the_rows_are_met() -> None:
    """Force and stiffnesses at the depths of the table, within 0.4 %; shear falls where its column does."""
    for k, depth in enumerate(LAW.depths):
        found = LAW([depth, 1e-9, 0.0, 1e-9], UP)
        expected = [LAW.normal[k], 1e-9 * LAW.shear[k], 1e-9 * LAW.torsion[k]]
        np.testing.assert_allclose(found[[0, 1, 3]], expected, rtol=4e-3)


@pytest.mark.parametrize("depth", [2e-5, 4e-4, 1.2e-3, 3.7e-3, 4.6e-3])
def test_forces_are_slopes_of_the_energy_and_stiffness_theirs(depth: float, rng: np.random.Generator) -> None:
    """In all four coordinates, within the table and beyond it; differences within a cell, where curves are smooth."""
    deformation = np.array([depth, *rng.normal(0.0, 0.1 * R, 2), 0.2])

    def energy(move: Array) -> float:
        return LAW.energy(*LAW.arguments(deformation + SIZES * move, 1.0, 0.3))

    def force(move: Array) -> Array:
        return LAW(deformation + SIZES * move, 1.0, 0.3) * SIZES

    found = force(np.zeros(4))
    np.testing.assert_allclose(found, numerical_jacobian(energy, 4, 1e-5), rtol=1e-6, atol=1e-6 * np.max(np.abs(found)))
    stiffness = np.reshape(LAW.stiffness(*LAW.arguments(deformation, 1.0, 0.3)), (4, 4)) * np.outer(SIZES, SIZES)
    np.testing.assert_allclose(stiffness, stiffness.T, rtol=1e-14)
    expected = numerical_jacobian(force, 4, 1e-6)
    np.testing.assert_allclose(stiffness, expected, rtol=1e-5, atol=1e-7 * np.max(np.abs(expected)))


def test_force_and_stiffness_have_no_steps() -> None:
    """Across cells and across the end of the table: the force is smooth, its slope is continuous within the table."""
    moved = (0.4e-3, 0.2e-3, 0.3)
    for depth in (*(LAW.depths[-1] * np.arange(1, COEFFICIENTS - 3) / (COEFFICIENTS - 3)), LAW.depths[-1]):
        less, more = (LAW([depth + side * 1e-12, *moved], UP) for side in (-1.0, 1.0))
        np.testing.assert_allclose(less, more, rtol=1e-7)
        if depth < LAW.depths[-1]:
            below, above = (LAW.stiffness(*LAW.arguments([depth + side * 1e-12, *moved], UP)) for side in (-1.0, 1.0))
            np.testing.assert_allclose(below, above, rtol=1e-6)


def test_the_force_grows_with_the_depth_everywhere() -> None:
    """Also between rows of a table with a sharp bend, where a cubic through its rows would fall."""
    bent = Tabulated(radius=R, depths=(0.001, 0.002, 0.003, 0.004), normal=(0.1, 0.11, 5.0, 5.01), shear=(1, 1, 1, 1),
                     torsion=(1, 1, 1, 1))  # fmt: skip
    for law in (LAW, bent):
        forces = [law([d, 0.0, 0.0, 0.0], UP)[0] for d in np.linspace(0.0, 0.006, 1500)]
        assert forces[0] == 0.0 and np.min(np.diff(forces)) > -1e-12


def test_a_table_of_another_law_is_that_law() -> None:
    """Rows of `hemisphere` give its forces back within 1 % where it has rows, with shear and torsion."""
    law, depths = Hemisphere(radius=R), tuple(np.linspace(0.0002, 0.004, 20).tolist())
    rows = np.array([law([d, 1e-9, 0.0, 1e-9], UP) for d in depths])
    table = Tabulated(radius=R, depths=depths, normal=tuple(rows[:, 0]), shear=tuple(rows[:, 1] / 1e-9),
                      torsion=tuple(rows[:, 3] / 1e-9))  # fmt: skip
    for depth in (0.0011, 0.0023, 0.0037):
        moved = [depth, 2e-4, -1e-4, 0.05]
        np.testing.assert_allclose(table(moved, UP), law(moved, UP), rtol=1e-2)


def test_compiled_it_answers_as_in_python() -> None:
    """Machine code of force and stiffness with its 62 numbers."""
    code, arguments, results = compile_law(LAW), LAW.arguments([0.0023, 2e-4, -1e-4, 0.05], 1.0), np.zeros(16)
    code.force.ctypes(arguments.ctypes.data_as(code.force.ctypes.argtypes[0]),
                      results.ctypes.data_as(code.force.ctypes.argtypes[1]))  # fmt: skip
    np.testing.assert_allclose(results[:4], LAW.force(*arguments), rtol=1e-13)


@pytest.mark.parametrize("t", [0.0, 0.3, 1.0])
def test_a_spline_is_the_slope_of_its_work(t: float) -> None:
    """Value, slope and bend of each of the four pieces by differences; together they are 1."""
    step = 1e-6
    for unit in np.eye(4):
        value, slope, bend = spline(t, *unit)
        sides = [(work(t + s, *unit), *spline(t + s, *unit)[:2]) for s in (step, -step)]
        np.testing.assert_allclose((np.subtract(*sides)) / (2.0 * step), [value, slope, bend], atol=1e-8)
    assert spline(t, 1.0, 1.0, 1.0, 1.0)[0] == pytest.approx(1.0) and work(1.0, 1.0, 1.0, 1.0, 1.0) == pytest.approx(
        1.0
    )


def test_a_curve_begins_at_nothing() -> None:
    """0 at depth 0, whether it must grow or not."""
    for grows in (True, False):
        assert curve(fit((0.1, 0.2, 0.4), (1.0, 1.5, 2.0), grows), np.array([0.0]))[0] == pytest.approx(0.0, abs=1e-12)


def test_a_table_is_not_fitted() -> None:
    """It has no coefficients; the command that takes rows as they are is named."""
    from softhand.identification.identify import identify
    from softhand.identification.record import EXAMPLE

    with pytest.raises(MeasurementError, match=r"Tabulated is a table .* softhand material --table"):
        identify([EXAMPLE], law="tabulated", compare=False)


TABLES: list[tuple[dict[str, Any], str]] = [
    ({"normal": (1.0, 3.0, 2.0)}, r"normal does not grow from row 2 to row 3: 3, 2 N; .*0\.002 to 0\.003 m"),
    ({"depths": (0.001, 0.001, 0.003)}, r"depths does not grow from row 1 to row 2"),
    ({"shear": (1.0, -1.0, 2.0)}, r"shear is -1 N/m in row 2"),
    ({"torsion": (1.0, 2.0)}, r"torsion has 2 rows and depths has 3"),
    ({"depths": (0.001, 0.002, 0.02)}, r"depths go from 0\.001 to 0\.02 m; .*the radius, 0\.01 m"),
    ({"depths": (0.0, 0.002, 0.003)}, r"normal is 1 N at depth 0"),
]


@pytest.mark.parametrize(("wrong", "words"), TABLES)
def test_no_table_of_a_tip_is_told_by_column_and_row(wrong: dict[str, Any], words: str) -> None:
    """A force that falls, depths out of order or beyond the tip, columns of other lengths."""
    table = {
        "depths": (0.001, 0.002, 0.003),
        "normal": (1.0, 2.0, 3.0),
        "shear": (1.0, 1.0, 1.0),
        "torsion": (1.0, 1.0, 1.0),
    }
    with pytest.raises(ScenarioError, match=words):
        read_settings(Tabulated, {"radius": R, **table, **wrong}, "fingertip")
