"""A controller about a state as a linear system: its torque and its memory, differenced through the observation."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.probe import Probe
from softhand.closed_loop.linearize import slope
from softhand.controllers.controller import Controller
from softhand.numerics.arrays import Array
from softhand.plant.state import State
from softhand.sensing.observation import Observation

_STEP = 1e-6
_NEGLIGIBLE = 1e-9  # of what the torque does with the state


@dataclass(frozen=True, eq=False)
class Feedback:
    """u = by_state x + by_memory m and, a sample later, m = memory_by_state x + memory_by_memory m.

    x is that of `LinearModel`, m are the numbers in the memory of the controller that change with x, directly or
    through others, less their values at the state.

    Attributes:
        torque: at the state [N m], shape (n,).
        by_state: shape (n, s).
        by_memory: shape (n, m).
        memory_by_state: shape (m, s).
        memory_by_memory: shape (m, m).
    """

    torque: Array
    by_state: Array
    by_memory: Array
    memory_by_state: Array
    memory_by_memory: Array

    @property
    def is_smooth(self) -> bool:
        """Whether the torque follows from the state alone, so that the law can be thought of without sampling."""
        return float(np.max(np.abs(self.by_memory), initial=0.0)) <= _NEGLIGIBLE * float(np.max(np.abs(self.by_state)))


def differentiate(controller: Controller, probe: Probe, state: State, period: float) -> Feedback:
    """A controller linear about a state.

    It has started there, has had its first sample, and is asked again a period later, at the state and beside it.

    Args:
        controller: a function of the observation and its memory.
        probe: of the plant, with what the controller is asked for.
        state: about which.
        period: between two samples [s].
    """
    first = probe.at(state, 0.0)
    _, memory = controller.torque(first, controller.start(first))

    def respond(beside: State) -> Array:
        return _joined(*controller.torque(probe.at(beside, period), memory))

    by_state, base = slope(probe.plant, state, respond), respond(state)
    observation, held = probe.at(state, period), np.concatenate([[], *numbers_of(memory)])

    def respond_to(values: Array) -> Array:
        return _joined(*controller.torque(observation, rebuilt(memory, iter(values))))

    def column(k: int) -> Array:
        move = np.where(np.arange(len(held)) == k, _STEP, 0.0)
        slope: Array = (respond_to(held + move) - respond_to(held - move)) / (2.0 * _STEP)
        return slope

    n = probe.plant.world.n_joints
    chosen, by_memory = follow(by_state, n, column)
    return Feedback(base[:n], by_state[:n], by_memory[:n], by_state[n:][chosen], by_memory[n:][chosen])


def follow(by_state: Array, n: int, column: Callable[[int], Array]) -> tuple[NDArray[np.int64], Array]:
    """Which numbers of a memory change with x, directly or through others, and what they do.

    Args:
        by_state: torque and memory by x, shape (n + m, s).
        n: torques in it.
        column: torque and memory by one number of the memory, shape (n + m,).

    Returns:
        Places of these numbers in the memory, and torque and memory by each of them, a column a number.
    """
    columns: dict[int, Array] = {}
    alive: NDArray[np.bool_] = np.any(by_state[n:] != 0.0, axis=1)
    while waiting := [k for k in np.flatnonzero(alive).tolist() if k not in columns]:
        for k in waiting:
            columns[k] = column(k)
            alive |= columns[k][n:] != 0.0
    chosen = np.flatnonzero(alive)
    return chosen, np.column_stack([np.zeros((len(by_state), 0)), *(columns[k] for k in chosen.tolist())])


def _joined(torque: Array, memory: Any) -> Array:
    return np.concatenate([torque, *numbers_of(memory)])


def numbers_of(memory: Any) -> Iterator[Array]:
    """The numbers in a memory, a row for each of its arrays."""
    if isinstance(memory, Observation):
        memory = memory.block
    if isinstance(memory, np.ndarray):
        if memory.dtype == float:
            yield memory.ravel()
    elif isinstance(memory, float):
        yield np.array([memory])
    else:
        for part in _parts(memory).values():
            yield from numbers_of(part)


def rebuilt(memory: Any, values: Iterator[float]) -> Any:
    """A memory with other numbers, in the order of `numbers_of`."""
    if isinstance(memory, Observation):
        return Observation(memory.known, rebuilt(memory.block, values), memory.time)
    if isinstance(memory, np.ndarray):
        if memory.dtype != float:
            return memory
        return np.array([next(values) for _ in range(memory.size)]).reshape(memory.shape)
    if isinstance(memory, float):
        return float(next(values))
    parts = {key: rebuilt(part, values) for key, part in _parts(memory).items()}
    if not parts:
        return memory
    if is_dataclass(memory):
        return replace(memory, **parts)  # type: ignore[type-var]
    if isinstance(memory, dict):
        return parts
    return type(memory)(*parts.values()) if hasattr(memory, "_fields") else type(memory)(parts.values())


def _parts(memory: Any) -> dict[Any, Any]:
    """What a memory is made of, by name or place; nothing for what is kept as it is."""
    if isinstance(memory, dict):
        return memory
    if isinstance(memory, tuple | list):
        return dict(enumerate(memory))
    if is_dataclass(memory) and not isinstance(memory, type):
        return {field.name: getattr(memory, field.name) for field in fields(memory) if field.init}
    return {}
