"""A piece of a run computed anew under the torques that were logged, in one compiled call for many starts of it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.calibration.handing_on import Kick, compare, go_on, leave, room_for_kick
from softhand.contact.answer import normal_force
from softhand.contact.limit import limit_use
from softhand.contact.scaled import material_force
from softhand.derivatives.model import PeriodModel
from softhand.derivatives.period import begin, start
from softhand.model.rigid import rigid_poses
from softhand.numerics.addressed import addressed
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.simulation.pushes import Push, add_pushes
from softhand.steppers.kernels import MIDPOINT, advance
from softhand.steppers.midpoint import Midpoint

TIP = 5
"""Numbers of a tip in a sample: force on the object in axes of F, torsion, compression."""


class Piece(NamedTuple):
    """What drives a piece of a run, and what is seen of it."""

    torques: Array
    """Held in each control period [N m, N], shape (most periods, n)."""
    periods: NDArray[np.int64]
    """How many there are, after how many the kick is left, and whether it goes on with one, shape (3,)."""
    has_pushes: bool
    """Whether something pushes from outside."""
    tips: int
    """Fingertips."""
    seen: Array
    """q, v, `TIP` numbers of each tip, and the numbers of z that belong to x, at the begin and after each period, shape
    (moves, 1 + most periods, numbers)."""
    kick: Kick
    """It goes on with."""
    left: Kick
    """Left by the first of the moves where the next piece begins."""
    use: Array
    """Coefficient of friction that the tips which may slip have needed most in the first of the moves, shape (1,)."""


@compiled
def run_pieces(mechanics, moves, piece, count):
    """The piece from the first `count` of the moved starts, with the kick of the piece before or afresh.

    Args:
        mechanics: `kernels.Mechanics`.
        moves: `derivatives.period.Moves`, its torque unused.
        piece: `Piece`.
        count: shape (1,).
    """
    m = mechanics
    piece.use[0] = 0.0
    for i in range(count[0]):
        begin(m, moves, moves.entry[i], moves.amount[i])
        start(m, moves)
        if piece.periods[2]:
            go_on(m, piece.kick)
        look(m, moves, piece.tips, piece.seen[i, 0])
        for k in range(piece.periods[0]):
            for j in range(m.torque.shape[0]):
                m.torque[j] = piece.torques[k, j]
            for s in range(moves.steps):
                if piece.has_pushes:
                    rigid_poses(m.tree, m.state.q, m.terms)
                    for j in range(m.external.shape[0]):
                        m.external[j] = 0.0
                    time = moves.time[0] + (k * moves.steps + s) * moves.step
                    add_pushes(moves.pushes, time, m.terms.poses, m.terms.J, m.external)
                advance(MIDPOINT, m, moves.step)
            look(m, moves, piece.tips, piece.seen[i, k + 1])
            if i == 0:
                if k + 1 == piece.periods[1]:
                    leave(m, piece.left)
                for tip in range(piece.tips):
                    contact = m.touch.contacts[tip]
                    if m.touch.pads[tip].can_slip and contact.force[2] > 0.0:
                        pad = m.touch.pads[tip]
                        needed = limit_use(contact, material_force(contact), normal_force(pad, contact))
                        piece.use[0] = max(piece.use[0], needed)


@compiled
def look(m, moves, tips, row):
    """A sample of the state that a step has left, its contacts evaluated."""
    nq, nv, state = m.state.q.shape[0], m.state.v.shape[0], m.state
    for k in range(nq):
        row[k] = state.q[k]
    for k in range(nv):
        row[nq + k] = state.v[k]
    for i in range(tips):
        pad, contact, place = m.touch.pads[i], m.touch.contacts[i], nq + nv + 5 * i
        pose, f = m.terms.poses[pad.joint], contact.force
        for k in range(3):
            along = 0.0
            for r in range(3):
                axis = (
                    pose[r] * pad.rotation[0, k] + pose[3 + r] * pad.rotation[1, k] + pose[6 + r] * pad.rotation[2, k]
                )
                C = contact.rotation
                along += axis * (C[r, 0] * f[0] + C[r, 1] * f[1] + C[r, 2] * f[2])
            row[place + k] = along
        row[place + 3], row[place + 4] = f[3], contact.deformation[0]
    for k in range(moves.remembered.shape[0]):
        row[nq + nv + 5 * tips + k] = state.z[moves.remembered[k, 0], moves.remembered[k, 1]]


class Replay:
    """One plant that goes through pieces of a run.

    Attributes:
        model: of one control period, whose starts can be moved: entries of (q, v, z) in tangent coordinates.

    Args:
        plant: with compiled terms.
        stepper: of the scenario.
        steps: in a control period.
        pushes: of the scenario.
        periods: of the longest piece.
    """

    def __init__(self, plant: Plant, stepper: Midpoint, steps: int, pushes: Sequence[Push], periods: int) -> None:
        world, tips = plant.world, plant.world.n_tips
        neutral = State(np.zeros(world.nq), np.zeros(world.nv), np.zeros((len(plant.contacts), plant.n_memory)))
        self.model = PeriodModel(plant, (stepper, MIDPOINT), steps, neutral, np.zeros(world.n_joints), pushes, True)
        model = self.model
        most, width = model.n_states + 1, world.nq + world.nv + TIP * tips + len(model.remembered)
        kick, left = (room_for_kick(world.nv, *neutral.z.shape) for _ in range(2))
        self._piece = Piece(
            np.zeros((periods, world.n_joints)), np.zeros(3, np.int64), bool(pushes), tips,
            np.zeros((most, 1 + periods, width)), kick, left, np.zeros(1),
        )  # fmt: skip
        self._compare = addressed(compare, model.mechanics, model.moves, left, layouts=model.layouts)
        self._run = addressed(run_pieces, model.mechanics, model.moves, self._piece, model.count, layouts=model.layouts)

    def samples(
        self,
        state: State,
        torques: Array,
        entries: NDArray[np.int64],
        amounts: Array,
        kick: Kick | None = None,
        leave_after: int = 0,
    ) -> Array:
        """What is seen of a piece from some starts.

        Args:
            state: where it begins unmoved, at its time.
            torques: held [N m, N], shape (periods, n).
            entries: of (q, v, z) that are moved, a start each, -1 for none, shape (k,).
            amounts: by how much, shape (k,).
            kick: that it goes on with; afresh if not given.
            leave_after: how many periods the kick is left for `left`; never if 0.

        Returns:
            q, v and numbers of the tips, live until the next call, shape (k, 1 + periods, numbers).
        """
        piece, model, count = self._piece, self.model, len(entries)
        model.put(state, torques[0])
        piece.torques[: len(torques)], piece.periods[:] = torques, (len(torques), leave_after, kick is not None)
        if kick is not None:
            piece.kick.assign(kick)
            rows, columns = model.remembered.T
            model.moves.base.z[:] = kick.z
            model.moves.base.z[rows, columns] = state.z[rows, columns]
        model.moves.entry[:count], model.moves.amount[:count], model.count[0] = entries, amounts, count
        self._run()
        return piece.seen[:count, : 1 + len(torques)]

    @property
    def use(self) -> float:
        """Coefficient of friction that was needed in the first move of the last call."""
        return float(self._piece.use[0])

    def left(self, state: State) -> Kick:
        """The kick that the first move of the last call has left, for a piece that begins beside its end.

        Args:
            state: where it was left.
        """
        model, left = self.model, self._piece.left
        model.put(state, model.moves.torque)
        model.moves.base.z[:] = left.z
        self._compare()
        return left.copy()

    def state(self, row: Array, time: float) -> State:
        """The state of a sample, one row of `samples`."""
        world, model = self.model.plant.world, self.model
        nq, nv = world.nq, world.nv
        z = np.zeros_like(model.mechanics.state.z)
        rows, columns = model.remembered.T
        z[rows, columns] = row[len(row) - len(rows) :]
        return State(row[:nq].copy(), row[nq : nq + nv].copy(), z, time)
