"""The paper's simulation anew: two targets, with and without compensation of the torsion moments.

Use it as:

    from softhand.plots import save_figure
    from softhand.studies.reproduce import draw, reproduce

    result = reproduce()
    for name, figure in draw(result).items():
        save_figure(figure, f"{name}.png")

`Reproduction.rows` is the table of the final errors, under `COLUMNS` and explained by `CAPTION`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import product

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from softhand.assembly.build import build
from softhand.errors import SimulationStopped
from softhand.plots.comparison import Compared, draw_comparison
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, load_scenario

REFERENCES = {
    "minimum-jerk": "Minimum-jerk reference: to the target within 1 s",
    "step": "Step reference: the target at once, as in the paper",
}
"""References that are followed, with the titles of their figures."""

TARGETS = {"A": "target-a", "B": "target-b"}
"""Targets and their scenarios."""

RUNS = 2 * len(REFERENCES) * len(TARGETS)
"""Runs of one reproduction."""

WINDOW = 0.5  # [s] at the end of a run, over which errors are averaged: longer than the swings of the object
NEAR = {"position": 0.2, "orientation": 1.0}  # [mm, deg] counts as being at the target, and as standing still

COLUMNS = ("run", "position\n[mm]", "orientation\n[deg]", "force\n[N]", "friction\nuse", "outcome")
"""Headings of `Reproduction.rows`."""

CAPTION = (
    "Final errors: length of the error vector (x, y, z; roll, pitch, yaw; all internal forces), averaged as a vector "
    f"over the last {WINDOW:g} s. At the target: up to {NEAR['position']:g} mm and {NEAR['orientation']:g} deg. "
    "Swings: rms distance from that average, where it is above the same figures. Friction use: largest "
    "|f_t| / (mu f_z) of the run; above 1 a real tip would have slipped."
)
"""What the numbers of `Reproduction.rows` mean."""


@dataclass(frozen=True)
class FinalError:
    """Error of one quantity over the last `WINDOW` of a run.

    Attributes:
        mean: length of the mean of the error vector, the steady part [mm, deg or N].
        swing: rms distance of the error vector from its mean, what still moves [mm, deg or N].
    """

    mean: float
    swing: float


@dataclass(frozen=True, eq=False)
class Case:
    """One run and how it ended.

    Attributes:
        target: "A" or "B".
        reference: "step" or "minimum-jerk".
        compensated: whether the controller compensated the torsion moments.
        recording: the run, incomplete if it stopped early.
    """

    target: str
    reference: str
    compensated: bool
    recording: Recording

    @property
    def position(self) -> FinalError:
        """Error of x, y and z [mm]."""
        return self._final_error("object_position", 1e3)

    @property
    def orientation(self) -> FinalError:
        """Error of roll, pitch and yaw [deg]: what the controller regulates, not the angle of one rotation."""
        return self._final_error("object_rpy", 180.0 / np.pi)

    @property
    def force(self) -> FinalError:
        """Error of the internal forces [N]."""
        return self._final_error("internal_force", 1.0)

    @property
    def friction_use(self) -> float:
        """Largest |f_t| / (mu f_z) of all contacts and times."""
        return float(np.max(self.recording.friction_use, initial=0.0))

    @property
    def is_at_target(self) -> bool:
        """Whether the mean errors of the pose are within `NEAR`; never for a run that stopped."""
        near = self.position.mean <= NEAR["position"] and self.orientation.mean <= NEAR["orientation"]
        return self.recording.complete and near

    @property
    def is_swinging(self) -> bool:
        """Whether the pose still swings by more than `NEAR`."""
        return self.position.swing > NEAR["position"] or self.orientation.swing > NEAR["orientation"]

    @property
    def outcome(self) -> str:
        """How the run ended, in words; the reason if it stopped early."""
        if not self.recording.complete:
            return f"stopped at {self.recording.stop_time:g} s: {self.recording.reason}"
        end = "at the target" if self.is_at_target else "steady error"
        swing = f", swings by {self.position.swing:.2g} mm, {self.orientation.swing:.2g} deg"
        return end + swing if self.is_swinging else end

    def row(self) -> tuple[str, ...]:
        """The cells under `COLUMNS`; a run that stopped has no final errors."""
        name = f"{self.target}, {'compensated' if self.compensated else 'uncompensated'}"
        errors = (self.position, self.orientation, self.force)
        cells = [f"{error.mean:.2g}" if self.recording.complete else "-" for error in errors]
        return (name, *cells, f"{self.friction_use:.3g}", self.outcome)

    def _final_error(self, name: str, scale: float) -> FinalError:
        time = self.recording.time
        error = scale * (self.recording[name] - self.recording[f"{name}_desired"])
        last: NDArray[np.float64] = error[time > self.recording.stop_time - WINDOW + 1e-9]
        mean = last.mean(axis=0) if len(last) else np.full(error.shape[1], np.nan)
        swing = np.sqrt(np.mean(np.sum((last - mean) ** 2, axis=1))) if len(last) else np.nan
        return FinalError(float(np.linalg.norm(mean)), float(swing))


@dataclass(frozen=True)
class Reproduction:
    """All runs: each reference, each target, with compensation and without, in this order."""

    cases: tuple[Case, ...]

    def case(self, reference: str, target: str, compensated: bool) -> Case:
        """One of the runs, such as `case("step", "A", True)`."""
        wanted = (reference, target, compensated)
        return next(case for case in self.cases if (case.reference, case.target, case.compensated) == wanted)

    def rows(self) -> list[tuple[str, ...]]:
        """The table of the final errors: cells as text under `COLUMNS`, explained by `CAPTION`.

        One row a run; before the runs of a reference a row with its name and nothing else.
        """
        table = []
        for reference in REFERENCES:
            table.append((reference, *[""] * (len(COLUMNS) - 1)))
            table += [case.row() for case in self.cases if case.reference == reference]
        return table


def reproduce(progress: Callable[[float], None] | None = None) -> Reproduction:
    """Run targets A and B with and without torsion compensation, for the references `minimum-jerk` and `step`.

    A run that stops early is kept as far as it came, with its reason.

    Args:
        progress: called now and then with the number of runs done, a fraction for the one going on; `RUNS` at the end.

    Raises:
        SofthandError: a run cannot be started.
        SimulationStopped: interrupted by Ctrl-C.
    """
    cases = []
    for done, (reference, target, compensated) in enumerate(_plan()):
        scenario = load_scenario(
            TARGETS[target], {"reference.kind": reference, "controller.torsion_compensation": compensated}
        )
        cases.append(Case(target, reference, compensated, _run(scenario, _part(progress, done, scenario.duration))))
    if progress is not None:
        progress(float(RUNS))
    return Reproduction(tuple(cases))


def draw(result: Reproduction) -> dict[str, Figure]:
    """The paper's simulation figure, once for each reference: figures by the reference's name.

    Columns position, orientation, internal force; both targets in the same axes; solid with compensation, dash-dotted
    without, desired values thin and black on top. The curves of the last row end at the mean errors of the table.
    """
    return {
        reference: draw_comparison([_compared(result, reference, target) for target in TARGETS], title, WINDOW)
        for reference, title in REFERENCES.items()
    }


def _plan() -> Iterator[tuple[str, str, bool]]:
    return product(REFERENCES, TARGETS, (True, False))


def _compared(result: Reproduction, reference: str, target: str) -> Compared:
    with_, without = (result.case(reference, target, compensated).recording for compensated in (True, False))
    return Compared(target, with_, without)


def _part(progress: Callable[[float], None] | None, done: int, duration: float) -> Callable[[float], None] | None:
    """Progress of one run, as a fraction of it, on top of the runs already done."""
    if progress is None:
        return None
    return lambda time: progress(done + time / duration)


def _run(scenario: Scenario, progress: Callable[[float], None] | None) -> Recording:
    try:
        return build(scenario).run(progress)
    except SimulationStopped as stop:
        if getattr(stop, "reason", "") == "interrupted":
            raise
        recording: Recording = stop.recording
        return recording
