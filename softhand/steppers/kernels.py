"""The steps of the steppers that need no Python: one call each, with rigid-body terms from a kernel."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.contact.address import done
from softhand.contact.damping import memory_rate, relax
from softhand.contact.friction import note_slip
from softhand.contact.kinematics import integrate_memory
from softhand.contact.layer import evaluate_contacts
from softhand.contact.sliders import slide
from softhand.model.compiled_snapshot import CompiledSnapshot
from softhand.model.configuration import coordinate_rate, integrate, normalize
from softhand.model.coupled import Terms
from softhand.model.rigid import branch_terms, rigid_terms
from softhand.model.tree import Tree, branches_of
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.numerics.inlined import inlined
from softhand.plant.dynamics import accelerate
from softhand.plant.plant import Plant, Touch
from softhand.plant.resistance import evaluate_resistance, hold
from softhand.plant.state import State, StateArrays, is_at, set_at
from softhand.steppers.midpoint import (
    FIRST,
    STARTED,
    Kicks,
    begin_kick,
    drift,
    first_kick,
    hold_first,
    hold_second,
    kick,
    kick_drift,
    meet_contact,
    resist,
    room_for_kicks,
    start_step,
)

MIDPOINT, SEMI_IMPLICIT_EULER, RK4 = range(3)

KICK_DRIFT, BEGIN, KICK, CONTACTS = range(4)
"""Rows of `Mechanics.straight`; from the last on one for each contact, then one for each branch of the tree."""


class Mechanics(NamedTuple):
    """All that a step works with: one plant, its state, and room."""

    tree: Tree
    joints: AnyArray
    touch: Touch
    terms: Terms
    envelope: NDArray[np.int64]
    at: Array
    """`Plant.at`; between two steps it is enough that its first number is no NaN."""
    state: StateArrays
    torque: Array
    """Of the joints [N m, N], shape (n,)."""
    external: Array
    """`Plant.external`."""
    can_slip: bool
    kicks: Kicks
    """Of the midpoint rule."""
    mass: Array
    """Room, shape (nv, nv)."""
    slopes: Array
    """Room: y, a stage and four slopes of Runge-Kutta, or the acceleration, shape (6, nq + nv + nc n_memory)."""
    straight: NDArray[np.int64]
    """Addresses of straight code and of its words, see `KICK_DRIFT`; zeros where there is none, shape (rows, 2)."""
    branches: NDArray[np.int64]
    """First and last joint of each branch of the tree, none where joints are coupled, shape (branches, 2)."""


def mechanics_of(plant: Plant, state: State, torque: Array) -> Mechanics:
    """Of a plant with compiled terms, and a state that stays where it is."""
    nv, snapshot = plant.world.nv, plant.snapshot
    assert isinstance(snapshot, CompiledSnapshot)
    branches = branches_of(snapshot.tree)
    return Mechanics(
        snapshot.tree,
        plant.joints,
        plant.touching,
        snapshot.terms,
        plant.envelope,
        plant.at,
        state.arrays,
        torque,
        plant.external,
        plant.can_slip,
        room_for_kicks(plant),
        np.zeros((nv, nv)),
        np.zeros((6, plant.at.shape[0])),
        np.zeros((CONTACTS + len(plant.contacts) + len(branches), 2), np.int64),
        branches,
    )


@inlined
def advance(kind, m, step):
    """One step of the stepper of that kind; the state moves on in place."""
    if kind == MIDPOINT:
        _midpoint(m, step)
    elif kind == SEMI_IMPLICIT_EULER:
        _semi_implicit_euler(m, step)
    else:
        _rk4(m, step)


@inlined
def _midpoint(m, step):
    """As `Midpoint`."""
    codes, state = m.straight, m.state
    if not (m.kicks.flags[STARTED] and m.at[0] == m.at[0]):  # NaN if the contacts are not those of the state
        rigid_terms(m.tree, state.q, state.v, m.terms)
        start_step(m.touch, m.terms, m.envelope, m.kicks, m.at, step, state)
    own = m.touch.resistance
    if own.friction.shape[0]:
        first_kick(m.torque, m.external, m.touch, m.terms, m.envelope, m.kicks, step)
        hold_first(m.touch, m.envelope, m.kicks, step)
        drift(m.joints, m.touch, m.kicks, step, state)
    elif not done(codes, KICK_DRIFT):  # type: ignore[call-arg]
        kick_drift(m.joints, m.torque, m.external, m.touch, m.terms, m.envelope, m.kicks, step, state)
    if m.branches.shape[0] == 0:
        rigid_terms(m.tree, state.q, m.kicks.ahead, m.terms)
    for k in range(m.branches.shape[0]):
        if not done(codes, CONTACTS + m.touch.contacts.shape[0] + k):  # type: ignore[call-arg]
            branch_terms(m.tree, m.branches[k, 0], m.branches[k, 1], state.q, m.kicks.ahead, m.terms)
    if not done(codes, BEGIN):  # type: ignore[call-arg]
        begin_kick(m.torque, m.external, m.terms, m.envelope, m.kicks, step, state.v)
    if own.force.shape[0]:
        resist(m.touch, m.kicks, step, state.q)
    for i in range(m.touch.contacts.shape[0]):
        if not done(codes, CONTACTS + i):
            meet_contact(i, m.touch, m.terms, m.kicks, step, state.z)
    is_first = m.kicks.flags[FIRST]
    if not done(codes, KICK):
        kick(m.envelope, m.kicks, step, state.v)
    if own.friction.shape[0]:
        hold_second(m.touch, m.envelope, m.kicks, is_first, step, state.v)
    m.at[0] = state.q[0]


@compiled
def _update(m, q, v, z):
    """As `Plant.update`."""
    touch = m.touch
    m.at[0] = np.nan
    rigid_terms(m.tree, q, v, m.terms)
    evaluate_contacts(touch.pads, touch.columns, m.terms.poses, m.terms.J, v, z, 0.0, touch.depths, False,
                      touch.contacts, touch.jacobian)  # fmt: skip
    evaluate_resistance(touch.resistance, q, v)


@compiled
def settle(m, step):
    """As `Plant.settle`."""
    q, v, z = m.state.q, m.state.v, m.state.z
    if m.can_slip and not is_at(q, v, z, m.at):
        _update(m, q, v, z)
        slide(m.touch.pads, m.touch.contacts, step)
        note_slip(m.touch.pads, m.touch.contacts, z, step)
        set_at(q, v, z, m.at)


@compiled
def _semi_implicit_euler(m, step):
    """As `SemiImplicitEuler`."""
    q, v, z, touch = m.state.q, m.state.v, m.state.z, m.touch
    settle(m, step * 0.0)
    _update(m, q, v, z)
    acceleration = m.slopes[0, : v.shape[0]]
    accelerate(touch, m.terms, m.envelope, m.torque, m.external, m.mass, acceleration)
    for k in range(v.shape[0]):
        v[k] += step * acceleration[k]
    if touch.resistance.friction.shape[0]:
        hold(touch.resistance, m.mass, m.envelope, step, v, touch.resistance.change)
    integrate(m.joints, q, v, step, q)
    integrate_memory(touch.pads, touch.columns, touch.contacts, touch.jacobian, v, step, z)
    relax(touch.pads, touch.contacts, step, z)
    settle(m, step)


@compiled
def _rate(m, y, out):
    """out = y' for y = (q, v, z), as `Flow.rate`."""
    nq, nv, touch = m.state.q.shape[0], m.state.v.shape[0], m.touch
    nc, memory = m.state.z.shape
    q, v, z = y[:nq], y[nq : nq + nv], y[nq + nv :].reshape(nc, memory)
    z_rate = out[nq + nv :].reshape(nc, memory)
    _update(m, q, v, z)
    accelerate(touch, m.terms, m.envelope, m.torque, m.external, m.mass, out[nq : nq + nv])
    coordinate_rate(m.joints, q, v, out[:nq])
    memory_rate(touch.pads, touch.contacts, z, z_rate)


