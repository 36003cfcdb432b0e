"""Rates, sensitivities and figures of sweeps, against what is known of them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.stats import sobol_indices

from softhand.plots.varied import Varied as Axis
from softhand.studies.outcome_settings import Outcome
from softhand.studies.samples import at_unit, unit_points
from softhand.studies.study import Sample, Varied
from softhand.studies.sweeps.figures import draw_all
from softhand.studies.sweeps.numbers import numbers_of
from softhand.studies.sweeps.rates import rate_of
from softhand.studies.sweeps.sensitivity import rank, sobol
from softhand.studies.sweeps.sweep import sweep


@pytest.mark.parametrize(("successes", "trials"), [(0, 10), (7, 10), (10, 10), (51, 240)])
def test_wilson_ends_are_where_the_score_test_ends(successes: int, trials: int) -> None:
    """Both solve |p_hat - p| = z sqrt(p (1 - p) / n) [Wilson 1927]; without trials all is possible."""
    found, z = rate_of(successes, trials), 1.959963984540054
    for end in (found.low, found.high):
        if 0.0 < end < 1.0:
            assert abs(found.value - end) == pytest.approx(z * math.sqrt(end * (1.0 - end) / trials), rel=1e-9)
    assert found.low <= found.value <= found.high and (found.low > 0.0) == (successes > 0)
    nothing = rate_of(0, 0)
    assert (nothing.low, nothing.high) == (0.0, 1.0) and math.isnan(nothing.value)


def ishigami(x: np.ndarray) -> np.ndarray:
    """[Ishigami, Homma 1990], whose indices are known in closed form."""
    return np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])


def test_sobol_indices_of_the_ishigami_function() -> None:
    """First order and total, in their intervals, whatever is added to the function; lost runs are left out."""
    sample, entry = Sample(method="saltelli", count=1024), Varied(range=(-math.pi, math.pi))
    x = np.array([at_unit(entry, column) for column in unit_points(sample, 3).T]).T
    values = ishigami(x) + 1000.0
    blocks = (values - values.reshape(-1, 5)[:, :2].mean()).reshape(-1, 5)
    f_A, f_B, f_AB = blocks[None, :, 0], blocks[None, :, 1], blocks[:, 2:].T[:, None]
    theirs = sobol_indices(func={"f_A": f_A, "f_B": f_B, "f_AB": f_AB}, n=1024)
    ours = sobol("y", ("a", "b", "c"), values)
    assert ours is not None and ours.first == pytest.approx(theirs.first_order.ravel(), abs=1e-9)
    assert ours.total == pytest.approx(theirs.total_order.ravel(), abs=1e-9)
    values[::97] = np.nan
    found = sobol("y", ("a", "b", "c"), values)
    assert found is not None and found.left_out == math.ceil(len(values) / 97) and found.used == 1024 - found.left_out
    assert found.first == pytest.approx([0.3139, 0.4424, 0.0], abs=0.05)
    assert found.total == pytest.approx([0.5576, 0.4424, 0.2437], abs=0.05)
    assert np.all(found.total_low < found.total) and np.all(found.total < found.total_high)
    assert sobol("y", ("a", "b", "c"), np.ones(len(x))) is None
    assert sobol("y", ("a", "b", "c"), np.full(len(x), np.nan)) is None


def test_rank_correlations() -> None:
    """1 for what always grows with a key, about 0 for what does not; the interval holds the value."""
    rng = np.random.default_rng(1)
    x, y = rng.random(200), rng.random(200)
    found = rank("z", {"x": x, "y": y, "same": np.ones(200)}, np.exp(x))
    assert found is not None and found.keys == ("x", "y")
    assert found.first[0] == pytest.approx(1.0) and abs(found.first[1]) < 0.2
    assert found.first_low[1] < found.first[1] < found.first_high[1]
    assert found.first_high[1] - found.first_low[1] == pytest.approx(2.0 * 1.96 * math.sqrt(1.06 / 197), rel=0.05)


def test_numbers_of_a_run() -> None:
    """What `of` and `over` say, with NaN passed over."""
    array = np.array([[[3.0, -4.0], [1.0, np.nan]], [[0.0, 2.0], [5.0, -6.0]], [[1.0, 1.0], [2.0, 2.0]]])
    asked = {
        ("max", "last"): 2.0, ("max", "max"): 5.0, ("min", "min"): -6.0, ("min", "first"): -4.0, ("mean", "last"): 1.5,
        ("mean", "mean"): (0.0 + 0.25 + 1.5) / 3.0, ("norm", "first"): math.sqrt(26.0),
        ("norm", "max"): math.sqrt(65.0), ("max", "rms"): math.sqrt((9.0 + 25.0 + 4.0) / 3.0),
    }  # fmt: skip
    for (of, over), expected in asked.items():
        outcome = Outcome.model_validate({"variable": "tip_position", "of": of, "over": over})
        found = numbers_of({"a": outcome}, {"time": np.arange(3.0), "tip_position": array})
        assert found["a"] == pytest.approx(expected, rel=1e-14), (of, over)


def test_groups_and_cells_of_an_axis() -> None:
    """All runs are in one group, groups of samples are as large as each other, and cells hold the grid."""
    axis = Axis("x", np.random.default_rng(0).random(100))
    groups = axis.groups()
    assert np.all(np.sum([which for _, which in groups], axis=0) == 1)
    assert {int(which.sum()) for _, which in groups} <= {12, 13}
    grid = Axis("x", np.array([1.0, 10.0, 100.0, 1.0]), is_grid=True, is_log=True)
    assert [int(which.sum()) for _, which in grid.groups()] == [2, 1, 1]
    assert grid.edges() == pytest.approx(np.sqrt([0.1, 10.0, 1000.0, 1e5]))
    assert Axis("x", np.array([2.0, 2.0]), is_grid=True).edges() == pytest.approx([1.5, 2.5])


def test_figures_of_grids_words_and_designs(tmp_path: object) -> None:
    """Of each kind of study, as many as it has enough for."""
    short = {"scenario": "target-a", "set": {"duration": 0.02}}
    words = {"K_v": {"grid": [0.004, 0.005]}, "torsion_compensation": {"grid": [True, False]}}
    figures = draw_all(sweep({**short, "vary": words}, f"{tmp_path}/words"))
    assert set(figures) == {"success", "map", "scatter"}
    names = [text.get_text() for text in figures["success"].axes[1].get_xticklabels()]
    assert names == ["true", "false"]
    design = {"mass": {"range": [0.15, 0.25]}, "K_v": {"range": [0.004, 0.006]}}
    found = sweep({**short, "vary": design, "sample": {"method": "saltelli", "count": 8}}, f"{tmp_path}/design")
    assert len(found) == 8 * 4
    told = found.sensitivity("position_error")
    assert told is not None and told.kind == "sobol" and told.keys == ("object.mass", "controller.K_v")
    assert set(draw_all(found)) == {"success", "map", "scatter", "sensitivity"}
    one = sweep({**short, "vary": {"mass": {"grid": [0.2]}}}, f"{tmp_path}/one")
    assert draw_all(one) == {} and one.rate().trials == 1
