"""Where the pieces of a log begin, as far as measured numbers tell before anything is fitted.

Joints and object are where a parabola through the samples around says. What tips store follows from how tips and object
have moved since the piece before, which a run of that piece tells whatever its forces are.
"""

from __future__ import annotations

import numpy as np

from softhand.calibration.instruments import instruments_of, off, quaternion_product
from softhand.calibration.problem import Problem
from softhand.numerics.arrays import Array
from softhand.plant.state import State

_AROUND = 0.012  # [s] to each side


def first_states(problem: Problem, start: State, x: Array) -> list[State]:
    """States at the begin of each piece.

    Args:
        problem: at the parameters x.
        start: of the scenario: what the tips store where the log begins, and where the object is if nobody measured.
        x: of the parameters.
    """
    states: list[State] = []
    state = start
    for k in range(len(problem.pieces)):
        state = _measured(problem, state, k, x)
        states.append(state)
        run = problem.runs(states, [k])[0]
        state = run.end if _is_number(run.end) else State(state.q, state.v, state.z)
    return states


def _is_number(state: State) -> bool:
    return all(bool(np.all(np.isfinite(array))) for array in state.arrays)


def _measured(problem: Problem, state: State, k: int, x: Array) -> State:
    """A state with all that was measured put into it."""
    world, log = problem.world, problem.log
    found = State(state.q.copy(), state.v.copy(), state.z.copy(), problem.time(k))
    instruments = instruments_of(problem.setup.scenario, world, problem.names, problem.parameters, problem.values(x))
    time = problem.time(k) - float(log.time[0])
    q, rate = _parabola(problem, "joint_position", time + instruments["joint_position"].delay)
    if q is not None:
        world.set_joint_position(q - instruments["joint_position"].bias, found.q)
        found.v[[j for _, _, j in world.joints[: world.n_joints]]] = rate
    rotation = world.object_rotation(found.q)
    if "object_orientation" in problem.names:
        turned = _turn(problem, time + instruments["object_orientation"].delay)
        if turned is not None:
            quaternion, spin = turned
            found.q[-4:] = quaternion / np.linalg.norm(quaternion)
            rotation = world.object_rotation(found.q)
            found.v[-3:] = rotation.T @ spin
    if "object_position" in problem.names:
        p, rate = _parabola(problem, "object_position", time + instruments["object_position"].delay)
        if p is not None:
            found.q[-7:-4] = p - instruments["object_position"].bias
            found.v[-6:-3] = rotation.T @ rate
    return found


def _around(problem: Problem, name: str, time: float) -> tuple[Array, Array]:
    """Times since then [s] and values of the samples around a time."""
    values = problem.log.measured[name]
    there = np.flatnonzero(np.isfinite(values).all(axis=1))
    at = there * problem.period - time
    near = np.abs(at) <= _AROUND + 1e-12
    if near.sum() < 5:
        near = np.zeros(len(at), bool)
        near[np.argsort(np.abs(at))[:5]] = True
    return at[near], values[there[near]]


def _parabola(problem: Problem, name: str, time: float) -> tuple[Array | None, Array]:
    at, values = _around(problem, name, time)
    if len(at) < 3:
        return None, np.zeros(0)
    return _fitted(at, values)


def _fitted(at: Array, values: Array) -> tuple[Array, Array]:
    """Value and slope at 0."""
    scale = np.max(np.abs(at)) or 1.0
    s = at / scale
    c = np.linalg.lstsq(np.stack([np.ones_like(s), s, s**2], axis=1), values, rcond=None)[0]
    return c[0], c[1] / scale


def _turn(problem: Problem, time: float) -> tuple[Array, Array] | None:
    """Quaternion and angular velocity, world axes."""
    at, values = _around(problem, "object_orientation", time)
    if len(at) < 3:
        return None
    middle = values[np.argmin(np.abs(at))]
    turns = off("object_orientation", values, np.broadcast_to(middle, values.shape), problem.world)
    turn, spin = _fitted(at, turns)
    angle = float(np.linalg.norm(turn))
    quaternion = np.append(0.5 * np.sinc(0.5 * angle / np.pi) * turn, np.cos(0.5 * angle))
    return quaternion_product(quaternion, middle), spin
