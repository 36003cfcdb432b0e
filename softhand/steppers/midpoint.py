"""The linearised implicit midpoint rule: one evaluation a step, second order, stable for stiff tips."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.contact.damping import relax, relax_contact
from softhand.contact.friction import note_slip, note_slip_of
from softhand.contact.kinematics import integrate_memory
from softhand.contact.layer import evaluate_contact, evaluate_contacts
from softhand.model.configuration import integrate
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.branches import seldom, spared, usually
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import factor, solve
from softhand.numerics.prepared import prepared
from softhand.plant.dynamics import add_contact_force, add_contact_moment, copy_mass
from softhand.plant.plant import Plant
from softhand.plant.resistance import add_slopes, evaluate_resistance, hold
from softhand.plant.state import State, is_at, set_at
from softhand.steppers.midpoint_terms import (
    acceleration_of,
    add_stiffness,
    factor_matrix,
    lag_of,
    pull_of,
    undamped_ahead,
)
from softhand.steppers.stepper import Integration, Stepper


class Midpoint(Stepper):
    """Linearised implicit midpoint, as kick, drift, kick.

        kick    w = w + (h/2) a,   J = [J_CF, -J_O]
                (M + (h/2) J^T D J + (h^2/4) J^T K J) a = (tau, 0) - (C v + N) - J^T {C_F + (h^2/4) K J' w}
        drift   q and z moved by w for h, the contact frames of z averaged over both ends
        kick    as before, at the new q and z, with the same torque
        v       w before the second kick + (h/6) (a of the first kick + 2 a of the second)

    with K = J_delta^-T (d dF / d delta) J_delta^-1, its symmetric part, and D = d C_F / d velocity of the damping;
    J a + J' w is the acceleration of the contact.
    Damping d and stops k of joints are in D and K as well. Dry friction is the r in each kick with which every joint is
    at rest after it or braked by its largest torque: what it holds has no velocity at all, and does not creep.
    The two kicks at one instant share one evaluation, which the controller sees as well. For a linear system q is that
    of the implicit midpoint rule (Newmark's method with beta = 1/4): no numerical damping, and no step is too long. v
    is that of an acceleration which grows evenly within the step. Use `adaptive` where the error must be known, and
    `rk4` where the torques change fast and the tips are soft.

    From one step into the next it takes w, the second kick with the torque that was held in it, and the evaluation;
    a `State` that a simulation saves has them with it.
    """

    holds_friction = True

    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant."""
        return _MidpointIntegration(plant, self.step)


STARTED, FIRST, HELD = range(3)
"""Flags of `Kicks`: whether w is known; whether the step is the first from its state, so that v lies above w; whether
`acceleration` is that of `held`."""


class Kicks(NamedTuple):
    """What a step works with. Those that the next step needs are in `_CARRIED`."""

    w: Array
    """Velocity that is kicked, shape (nv,)."""
    middle: Array
    """w between the kicks: the velocity of the drift, shape (nv,)."""
    ahead: Array
    """w expected after the second kick, where C v is taken, shape (nv,)."""
    above: Array
    """What v lies above w at the begin of a first step, shape (nv,)."""
    acceleration: Array
    """a of the last kick, shape (nv,)."""
    held: Array
    """Generalized force of torques and pushes in that kick [N m, N], shape (nv,)."""
    pull: Array
    """(h^2/4) K J' w of each contact, in C_F, shape (nc, 4)."""
    rate: Array
    """Rate of each deformation before the drift, shape (nc, 4)."""
    matrix: Array
    """Factor of M + (h/2) J^T D J + (h^2/4) J^T K J, shape (nv, nv)."""
    flags: AnyArray
    """See `STARTED`, shape (3,)."""


def room_for_kicks(plant: Plant) -> Kicks:
    """All zero, which is how a step starts from its state alone."""
    nv, nc = plant.world.nv, len(plant.contacts)
    w, middle, ahead, above, acceleration, held = np.zeros((6, nv))
    pull, rate = np.zeros((2, nc, 4))
    flags = np.zeros(3, np.int64)
    return Kicks(w, middle, ahead, above, acceleration, held, pull, rate, np.zeros((nv, nv)), flags)


_CARRIED = ("w", "above", "acceleration", "held", "pull", "matrix", "flags")


class _MidpointIntegration(Integration):
    """Each step ends with the plant evaluated at the new state, so that the sensor need not do it again."""

    def __init__(self, plant: Plant, step: float) -> None:
        super().__init__(plant)
        self._plant, self._step = plant, step
        self._kicks = room_for_kicks(plant)
        self._state: State | None = None

    def advance(self, state: State, torque: Array) -> None:
        if state is not self._state:
            self._prepare(state)
        if torque is not self.torque:
            self.torque[:] = torque
        if not self._kick_drift():  # the state is not where the last step left it
            self._plant.snapshot.update(state.q, state.v)
            self._start()
            self._kick_drift()
        for update in self._update:
            update()
        self._kick()

    def restart(self) -> None:
        self._kicks.flags[:] = 0

    def carry(self) -> dict[str, AnyArray]:
        return {name: getattr(self._kicks, name).copy() for name in _CARRIED}

    def resume(self, carried: dict[str, AnyArray]) -> None:
        for name in _CARRIED:
            getattr(self._kicks, name)[...] = carried[name]

    def _prepare(self, state: State) -> None:
        plant, kicks = self._plant, self._kicks
        self._state = state
        self._update = plant.snapshot.updates(state.q, kicks.ahead)
        common = plant.touching, plant.snapshot.terms, plant.envelope, kicks, plant.at, self._step, state.arrays
        drive = self.torque, plant.external
        self._start = prepared(start_step, *common)
        self._kick_drift = prepared(_kick_drift_from_there, plant.joints, *drive, *common)
        self._kick = prepared(_kick_again, *drive, *common)


@compiled
def start_step(touch, terms, envelope, kicks, at, step, state):
    """The first step from a state: contacts and matrix there, and the w that belongs to v.

    The acceleration will change within the step by about -M^-1 J^T K J v h, so w = v - (h^2/6) M^-1 J^T K J v. What w
    is lower than v is kept, so that the end of the step can settle the rest.
    """
    evaluate_contacts(touch.pads, touch.columns, terms.poses, terms.J, state.v, state.z, 0.0, touch.depths, True,
                      touch.contacts, touch.jacobian)  # fmt: skip
    note_slip(touch.pads, touch.contacts, state.z, 0.0)
    evaluate_resistance(touch.resistance, state.q, state.v)
    factor_matrix(touch, terms.M, envelope, step, kicks.matrix)
    lag_of(touch, envelope, kicks.matrix, step, state.v, kicks.w)
    for k in range(state.v.shape[0]):
        kicks.above[k] = -kicks.w[k]
        kicks.w[k] += state.v[k]
    kicks.pull[:] = 0.0
    kicks.flags[STARTED], kicks.flags[FIRST], kicks.flags[HELD] = 1, 1, 0
    set_at(state.q, state.v, state.z, at)


@compiled
def kick_drift(joints, torque, external, touch, terms, envelope, kicks, step, state):
    """First kick and drift, from a state at which the contacts are evaluated."""
    first_kick(torque, external, touch, terms, envelope, kicks, step)
    drift(joints, touch, kicks, step, state)


@compiled
def first_kick(torque, external, touch, terms, envelope, kicks, step):
    """First kick, without dry friction."""
    w, middle, ahead, a, h = kicks.w, kicks.middle, kicks.ahead, kicks.acceleration, step
    # kick: a at the evaluation that the last step ended with, under the torques and pushes of now
    if usually(kicks.flags[HELD] > 0):
        _change_drive(envelope, torque, external, kicks)
    else:
        acceleration_of(touch, terms.nle, envelope, torque, external, kicks.pull, kicks.matrix, a)
        undamped_ahead(touch, envelope, h, kicks.matrix, ahead, a)
    for k in range(w.shape[0]):
        middle[k] = w[k] + 0.5 * h * a[k]
        ahead[k] = middle[k] + 0.5 * h * a[k]
        kicks.held[k] = _drive(torque, external, k)


@compiled
def drift(joints, touch, kicks, step, state):
    """The drift, by the velocity between the kicks."""
    middle, h = kicks.middle, step
    # q for h, z for h/2 with the frames of the begin
    relax(touch.pads, touch.contacts, 0.5 * h, state.z)
    integrate_memory(touch.pads, touch.columns, touch.contacts, touch.jacobian, middle, 0.5 * h, state.z)
    integrate(joints, state.q, middle, h, state.q)


@compiled
def begin_kick(torque, external, terms, envelope, kicks, step, v):
    """Second kick: v, matrix and right-hand side without the contacts; `acceleration` is that side until it is solved.

    v is that of an acceleration which grows evenly within the step.
    """
    copy_mass(terms.M, envelope, kicks.matrix)
    for k in range(v.shape[0]):
        v[k] = kicks.middle[k] + step / 6.0 * kicks.acceleration[k]
        kicks.above[k] -= step / 6.0 * kicks.acceleration[k]
        kicks.acceleration[k] = _drive(torque, external, k) - terms.nle[k]


@compiled
def resist(touch, kicks, step, q):
    """Damping and stops of the joints at the new configuration; their part of the second kick."""
    own = touch.resistance
    evaluate_resistance(own, q, kicks.middle)
    add_slopes(own, step, kicks.matrix)
    for k in range(own.force.shape[0]):
        kicks.acceleration[k] += own.force[k]


@compiled
def hold_first(touch, envelope, kicks, step):
    """Dry friction of the joints in the first kick; `acceleration` then has what it does."""
    own, middle, a, h = touch.resistance, kicks.middle, kicks.acceleration, step
    hold(own, kicks.matrix, envelope, 0.5 * h, middle, own.change)
    for k in range(middle.shape[0]):
        a[k] += own.change[k]
        kicks.ahead[k] = middle[k] + 0.5 * h * a[k]


@compiled
def hold_second(touch, envelope, kicks, is_first, step, v):
    """In the second: of v and w. `acceleration` stays without it, as the next kick has a friction of its own.

    Args:
        touch: `Touch`.
        envelope: of the matrix.
        kicks: `Kicks`, after `kick`.
        is_first: whether the step is the first from its state, in which h/6 of the acceleration is added.
        step: h [s].
        v: shape (nv,).
    """
    own, w, h = touch.resistance, kicks.w, step
    missing = h / 6.0 if is_first > 0 else 0.0
    hold(own, kicks.matrix, envelope, 0.5 * h + missing, w, own.change)
    for k in range(w.shape[0]):
        v[k] += (h / 3.0 + missing) * own.change[k]
    for k in range(own.friction.shape[0]):
        if own.holds[0, k] and kicks.middle[k] == 0.0:
            v[k] = 0.0


@compiled
def meet_contact(i, touch, terms, kicks, step, z):
    """One contact at the new configuration: z for the other h/2 with the frames there, slip; its part of the kick."""
    pad, contact, memory, rate = touch.pads[i], touch.contacts[i], z[i], kicks.rate[i]
    columns, jacobian, pull = touch.columns[i], touch.jacobian[i], kicks.pull[i]
    depth = contact.deformation[0]
    if pad.is_support and seldom(contact.is_idle > 0):
        depth = math.nan
    for k in range(4):
        rate[k] = contact.deformation_rate[k]
    # drift, second half: z + (h/2) z'(middle) at the new configuration
    evaluate_contact(pad, columns, terms.poses, terms.J, kicks.middle, memory, 0.5 * step, depth, True, contact,
                     jacobian)  # fmt: skip
    if pad.elements == 1:
        for k in range(3):
            memory[k] = contact.deformation[1 + k]
    if pad.is_support and seldom(contact.is_idle > 0):
        return
    pull_of(contact, 0.25 * step, rate, depth, pull)
    note_slip_of(pad, contact, memory, step)
    relax_contact(pad, contact, 0.5 * step, memory)
    # kick
    add_stiffness(columns, contact, jacobian, step, kicks.matrix)
    add_contact_force(columns, jacobian, contact.force, kicks.acceleration)
    add_contact_moment(columns, jacobian, contact.lean_elastic, kicks.acceleration)
    add_contact_force(columns, jacobian, pull, kicks.acceleration)


@compiled
def kick(envelope, kicks, step, v):
    """The second kick itself, once all contacts are met: v and w."""
    w, middle, a, h = kicks.w, kicks.middle, kicks.acceleration, step
    if factor(kicks.matrix, envelope) >= 0:
        kicks.matrix[:] = math.nan
    solve(kicks.matrix, envelope, a)
    is_first = seldom(kicks.flags[FIRST] > 0)
    for k in range(w.shape[0]):
        missing = kicks.above[k] + h / 6.0 * a[k] if is_first else 0.0
        v[k] += h / 3.0 * a[k] + missing
        w[k] = middle[k] + 0.5 * h * a[k] + missing
    kicks.flags[FIRST], kicks.flags[HELD] = 0, 1


@compiled
def _kick_again(torque, external, touch, terms, envelope, kicks, at, step, state):
    """The second kick with all that belongs to it."""
    begin_kick(torque, external, terms, envelope, kicks, step, state.v)
    if touch.resistance.force.shape[0]:
        resist(touch, kicks, step, state.q)
    for i in range(touch.contacts.shape[0]):
        meet_contact(i, touch, terms, kicks, step, state.z)
    is_first = kicks.flags[FIRST]
    kick(envelope, kicks, step, state.v)
    if touch.resistance.friction.shape[0]:
        hold_second(touch, envelope, kicks, is_first, step, state.v)
    set_at(state.q, state.v, state.z, at)


@compiled
def _kick_drift_from_there(joints, torque, external, touch, terms, envelope, kicks, at, step, state):
    """`kick_drift`; False if the plant was not evaluated at this state by the step before."""
    if not (kicks.flags[STARTED] and is_at(state.q, state.v, state.z, at)):
        return False
    first_kick(torque, external, touch, terms, envelope, kicks, step)
    if touch.resistance.friction.shape[0]:
        hold_first(touch, envelope, kicks, step)
    drift(joints, touch, kicks, step, state)
    return True


@compiled
def _drive(torque, external, k):
    """(tau, 0) + external of one velocity."""
    return external[k] + torque[k] if k < torque.shape[0] else external[k]


@compiled
def _change_drive(envelope, torque, external, kicks):
    """What other torques and pushes than those held before add to the acceleration."""
    change, same = kicks.ahead, True
    for k in range(change.shape[0]):
        change[k] = _drive(torque, external, k) - kicks.held[k]
        same &= change[k] == 0.0
    if not spared(same):
        solve(kicks.matrix, envelope, change)
        for k in range(change.shape[0]):
            kicks.acceleration[k] += change[k]
