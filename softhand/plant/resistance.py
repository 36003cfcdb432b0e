"""What joints do to a motion by themselves: damping and stops as a force, dry friction as the impulse that it takes.

    torque of a joint = -d q' - side k x (1 + chi x'),   x > 0 the depth in a stop, x' its rate; never a pull
    dry friction r:  |r| <= f,   and q' = 0 or r = -f sign q'

The stops are those of Hunt and Crossley: no jump at touch, and what they take of a bounce grows with its speed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.model.configuration import ADDITIVE
from softhand.model.world import World
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.branches import seldom
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import factor, solve

_ROUNDS, _SWEEPS = 60, 8  # of guessing which joints friction holds, and of what improves the guess
_ROUNDING = 1e-12


class Resistance(NamedTuple):
    """For kernels; all of no length where joints run free, n where they do not."""

    damping: Array
    """[N m s/rad], shape (n,)."""
    friction: Array
    """Largest torque of dry friction [N m], shape (n,)."""
    places: NDArray[np.int64]
    """Index in q and in v of each joint with stops, shape (stops, 2)."""
    limits: Array
    """Lower and upper limit of these [rad], shape (stops, 2)."""
    stiffness: Array
    """Of these stops [N m/rad], shape (stops,)."""
    dissipation: Array
    """chi of these [s/rad], shape (stops,)."""
    force: Array
    """Torque of damping and stops as last evaluated [N m], shape (n,)."""
    rate: Array
    """- d torque / d q', shape (n,)."""
    spring: Array
    """- d torque / d q of the stops, shape (n,)."""
    dry: Array
    """Torque of dry friction in the last kick [N m], shape (n,)."""
    answer: Array
    """Room: velocities by torques of friction, shape (n, n)."""
    system: Array
    """Room, shape (n, n)."""
    numbers: Array
    """Room, shape (n,)."""
    change: Array
    """Room, shape (nv,)."""
    holds: NDArray[np.int64]
    """Which joints friction holds, then a row of zeros, shape (2, n)."""


def resistance_of(world: World) -> Resistance:
    """That of the joints of a world, or of the motors of coupled ones."""
    mechanics, n = world.mechanics, world.n_joints
    lower, upper = world.position_limits
    rows = [(int(i), int(j)) for kind, i, j in world.joints[:-1] if kind == ADDITIVE and mechanics.stop_stiffness[j]]
    places = np.array([row for row in rows if np.isfinite([lower[row[1]], upper[row[1]]]).any()], np.int64)
    places = places.reshape(-1, 2)
    own = places[:, 1]
    moving = n if np.any(mechanics.damping) or len(places) else 0
    dry = n if np.any(mechanics.friction) else 0
    return Resistance(
        mechanics.damping[:moving].copy(), mechanics.friction[:dry].copy(), places,
        np.stack([lower[own], upper[own]], axis=1), mechanics.stop_stiffness[own].copy(),
        mechanics.stop_damping[own].copy(), np.zeros(moving), np.zeros(moving), np.zeros(moving), np.zeros(dry),
        np.zeros((dry, dry)), np.zeros((dry, dry)), np.zeros(dry), np.zeros(world.nv if dry else 0),
        np.zeros((2, dry), np.int64),
    )  # fmt: skip


def become(mine: Resistance, other: Resistance) -> bool:
    """Be another one of the same kind, in the same memory; False where it is of another kind."""
    pairs: list[tuple[AnyArray, AnyArray]] = list(zip(mine, other, strict=True))
    if any(own.shape != new.shape for own, new in pairs) or np.any(mine.places != other.places):
        return False
    for own, new in pairs:
        own[...] = new
    return True


@compiled
def evaluate_resistance(own, q, v):
    """Torque of damping and stops, and its slopes, at q and v.

    Args:
        own: `Resistance`.
        q: shape (nq,).
        v: shape (nv,).
    """
    for k in range(own.force.shape[0]):
        own.force[k] = -own.damping[k] * v[k]
        own.rate[k] = own.damping[k]
        own.spring[k] = 0.0
    for s in range(own.places.shape[0]):
        x, j = q[own.places[s, 0]], own.places[s, 1]
        if seldom(x > own.limits[s, 1]):
            _press(own, s, x - own.limits[s, 1], 1.0, v[j])
        if seldom(x < own.limits[s, 0]):
            _press(own, s, own.limits[s, 0] - x, -1.0, v[j])


