"""Where the pieces of a log begin, as far as measured numbers tell before anything is fitted.

The run is computed anew and led: every few milliseconds the joints are put where a parabola through the samples around
says, the object gets the velocity that its measured poses tell, and is drawn a little to where it was seen. So it stays
where the tips hold it, and what they store fits; an object that is put where a camera has seen it does not, by a
millimetre of bias or of radius.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from softhand.calibration.instruments import Instrument, instruments_of, off, quaternion_by, quaternion_product
from softhand.calibration.problem import Problem
from softhand.errors import MeasurementError
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_AROUND = 0.012  # [s] to each side
_LED = 0.004  # [s] between two times that the run is led
_DRAWN = 0.05  # share of the way to where the object was seen, each time


class Track(NamedTuple):
    """A measured quantity, smoothed, and its rate at each sample; of an orientation the angular velocity."""

    values: Array
    rates: Array


def first_states(problem: Problem, start: State, x: Array) -> list[State]:
    """States at the begin of each piece.

    Args:
        problem: at the parameters x.
        start: of the scenario.
        x: of the parameters.

    Raises:
        MeasurementError: the object is lost on the way.
    """
    states: list[State] = []
    stride = max(round(_LED / problem.period), 1)
    late = instruments_of(problem.setup.scenario, problem.world, problem.names, problem.parameters, problem.values(x))
    names: list[str] = [
        name for name in ("joint_position", "object_position", "object_orientation") if name in problem.names
    ]
    tracks = {name: _track(problem, name) for name in names}
    state, now = _led(problem, start, 0, tracks, late), 0
    for piece in problem.pieces:
        while now < piece.first:
            count = min(stride, piece.first - now)
            state = problem.go(state, now, count)
            now += count
            if not all(bool(np.all(np.isfinite(array))) for array in state.arrays):
                raise _lost(problem, now)
            state = _led(problem, state, now, tracks, late)
        states.append(state)
    return states


def _lost(problem: Problem, now: int) -> MeasurementError:
    time = float(problem.log.time[0]) + now * problem.period
    return problem.log.refused(
        f"the object is lost at t = {time:.4g} s when the run is computed anew with the joints where they were "
        "measured; begin from values nearer to the truth, give the scenario the start of the log, or cut the log "
        "before."
    )


def _led(problem: Problem, state: State, sample: int, tracks: dict[str, Track], late: dict[str, Instrument]) -> State:
    """A state with the joints where they were measured, and the object drawn to where it was."""
    world, last = problem.world, len(problem.log) - 1
    found = State(state.q.copy(), state.v.copy(), state.z.copy(), float(problem.log.time[0]) + sample * problem.period)
    at = {name: min(sample + round(late[name].delay / problem.period), last) for name in tracks}
    k, joints = at["joint_position"], tracks["joint_position"]
    world.set_joint_position(joints.values[k] - late["joint_position"].bias, found.q)
    found.v[[j for _, _, j in world.joints[: world.n_joints]]] = joints.rates[k]
    if "object_orientation" in tracks:
        k, track = at["object_orientation"], tracks["object_orientation"]
        turn = off("object_orientation", track.values[k], found.q[-4:], world) - late["object_orientation"].bias
        found.q[-4:] = quaternion_product(quaternion_by(_DRAWN * turn), found.q[-4:])
        found.q[-4:] /= np.linalg.norm(found.q[-4:])
        found.v[-3:] = world.object_rotation(found.q).T @ track.rates[k]
    if "object_position" in tracks:
        k, track = at["object_position"], tracks["object_position"]
        found.q[-7:-4] += _DRAWN * (track.values[k] - late["object_position"].bias - found.q[-7:-4])
        found.v[-6:-3] = world.object_rotation(found.q).T @ track.rates[k]
    return found


def _track(problem: Problem, name: str) -> Track:
    """By parabolas through the samples around each [Savitzky and Golay, Anal. Chem. 36, 1964]."""
    values, period = problem.log.measured[name], problem.period
    there = np.flatnonzero(np.isfinite(values).all(axis=1))
    if name == "object_orientation":  # the sign of a quaternion is free: no jumps
        kept = values[there]
        turns = np.cumprod(np.concatenate([[1.0], np.sign(np.sum(kept[1:] * kept[:-1], axis=1))]))
        filled = _filled(there, kept * turns[:, None], len(values))
    else:
        filled = _filled(there, values[there], len(values))
    width = min(2 * max(round(_AROUND / period), 2) + 1, len(values) - 1 + len(values) % 2)
    smooth = savgol_filter(filled, width, 2, axis=0)
    rates = savgol_filter(filled, width, 2, deriv=1, delta=period, axis=0)
    if name == "object_orientation":
        smooth /= np.linalg.norm(smooth, axis=1, keepdims=True)
        rates = 2.0 * quaternion_product(rates, smooth * np.array([-1.0, -1.0, -1.0, 1.0]))[:, :3]  # q' = w q / 2
    return Track(smooth, rates)


def _filled(there: NDArray[np.int64], values: Array, count: int) -> Array:
    """Values at all samples, between those that there are by straight lines."""
    return np.stack([np.interp(np.arange(count), there, column) for column in values.T], axis=1)
