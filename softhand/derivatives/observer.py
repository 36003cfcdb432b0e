"""What a recording keeps of a state, and what a controller answers there, beside one state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.probe import Probe
from softhand.closed_loop.feedback import numbers_of, rebuilt
from softhand.controllers.controller import Controller
from softhand.derivatives.model import less_shear
from softhand.derivatives.period import FEATURE, SLIPS, TOUCHES
from softhand.model.configuration import integrate
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.recording.variables import COMPONENTS, VARIABLES
from softhand.sensing.fields import Sizes
from softhand.sensing.observation import Observation
from softhand.simulation.keep import Keep
from softhand.simulation.samples import labels_of


class Observer:
    """Outputs y, torque and memory of the controller as functions of x, of u and of the memory.

    Attributes:
        held: the numbers in the memory.
        effort_limit: of the joints [N m, N], shape (n,).

    Args:
        probe: of the plant.
        keep: which variables y is made of.
        controller: asked as well; None if it is not.
        memory: of the controller before it speaks.
        state: unmoved.
        torque: applied there, as far as it is among the outputs.
        remembered: row and column of the numbers of z that belong to x.
    """

    def __init__(
        self,
        probe: Probe,
        keep: Keep,
        controller: Controller | None,
        memory: Any,
        state: State,
        torque: Array,
        remembered: NDArray[np.int64],
    ) -> None:
        self._probe, self._keep, self._controller, self._memory = probe, keep, controller, memory
        self._state, self._torque, self._remembered = state, torque, remembered
        self.held: Array = np.concatenate([[], *numbers_of(memory)]) if controller else np.zeros(0)
        observation = probe.at(state, state.time)
        self.effort_limit, self._sizes = observation.effort_limit.copy(), observation.known.sizes
        self._segments = keep.segments(self._sizes)
        self._unmoved = self._row(observation), sides_of(probe)

    def at(
        self, index: NDArray[np.int64], amount: Array, shares: Array | None = None
    ) -> tuple[Array, NDArray[np.int64]]:
        """Outputs, torque and memory with one entry of (q, v, z, memory) moved, and sides, as a `Function`."""
        rows, answers, sides = [], [], []
        shares = np.zeros(len(index)) if shares is None else shares
        s = 2 * len(self._state.v) + len(self._remembered)
        for j, h, share in zip(index.tolist(), amount.tolist(), shares.tolist(), strict=True):
            state = self._state
            if share:
                state = State(state.q, state.v, less_shear(self._probe.plant, state.z, share), state.time)
            moved = moved_state(self._probe, state, self._remembered, j, h)
            row, side = self._unmoved
            if moved is not self._state:
                row, side = self._row(self._probe.at(moved, state.time)), sides_of(self._probe)
            rows.append(row)
            sides.append(side)
            memory = self._memory
            if j >= s:
                values = self.held.copy()
                values[j - s] += h
                memory = rebuilt(memory, iter(values))
            answers.append(self._answer(moved, memory))
        y = outputs_of(self._keep, np.array(rows), self._sizes, self._probe.plant)
        return np.hstack([y, np.array(answers)]), np.array(sides, dtype=np.int64)

    def _row(self, observation: Observation) -> Array:
        """As the compiled loop has it: time, what is observed, torque, whether it was cut, push."""
        parts = [observation.block[begin : begin + size] for begin, size in self._segments]
        push = np.zeros(len(self._state.v))
        return np.concatenate([[observation.time], *parts, self._torque, np.zeros_like(self._torque), push])

    def _answer(self, state: State, memory: Any) -> Array:
        if self._controller is None:
            return np.zeros(0)
        torque, after = self._controller.torque(self._probe.seen(state, self._state.time), memory)
        return np.concatenate([np.asarray(torque, dtype=float), *numbers_of(after)])


def outputs_of(keep: Keep, rows: Array, sizes: Sizes, plant: Plant) -> Array:
    """The variables that are kept, one behind the other, from rows of the compiled loop, shape (rows, y)."""
    found = keep.variables_of(rows, sizes, plant)
    parts = [np.asarray(found[name], dtype=float).reshape(len(rows), -1) for name in keep.variables]
    return np.hstack([np.zeros((len(rows), 0)), *parts])


def output_names(probe: Probe, names: Sequence[str], slides: frozenset[str]) -> list[tuple[str, str, str]]:
    """Variable, label and unit of each entry of y."""
    labels, found = labels_of(probe.plant, is_pushed=True), []
    for name in names:
        dims = VARIABLES[name].dims[1:]
        along = [COMPONENTS[dim] if dim in COMPONENTS else labels.get(dim, ()) for dim in dims]
        hinge, is_mixed, slide = VARIABLES[name].units.partition(" or ")
        units = hinge.split(", ")
        for place in np.ndindex(*map(len, along)):
            words = [one[k] for one, k in zip(along, place, strict=True)]
            unit = units[place[-1]] if len(units) > 1 else units[0]
            if is_mixed and words[-1] in slides:
                unit = slide
            found.append((name, " ".join([name, *words]), unit))
    return found


def moved_state(probe: Probe, state: State, remembered: NDArray[np.int64], index: int, amount: float) -> State:
    """With one entry of (q, v, z) moved."""
    nv = len(state.v)
    if index < 0 or index >= 2 * nv + len(remembered):
        return state
    q, v, z = state.q.copy(), state.v.copy(), state.z.copy()
    if index < nv:
        along = np.zeros(nv)
        along[index] = amount
        integrate(probe.plant.joints, state.q, along, 1.0, q)
    elif index < 2 * nv:
        v[index - nv] += amount
    else:
        z[tuple(remembered[index - 2 * nv])] += amount
    return State(q, v, z)


def sides_of(probe: Probe) -> NDArray[np.int64]:
    """As `period` has them; a contact beyond the limit of friction slips at once."""
    contacts, pads = probe.plant.contacts, probe.plant.pads
    touches = np.where(pads["is_support"] > 0, contacts["is_idle"] == 0, contacts["deformation"][:, 0] > 0.0)
    slips = np.any(contacts["slip"] != 0.0, axis=1) | np.any(contacts["slip_rate"] != 0.0, axis=1)
    sides: NDArray[np.int64] = touches * (
        TOUCHES + SLIPS * (slips & (pads["can_slip"] > 0)) + FEATURE * contacts["feature"]
    )
    return sides
