"""Slip: what a tip stores of shear and torsion goes back to the limit of friction, along the flow of most dissipation.

Forces, displacements and velocities are the three numbers of `scaled`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from softhand.contact.answer import answer, answer_stiffness, normal_force
from softhand.contact.limit import limit_of, limit_use
from softhand.contact.scaled import displacement_of, material_force, normal_stiffness_of, stiffness_of
from softhand.numerics.compiled import compiled
from softhand.numerics.triples import (
    diagonal,
    dot,
    length,
    moved,
    one_and_product,
    solved,
    times,
    times_number,
    transposed_times,
    with_diagonal,
)

Triple = tuple[float, float, float]

ROUNDED = 1e-12
"""How far beyond 1 the use of the limit surface still counts as within."""

_CLOSE = 1e-13  # how near to 1 it must come on the way back
_ALIGNED = 1e-10  # how far the slip may then be off the normal, as a share of it
_OFF = 1e-15  # and as a share of the whole displacement
_GOOD = 1e-20  # square of both that will do where rounding allows no more
_NEAR = 2.0  # use up to which the law at the trial displacement is a good guide on the way back
_MOST_STEPS = 40  # of each search
_MOST_HALVINGS = 60
_NOTHING = 1e-12  # of the force: what is left of the limit for a search where the tip does not press
_AT_ONCE = 1e-6  # [s]
_ZERO = (0.0, 0.0, 0.0)
_UNIT = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Trial(NamedTuple):
    """A tip that is held as if nothing slipped: its force after a slip y is s(x0 - y) + push - dash y."""

    x0: Triple
    """Its displacement [m]."""
    push: Triple
    """What its dashpots add to the force s of the material [N]."""
    dash: Triple
    """How much less of that for a slip within the time of the dashpots [N/m]."""
    least: float
    """For a limit of nothing [N]."""


@compiled
def slip_to_limit(pad, contact, duration):
    """Let a tip slip whose whole force is beyond the limit of its whole normal force.

    With the displacement x0 and the velocity v that it would have without slip, s(x) of the material, D of the
    dashpots, H of `limit_of`, and the time h within which it slips:

        x = x0 - y,   f = s(x) + D (v - y / h),   y = m e(f),   e = (1/2) dH/df,   sqrt(H(f)) = mu f_z,   m >= 0

    The slip y is along the outward normal of the limit: against y, no force within the limit takes more work than the
    one on it. This is an implicit Euler step of the associated flow, and where f has an energy the closest point in its
    norm. In steady sliding y is the whole displacement of a step, so that friction is against it for every law.

    Dashpots do not hold what the material alone has beyond the limit: that it lets go at once, without them, and so it
    does all where h is 0. Where only some directions have a dashpot, the others give way at once and those do not.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`, after `answer` at x0, with its `grip` mu; what it lets go is added to
            `slip`.
        duration: h [s].

    Returns:
        The multiplier m [m/N]; 0 if it lets go nothing.
    """
    first, second, third = contact.deformation[1], contact.deformation[2], contact.deformation[3]
    lever, D, v, m = contact.lever, contact.dashpot, contact.velocity, 0.0
    least = _NOTHING * length(material_force(contact))
    is_held = D[0] + D[1] + D[3] > 0.0
    if is_held and D[0] * D[1] * D[3] == 0.0:
        duration = max(duration, _AT_ONCE)
    if is_held and duration > 0.0:
        dash = D[0] / duration, D[1] / duration, D[3] / (lever * lever * duration)
        push = D[0] * v[0], D[1] * v[1], D[3] * v[3] / lever
        m = _return(pad, contact, Trial(displacement_of(contact), push, dash, least))
    if not limit_use(contact, material_force(contact), contact.grip * normal_force(pad, contact)) <= 1.0 + ROUNDED:
        m = _return(pad, contact, Trial(displacement_of(contact), _ZERO, _ZERO, least))
    contact.slip[0] += first - contact.deformation[1]
    contact.slip[1] += second - contact.deformation[2]
    contact.slip[2] += third - contact.deformation[3]
    return m


@compiled
def _return(pad, contact, trial):
    """The equations of `slip_to_limit` for one trial: stores x and returns m.

    Newton's method on (x, m). It begins from the solution for a linear law and a limit that is a sphere: as they are at
    x0, or the law as it is at x = 0 where x0 is so far out that it need not mean anything there. If that does not lead
    to the end, as with a normal force that depends much on the shear, it begins from x0 cut back in proportion, and
    there it stays if that does not either; at x0 if the force is no number there, for that is then the law's fault.
    """
    use = limit_use(contact, moved(material_force(contact), 1.0, trial.push), contact.grip * normal_force(pad, contact))
    m, x = _guess_linear(pad, contact, trial, use < _NEAR)
    found, m = _closest_point(pad, contact, trial, m, x)
    if not found:
        m, x = _guess_in_proportion(pad, contact, trial)
        found, m = _closest_point(pad, contact, trial, m, x)
    if not found:
        m = 0.0
        _force(pad, contact, trial, x if use > 0.0 else trial.x0)
    return m


@compiled
def _closest_point(pad, contact, trial, m, x):
    """Newton's method from a guess of m and x: whether it came to its end, and m. A step is halved until it is nearer.

    (1 + m e' K) dx + e dm = y - m e,   d(use) = 1 - use,   K = df/dx
    """
    size = max(length(trial.x0), 1e-300)
    gap, share, x_last, m_last, dx, dm = math.inf, 1.0, x, m, _ZERO, 0.0
    for _ in range(_MOST_STEPS):
        # how far off
        s = _force(pad, contact, trial, x)
        normal = contact.grip * normal_force(pad, contact)
        room = max(normal, trial.least)
        H, e, by_s = limit_of(contact.curve, s)
        use, y = math.sqrt(H) / room, moved(trial.x0, -1.0, x)
        off = moved(y, -m, e)
        if abs(use - 1.0) < _CLOSE and length(off) <= _ALIGNED * length(y) + _OFF * size:
            return True, m
        nearer = (use - 1.0) ** 2 + (length(off) / size) ** 2
        if nearer < gap and m > 0.0:
            # the next step
            gap, share, x_last, m_last = nearer, 1.0, x, m
            answer_stiffness(pad, contact)
            K = with_diagonal(stiffness_of(contact), trial.dash)
            by_x = times_number(1.0 / (math.sqrt(H) * room), transposed_times(K, e))
            if pad.elements == 1 and normal > trial.least:
                by_x = moved(by_x, -contact.grip * use / room, normal_stiffness_of(contact))
            dx, dm = _newton_step(K, e, by_s, by_x, off, use, m)
        elif gap == math.inf:
            return False, m
        else:
            share *= 0.5
        x, m = moved(x_last, share, dx), m_last + share * dm
    _force(pad, contact, trial, x_last)
    return gap < _GOOD, m_last


@compiled
def _newton_step(K, e, by_s, use_by_x, off, use, m):
    """dx and dm of (1 + m e' K) dx + e dm = off and use + (d use / dx) dx = 1."""
    B = one_and_product(m, by_s, K)
    a, b = solved(B, off), solved(B, e)
    dm = (use - 1.0 + dot(use_by_x, a)) / dot(use_by_x, b)
    return moved(a, -dm, b), dm


@compiled
def _guess_linear(pad, contact, trial, from_trial):
    """m and x for a law that is linear: as it is at x0, or as it is at 0."""
    x0 = trial.x0
    s = _force(pad, contact, trial, x0 if from_trial else _ZERO)
    answer_stiffness(pad, contact)
    K = with_diagonal(stiffness_of(contact), trial.dash)
    if not from_trial:
        s = moved(s, 1.0, times(K, x0))
    return _guess_round(contact, K, s, x0, max(contact.grip * normal_force(pad, contact), trial.least))


@compiled
def _guess_round(contact, K, s, x0, room):
    """m and x with s, beyond the limit, taken for linear and the limit for a sphere as far out as it is along s.

    |(1 + m K)^-1 s| = r by Newton's method on 1 / |.|, which is concave in m if K is that of an energy. Where K leaves
    too much of s as it is for that sphere, the one around the whole limit is taken.
    """
    H, _, _ = limit_of(contact.curve, s)
    r = room * length(s) / math.sqrt(H)
    m, t = 0.0, s
    for _ in range(2 * _MOST_STEPS):
        B = one_and_product(m, _UNIT, K)
        t = solved(B, s)
        size = length(t)
        step = (size / r - 1.0) * size * size / dot(t, solved(B, times(K, t)))
        if 1e-15 * m < step < math.inf:
            m += step
        elif size > 1.001 * r and r < room:
            m, r = 0.0, room
        else:
            break
    return m, moved(x0, -m, t)


@compiled
def _guess_in_proportion(pad, contact, trial):
    """m and x with x0 cut back, towards where there is no force, until the force is within the limit."""
    # where there is no force, by Newton's method from 0
    x = _ZERO
    for _ in range(_MOST_STEPS):
        s = _force(pad, contact, trial, x)
        if limit_use(contact, s, contact.grip * normal_force(pad, contact)) < _CLOSE:
            break
        answer_stiffness(pad, contact)
        ahead = moved(x, -1.0, solved(with_diagonal(stiffness_of(contact), trial.dash), s))
        if not length(ahead) < math.inf:
            break
        x = ahead
    if not limit_use(contact, _force(pad, contact, trial, x), contact.grip * normal_force(pad, contact)) <= 1.0:
        x = _ZERO
    # how far from there towards x0, by bisection
    low, high, way = 0.0, 1.0, moved(trial.x0, -1.0, x)
    for _ in range(_MOST_HALVINGS):
        middle = 0.5 * (low + high)
        s = _force(pad, contact, trial, moved(x, middle, way))
        if limit_use(contact, s, contact.grip * normal_force(pad, contact)) <= 1.0:
            low = middle
        else:
            high = middle
    x = moved(x, low, way)
    _, e, _ = limit_of(contact.curve, _force(pad, contact, trial, x))
    return dot(moved(trial.x0, -1.0, x), e) / dot(e, e), x


@compiled
def slip_velocity(contact, room):
    """How fast the surfaces slip over each other where only the dashpots take the force beyond the limit.

    As in `slip_to_limit`, with velocities for displacements and the dashpots D for the law:

        f = s_el + D (v - y),   y = m e(f),   sqrt(H(f)) = mu f_z

    Args:
        contact: one row of `records.CONTACT`, after `answer`; its `elastic` force is within the limit.
        room: mu f_z [N].

    Returns:
        y; the whole of v where there is no other, as where a direction that has no dashpot is at the limit by itself.
    """
    lever, D, velocity = contact.lever, contact.dashpot, contact.velocity
    K = diagonal((D[0], D[1], D[3] / (lever * lever)))
    elastic, v = material_force(contact), (velocity[0], velocity[1], lever * velocity[3])
    m, x = _guess_round(contact, K, moved(elastic, 1.0, times(K, v)), v, room)
    size = max(length(v), 1e-300)
    gap, share, x_last, m_last, dx, dm = math.inf, 1.0, x, m, _ZERO, 0.0
    for _ in range(_MOST_STEPS):
        s = moved(elastic, 1.0, times(K, x))
        H, e, by_s = limit_of(contact.curve, s)
        use, y = math.sqrt(H) / room, moved(v, -1.0, x)
        off = moved(y, -m, e)
        if abs(use - 1.0) < _CLOSE and length(off) <= _ALIGNED * length(y) + _OFF * size:
            return y
        nearer = (use - 1.0) ** 2 + (length(off) / size) ** 2
        if nearer < gap and m > 0.0:
            gap, share, x_last, m_last = nearer, 1.0, x, m
            by_x = times_number(1.0 / (math.sqrt(H) * room), times(K, e))
            dx, dm = _newton_step(K, e, by_s, by_x, off, use, m)
        else:
            share *= 0.5
        x, m = moved(x_last, share, dx), m_last + share * dm
    return moved(v, -1.0, x_last) if gap < _GOOD else v


@compiled
def _force(pad, contact, trial, x):
    """f after the slip x0 - x; the contact is then there."""
    contact.deformation[1] = contact.theta_per_x * x[0]
    contact.deformation[2] = contact.phi_per_y * x[1]
    contact.deformation[3] = x[2] / contact.lever + contact.psi_per_x * x[0]
    answer(pad, contact)
    s, x0, push, dash = material_force(contact), trial.x0, trial.push, trial.dash
    return (
        s[0] + push[0] - dash[0] * (x0[0] - x[0]),
        s[1] + push[1] - dash[1] * (x0[1] - x[1]),
        s[2] + push[2] - dash[2] * (x0[2] - x[2]),
    )
