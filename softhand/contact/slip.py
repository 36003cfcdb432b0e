"""Slip: what a tip stores of shear and torsion goes back to the limit of friction, along the flow of most dissipation.

Forces, displacements and velocities of this file are three numbers in the contact frame, the spin scaled by the lever l
of the limit surface, so that all three have one unit and force times displacement is work:

    s = (f_x, f_y, tau / l) [N],   x = (x, y, l w) [m],   v = (v_x, v_y, l w_z) [m/s]
"""

from __future__ import annotations

import math

from softhand.contact.answer import answer, answer_stiffness, normal_force
from softhand.contact.friction import limit_of, limit_use, traction
from softhand.numerics.compiled import compiled
from softhand.numerics.triples import dot, length, moved, one_and_product, solved, times, times_number, transposed_times

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
_UNIT = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@compiled
def slip_to_limit(pad, contact):
    """Let a tip slip until its `elastic` force is within the limit of its whole normal force.

    With the displacement x0 that it would have without slip, s(x) and f_z(x) of the material and H of `limit_of`:

        x = x0 - y,   y = m e(s),   e = (1/2) dH/ds,   sqrt(H(s)) = mu f_z,   m >= 0

    The slip y is along the outward normal of the limit: against y, no force within the limit takes more work than the
    one on it. This is an implicit Euler step of the associated flow, and where s has an energy the closest point in its
    norm. In steady sliding y is the whole displacement of a step, so that friction is against it for every law.

    Newton's method on (x, m). It begins from the solution for a law that is linear and a limit that is a sphere: as they
    are at x0, or the law as it is at x = 0 where x0 is so far out that it need not mean anything there. If that does
    not lead to the end, as with a normal force that depends much on the shear, it begins from x0 cut back in
    proportion, and there it stays if that does not either.

    Args:
        pad: one row of `records.PAD`.
        contact: one row of `records.CONTACT`, after `answer` at x0, with its `grip` mu; what it lets go is added to
            `slip`.

    Returns:
        The multiplier m [m/N]; 0 if the force was within.
    """
    mu, s0 = contact.grip, _material(contact)
    room, least = mu * normal_force(contact), _NOTHING * length(s0)
    use = limit_use(contact, s0, room)
    if use <= 1.0 + ROUNDED:
        return 0.0
    first, second, third = contact.deformation[1], contact.deformation[2], contact.deformation[3]
    x0 = _stored(contact)
    m, x = _linear_guess(pad, contact, mu, x0, use < _NEAR, least)
    found, m = _closest_point(pad, contact, mu, x0, m, x, least)
    if not found:
        m, x = _guess_in_proportion(pad, contact, mu, x0)
        found, m = _closest_point(pad, contact, mu, x0, m, x, least)
    if not found:
        m = 0.0
        _store(contact, x)
        answer(pad, contact)
    contact.slip[0] += first - contact.deformation[1]
    contact.slip[1] += second - contact.deformation[2]
    contact.slip[2] += third - contact.deformation[3]
    return m


@compiled
def _linear_guess(pad, contact, mu, x0, from_trial, least):
    """m and x for a law that is linear: as it is at x0, or as it is at 0."""
    _store(contact, x0 if from_trial else (0.0, 0.0, 0.0))
    answer(pad, contact)
    answer_stiffness(pad, contact)
    K, s = _stiffness(contact), _material(contact)
    if not from_trial:
        s = moved(s, 1.0, times(K, x0))
    return _guess(contact, K, s, x0, max(mu * normal_force(contact), least))


@compiled
def _closest_point(pad, contact, mu, x0, m, x, least):
    """The search of `slip_to_limit` from a guess of m and x: whether it came to its end, and m."""
    # Newton: (1 + m e' K) dx + e dm = y - m e,   d(use) = 1 - use; half a step again until it comes nearer
    unit = 1.0 / max(length(x0), 1e-300)
    gap, share, x_last, m_last, dx, dm = math.inf, 1.0, x, m, (0.0, 0.0, 0.0), 0.0
    for _ in range(_MOST_STEPS):
        _store(contact, x)
        answer(pad, contact)
        s, room = _material(contact), max(mu * normal_force(contact), least)
        H, e, by_s = limit_of(contact.curve, s)
        use, y = math.sqrt(H) / room, moved(x0, -1.0, x)
        off = moved(y, -m, e)
        if abs(use - 1.0) < _CLOSE and length(off) <= _ALIGNED * length(y) + _OFF * length(x0):
            return True, m
        nearer = (use - 1.0) ** 2 + (unit * length(off)) ** 2
        if nearer < gap and m > 0.0:
            gap, share, x_last, m_last = nearer, 1.0, x, m
            answer_stiffness(pad, contact)
            K = _stiffness(contact)
            by_x = moved(times_number(-mu * use / room, _normal_stiffness(contact)), 1.0 / (math.sqrt(H) * room),
                         transposed_times(K, e))  # fmt: skip
            dx, dm = _newton_step(K, e, by_s, by_x, off, use, m)
        elif gap == math.inf:
            return False, m
        else:
            share *= 0.5
        x, m = moved(x_last, share, dx), m_last + share * dm
    _store(contact, x_last)
    answer(pad, contact)
    return gap < _GOOD, m_last


