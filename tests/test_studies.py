"""Studies: what is wrong is told with its line, and samples are what their names say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import kstest, norm

from softhand.errors import StudyError
from softhand.settings.lines import line_of
from softhand.studies.loading import as_study, load_study
from softhand.studies.samples import at_unit, draw, nodes, unit_points
from softhand.studies.study import Sample, Varied

GOOD = """\
scenario = "target-a"

[set]
duration = 0.04
fingertip.contact = "coulomb"

[vary]
mass = { range = [0.1, 0.4] }
"fingertip.friction" = { range = [0.2, 1.0], scale = "log" }
K_v = { grid = [
    0.004,
    0.005,
] }

[sample]
method = "latin-hypercube"
count = 8

[outcomes]
error = "position_error"
slip = { variable = "slip_travel", over = "max" }

[success]
error = { below = 0.5 }
"""

WRONG = {
    ('"fingertip.friction"', '"fingertip.frction"'): (9, "Did you mean fingertip.friction?"),
    ("mass =", "mas ="): (8, "Did you mean mass, for object.mass?"),
    ("[0.1, 0.4]", "[0.4, 0.1]"): (8, "the range is empty"),
    ("0.004,\n    0.005,", ""): (10, "it is empty"),
    ("[0.1, 0.4]", "[-0.1, 0.4]"): (8, "object.mass: got -0.1, but it must be a number > 0"),
    ("[sample]", "[smple]"): (15, "Did you mean sample?"),
    ("range = [0.1", "rnge = [0.1"): (8, "Did you mean vary.mass.range?"),
    ("duration = 0.04", "duraton = 0.04"): (4, "Did you mean duration"),
    ("duration = 0.04", "duration = -0.04"): (4, "must be a number > 0"),
    ('"latin-hypercube"', '"latin"'): (16, "must be one of"),
    ("count = 8", "count = 0"): (17, "whole number >= 1"),
    ('method = "latin-hypercube"\ncount = 8', 'method = "sobol"\ncount = 9'): (15, "8 or 16, not 9"),
    ('method = "latin-hypercube"\ncount = 8', ""): (8, 'the method "grid" takes values from a grid'),
    ('"position_error"', '"positon_error"'): (20, 'Did you mean "position_error"?'),
    ("slip_travel", "slip_trvel"): (21, 'Did you mean "slip_travel"?'),
    ('variable = "slip_travel"', 'variable = "measured_object_rpy"'): (21, "under [sensing] alone"),
    ("error = { below", "eror = { below"): (24, "Did you mean error?"),
    ("range = [0.1, 0.4]", "range = [0.1, 0.4], grid = [1]"): (8, "got grid and range"),
    ('"target-a"', '"target-z"'): (1, "Did you mean target-b?"),
    ("mass = {", '"object.mass" = { grid = [1] }\nmass = {'): (9, "object.mass is varied twice"),
    ("mass = {", '"object.position[3]" = { range = [0.0, 1.0] }\nmass = {'): (8, "there is none at [3]"),
    ("count = 8", "count = 8\nrepeats = 3"): (18, "all repeats would be the same run"),
}


@pytest.mark.parametrize(("change", "told"), WRONG.items(), ids=lambda item: str(item[1])[:40])
def test_what_is_wrong_is_told_with_its_line(change: tuple[str, str], told: tuple[int, str], tmp_path: Path) -> None:
    """File, line, key and remedy, before anything runs."""
    assert change[0] in GOOD
    file = tmp_path / "study.toml"
    file.write_text(GOOD.replace(*change, 1))
    with pytest.raises(StudyError) as caught:
        load_study(file)
    assert f"{file}, line {told[0]}: " in str(caught.value) and told[1] in str(caught.value)
    assert caught.value.line == told[0]


def test_a_study_is_read_with_full_keys(tmp_path: Path) -> None:
    """Last parts of keys become keys, numbers of lists keep their place, and paths are relative to the file."""
    file = tmp_path / "study.toml"
    file.write_text(GOOD.replace("mass =", '"object.position[0]" = { normal = [0.0, 0.001] }\nmass ='))
    found = load_study(file)
    assert list(found.study.vary) == ["object.position[0]", "object.mass", "fingertip.friction", "controller.K_v"]
    assert found.base.duration == 0.04 and found.base.fingertip.contact == "coulomb"
    (tmp_path / "own.toml").write_text(found.base.to_toml())
    file.write_text(GOOD.replace('"target-a"', '"own.toml"'))
    assert load_study(file).base == found.base
    again = as_study({"scenario": "target-a", "vary": {"mass": {"grid": [0.2]}}, "own": {"a": 1}}, others=("own",))
    assert again.others == {"own": {"a": 1}} and list(again.study.vary) == ["object.mass"]


def test_lines_of_keys() -> None:
    """Of a statement's first line, whatever is in it; of the table, for a key that is not there."""
    text = 'a = """\nb = 1\n"""  # c\n\n[t]\n# b = 2\nb = [\n  1,\n]\n"c.d" = 3\n[t.u]\nv.w = 1\n'
    places = {("a",): 1, ("t",): 5, ("t", "b"): 7, ("t", "c.d"): 10, ("t", "u", "v", "w"): 12, ("t", "x"): 5, ("b",): 0}
    assert {keys: line_of(text, keys) for keys in places} == places


