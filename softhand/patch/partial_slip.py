"""Partial slip: which columns of a contact hold and which slip, along a history of motion or of load, compiled.

The columns stand on an elastic body of compliance C. Their forces q, within mu p of each, are those of

    u = C q,   slip w = X - u,   |q_i| <= mu p_i,   q_i against the rest of the surface where w_i moves

with X the displacement of the rigid surfaces at each column. A step of it is a step of implicit Euler, and that is the
least of the complementary energy q C q / 2 - q (X - w) within the limits: the closest point in the norm of the energy.
"""

from __future__ import annotations

import math

from softhand.numerics.compiled import compiled

LEADING = 3
"""Numbers of a history before those of the columns: the displacement x, y [m] and the spin [rad]."""

FORCE, LOST, STORED, SWEEPS = 0, 3, 4, 5
"""Places in the results: f_x, f_y [N], tau [N m]; loss of the step [J]; stored [J]; its sweeps, 0 if these failed."""
RESULTS = 6

_MOST_SWEEPS = 4000
_CLOSE = 1e-7  # of the whole limit: change of a force in the last sweep, and what may be missing of the load


@compiled
def carry(points, C, limits, history, scratch, results):
    """The forces of the columns at the displacement of the history; the slip of each goes on.

    Args:
        points: of the columns [m], shape (N, 2).
        C: compliance [m/N], shape (2 N, 2 N).
        limits: mu times the normal force on each [N], shape (N,).
        history: displacement, slip w of each column [m], force q of each [N], shape (3 + 4 N,); w and q change.
        scratch: shape (4 N,).
        results: set, shape (RESULTS,).
    """
    close = _begin(C, limits, history, scratch)
    sweeps = 0
    for count in range(1, _MOST_SWEEPS + 1):
        if _sweep(points, C, limits, history, scratch) <= close:
            sweeps = count
            break
    _end(points, history, scratch, results)
    results[SWEEPS] = sweeps


@compiled
def load(points, C, limits, stiffness, wanted, history, scratch, results):
    """As `carry`, with the displacement that it takes to transmit a load.

    Each sweep is followed by a step of the displacement, by what is missing of the load over the stiffness of columns
    none of which slips. That is never too far, as columns that slip are less stiff.

    Args:
        points: as in `carry`.
        C: likewise.
        limits: likewise.
        stiffness: of the columns that are pressed, all of them stuck, against shear [N/m] and spin [N m/rad].
        wanted: f_x, f_y [N], tau [N m], within the limit of all columns, shape (3,).
        history: as in `carry`; the displacement changes too.
        scratch: likewise.
        results: likewise.
    """
    close = _begin(C, limits, history, scratch)
    shear, spin = stiffness
    reach = math.sqrt(spin / shear)
    sweeps = 0
    for count in range(1, _MOST_SWEEPS + 1):
        change = _sweep(points, C, limits, history, scratch)
        _sum_forces(points, history, results)
        missing = wanted[0] - results[0], wanted[1] - results[1], wanted[2] - results[2]
        if change <= close and math.hypot(missing[0], missing[1]) + abs(missing[2]) / reach <= close:
            sweeps = count
            break
        history[0] += missing[0] / shear
        history[1] += missing[1] / shear
        history[2] += missing[2] / spin
    _end(points, history, scratch, results)
    results[SWEEPS] = sweeps


@compiled
def slipped_share(areas, limits, history, moving):
    """Share of the pressed area that is at its limit; `moving` is how far off it still counts, a share of it."""
    count = areas.shape[0]
    pressed, slips = 0.0, 0.0
    for i in range(count):
        if limits[i] > 0.0:
            pressed += areas[i]
            first = LEADING + 2 * count + 2 * i
            if math.hypot(history[first], history[first + 1]) >= (1.0 - moving) * limits[i]:
                slips += areas[i]
    return slips / pressed if pressed > 0.0 else 0.0