@compiled
def slip_velocity(contact, room):
    """How fast the surfaces slip over each other where only the dashpots take the force beyond the limit.

    As in `slip_to_limit`, with velocities for displacements and the dashpots D for the law:

        s = s_el + D (v - y),   y = m e(s),   sqrt(H(s)) = mu f_z

    Args:
        contact: one row of `records.CONTACT`, after `answer`; its `elastic` force is within the limit.
        room: mu f_z [N].
    """
    lever, D, velocity = contact.lever, contact.dashpot, contact.velocity
    K = (D[0], 0.0, 0.0, 0.0, D[1], 0.0, 0.0, 0.0, D[3] / (lever * lever))
    elastic, v = _material(contact), (velocity[0], velocity[1], lever * velocity[3])
    m, x = _guess(contact, K, moved(elastic, 1.0, times(K, v)), v, room)
    for _ in range(_MOST_STEPS):
        s = moved(elastic, 1.0, times(K, x))
        H, e, by_s = limit_of(contact.curve, s)
        use, y = math.sqrt(H) / room, moved(v, -1.0, x)
        off = moved(y, -m, e)
        if abs(use - 1.0) < _CLOSE and length(off) <= _ALIGNED * length(y) + _OFF * length(v):
            break
        by_x = times_number(1.0 / (math.sqrt(H) * room), times(K, e))
        dx, dm = _newton_step(K, e, by_s, by_x, off, use, m)
        x, m = moved(x, 1.0, dx), max(m + dm, 0.5 * m)
    return moved(v, -1.0, x)


@compiled
def slide_on(pad, contact, duration):
    """Let a tip slip for a while at the slip rate of `react`; `slip` is what it lets go.

    Returns:
        The multiplier m [m/N] of this slip.
    """
    rate, lever, first = contact.slip_rate, contact.lever, contact.deformation[1]
    second, third = contact.deformation[2], contact.deformation[3]
    y = times_number(duration, (rate[0], rate[1], lever * rate[2]))
    _, e, _ = limit_of(contact.curve, traction(contact))
    _store(contact, moved(_stored(contact), -1.0, y))
    answer(pad, contact)
    contact.slip[0] += first - contact.deformation[1]
    contact.slip[1] += second - contact.deformation[2]
    contact.slip[2] += third - contact.deformation[3]
    return length(y) / length(e)


@compiled
def _guess(contact, K, s, x0, room):
    """m and x with s, beyond the limit, taken for linear and the limit for a sphere as far out as it is along s.

    |(1 + m K)^-1 s| = r by Newton's method on 1 / |.|, which is concave in m if K is that of an energy.
    """
    H, _, _ = limit_of(contact.curve, s)
    r = room * length(s) / math.sqrt(H)
    m, t = 0.0, s
    for _ in range(_MOST_STEPS):
        B = one_and_product(m, _UNIT, K)
        t = solved(B, s)
        size = length(t)
        step = (size / r - 1.0) * size * size / dot(t, solved(B, times(K, t)))
        if not 1e-15 * m < step < math.inf:
            break
        m += step
    return m, moved(x0, -m, t)


@compiled
def _newton_step(K, e, by_s, use_by_x, off, use, m):
    """dx and dm of (1 + m e' K) dx + e dm = off, with K = ds/dx, and use + (d use / dx) dx = 1."""
    B = one_and_product(m, by_s, K)
    a, b = solved(B, off), solved(B, e)
    dm = (use - 1.0 + dot(use_by_x, a)) / dot(use_by_x, b)
    return moved(a, -dm, b), dm


