"""What a step hands on beside q, v and z, from the end of a piece to the begin of the next, which may be moved.

A run of `midpoint` goes on with the kick of the step before. A start afresh from q, v and z is off by a little of
second order in the step, which a push that jolts the object or a tip that slips makes large. So a piece begins with
what it lacks: how far w, the acceleration and the velocity of the drift lie beyond those of a start afresh there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.contact.friction import note_slip
from softhand.contact.layer import evaluate_contacts
from softhand.derivatives.period import begin, start
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.plant.resistance import evaluate_resistance
from softhand.steppers.midpoint import FIRST, HELD, STARTED
from softhand.steppers.midpoint_terms import acceleration_of


class Kick(NamedTuple):
    """The last kick of a step: what of it a start afresh from its end does not know."""

    w: Array
    """Velocity that is kicked, beyond that of a start afresh, shape (nv,)."""
    acceleration: Array
    """Likewise, shape (nv,)."""
    middle: Array
    """Velocity of the drift, beyond v at the end, shape (nv,)."""
    held: Array
    """Generalized force of torques and pushes in that step [N m, N], shape (nv,)."""
    matrix: Array
    """Factor of the matrix of the kick, shape (nv, nv)."""
    z: Array
    """Memory of the contacts at the end, with what no state of a piece has, shape (nc, n_memory)."""

    @property
    def is_finite(self) -> bool:
        """Whether the step came to its end."""
        return all(bool(np.all(np.isfinite(array))) for array in self)

    def copy(self) -> Kick:
        """An independent one."""
        return Kick(*(array.copy() for array in self))

    def assign(self, other: Kick) -> None:
        """Take over another one, in place."""
        for mine, given in zip(self, other, strict=True):
            mine[...] = given


def room_for_kick(nv: int, contacts: int, memory: int) -> Kick:
    """All zero."""
    w, acceleration, middle, held = np.zeros((4, nv))
    return Kick(w, acceleration, middle, held, np.zeros((nv, nv)), np.zeros((contacts, memory)))


@compiled
def leave(m, kick):
    """Keep the kick of the step that has ended: w and acceleration as they are.

    Args:
        m: `kernels.Mechanics`.
        kick: `Kick`, set.
    """
    kicks, v = m.kicks, m.state.v
    for k in range(v.shape[0]):
        kick.w[k], kick.acceleration[k], kick.held[k] = kicks.w[k], kicks.acceleration[k], kicks.held[k]
        kick.middle[k] = kicks.middle[k] - v[k]
    _copy(kicks.matrix, kick.matrix)
    _copy(m.state.z, kick.z)


@compiled
def compare(m, moves, kick):
    """Take from a kick that was left what a start afresh from the base of the moves has.

    Args:
        m: `kernels.Mechanics`.
        moves: `derivatives.period.Moves`, their base the state that was left.
        kick: `Kick`.
    """
    begin(m, moves, -1, 0.0)
    start(m, moves)
    _accelerate(m, kick.held)
    for k in range(kick.w.shape[0]):
        kick.w[k] -= m.kicks.w[k]
        kick.acceleration[k] -= m.kicks.acceleration[k]


@compiled
def go_on(m, kick):
    """Go on from a start afresh as the step did that has left a kick.

    Args:
        m: `kernels.Mechanics`, after `start`.
        kick: `Kick`, after `compare`.
    """
    kicks, state, touch = m.kicks, m.state, m.touch
    _accelerate(m, kick.held)
    for k in range(kick.w.shape[0]):
        kicks.w[k] += kick.w[k]
        kicks.acceleration[k] += kick.acceleration[k]
        kicks.held[k] = kick.held[k]
        kicks.middle[k] = state.v[k] + kick.middle[k]
    _copy(kick.matrix, kicks.matrix)
    kicks.flags[STARTED], kicks.flags[FIRST], kicks.flags[HELD] = 1, 0, 1
    evaluate_contacts(touch.pads, touch.columns, m.terms.poses, m.terms.J, kicks.middle, state.z, 0.0, touch.depths,
                      True, touch.contacts, touch.jacobian)  # fmt: skip
    note_slip(touch.pads, touch.contacts, state.z, 0.0)
    evaluate_resistance(touch.resistance, state.q, kicks.middle)


@compiled
def _copy(matrix, out):
    for i in range(matrix.shape[0]):
        for j in range(matrix.shape[1]):
            out[i, j] = matrix[i, j]


@compiled
def _accelerate(m, held):
    """The acceleration under a generalized force, at contacts and matrix of a start afresh."""
    n = m.torque.shape[0]
    for k in range(held.shape[0]):
        m.external[k] = 0.0 if k < n else held[k]
    for k in range(n):
        m.torque[k] = held[k]
    acceleration_of(m.touch, m.terms.nle, m.envelope, m.torque, m.external, m.kicks.pull, m.kicks.matrix,
                    m.kicks.acceleration)  # fmt: skip
    for k in range(held.shape[0]):
        m.external[k] = 0.0
