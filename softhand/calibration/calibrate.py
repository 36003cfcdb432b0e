"""Numbers of a scenario from a log of a run, in one call."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from softhand.assembly.resolve import Setup, resolve
from softhand.calibration.fit import Fitted, fit, held_out_ratio, look
from softhand.calibration.intervals import half_widths
from softhand.calibration.log import Log, check_hand
from softhand.calibration.motions import propose
from softhand.calibration.parameters import DELAY, Parameter, choose, keyed
from softhand.calibration.reading import read_log
from softhand.calibration.record import Calibration, Estimate, Residuals
from softhand.calibration.told import Direction
from softhand.errors import MeasurementError, ScenarioError
from softhand.laws.law import Law
from softhand.model.world import slides_of
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario, as_scenario

PIECE = 0.04
"""Length of a piece of a run [s]."""

Progress = Callable[[str], None]


def calibrate(
    log: Log | Recording | str | Path,
    fit_to: Iterable[str],
    scenario: Scenario | str | Path | None = None,
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    held_out: float = 0.2,
    starts: int = 1,
    seed: int = 0,
    level: float = 0.95,
    piece: float = PIECE,
    untold: str = "refuse",
    law: Law | None = None,
    overrides: Mapping[str, Any] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Calibration:
    """Fit numbers of a scenario to a log of a whole run.

        found = softhand.calibrate("run.nc", ["k_r", "mass", "sensing.object_position.delay"])
        found.value("object.mass"), found.interval("object.mass")

    The run is computed anew under the logged torques, in pieces that begin where those before them end, and parameters
    and states are fitted together to all that was measured: maximum likelihood for white noise, of which the standard
    deviations are found on the way. docs/calibrate.md has what is assumed.

    Args:
        log: a recording or its file, a CSV or MCAP file, or a `Log`.
        fit_to: dotted keys or their last part, and biases and delays of instruments.
        scenario: of the hand that was logged, with values to begin from; that of the recording if not given.
        bounds: lowest and highest value of a parameter by its name.
        held_out: share of the log, at its end, that is predicted and not fitted.
        starts: how many the fit begins from; the first from the values of the scenario.
        seed: of the others.
        level: of the intervals.
        piece: length of a piece [s].
        untold: "refuse", or "hold" to keep parameters that the log does not tell at their values.
        law: at all tips in place of the scenario's.
        overrides: dotted keys and values put over the scenario.
        threads: at work at the same time; as many as there are processors if not given.
        progress: called with what is being done.

    Raises:
        MeasurementError: the log cannot be used, does not tell a parameter, or the fit does not come to rest. Where it
            is not told, `.untold` has the names and `.motion` a scenario that would tell them, or None.
        ScenarioError: a key, a bound or an option is wrong.
    """
    _check(held_out, starts, level, piece, untold)
    if scenario is None and not isinstance(log, Log):
        scenario = _scenario_of(log)
    if scenario is None:
        raise ScenarioError("scenario: a log has none; give that of the hand that was logged.", key="scenario")
    base = as_scenario(scenario, overrides)
    read = log if isinstance(log, Log) else read_log(log, base)
    setup = resolve(base, law=law)
    world = setup.world
    check_hand(read, tuple(world.joint_names), world.n_tips, *world.position_limits, slides_of(world))
    names = [fit_to] if isinstance(fit_to, str) else list(fit_to)
    parameters = choose(setup.scenario, world, names, bounds or {})
    if not parameters:
        raise ScenarioError("fit: nothing is to be fitted; name a key, such as object.mass.", key="fit", value=names)
    workers = threads or os.cpu_count() or 1
    _tell(progress, "looking at what the log tells")
    unknown = look(read, setup, parameters, piece, workers)
    if unknown and untold == "refuse":
        _refuse(read, setup, parameters, unknown, piece, workers, progress)
    kept = [one for one in parameters if not any(one.name in way.parameters for way in unknown)]
    if not kept:
        raise _nothing_told(read, unknown, None)
    fitted = fit(read, setup, kept, piece, held_out, starts, seed, workers, progress)
    return _record(read, setup, fitted, unknown, level)


def _check(held_out: float, starts: int, level: float, piece: float, untold: str) -> None:
    for name, value, low, high in (
        ("held_out", held_out, 0.0, 0.8), ("level", level, 0.01, 0.9999), ("piece", piece, 0.005, 1.0),
        ("starts", starts, 1, 100),
    ):  # fmt: skip
        if not low <= value <= high:
            raise ScenarioError(f"{name}: got {value:g}; it must lie from {low:g} to {high:g}.", key=name, value=value)
    if untold not in ("refuse", "hold"):
        raise ScenarioError(f"untold: got {untold!r}; give refuse or hold.", key="untold", value=untold)


def _scenario_of(log: Recording | str | Path) -> Scenario | None:
    from softhand.assembly.probe import recorded_scenario
    from softhand.calibration.reading import recording_of

    recording = log if isinstance(log, Recording) else recording_of(Path(log))
    return None if recording is None else recorded_scenario(recording)


def _tell(progress: Progress | None, what: str) -> None:
    if progress is not None:
        progress(what)


def _refuse(
    log: Log, setup: Setup, parameters: list[Parameter], unknown: list[Direction], piece: float, threads: int,
    progress: Progress | None,
) -> None:  # fmt: skip
    _tell(progress, "looking for a motion that would tell it")
    motion = propose(setup, parameters, unknown, log, piece, threads)
    raise _nothing_told(log, unknown, motion)


def _nothing_told(log: Log, unknown: list[Direction], motion: Any) -> MeasurementError:
    told = "; ".join(way.text for way in unknown)
    remedy = "Fit them by another log, or hold them (--untold hold)." if motion is None else motion.text
    error = MeasurementError(f"{log.source}: the motion does not tell {told}. {remedy}", column="", value=None)
    error.__dict__["untold"] = tuple(dict.fromkeys(name for way in unknown for name in way.parameters))
    error.__dict__["motion"] = None if motion is None else motion.scenario
    return error


def _record(log: Log, setup: Setup, fitted: Fitted, unknown: list[Direction], level: float) -> Calibration:
    problem, solution, spread = fitted.problem, fitted.solution, fitted.spread
    half = half_widths(spread, level)
    estimates = []
    for one, x, width in zip(problem.parameters, solution.x, half, strict=True):
        value, low, high = one.to_value(x), one.to_value(x - width), one.to_value(x + width)
        at_bound = min(abs(value - one.lower), abs(one.upper - value)) <= 1e-6 * max(abs(value), 1e-12)
        note = "at its bound" if at_bound else ""
        estimates.append(Estimate(one.name, value, low, high, one.unit, one.value, note))
    ratios = held_out_ratio(fitted)
    residuals = []
    for name in problem.names:
        which = [k for k, (quantity, _) in enumerate(problem.channels) if quantity == name]
        held = float(np.sqrt(np.mean(ratios[which] ** 2)))
        noise = float(np.sqrt(np.mean(solution.sigma[which] ** 2)))
        residuals.append(Residuals(name, noise, held, spread.alike[name]))
    agree = [bool(np.all(np.abs(x - solution.x) <= np.maximum(half, 1e-3))) for x, _ in fitted.others]
    return Calibration(
        estimates=tuple(estimates), residuals=tuple(residuals), level=level, is_noise=spread.is_noise,
        untold=tuple(way.text for way in unknown), starts=1 + len(fitted.others), agreeing=1 + sum(agree),
        duration=float(log.time[-1] - log.time[0]), source=log.source, scenario=_scenario(setup, problem, solution.x),
        fitted=fitted,
    )  # fmt: skip


def _scenario(setup: Setup, problem: Any, x: Any) -> Scenario:
    """The scenario with what was found; delays as whole control periods."""
    values = problem.values(x)
    period = setup.scenario.control_period
    rounded = [
        round(value / period) * period if one.kind == DELAY else value
        for one, value in zip(problem.parameters, values, strict=True)
    ]
    return setup.asked.replace(keyed(problem.parameters, rounded))
