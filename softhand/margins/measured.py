"""What a controller answers to errors of the instruments, and what they measure along each way a plant can move."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.assembly.probe import Probe
from softhand.closed_loop.feedback import numbers_of
from softhand.derivatives.differences import slopes
from softhand.derivatives.model import less_shear, remembered_in
from softhand.derivatives.observer import moved_state, sides_of
from softhand.derivatives.situation import Situation
from softhand.derivatives.states import state_entries
from softhand.numerics.arrays import Array
from softhand.plant.state import State
from softhand.sensing.quantities import NORMAL, PLAIN, QUANTITIES, ROTATION, Channel, Sensing

_STEP = 1e-6  # of an error of any component, in SI units


def answers_to(situation: Situation, names: list[str], kept: list[int]) -> dict[str, Array]:
    """Command and memory by an error of each component, of some quantities that have instruments.

    Args:
        situation: in which the controller is asked.
        names: of the quantities.
        kept: places of the numbers of its memory that count.

    Returns:
        By quantity, shape (n + m, components).
    """
    sensing = situation.setup.sensing
    if not names or sensing is None:
        return {}
    state, controller = situation.state, situation.setup.controller
    biases = {name: one.bias for name, one in sensing.channels.items()}
    probe = Probe(situation.plant, situation.probe.reference, sensing)

    def answer(name: str, error: Array) -> Array:
        seen = {**biases, name: _added(QUANTITIES[name].kind, biases[name], error)}
        probe.become(Sensing({key: Channel(0.0 * bias, bias) for key, bias in seen.items()}))
        torque, memory = controller.torque(probe.seen(state, state.time), situation.memory)
        numbers = np.concatenate([[], *numbers_of(memory)])
        return np.concatenate([np.asarray(torque, dtype=float), numbers[kept]])

    found = {}
    for name in names:
        steps = _STEP * np.eye(len(biases[name]))
        columns = [(answer(name, one) - answer(name, -one)) / (2.0 * _STEP) for one in steps]
        found[name] = np.column_stack(columns)
    return found


def measured_along(situation: Situation, names: list[str]) -> dict[str, Array]:
    """What instruments measure by x of `linearize`, each component as its error is told.

    Args:
        situation: beside which.
        names: of the quantities, which have instruments.

    Returns:
        By quantity, shape (components, s).
    """
    sensing = situation.setup.sensing
    if not names or sensing is None:
        return {}
    plant, probe, state = situation.plant, situation.probe, situation.state
    remembered = remembered_in(plant)
    probe.seen(state, state.time)
    here = {name: getattr(probe.measured, name).copy() for name in names}

    def at(index: NDArray[np.int64], amount: Array, shares: Array) -> tuple[Array, NDArray[np.int64]]:
        rows, sides = [], []
        for j, h, share in zip(index.tolist(), amount.tolist(), shares.tolist(), strict=True):
            base = State(state.q, state.v, less_shear(probe.plant, state.z, share), state.time) if share else state
            probe.seen(moved_state(probe, base, remembered, j, h), state.time)
            rows.append(np.concatenate([_beyond(name, here[name], getattr(probe.measured, name)) for name in names]))
            sides.append(sides_of(probe))
        return np.array(rows), np.array(sides, dtype=np.int64)

    entries = state_entries(plant, situation.slides, remembered, situation.period)
    columns = slopes(at, entries.steps).columns
    sizes = [len(sensing.channels[name].bias) for name in names]
    parts = np.split(columns, np.cumsum(sizes)[:-1])
    return {name: _as_seen(name, sensing.channels[name].bias, part) for name, part in zip(names, parts, strict=True)}


def _added(kind: int, bias: Array, error: Array) -> Array:
    """The bias that has the effect of a bias and an error after it."""
    if kind == PLAIN:
        return bias + error
    return np.concatenate([
        pin.log3(pin.exp3(one) @ pin.exp3(vector))
        for vector, one in zip(bias.reshape(-1, 3), error.reshape(-1, 3), strict=True)
    ])  # fmt: skip


def _as_seen(name: str, bias: Array, rows: Array) -> Array:
    """Turns of what is true as turns of what is seen, which a bias has turned."""
    if QUANTITIES[name].kind == PLAIN:
        return rows
    turned = [pin.exp3(one) @ rows[3 * k : 3 * k + 3] for k, one in enumerate(bias.reshape(-1, 3))]
    return np.concatenate(turned)


def _beyond(name: str, base: Array, value: Array) -> Array:
    """From one value to another close to it, as an error, shape (components,)."""
    kind = QUANTITIES[name].kind
    if kind == ROTATION:
        turn = value @ base.T
        return 0.5 * np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    if kind == NORMAL:
        return np.cross(base, value).ravel()
    away = (value - base).ravel()
    if name == "joint_position":  # of a joint without end
        away -= 2.0 * np.pi * np.rint(away / (2.0 * np.pi))
    return away
