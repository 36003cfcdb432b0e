"""Stiffness of a contact that slips, for steppers that look ahead."""

from __future__ import annotations

import math

from softhand.contact.limit import limit_of
from softhand.contact.scaled import stiffness_of, traction
from softhand.numerics.compiled import compiled
from softhand.numerics.triples import dot, one_and_product, solved, times, transposed_times, with_diagonal


@compiled
def stiffness_while_slipping(contact, m, per_lead):
    """The stiffness of a tip that slipped by m e in the last step, for the next one, in place of that of its law.

        A = K (1 + (m / 2) e' K)^-1,   A <- A - (A e) (e^T A) / (e^T A e),   e' = de/df

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
        m: of `slip_to_limit` [m/N].
        per_lead: one over the lead, half of the step [1/s].
    """
    lever, D, stiffness = contact.lever, contact.dashpot, contact.stiffness
    dash = per_lead * D[0], per_lead * D[1], per_lead * D[3] / (lever * lever)
    K, s, normal = with_diagonal(stiffness_of(contact), dash), traction(contact), stiffness[2, 2]
    stiffness[:] = 0.0
    stiffness[2, 2] = normal
    _, e, by_s = limit_of(contact.curve, s)
    B = one_and_product(0.5 * m, by_s, K)
    a = times(K, solved(B, (1.0, 0.0, 0.0)))
    b = times(K, solved(B, (0.0, 1.0, 0.0)))
    c = times(K, solved(B, (0.0, 0.0, 1.0)))
    A = (a[0], b[0], c[0], a[1], b[1], c[1], a[2], b[2], c[2])
    right, left = times(A, e), transposed_times(A, e)
    most = dot(e, right)
    if not 0.0 < most < math.inf:
        return
    for i in range(3):
        row, to_row = (i, 1.0) if i < 2 else (3, lever)
        for j in range(3):
            column, to_column = (j, 1.0) if j < 2 else (3, lever)
            stiffness[row, column] = to_row * to_column * (A[3 * i + j] - right[i] * left[j] / most)