@compiled
def _rk4(m, step):
    """As `RungeKutta4`."""
    q, v, z = m.state.q, m.state.v, m.state.z
    nq, nv = q.shape[0], v.shape[0]
    nc, memory = z.shape
    settle(m, step * 0.0)
    y, stage = m.slopes[0], m.slopes[1]
    for k in range(nq):
        y[k] = q[k]
    for k in range(nv):
        y[nq + k] = v[k]
    for i in range(nc):
        for k in range(memory):
            y[nq + nv + memory * i + k] = z[i, k]
    _rate(m, y, m.slopes[2])
    for i in range(1, 4):
        before, share = m.slopes[1 + i], step if i == 3 else 0.5 * step
        for k in range(y.shape[0]):
            stage[k] = y[k] + share * before[k]
        _rate(m, stage, m.slopes[2 + i])
    for k in range(y.shape[0]):
        y[k] += step / 6.0 * (m.slopes[2, k] + 2.0 * m.slopes[3, k] + 2.0 * m.slopes[4, k] + m.slopes[5, k])
    for k in range(nq):
        q[k] = y[k]
    for k in range(nv):
        v[k] = y[nq + k]
    for i in range(nc):
        for k in range(memory):
            z[i, k] = y[nq + nv + memory * i + k]
    normalize(m.joints, q)
    settle(m, step)
