"""Internal forces of the least total normal force, in a kernel: a cone program of few unknowns by a barrier.

With y the internal forces, f = a + K y the contact forces, k = (1 - margin) mu / sqrt(Q) and e >= 0 by how much all
limits are passed,

    min_y,e  w (sum f_z + M e) - sum log [(k f_z + e)^2 - f_x^2 - f_y^2 - (tau / l)^2] - sum log [f_z - touch + k e]
             - log [most - sum f_z + e] - sum log [effort -+ T + e effort / F] - log e

by Newton's method, for w that grows by steps up to W. Then sum f_z is above the least by no more than the number of
limits, cones counted twice, over W; and it is a smooth function of the load, which a vertex of a cone program is not.
e is as good as zero while some squeeze holds: M = 20 / k is above its price. Q is that of the limit surface where the
last squeeze loads it, see `contact.limit`.

Sources: Buss, Hashimoto, Moore, Dextrous Hand Grasping Force Optimization (1996), for the barrier of friction cones;
Boyd, Vandenberghe, Convex Optimization (2004), chapter 11, for its path.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.contact.limit import limit_of
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled

_FIRST, _LAST, _GROWTH = 0.3, 300.5, 10.0  # w [1/N]
_PENALTY = 20.0  # k M: above what a newton of limit can be worth
_STEPS = 20  # of Newton for each w
_ON, _DONE = 1e-2, 1e-20  # squared decrement of Newton with which w grows, and with which the last w is done
_NEAR = 1e-6  # below which a whole step is as good as any
_SHRINK, _SHORTEST = 0.5, 1e-6
_RIDGE = 1e-6  # [1/N^2], for internal forces that do nothing
_STRENGTH = 10.0  # F [N]: how e counts for an effort limit


class Limits(NamedTuple):
    """What limits a squeeze."""

    mu: Array
    """(1 - margin) mu, shape (nc,)."""
    effort: Array
    """Limits of the joint torques [N m, N], infinite for none, shape (n,)."""
    normal: Array
    """touch and most [N], shape (2,)."""


@compiled
def squeeze_by_barrier(limits, contacts, basis, load, torsion, J, held, last, squeeze):
    """Set the internal forces of the least total normal force [N].

    Args:
        limits: of contacts and joints.
        contacts: table `records.CONTACT` after `set_limit`: lever and curve.
        basis: K, shape (3 nc, np).
        load: a, contact forces without squeeze [N], shape (3 nc,).
        torsion: tau [N m], shape (nc,).
        J: J_CF^f, shape (3 nc, n).
        held: joint torques without the contact forces [N m, N], shape (n,).
        last: the squeeze before, which Q is taken at [N], shape (np,).
        squeeze: set, shape (np,).
    """
    nc, pairs, n = contacts.shape[0], basis.shape[1], J.shape[1]
    size = pairs + 1
    x, gradient, step, hessian = np.zeros(size), np.empty(size), np.empty(size), np.empty((size, size))
    reach, spin = np.empty(nc), np.empty(nc)
    for i in range(nc):
        spin[i] = torsion[i] / contacts[i].lever
        reach[i] = limits.mu[i] / math.sqrt(_bulge(contacts[i], basis, load, spin[i], last, i))
    J_K, base = np.zeros((n, pairs)), np.empty(n)
    for j in range(n):
        base[j] = held[j]
        for row in range(3 * nc):
            base[j] += J[row, j] * load[row]
            for k in range(pairs):
                J_K[j, k] += J[row, j] * basis[row, k]
    x[:pairs] = last
    x[pairs] = 1.0 + _beyond(limits, reach, spin, basis, load, J_K, base, x)
    weight = _FIRST
    while weight <= _LAST:
        for _ in range(_STEPS):
            value = _expand(limits, reach, spin, basis, load, J_K, base, x, weight, gradient, hessian)
            if not _descend(hessian, gradient, step):
                break
            decrement = 0.0
            for k in range(size):
                decrement -= gradient[k] * step[k]
            if not decrement > (_DONE if weight * _GROWTH > _LAST else _ON):
                break
            length = 1.0
            if decrement < _NEAR:
                for k in range(size):
                    x[k] += step[k]
                continue
            while length > _SHORTEST:
                for k in range(size):
                    x[k] += length * step[k]
                now = _value(limits, reach, spin, basis, load, J_K, base, x, weight)
                if now <= value - 0.1 * length * decrement:
                    break
                for k in range(size):
                    x[k] -= length * step[k]
                length *= _SHRINK
            if length <= _SHORTEST:
                break
        weight *= _GROWTH
    for k in range(pairs):
        squeeze[k] = x[k]


@compiled
def _bulge(contact, basis, load, spin, squeeze, i):
    """Q of the limit surface where this squeeze loads contact i."""
    x, y = load[3 * i], load[3 * i + 1]
    for k in range(squeeze.shape[0]):
        x, y = x + basis[3 * i, k] * squeeze[k], y + basis[3 * i + 1, k] * squeeze[k]
    square = x * x + y * y + spin * spin
    if square == 0.0:
        return 1.0
    return limit_of(contact.curve, (x, y, spin))[0] / square


@compiled
def _force(basis, load, x, row):
    """Of one row."""
    value = load[row]
    for k in range(x.shape[0] - 1):
        value += basis[row, k] * x[k]
    return value


@compiled
def _beyond(limits, reach, spin, basis, load, J_K, base, x):
    """By how much the limits are passed at most [N]."""
    most, total = 0.0, 0.0
    for i in range(reach.shape[0]):
        f_x, f_y, f_z = (
            _force(basis, load, x, 3 * i),
            _force(basis, load, x, 3 * i + 1),
            _force(basis, load, x, 3 * i + 2),
        )
        most = max(
            most,
            math.sqrt(f_x * f_x + f_y * f_y + spin[i] * spin[i]) - reach[i] * f_z,
            (limits.normal[0] - f_z) / reach[i],
        )
        total += f_z
    most = max(most, total - limits.normal[1])
    for j in range(base.shape[0]):
        torque = base[j]
        for k in range(x.shape[0] - 1):
            torque += J_K[j, k] * x[k]
        if limits.effort[j] < math.inf:
            most = max(most, _STRENGTH * (abs(torque) / limits.effort[j] - 1.0))
    return most


@compiled
def _value(limits, reach, spin, basis, load, J_K, base, x, weight):
    """What is minimised; infinite beyond a limit."""
    pairs = x.shape[0] - 1
    e, total, value = x[pairs], 0.0, 0.0
    if e <= 0.0:
        return math.inf
    for i in range(reach.shape[0]):
        f_x, f_y, f_z = (
            _force(basis, load, x, 3 * i),
            _force(basis, load, x, 3 * i + 1),
            _force(basis, load, x, 3 * i + 2),
        )
        room, lift = reach[i] * f_z + e, f_z - limits.normal[0] + reach[i] * e
        D = room * room - f_x * f_x - f_y * f_y - spin[i] * spin[i]
        if room <= 0.0 or D <= 0.0 or lift <= 0.0:
            return math.inf
        value -= math.log(D) + math.log(lift)
        total += f_z
    spare = limits.normal[1] - total + e
    if spare <= 0.0:
        return math.inf
    value += weight * (total + _PENALTY / np.min(reach) * e) - math.log(spare) - math.log(e)
    for j in range(base.shape[0]):
        if limits.effort[j] < math.inf:
            torque = base[j]
            for k in range(pairs):
                torque += J_K[j, k] * x[k]
            width = limits.effort[j] * (1.0 + e / _STRENGTH)
            if abs(torque) >= width:
                return math.inf
            value -= math.log((width - torque) * (width + torque) / limits.effort[j] ** 2)
    for k in range(pairs):
        value += 0.5 * _RIDGE * x[k] * x[k]
    return value


@compiled
def _expand(limits, reach, spin, basis, load, J_K, base, x, weight, gradient, hessian):
    """Gradient and Hessian of `_value`, set, and its value."""
    size = x.shape[0]
    pairs, e = size - 1, x[size - 1]
    slope, total = np.empty(size), 0.0
    for k in range(size):
        gradient[k] = _RIDGE * x[k]
        for m in range(size):
            hessian[k, m] = _RIDGE if k == m else 0.0
    gradient[pairs] = weight * _PENALTY / np.min(reach) - 1.0 / e
    hessian[pairs, pairs] = 1.0 / (e * e)
    for i in range(reach.shape[0]):
        a, b, c = 3 * i, 3 * i + 1, 3 * i + 2
        f_x, f_y, f_z = _force(basis, load, x, a), _force(basis, load, x, b), _force(basis, load, x, c)
        total += f_z
        room, lift = reach[i] * f_z + e, f_z - limits.normal[0] + reach[i] * e
        D = room * room - f_x * f_x - f_y * f_y - spin[i] * spin[i]
        for k in range(pairs):
            slope[k] = 2.0 * (room * reach[i] * basis[c, k] - f_x * basis[a, k] - f_y * basis[b, k]) / D
            gradient[k] += weight * basis[c, k] - slope[k] - basis[c, k] / lift
        slope[pairs] = 2.0 * room / D
        gradient[pairs] -= slope[pairs] + reach[i] / lift
        for k in range(size):
            z_k, r_k = (basis[c, k], reach[i] * basis[c, k]) if k < pairs else (reach[i], 1.0)
            for m in range(k + 1):
                z_m, r_m = (basis[c, m], reach[i] * basis[c, m]) if m < pairs else (reach[i], 1.0)
                bent = r_k * r_m
                if k < pairs:
                    bent -= basis[a, k] * basis[a, m] + basis[b, k] * basis[b, m]
                hessian[k, m] += slope[k] * slope[m] - 2.0 * bent / D + z_k * z_m / (lift * lift)
    spare = limits.normal[1] - total + e
    for k in range(size):
        slope[k] = 1.0 if k == pairs else 0.0
    for i in range(reach.shape[0]):
        for k in range(pairs):
            slope[k] -= basis[3 * i + 2, k]
    _add(slope, spare, gradient, hessian)
    for j in range(base.shape[0]):
        if limits.effort[j] < math.inf:
            torque = base[j]
            for k in range(pairs):
                torque += J_K[j, k] * x[k]
            for sign in (-1.0, 1.0):
                for k in range(pairs):
                    slope[k] = sign * J_K[j, k] / limits.effort[j]
                slope[pairs] = 1.0 / _STRENGTH
                _add(slope, 1.0 + e / _STRENGTH + sign * torque / limits.effort[j], gradient, hessian)
    return _value(limits, reach, spin, basis, load, J_K, base, x, weight)


@compiled
def _add(slope, room, gradient, hessian):
    """What -log room adds."""
    for k in range(slope.shape[0]):
        gradient[k] -= slope[k] / room
        for m in range(k + 1):
            hessian[k, m] += slope[k] * slope[m] / (room * room)


@compiled
def _descend(H, gradient, step):
    """step = -H^-1 gradient by Cholesky, H's lower triangle overwritten; False if H is not positive."""
    size = gradient.shape[0]
    for i in range(size):
        for j in range(i + 1):
            value = H[i, j]
            for k in range(j):
                value -= H[i, k] * H[j, k]
            if i == j:
                if not value > 0.0:
                    return False
                H[i, i] = math.sqrt(value)
            else:
                H[i, j] = value / H[j, j]
    for i in range(size):
        value = -gradient[i]
        for k in range(i):
            value -= H[i, k] * step[k]
        step[i] = value / H[i, i]
    for i in range(size - 1, -1, -1):
        value = step[i]
        for k in range(i + 1, size):
            value -= H[k, i] * step[k]
        step[i] = value / H[i, i]
    return True
