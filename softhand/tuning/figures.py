"""What a run may cost, by name: the figures of `softhand compare`, and a few that only tuning asks for."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from softhand.analysis.performance import measure
from softhand.batch.runs import Runs
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario

MOST_USE = 100.0
"""A friction use beyond it, or without limit, counts as this."""

_SHARE = 0.25  # of a run, at its end, over which scatter is taken

VARIABLES = (
    "object_position", "object_position_desired", "object_rpy", "object_rpy_desired", "internal_force",
    "internal_force_desired", "friction_use", "joint_torque",
)  # fmt: skip
"""Variables of a run that figures are computed from."""


class Figure(NamedTuple):
    """One kind of figure; the smaller the better."""

    unit: str
    words: str
    """What it is, for a table."""
    least: float
    """A cost is counted by the figure before, but at least by this, as that may be nothing."""


FIGURES: Mapping[str, Figure] = {
    "settling": Figure("s", "settling", 0.01),
    "overshoot": Figure("%", "overshoot", 1.0),
    "friction_use": Figure("1", "friction use", 0.01),
    "effort": Figure("N m", "effort", 0.001),
    "position_error": Figure("mm", "position error", 0.01),
    "orientation_error": Figure("deg", "orientation error", 0.01),
    "force_error": Figure("N", "force error", 0.001),
    "tracking": Figure("mm", "error on the way", 0.01),
    "scatter": Figure("mm", "scatter", 0.0001),
}
"""Those that a cost may be made of; docs/tune.md defines them."""


def figures_of(runs: Runs, index: int, names: Sequence[str], duration: float) -> Array:
    """The figures of a run that came to its end, shape (names,); NaN where there is none.

    A run that is not settled at its end counts as settled then: infinity would tell a search nothing.

    Args:
        runs: with `VARIABLES` kept.
        index: of the run.
        names: in `FIGURES`.
        duration: of the run [s].
    """
    count = int(np.count_nonzero(np.isfinite(runs.object_position[index, :, 0])))
    variables = {"time": runs.time[:count], **{name: runs[name][index, :count] for name in VARIABLES}}
    run = Recording(variables, runs.labels, "", runs.version, True, "", duration)
    found = measure(run)
    told = {
        "settling": min(found.settling_time, duration),
        "overshoot": found.overshoot,
        "friction_use": min(found.friction_use, MOST_USE),
        "effort": found.effort,
        "position_error": found.position_error,
        "orientation_error": found.orientation_error,
        "force_error": found.force_error,
        "tracking": _rms(1e3 * (run.object_position - run.object_position_desired)),
        "scatter": _scatter(run.time, 1e3 * run.object_position),
    }
    return np.array([told[name] for name in names])


def has_noise(scenario: Scenario) -> bool:
    """Whether an instrument or a drive is noisy."""
    instruments = scenario.sensing.instruments.values() if scenario.sensing is not None else ()
    drives = scenario.actuation.noise if scenario.actuation is not None else 0.0
    return any(np.any(one.noise) for one in instruments) or bool(np.any(drives))


def _scatter(time: Array, position: Array) -> float:
    """Root mean square distance from the mean place, over the last part of a run."""
    last = position[time >= (1.0 - _SHARE) * time[-1] - 1e-9]
    return _rms(last - np.mean(last, axis=0))


def _rms(rows: Array) -> float:
    return math.sqrt(float(np.mean(np.sum(rows**2, axis=1))))