@compiled
def _press(own, s, depth, side, velocity):
    """One joint at a depth in a stop."""
    j = own.places[s, 1]
    stiffness = own.stiffness[s] * (1.0 + own.dissipation[s] * side * velocity)
    if stiffness > 0.0:
        own.force[j] -= side * stiffness * depth
        own.spring[j] += stiffness
        own.rate[j] += own.stiffness[s] * own.dissipation[s] * depth


@compiled
def add_slopes(own, step, matrix):
    """Diagonal of matrix += (h/2) rate + (h^2/4) spring."""
    for k in range(own.force.shape[0]):
        matrix[k, k] += 0.5 * step * own.rate[k] + 0.25 * step * step * own.spring[k]


@compiled
def hold(own, matrix, envelope, weight, w, change):
    """Dry friction: w + weight A^-1 (r, 0) with |r| <= f, and a joint at rest or r = -f sign of its velocity.

    r is the only one that obeys, as A is positive definite. Joints that are held are so exactly: their w is 0.

    Args:
        own: `Resistance`; sets `dry`, r, and `holds`.
        matrix: factor of A, shape (nv, nv).
        envelope: of it, shape (nv,).
        weight: [s].
        w: velocity without friction, then with it, shape (nv,).
        change: set to A^-1 (r, 0), shape (nv,).
    """
    n, G, r, holds = own.friction.shape[0], own.answer, own.dry, own.holds[0]
    for j in range(n):
        change[:] = 0.0
        change[j] = weight
        solve(matrix, envelope, change)
        for i in range(n):
            G[i, j] = change[i]
        r[j] = 0.0
    for _ in range(_ROUNDS):
        for _ in range(_SWEEPS):
            _improve(own, w)
        for j in range(n):
            holds[j] = abs(r[j]) < own.friction[j]
        if _solve_held(own, w):
            break
    change[:] = 0.0
    for j in range(n):
        change[j] = r[j]
    solve(matrix, envelope, change)
    for k in range(w.shape[0]):
        w[k] += weight * change[k]
    for j in range(n):
        if holds[j]:
            w[j] = 0.0


@compiled
def _improve(own, w):
    """Each joint after the other: its own r, with all others as they are (projected Gauss-Seidel)."""
    n, G, r = own.friction.shape[0], own.answer, own.dry
    for i in range(n):
        if own.friction[i] > 0.0:
            moves = w[i]
            for j in range(n):
                moves += G[i, j] * r[j]
            r[i] = min(max(r[i] - moves / G[i, i], -own.friction[i]), own.friction[i])


@compiled
def _solve_held(own, w):
    """r of the joints that are held, exactly, with the others at their bounds; whether all of them then obey.

    If they do not r is what obeys the bounds.
    """
    n, G, r, holds = own.friction.shape[0], own.answer, own.dry, own.holds[0]
    system, answer = own.system, own.numbers
    for i in range(n):
        for j in range(n):
            system[i, j] = G[i, j] if holds[i] and holds[j] else 1.0 * (i == j)
        answer[i] = r[i]
        if holds[i]:
            answer[i] = -w[i]
            for j in range(n):
                answer[i] -= 0.0 if holds[j] else G[i, j] * r[j]
    if factor(system, own.holds[1]) >= 0:
        return False
    solve(system, own.holds[1], answer)
    obeys = True
    for i in range(n):
        if holds[i]:
            obeys &= abs(answer[i]) <= own.friction[i] * (1.0 + _ROUNDING)
            r[i] = min(max(answer[i], -own.friction[i]), own.friction[i])
    for i in range(n):
        if not holds[i] and own.friction[i] > 0.0:
            moves, size = w[i], abs(w[i])
            for j in range(n):
                moves += G[i, j] * answer[j]
                size += abs(G[i, j] * answer[j])
            obeys &= moves * r[i] <= _ROUNDING * size * own.friction[i]
    return obeys
