"""The paper's claim in numbers: compensated goes to the target, uncompensated keeps a steady error."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from softhand.errors import SimulationStopped
from softhand.recording.recording import Recording
from softhand.studies import reproduce as module
from softhand.studies.reproduce import COLUMNS, REFERENCES, RUNS, TARGETS, WINDOW, Case, Reproduction, draw, reproduce

PAIRS = [(reference, target) for reference in REFERENCES for target in TARGETS]


@pytest.fixture(scope="module")
def done() -> list[float]:
    return []


@pytest.fixture(scope="module")
def result(done: list[float]) -> Reproduction:
    return reproduce(done.append)


@pytest.fixture
def case(result: Reproduction) -> Case:
    return result.case("minimum-jerk", "A", True)


def test_each_case_is_run_once(result: Reproduction) -> None:
    """Two references, two targets, with and without compensation."""
    assert len({(case.reference, case.target, case.compensated) for case in result.cases}) == RUNS == 8


def test_every_run_is_complete(result: Reproduction) -> None:
    """No run of the paper's stops early."""
    assert [case.recording.reason for case in result.cases] == [""] * RUNS


def test_progress_rises_to_the_number_of_runs(result: Reproduction, done: list[float]) -> None:
    """It is told now and then, never falls, and ends at `RUNS`."""
    assert len(done) > 5 * RUNS
    assert done == sorted(done)
    assert done[-1] == RUNS


@pytest.mark.parametrize("target", TARGETS)
def test_compensated_goes_to_the_target(result: Reproduction, target: str) -> None:
    """Within 0.05 mm and 0.02 deg when led there smoothly."""
    case = result.case("minimum-jerk", target, True)
    assert case.position.mean < 0.05
    assert case.orientation.mean < 0.02
    assert case.outcome == "at the target"


@pytest.mark.parametrize("target", TARGETS)
def test_uncompensated_keeps_a_steady_error(result: Reproduction, target: str) -> None:
    """About half a millimetre and more than a degree, at rest."""
    case = result.case("minimum-jerk", target, False)
    assert 0.4 < case.position.mean < 0.6
    assert 1.3 < case.orientation.mean < 1.7
    assert case.outcome == "steady error"


@pytest.mark.parametrize(("reference", "target"), PAIRS)
@pytest.mark.parametrize("quantity", ["position", "orientation", "force"])
def test_compensation_takes_the_steady_error_away(
    result: Reproduction, reference: str, target: str, quantity: str
) -> None:
    """At most a quarter of each error is left, for the ringing step too."""
    with_, without = (getattr(result.case(reference, target, how), quantity).mean for how in (True, False))
    assert with_ < 0.25 * without


@pytest.mark.parametrize("target", TARGETS)
def test_a_step_is_still_swinging(result: Reproduction, target: str) -> None:
    """The table says so, by how much, for both."""
    for compensated, where in ((True, "at the target"), (False, "steady error")):
        outcome = result.case("step", target, compensated).outcome
        assert outcome.startswith(f"{where}, swings by 0.")
        assert outcome.endswith(" deg")


def test_a_step_asks_for_more_friction_than_there_is(result: Reproduction) -> None:
    """Friction use is above 1 for the step and below for the smooth reference."""
    for case in result.cases:
        assert (case.friction_use > 1.0) == (case.reference == "step")


def test_final_errors_are_those_of_the_definition(case: Case) -> None:
    """Length of the mean of the last 500 samples, and rms distance from it."""
    rpy = np.degrees(case.recording.object_rpy - case.recording.object_rpy_desired)[-round(WINDOW / 1e-3) :]
    assert case.orientation.mean == pytest.approx(np.linalg.norm(rpy.mean(axis=0)))
    assert case.orientation.swing == pytest.approx(np.sqrt(rpy.var(axis=0).sum()))


def test_the_table_has_a_row_for_each_run_below_its_reference(result: Reproduction) -> None:
    """All rows are as wide as the headings."""
    rows = result.rows()
    assert {len(row) for row in rows} == {len(COLUMNS)}
    names = [f"{target}, {how}" for target in TARGETS for how in ("compensated", "uncompensated")]
    assert [row[0] for row in rows] == [name for reference in REFERENCES for name in (reference, *names)]


def test_a_stopped_run_shows_its_reason_and_no_final_error(case: Case) -> None:
    """An early end is told, not hidden behind numbers of the way."""
    stopped = replace_recording(case, complete=False, reason="finger_1_tip is pressed flat", stop_time=0.75)
    assert stopped.row()[1:4] == ("-", "-", "-")
    assert stopped.outcome == "stopped at 0.75 s: finger_1_tip is pressed flat"
    assert not stopped.is_at_target


def test_a_run_that_stops_early_is_kept(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other runs go on, and the figure tells the reason."""
    half = replace_recording(case, complete=False, reason="the run diverged", stop_time=1.0).recording
    let_runs_stop(monkeypatch, half, "diverged")
    result = reproduce()
    assert len(result.cases) == RUNS
    figure = draw(result)["step"]
    assert any("stopped at 1 s: the run diverged" in text.get_text().replace("\n", " ") for text in figure.texts)


def test_an_interrupt_ends_the_reproduction(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C is not taken for a run that stopped."""
    let_runs_stop(monkeypatch, case.recording, "interrupted")
    with pytest.raises(SimulationStopped, match="interrupted"):
        reproduce()


def test_there_is_a_figure_for_each_reference(result: Reproduction) -> None:
    """Named so that files can be named alike."""
    figures = draw(result)
    assert list(figures) == list(REFERENCES)
    assert all(len(figure.axes) == 12 for figure in figures.values())


def test_the_curves_of_the_last_row_end_at_the_numbers_of_the_table(result: Reproduction) -> None:
    """Uncompensated and compensated of A, then of B."""
    for reference, figure in draw(result).items():
        shown = [np.asarray(line.get_ydata())[-1] for line in figure.axes[7].lines]
        table = [result.case(reference, target, how).orientation.mean for target in TARGETS for how in (False, True)]
        assert shown == pytest.approx(table)


def replace_recording(case: Case, **changes: Any) -> Case:
    return replace(case, recording=replace(case.recording, **changes))


def let_runs_stop(monkeypatch: pytest.MonkeyPatch, recording: Recording, reason: str) -> None:
    """Let every run stop with this recording."""

    class Stopping:
        def run(self, progress: object = None) -> Recording:
            raise SimulationStopped(reason, recording=recording, reason=reason, time=recording.stop_time)

    monkeypatch.setattr(module, "build", lambda scenario: Stopping())
