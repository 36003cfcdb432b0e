"""Laws and controllers side by side: what is run, what the table says, and what becomes of runs that stop."""

from __future__ import annotations

import csv
import io
import math
import sys
from pathlib import Path

import numpy as np
import pytest
from commands import Outcome, run_command

from softhand import (
    Scenario,
    ScenarioError,
    Simulation,
    SimulationStopped,
    build,
    compare,
    load_scenario,
    simulate,
    summarize,
)
from softhand.plugins import SHIPPED
from softhand.studies import compare as module
from softhand.studies.compare import COLUMNS, LAWS, LINE_OF_WORK, Row, draw, labels, pairs, split_choices, to_csv

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

SHORT = {"duration": 0.02}


@pytest.fixture(scope="module")
def rows() -> list[Row]:
    return compare("target-a", controllers=["regulation", "regulation(torsion_compensation=false)"])


def test_the_numbers_are_those_of_single_runs(rows: list[Row]) -> None:
    """The same run alone ends with the same errors, and without compensation a steady error is left."""
    alone = simulate(load_scenario("target-a"))
    assert np.array_equal(rows[0].recording.object_position, alone.object_position)
    with_, without = (row.performance for row in rows)
    assert with_.position_error == pytest.approx(summarize(alone).position_error, rel=1.0)
    assert with_.position_error < 0.05 and 0.4 < without.position_error < 0.6
    assert with_.orientation_error < 0.1 and 1.3 < without.orientation_error < 1.7
    assert with_.settling_time < 1.0 and without.settling_time == math.inf
    assert with_.friction_use == pytest.approx(summarize(alone).friction_use)


def test_every_law_meets_every_controller() -> None:
    """Law by law; own settings stay, others have defaults or what is in the brackets."""
    task = load_scenario("target-a", SHORT)
    rows = compare(task, ["nakashima", "nakashima(k_r=0.5e6)"], ["regulation(K_v=0.01)", "blind(K_p=10, mass=0.1)"])
    assert [(row.law, row.controller) for row in rows] == [
        (law, controller) for law in ("nakashima", "nakashima(k_r=0.5e6)")
        for controller in ("regulation(K_v=0.01)", "blind(K_p=10, mass=0.1)")
    ]  # fmt: skip
    assert "k_r = 500000.0" in rows[2].recording.scenario and "k_phi = 166000.0" in rows[2].recording.scenario
    assert "K_v = 0.01" in rows[0].recording.scenario and "K_p = 10" in rows[3].recording.scenario
    assert labels(rows)[3] == "nakashima(k_r=0.5e6), blind(K_p=10, mass=0.1)"


def test_another_law_takes_along_what_it_shares(monkeypatch: pytest.MonkeyPatch) -> None:
    """The radius goes along, the coefficients of the paper do not; what is missing is asked for."""
    monkeypatch.setitem(SHIPPED["laws"], "springs", "test_performance:Springs")
    task = load_scenario("target-a", SHORT)
    rows = compare(task, ["nakashima", "springs(k=2500)"])
    assert labels(rows) == ["nakashima", "springs(k=2500)"]
    assert rows[1].outcome == "" and not np.array_equal(rows[0].recording.deformation, rows[1].recording.deformation)
    with pytest.raises(ScenarioError, match=r"fingertip\.k: missing"):
        compare(task, ["springs"])


@pytest.mark.parametrize(("name", "own", "last"), [("target-a", "blind", "planar"), ("pinch", "two-phase", "planar")])
def test_what_is_compared_by_default(name: str, own: str, last: str) -> None:
    """Alone the line of work for that number of fingers, then other laws; every run goes through."""
    rows = compare(load_scenario(name, {"duration": 0.005}))
    assert labels(rows)[0] == "nakashima, regulation" and labels(rows)[1] == LINE_OF_WORK[1]
    assert own in labels(rows) and labels(rows)[-4:] == list(LAWS[1:]) and LAWS[-1] == last
    assert [row.outcome for row in rows] == [""] * len(rows)
    assert {row.controller for row in rows if row.law != "nakashima"} == {"regulation"}