@compiled
def _begin(C, limits, history, scratch):
    """u = C q and a copy of q, in scratch; how close the forces must come [N]."""
    count = limits.shape[0]
    whole = 0.0
    for k in range(2 * count):
        scratch[k] = 0.0
        scratch[2 * count + k] = history[LEADING + 2 * count + k]
    for k in range(2 * count):
        whole += limits[k // 2]
        q = history[LEADING + 2 * count + k]
        if q != 0.0:
            for j in range(2 * count):
                scratch[j] += C[k, j] * q
    return 0.5 * _CLOSE * whole


@compiled
def _sweep(points, C, limits, history, scratch):
    """Each force once, to where its column sticks, or to its limit in that direction; the largest change [N]."""
    count = limits.shape[0]
    slip, force = LEADING, LEADING + 2 * count
    x, y, spin, largest = history[0], history[1], history[2], 0.0
    for i in range(count):
        a, b = 2 * i, 2 * i + 1
        before_x, before_y = history[force + a], history[force + b]
        if limits[i] > 0.0:
            give = 0.5 * (C[a, a] + C[b, b])
            off_x = x - spin * points[i, 1] - history[slip + a] - scratch[a]
            off_y = y + spin * points[i, 0] - history[slip + b] - scratch[b]
            now_x, now_y = before_x + off_x / give, before_y + off_y / give
            size = math.hypot(now_x, now_y)
            if size > limits[i]:
                now_x, now_y = now_x * limits[i] / size, now_y * limits[i] / size
        else:
            now_x, now_y = 0.0, 0.0
        dx, dy = now_x - before_x, now_y - before_y
        if dx != 0.0 or dy != 0.0:
            history[force + a], history[force + b] = now_x, now_y
            for k in range(2 * count):
                scratch[k] += C[a, k] * dx + C[b, k] * dy
            largest = max(largest, abs(dx), abs(dy))
    return largest


@compiled
def _end(points, history, scratch, results):
    """The slip of each column, and what the step gave; the loss is slip times the mean of the forces."""
    count = points.shape[0]
    slip, force = LEADING, LEADING + 2 * count
    _sum_forces(points, history, results)
    results[LOST], results[STORED] = 0.0, 0.0
    for i in range(count):
        for k in range(2):
            place = 2 * i + k
            arm = history[2] * (-points[i, 1] if k == 0 else points[i, 0])
            left = history[k] + arm - scratch[place]
            mean = 0.5 * (history[force + place] + scratch[2 * count + place])
            results[LOST] += mean * (left - history[slip + place])
            results[STORED] += 0.5 * history[force + place] * scratch[place]
            history[slip + place] = left


@compiled
def _sum_forces(points, history, results):
    """f_x, f_y, tau of all columns."""
    count = points.shape[0]
    force = LEADING + 2 * count
    x, y, tau = 0.0, 0.0, 0.0
    for i in range(count):
        f_x, f_y = history[force + 2 * i], history[force + 2 * i + 1]
        x, y = x + f_x, y + f_y
        tau += points[i, 0] * f_y - points[i, 1] * f_x
    results[0], results[1], results[2] = x, y, tau


@compiled
def use_of(points, limits, wanted):
    """How much of what the columns hold together a load takes: 1 on their limit, infinite where nothing presses.

    No load within the limit takes more power than the columns lose as they slip as a whole, so that

        use = max over v, w of (f_t v + tau w) / sum_i mu p_i |v + w x r_i|

    with v along f_t, as the disc has no direction of its own. Along the ratio of v and w there is one maximum.

    Args:
        points: of the columns [m], shape (N, 2).
        limits: of each [N], shape (N,).
        wanted: f_x, f_y [N], tau [N m], shape (3,).
    """
    f_t, tau, whole, spun = math.hypot(wanted[0], wanted[1]), abs(wanted[2]), 0.0, 0.0
    for i in range(limits.shape[0]):
        whole += limits[i]
        spun += limits[i] * math.hypot(points[i, 0], points[i, 1])
    if f_t == 0.0 and tau == 0.0:
        return 0.0
    if whole <= 0.0:
        return math.inf
    lever = spun / whole
    along = (wanted[0] / f_t, wanted[1] / f_t) if f_t > 0.0 else (1.0, 0.0)
    turn = 1.0 if wanted[2] >= 0.0 else -1.0
    low, high = 0.0, 0.5 * math.pi
    a, b = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
    at_a = _ratio(points, limits, along, turn, f_t, tau, lever, a)
    at_b = _ratio(points, limits, along, turn, f_t, tau, lever, b)
    for _ in range(_GOLDEN_STEPS):
        if at_a > at_b:
            high, b, at_b = b, a, at_a
            a = high - _GOLDEN * (high - low)
            at_a = _ratio(points, limits, along, turn, f_t, tau, lever, a)
        else:
            low, a, at_a = a, b, at_b
            b = low + _GOLDEN * (high - low)
            at_b = _ratio(points, limits, along, turn, f_t, tau, lever, b)
    return max(at_a, at_b)


_GOLDEN, _GOLDEN_STEPS = 0.6180339887498949, 30


@compiled
def _ratio(points, limits, along, turn, f_t, tau, lever, angle):
    """Power of the load over what is lost, for v = cos(angle) along f_t and w = sin(angle) / lever."""
    v, w = math.cos(angle), math.sin(angle) / lever
    lost = 0.0
    for i in range(limits.shape[0]):
        x = v * along[0] - turn * w * points[i, 1]
        y = v * along[1] + turn * w * points[i, 0]
        lost += limits[i] * math.hypot(x, y)
    return (f_t * v + tau * w) / lost