@compiled
def _guess_in_proportion(pad, contact, mu, x0):
    """m and x with x0 cut back, towards where there is no force, until the force is within the limit."""
    x = (0.0, 0.0, 0.0)
    for _ in range(_MOST_HALVINGS):
        _store(contact, x)
        answer(pad, contact)
        if limit_use(contact, _material(contact), mu * normal_force(contact)) < _CLOSE:
            break
        answer_stiffness(pad, contact)
        ahead = moved(x, -1.0, solved(_stiffness(contact), _material(contact)))
        if not length(ahead) < math.inf:
            break
        x = ahead
    low, high, way = 0.0, 1.0, moved(x0, -1.0, x)
    for _ in range(_MOST_HALVINGS):
        middle = 0.5 * (low + high)
        _store(contact, moved(x, middle, way))
        answer(pad, contact)
        if limit_use(contact, _material(contact), mu * normal_force(contact)) <= 1.0:
            low = middle
        else:
            high = middle
    x = moved(x, low, way)
    _store(contact, x)
    answer(pad, contact)
    _, e, _ = limit_of(contact.curve, _material(contact))
    return dot(moved(x0, -1.0, x), e) / dot(e, e), x


@compiled
def stiffness_while_slipping(contact, m, per_lead):
    """The stiffness of a tip that slipped by m e in the last step, for the next one, in place of that of its law.

        A = K (1 + (m / 2) e' K)^-1,   A <- A - (A e) (e^T A) / (e^T A e),   e' = de/ds

    With m in place of m / 2 it is the derivative of the force of `slip_to_limit` by the displacement, at a given normal
    force. It is zero along the slip. Across it the force turns with the direction of slip, by no more than mu f_z over
    the slip of a step, however stiff the law: the force answers to the displacement of that step, thus to a velocity.
    A stepper that adds h^2/4 of the stiffness to the mass is stable with any spring, but wants twice as much for what
    answers to a velocity; the half of m is what is enough for both, at every ratio of the slip of a step to the
    stored displacement. The limit changes with the normal force too, but a matrix of that is not symmetric, so of the
    normal direction only its own stiffness is kept.

    Dashpots are in it as D / lead, h/2 of the damping for h^2/4 of the stiffness.

    Args:
        contact: one row of `records.CONTACT`, after `answer_stiffness`; stiffness is changed.
        m: of `slip_to_limit` or `slide_on` [m/N].
        per_lead: one over the lead, half of the step [1/s].
    """
    lever, D, stiffness = contact.lever, contact.dashpot, contact.stiffness
    for k in (0, 1, 3):
        stiffness[k, k] += per_lead * D[k]
    K, s, normal = _stiffness(contact), traction(contact), stiffness[2, 2]
    stiffness[:] = 0.0
    stiffness[2, 2] = normal
    _, e, by_s = limit_of(contact.curve, s)
    B = one_and_product(0.5 * m, by_s, K)
    a = times(K, solved(B, (1.0, 0.0, 0.0)))
    b = times(K, solved(B, (0.0, 1.0, 0.0)))
    c = times(K, solved(B, (0.0, 0.0, 1.0)))
    A = (a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2])
    across, along = times(A, e), transposed_times(A, e)
    most = dot(e, across)
    if not 0.0 < most < math.inf:
        return
    for i in range(3):
        row, to_row = (i, 1.0) if i < 2 else (3, lever)
        for j in range(3):
            column, to_column = (j, 1.0) if j < 2 else (3, lever)
            stiffness[row, column] = to_row * to_column * (A[3 * i + j] - across[i] * along[j] / most)


@compiled
def _stored(contact):
    """x of the deformation, the tangential part of J_delta times it."""
    along_x = contact.deformation[1] / contact.theta_per_x
    twist = contact.deformation[3] - contact.psi_per_x * along_x
    return along_x, contact.deformation[2] / contact.phi_per_y, contact.lever * twist


@compiled
def _store(contact, x):
    """The deformation of a displacement x."""
    contact.deformation[1] = contact.theta_per_x * x[0]
    contact.deformation[2] = contact.phi_per_y * x[1]
    contact.deformation[3] = x[2] / contact.lever + contact.psi_per_x * x[0]


@compiled
def _material(contact):
    """s of `elastic`."""
    return contact.elastic[0], contact.elastic[1], contact.elastic[3] / contact.lever


@compiled
def _stiffness(contact):
    """ds/dx of `elastic`, after `answer_stiffness`."""
    K, lever = contact.stiffness, contact.lever
    return (
        K[0, 0], K[0, 1], K[0, 3] / lever,
        K[1, 0], K[1, 1], K[1, 3] / lever,
        K[3, 0] / lever, K[3, 1] / lever, K[3, 3] / (lever * lever),
    )  # fmt: skip


@compiled
def _normal_stiffness(contact):
    """df_z/dx of `elastic`."""
    K = contact.stiffness
    return K[2, 0], K[2, 1], K[2, 3] / contact.lever