@pytest.mark.parametrize(
    ("asked", "expected"),
    [({"laws": ["radial"]}, [("radial", "regulation")]), ({"controllers": ["blind"]}, [("nakashima", "blind")])],
)
def test_what_is_not_named_is_that_of_the_scenario(asked: dict, expected: list[tuple[str, str]]) -> None:
    """With laws only, the scenario's controller; with controllers only, its law."""
    assert pairs(load_scenario("target-a"), **asked) == expected


def test_a_law_that_is_a_spring_loses_nothing() -> None:
    """The energy of a run closes for laws in surface coordinates, whose displacements are recorded as angles."""
    rows = compare(load_scenario("target-a", {"stepper.step": 5e-4}), ["conservative", "radial"])
    assert [abs(row.energy_lost) < 1e-5 for row in rows] == [True, True]


def test_a_run_that_stops_has_reason_and_time_in_place_of_numbers() -> None:
    """And the others go on; the figure marks it."""
    rows = compare(load_scenario("pinch", {"duration": 0.8}), controllers=["two-phase(K_q=0.5)", "regulation"])
    stopped, complete = rows
    assert stopped.performance is None and stopped.cells() == ("-",) * len(COLUMNS)
    assert stopped.outcome.startswith("stopped at 0.67") and "finger_1_tip rolls over its apex" in stopped.outcome
    assert complete.outcome == "" and complete.performance is not None
    figure = draw(rows, "one of two")
    assert any("stopped at 0.67" in text.get_text().replace("\n", " ") for text in figure.axes[0].texts)


def test_a_run_that_cannot_begin_is_a_row_too() -> None:
    """A hand of the wrong kind, a start that is not possible."""
    rows = compare(load_scenario("pinch", SHORT), controllers=["blind", "regulation"])
    assert "at least 3 fingers" in rows[0].outcome and rows[1].outcome == ""
    refused = compare(load_scenario("pinch", {**SHORT, "fingertip.friction": 0.1}), controllers=["regulation"])[0]
    assert refused.outcome.startswith("cannot begin") and "friction" in refused.outcome and refused.recording is None
    draw([refused, rows[1]], "one of two")


