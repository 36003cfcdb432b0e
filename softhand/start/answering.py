"""In a kernel: the deformation that a fingertip law answers with a given force."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.contact.address import call
from softhand.laws.law import LEADING, CompiledLaw, Law
from softhand.model.chain import ITERATIONS, LONGEST
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.shortest import shortest

ANSWERED = 1e-9
"""What may be left of the force, as a share of it."""

RIM = math.radians(1.0)
"""Phi of a start must lie between RIM and APEX: at 90 deg J_delta of the polar coordinates is singular. A law in
surface coordinates needs no such limit at the apex."""

APEX = math.radians(89.0)

SHALLOWEST, DEEPER, DEEPEST = 1e-3, 1.05, 0.9
"""Of `plain_depth`: where it begins and ends, as shares of the radius, and by what it grows."""

LEAST_DEPTH, MOST_DEPTH, MOST_SHEAR, MOST_TORSION = 1e-6, 0.95, 1.5, 3.0
"""Bounds of a deformation: dr and shear in radii, angles in [rad]."""


class Formula(NamedTuple):
    """A law as machine code."""

    force_function: int
    """Address."""
    stiffness_function: int
    """Address of the derivatives."""
    is_surface: int
    """Coordinates of the law: 1 surface, 0 polar."""
    arguments: Array
    """Deformation and angles, which are set, then the parameters, the radius first."""


def formula_of(law: Law, code: CompiledLaw) -> Formula:
    """The law for `answer_force`; whoever calls it keeps the code alive."""
    leading = len(LEADING[law.coordinates])
    arguments = np.concatenate([np.zeros(leading), code.parameters])
    return Formula(code.force.address, code.stiffness.address, int(law.coordinates == "surface"), arguments)


@compiled
def answer_force(formula, Phi, bearing, wanted, deformation, force):
    """`press.deform_tip` by Newton's iteration, without its other ways.

    Args:
        formula: of the law.
        Phi: [rad].
        bearing: of the axis of the tip in the face [rad].
        wanted: contact force in C_F, f_x, f_y, f_z [N], tau [N m], shape (4,).
        deformation: set, shape (4,).
        force: that of the law there, set, shape (4,).

    Returns:
        Whether it has been found within its bounds.
    """
    radius = formula.arguments[6 if formula.is_surface else 5]
    lengths, scaled, step, excess = np.empty(4), np.empty(4), np.empty(4), np.empty(4)
    derivatives, slope = np.empty(16), np.empty((4, 4))
    lengths[0], lengths[3] = radius, 1.0
    lengths[1] = lengths[2] = radius if formula.is_surface else 1.0
    size = math.sqrt(wanted[0] ** 2 + wanted[1] ** 2 + wanted[2] ** 2 + wanted[3] ** 2)
    scaled[0] = _plain_depth(formula, radius, Phi, bearing, wanted[2], deformation, force) / radius
    scaled[1] = scaled[2] = scaled[3] = 0.0
    left = math.inf
    for _ in range(ITERATIONS):
        for k in range(4):
            deformation[k] = scaled[k] * lengths[k]
        now = _excess(formula, radius, Phi, bearing, wanted, size, lengths, deformation, force, excess)
        if not math.isfinite(now) or (now >= left and now < 1e-12):
            break
        left = now
        _slope(formula, radius, Phi, wanted, size, lengths, derivatives, slope)
        shortest(slope, excess, 4, step)
        longest = max(abs(step[0]), abs(step[1]), abs(step[2]), abs(step[3]))
        if not longest >= 1e-16:
            break
        for k in range(4):
            scaled[k] -= step[k] * min(1.0, LONGEST / longest)
    for k in range(4):
        deformation[k] = scaled[k] * lengths[k]
    now = _excess(formula, radius, Phi, bearing, wanted, size, lengths, deformation, force, excess)
    lowest, highest = (-MOST_SHEAR, MOST_SHEAR) if formula.is_surface else (RIM - Phi, math.pi - RIM - Phi)
    return (
        now <= ANSWERED
        and LEAST_DEPTH <= scaled[0] <= MOST_DEPTH
        and abs(scaled[1]) <= MOST_SHEAR
        and lowest <= scaled[2] <= highest
        and abs(scaled[3]) <= MOST_TORSION
    )


@compiled
def _ask(formula, Phi, bearing, deformation, force):
    """The law at a deformation."""
    arguments = formula.arguments
    for k in range(4):
        arguments[k] = deformation[k]
    if formula.is_surface:
        arguments[4], arguments[5] = math.cos(Phi) * math.cos(bearing), math.cos(Phi) * math.sin(bearing)
    else:
        arguments[4] = Phi + deformation[2]
    call(formula.force_function, arguments, force)  # type: ignore[call-arg]


@compiled
def _plain_depth(formula, radius, Phi, bearing, pressing, deformation, force):
    """`press.plain_depth`."""
    deformation[1] = deformation[2] = deformation[3] = 0.0
    depth = SHALLOWEST * radius
    while depth < DEEPEST * radius:
        deformation[0] = depth
        _ask(formula, Phi, bearing, deformation, force)
        if not force[0] < pressing:
            break
        depth *= DEEPER
    return depth


@compiled
def _excess(formula, radius, Phi, bearing, wanted, size, lengths, deformation, force, excess):
    """excess = (F - J_delta^T f) / size of each; returns its length."""
    _ask(formula, Phi, bearing, deformation, force)
    f, R = wanted, radius - deformation[0]
    excess[0] = force[0] - f[2]
    if formula.is_surface:
        excess[1], excess[2] = force[1] - f[0], force[2] - f[1]
    else:
        excess[1] = force[1] - R * math.cos(Phi) * f[0] - math.sin(Phi) * f[3]
        excess[2] = force[2] - R * f[1]
    excess[3] = force[3] - f[3]
    total = 0.0
    for k in range(4):
        excess[k] *= lengths[k] / (radius * size)
        total += excess[k] * excess[k]
    return math.sqrt(total)


@compiled
def _slope(formula, radius, Phi, wanted, size, lengths, derivatives, slope):
    """Derivatives of the excess by the scaled deformation that the law was last asked at."""
    call(formula.stiffness_function, formula.arguments, derivatives)  # type: ignore[call-arg]
    if not formula.is_surface:  # R = r - dr in J_delta
        derivatives[4] += math.cos(Phi) * wanted[0]
        derivatives[8] += wanted[1]
    for i in range(4):
        for j in range(4):
            slope[i, j] = derivatives[4 * i + j] * lengths[j] * lengths[i] / (radius * size)
