"""Where the pieces of a log begin, as far as measured numbers tell before anything is fitted.

The run is computed anew and led: every few milliseconds the joints are put where a parabola through the samples around
says, the object gets the velocity that its measured poses tell, and is drawn a little to where it was seen. So it stays
where the tips hold it, and what they store fits; an object that is put where a camera has seen it does not, by a
millimetre of bias or of radius.
"""

from __future__ import annotations

import numpy as np

from softhand.calibration.instruments import Instrument, instruments_of, off, quaternion_by, quaternion_product
from softhand.calibration.problem import Problem
from softhand.errors import MeasurementError
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_AROUND = 0.012  # [s] to each side
_LED = 0.004  # [s] between two times that the run is led
_DRAWN = 0.05  # share of the way to where the object was seen, each time


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
    begins, last = [piece.first for piece in problem.pieces], problem.pieces[-1].first
    state, now = _led(problem, start, 0, late), 0
    for begin in begins:
        while now < begin:
            count = min(stride, begin - now)
            state = problem.go(state, now, count)
            now += count
            if not all(bool(np.all(np.isfinite(array))) for array in state.arrays):
                raise _lost(problem, now, last)
            state = _led(problem, state, now, late)
        states.append(state)
    return states


def _lost(problem: Problem, now: int, last: int) -> MeasurementError:
    time = float(problem.log.time[0]) + now * problem.period
    return problem.log.refused(
        f"the object is lost at t = {time:.4g} s when the run is computed anew with the joints where they were measured; "
        "begin from values nearer to the truth, give the scenario the start of the log, or cut the log before.",
        column="", sample=None,
    )  # fmt: skip


def _led(problem: Problem, state: State, sample: int, late: dict[str, Instrument]) -> State:
    """A state with the joints where they were measured, and the object drawn to where it was."""
    world, time = problem.world, sample * problem.period
    found = State(state.q.copy(), state.v.copy(), state.z.copy(), float(problem.log.time[0]) + time)
    joints = late["joint_position"]
    q, rate = _parabola(problem.period, problem.log.measured["joint_position"], time + joints.delay)
    world.set_joint_position(q - joints.bias, found.q)
    found.v[[j for _, _, j in world.joints[: world.n_joints]]] = rate
    rotation = world.object_rotation(found.q)
    if "object_orientation" in late:
        one = late["object_orientation"]
        here = np.broadcast_to(found.q[-4:], (len(problem.log), 4))
        around = _around(problem.period, problem.log.measured["object_orientation"], time + one.delay)
        if around is not None:
            first, end = around
            seen = problem.log.measured["object_orientation"][first:end]
            turns = off("object_orientation", seen, here[first:end], world) - one.bias
            turn, spin = _parabola(problem.period, turns, time + one.delay - first * problem.period)
            found.q[-4:] = quaternion_product(quaternion_by(_DRAWN * turn), found.q[-4:])
            found.q[-4:] /= np.linalg.norm(found.q[-4:])
            rotation = world.object_rotation(found.q)
            found.v[-3:] = rotation.T @ spin
    if "object_position" in late:
        one = late["object_position"]
        if _around(problem.period, problem.log.measured["object_position"], time + one.delay) is not None:
            p, rate = _parabola(problem.period, problem.log.measured["object_position"], time + one.delay)
            found.q[-7:-4] += _DRAWN * (p - one.bias - found.q[-7:-4])
            found.v[-6:-3] = rotation.T @ rate
    return found


def _around(period: float, values: Array, time: float) -> tuple[int, int] | None:
    """First and end of the samples about a time since the first one [s]; None where too few were measured."""
    around = max(round(_AROUND / period), 2)
    middle = min(max(round(time / period), 0), len(values) - 1)
    first, end = max(0, middle - around), min(len(values), middle + around + 1)
    return (first, end) if np.isfinite(values[first:end]).all(axis=1).sum() >= 5 else None


def _parabola(period: float, values: Array, time: float) -> tuple[Array, Array]:
    """Value and slope at a time since the first sample [s]."""
    first, end = _around(period, values, time) or (0, len(values))
    there = np.isfinite(values[first:end]).all(axis=1)
    s = ((np.arange(first, end) * period - time) / _AROUND)[there]
    c = np.linalg.lstsq(np.stack([np.ones_like(s), s, s**2], axis=1), values[first:end][there], rcond=None)[0]
    return c[0], c[1] / _AROUND