@pytest.mark.parametrize(
    ("controller", "words"),
    [("regulatoin", "Did you mean"), ("regulation(K_w=1)", r"controller\.K_w.*K_v"), ("regulation)", "list of names"),
     ("regulation(K_v=[1)", "list of names"), ("regulation(K_v)", "key=value"), ("blind,,regulation", "list of names")],
)  # fmt: skip
def test_a_wrong_choice_ends_all_before_the_first_run(
    controller: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Names and settings are checked first."""
    monkeypatch.setattr(module, "build", lambda scenario: pytest.fail("ran"))
    with pytest.raises(ScenarioError, match=words):
        compare("target-a", controllers=["regulation", *split_choices(controller)])


def test_names_are_split_at_commas_outside_of_brackets() -> None:
    """Lists and tables may stand in the brackets."""
    assert split_choices(" a, b(k=1, l=[2, 3]),c ") == ["a", "b(k=1, l=[2, 3])", "c"]


def test_progress_counts_runs() -> None:
    """It never falls and ends at the number of runs."""
    told: list[float] = []
    compare(load_scenario("target-a", {"duration": 0.1}), controllers=["regulation", "blind"], progress=told.append)
    assert told == sorted(told) and told[-1] == 2.0 and len(told) > 8


def test_an_interrupt_ends_the_comparison(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C is not taken for a run that stopped; the runs before it are kept."""

    def interrupted(scenario: Scenario) -> Simulation:
        if scenario.controller.name == "blind":
            raise SimulationStopped("interrupted", reason="interrupted")
        return build(scenario)

    monkeypatch.setattr(module, "build", interrupted)
    with pytest.raises(SimulationStopped, match=r"after 1 of 2 runs") as caught:
        compare(load_scenario("target-a", {"duration": 0.1}), controllers=["regulation", "blind"])
    assert [row.controller for row in caught.value.rows] == ["regulation"]  # type: ignore[attr-defined]


def test_friction_of_the_task_holds_for_all_runs() -> None:
    """Another law changes the law alone: contact mode, coefficients and damping stay."""
    task = load_scenario("target-a", {
        "duration": 0.002, "fingertip.contact": "coulomb", "fingertip.static_friction": 0.7,
        "fingertip.damping": {"name": "kelvin-voigt", "radial": 3.0},
    })  # fmt: skip
    for row in compare(task, laws=["nakashima", "conservative"]):
        tip = tomllib.loads(row.recording.scenario)["fingertip"]
        assert (tip["contact"], tip["static_friction"], tip["damping"]["radial"]) == ("coulomb", 0.7, 3.0)


def test_the_csv_has_all_digits(rows: list[Row]) -> None:
    """One row a run below the headings, numbers as they are."""
    table = list(csv.DictReader(io.StringIO(to_csv(rows))))
    assert [row["controller"] for row in table] == [row.controller for row in rows]
    assert float(table[1]["place [mm]"]) == rows[1].performance.position_error
    assert float(table[0]["lost [mJ]"]) == 1e3 * rows[0].energy_lost


def test_the_figure_has_a_curve_a_run(rows: list[Row]) -> None:
    """Four columns; in the first each run has its error as a curve, on decades from a micrometre up, and as a number.

    The lowest decade stands 0.12 of a row above its foot, the highest 0.12 below its head.
    """
    figure = draw(rows, "two")
    assert len(figure.axes) == 4
    axes = figure.axes[0]
    shown = [text.get_text() for text in axes.texts]
    curves = [line.get_xydata() for line in axes.lines if line.get_color() != "0.6"]
    runs = [row.recording for row in rows]
    errors = [1e3 * np.linalg.norm(run.object_position - run.object_position_desired, axis=1) for run in runs]
    top = np.ceil(np.log10(max(error.max() for error in errors)))
    for n, (curve, run, error) in enumerate(zip(curves, runs, errors, strict=True)):
        assert f"{error[-1]:.2g}" in shown and curve[-1, 0] == run.time[-1]
        height = (np.log10(np.maximum(error, 1e-3)) + 3.0) / (top + 3.0)
        expected = len(rows) - 1 - n + 0.12 + 0.76 * height[np.searchsorted(run.time, curve[:, 0])]
        np.testing.assert_allclose(curve[:, 1], expected, rtol=1e-12)


def run(*arguments: str, folder: Path) -> Outcome:
    return run_command("compare", *arguments, folder=folder, width=80)


def test_the_command_prints_a_table_and_writes_a_figure(tmp_path: Path) -> None:
    """In two processes, on a terminal of 80 columns, nothing is cut off."""
    result = run("target-a", "--controller", "regulation,blind(K_p=100)", "--controller", "opposing", "--duration",
                 "0.02", "--jobs", "2", "--out", "here", folder=tmp_path)  # fmt: skip
    assert result.returncode == 0, result.stderr
    for words in ("settled", "lost", "[mJ]", "blind(K_p=100)", "opposing: cannot begin", "needs 2 fingers"):
        assert words in result.stdout
    assert {file.name for file in (tmp_path / "here").iterdir()} == {"comparison.png", "comparison.csv"}
    table = list(csv.DictReader((tmp_path / "here/comparison.csv").open()))
    assert [row["controller"] for row in table] == ["regulation", "blind(K_p=100)", "opposing"]


def test_the_command_is_silent_and_names_mistakes(tmp_path: Path) -> None:
    """--quiet prints nothing; a wrong name is one message."""
    quiet = run("pinch", "--law", "nakashima", "--duration", "0.002", "--quiet", folder=tmp_path)
    assert (quiet.returncode, quiet.stdout, quiet.stderr) == (0, "", "")
    assert (tmp_path / "runs/compare-pinch/comparison.png").is_file()
    none = run("--controller", "opposing", "--duration", "0.002", folder=tmp_path)
    assert none.returncode == 1 and "needs 2 fingers" in none.stdout
    (tmp_path / "file").touch()
    before = run("--out", "file/below", folder=tmp_path)
    assert before.returncode == 1 and "choose another with --out" in before.stderr
    wrong = run("--law", "nakashina", folder=tmp_path)
    assert wrong.returncode == 1 and "Did you mean" in wrong.stderr and "Traceback" not in wrong.stderr