def test_samples_have_the_distributions_of_their_names() -> None:
    """Even between two numbers or their logarithms, normal, and all choices alike."""
    u = np.random.default_rng(3).random(4000)
    shapes = {
        Varied(range=(2.0, 5.0)): lambda x: (x - 2.0) / 3.0,
        Varied(range=(0.1, 10.0), scale="log"): lambda x: np.log10(x / 0.1) / 2.0,
        Varied(normal=(3.0, 0.5)): norm(3.0, 0.5).cdf,
    }
    for entry, cdf in shapes.items():
        assert kstest(at_unit(entry, u), cdf).pvalue > 0.01
    counts = np.unique(at_unit(Varied(choice=("a", "b", "c", "d")), u), return_counts=True)[1]
    assert len(counts) == 4 and np.all(np.abs(counts - 1000) < 130)  # five standard deviations
    assert np.all(np.isfinite(at_unit(Varied(normal=(0.0, 1.0)), np.array([0.0, 1.0 - 2.0**-53]))))
    assert at_unit(Varied(choice=(1, 2)), np.array([0.0, 1.0 - 2.0**-53])).tolist() == [1, 2]


def test_designs_fill_the_cube() -> None:
    """A row and a column of a Latin hypercube has one point each; Sobol points fall evenly into dyadic boxes."""
    points = unit_points(Sample(method="latin-hypercube", count=50, seed=4), 3)
    assert all(sorted((50 * column).astype(int)) == list(range(50)) for column in points.T)
    points = unit_points(Sample(method="sobol", count=64, seed=4), 2)
    assert np.all(np.histogram2d(*points.T, bins=8, range=[(0, 1), (0, 1)])[0] == 1)
    assert not np.array_equal(unit_points(Sample(method="random", count=5, seed=1), 2),
                              unit_points(Sample(method="random", count=5, seed=2), 2))  # fmt: skip


def test_the_design_of_sobol_indices_changes_one_key_at_a_time() -> None:
    """Blocks of A, B, and A with one coordinate of B."""
    blocks = unit_points(Sample(method="saltelli", count=8, seed=1), 3).reshape(8, 5, 3)
    for key in range(3):
        expected = blocks[:, 0].copy()
        expected[:, key] = blocks[:, 1, key]
        assert np.array_equal(blocks[:, 2 + key], expected)


def test_grids_are_crossed_with_samples_and_repeats() -> None:
    """The same samples and the same seeds at each node of a grid."""
    noisy = {"sensing.object_position.noise": 1e-4}
    vary = {"mass": {"range": [0.1, 0.2]}, "friction": {"grid": [0.5, 0.6]}, "K_v": {"range": [0.1, 0.3], "points": 3}}
    sample = {"method": "random", "count": 2, "repeats": 4}
    found = draw(as_study({"scenario": "target-a", "set": noisy, "vary": vary, "sample": sample}).study)
    assert len(found) == 2 * 2 * 3 * 4 and found.seeds is not None
    masses = found.columns["object.mass"].reshape(2, 6, 4)
    assert np.all(masses == masses[:, :1, :1]) and masses[0, 0, 0] != masses[1, 0, 0]
    seeds = found.seeds.reshape(2, 6, 4)
    assert np.all(seeds == seeds[:, :1]) and len(np.unique(seeds)) == 8
    grid = [(found.columns["fingertip.friction"][i], found.columns["controller.K_v"][i]) for i in range(0, 24, 4)]
    assert grid == [(a, b) for a in (0.5, 0.6) for b in (0.1, 0.2, 0.3)]
    assert nodes(Varied(range=(0.1, 10.0), scale="log", points=3)) == pytest.approx([0.1, 1.0, 10.0], rel=1e-15)


def test_lists_are_values_like_numbers() -> None:
    """Lists of one length stay lists, and are not taken apart."""
    forces = [[4.0, 4.0, 3.0], [5.0, 5.0, 4.0]]
    entry = {"grid": forces, "also": ["reference.internal_force"]}
    found = as_study({"scenario": "target-a", "vary": {"grasp.internal_force": entry}})
    samples = draw(found.study)
    assert samples.row(1) == {"grasp.internal_force": (5.0, 5.0, 4.0)}
    assert found.study.vary["grasp.internal_force"].also == ("reference.internal_force",)
