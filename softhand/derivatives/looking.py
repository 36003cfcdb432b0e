"""What is observed at states beside one another, in one compiled call: the sensor that exists, without Python."""

from __future__ import annotations

from math import prod

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.probe import Probe
from softhand.assembly.unmodelled import must_not_feel
from softhand.batch.loop import Senses
from softhand.derivatives.following import has_obstacles
from softhand.derivatives.look_tangent import LookTangent
from softhand.derivatives.model import ROOM, PeriodModel
from softhand.derivatives.observer import outputs_of
from softhand.derivatives.period import FEATURE, SLIPS, TOUCHES, begin
from softhand.derivatives.tangent import NoTangentError
from softhand.model.rigid import rigid_poses
from softhand.numerics.addressed import addressed
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.sensing.fields import Sizes, beginnings, shapes
from softhand.sensing.groups import parts_of
from softhand.sensing.sensor import Sensor, Wanted, observe
from softhand.simulation.keep import Keep


class Looks:
    """Outputs y as functions of x, beside the state of a `PeriodModel`.

    Args:
        model: whose plant is observed.
        probe: has what is asked for, at the time of the state.
        keep: which variables y is made of.

    Raises:
        ScenarioError: they are those of taxels.
    """

    def __init__(self, model: PeriodModel, probe: Probe, keep: Keep) -> None:
        must_not_feel("A derivative", "outputs", keep.variables)
        self._model, self._keep = model, keep
        sensor = Sensor(model.plant, probe.reference.desired)
        self._sizes = sensor.observation.known.sizes
        segments = keep.segments(self._sizes)
        self._rows = np.zeros((ROOM, keep.width(self._sizes, len(model.moves.along))))
        self._sides = np.zeros((ROOM, len(model.plant.contacts)), np.int64)
        senses, parts = Senses(sensor.body, Wanted.of(probe.reference.desired), sensor.groups), parts_of(keep.fields)
        self._run = addressed(
            run_looks, model.mechanics, model.moves, model.count, senses, parts, segments, sensor.block,
            self._rows, self._sides, layouts=model.layouts,
        )  # fmt: skip
        self._kept = _kept(keep, self._sizes)
        self._of = np.flatnonzero(self._kept >= 0)
        is_plain = "deformation" not in keep.variables or not model.plant.pads["is_surface"].any()
        self._follows = is_plain and model.plant.world.coupling is None and not has_obstacles(model.plant)
        self._wanted = senses, parts, sensor.block, self._kept[self._of]
        self._tangent: LookTangent | None = None

    def at(
        self, index: NDArray[np.int64], amount: Array, shares: Array | None = None
    ) -> tuple[Array, NDArray[np.int64]]:
        """y with one entry of x moved, and sides, as a `differences.Function`."""
        rows, sides = self._model.rows(self._run, self._rows, self._sides, index, amount, shares)
        return outputs_of(self._keep, rows, self._sizes, self._model.plant), sides

    def derivatives(self, n_states: int) -> tuple[Array, Array] | None:
        """y, and its derivatives by x of the sums themselves; None where these cannot be followed."""
        if not self._follows:
            return None
        value, _ = self.at(np.array([-1]), np.zeros(1))
        try:
            self._tangent = self._tangent or LookTangent(self._model, *self._wanted)
        except NoTangentError:
            self._follows = False
            return None
        if not self._tangent.find():
            return None
        C = np.zeros((len(self._kept), n_states))
        C[self._of] = self._tangent.columns
        return value[0], C


def _kept(keep: Keep, sizes: Sizes) -> NDArray[np.int64]:
    """Where each number of y lies in the block of an observation; -1 for what does not depend on x in between."""
    begins, every, n = beginnings(sizes), shapes(sizes), sizes.n
    found = []
    for name in keep.variables:
        is_field = name in keep.fields
        size = prod(every[name]) if is_field else n
        found.append(begins[name] + np.arange(size) if is_field else np.full(size, -1))
    return np.concatenate([np.zeros(0, np.int64), *found]).astype(np.int64)


@compiled
def run_looks(mechanics, moves, count, senses, parts, segments, block, rows, sides):
    """What is kept of an observation at the begin of each of the first `count` moves.

    Args:
        mechanics: `kernels.Mechanics`.
        moves: `Moves`.
        count: shape (1,).
        senses: `loop.Senses`.
        parts: of an observation that are needed, see `groups.parts_of`.
        segments: see `Keep.segments`.
        block: of the observation.
        rows: set, as those of the compiled loop.
        sides: set, as `Moves.sides` at the begin; a contact beyond the limit of friction slips at once.
    """
    m = mechanics
    for i in range(count[0]):
        begin(m, moves, moves.entry[i], moves.amount[i])
        rigid_poses(m.tree, m.state.q, m.terms)
        observe(senses.body, m.touch, m.terms, senses.wanted, m.state, m.at, senses.groups, parts, False)
        end = 1
        for s in range(segments.shape[0]):
            for k in range(segments[s, 1]):
                rows[i, end + k] = block[segments[s, 0] + k]
            end += segments[s, 1]
        for k in range(m.torque.shape[0]):
            rows[i, end + k] = m.torque[k]
        _note_slips(m, sides[i])


@compiled
def _note_slips(m, sides):
    for i in range(sides.shape[0]):
        pad, contact = m.touch.pads[i], m.touch.contacts[i]
        touches = contact.is_idle == 0 if pad.is_support else contact.deformation[0] > 0.0
        slips = False
        for k in range(contact.slip.shape[0]):
            slips |= contact.slip[k] != 0.0
        for k in range(contact.slip_rate.shape[0]):
            slips |= contact.slip_rate[k] != 0.0
        sides[i] = 0
        if touches:
            sides[i] = TOUCHES + FEATURE * contact.feature + (SLIPS if slips and pad.can_slip > 0 else 0)
