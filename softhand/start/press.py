"""How a tip is deformed by the force that it carries at the start."""

from __future__ import annotations

import math

import numpy as np

from softhand.contact.kinematics import deformation_jacobian
from softhand.errors import GraspError, LawError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.numerics.roots import find_root
from softhand.start.answering import (
    ANSWERED,
    DEEPER,
    DEEPEST,
    LEAST_DEPTH,
    MOST_DEPTH,
    MOST_SHEAR,
    MOST_TORSION,
    RIM,
    SHALLOWEST,
)


def deform_tip(name: str, law: Law, Phi: float, bearing: float, wanted: Array) -> Array:
    """The deformation that the law answers with a contact force, J_delta^-T dF = wanted."""
    is_surface = law.coordinates == "surface"
    J_delta = np.eye(4)[[1, 2, 0, 3]]
    tangential = law.radius if is_surface else 1.0
    lengths = np.array([law.radius, tangential, tangential, 1.0])
    size = law.radius / lengths * np.linalg.norm(wanted)

    def excess(scaled: Array) -> Array:
        deformation = scaled * lengths
        if not is_surface:
            deformation_jacobian(law.radius - deformation[0], math.sin(Phi), math.cos(Phi), J_delta)
        return (law(deformation, Phi, bearing) - J_delta.T @ wanted) / size

    def slope(scaled: Array) -> Array:
        return np.column_stack([(excess(scaled + h) - excess(scaled - h)) / 2e-6 for h in 1e-6 * np.eye(4)])

    lower = np.array([LEAST_DEPTH, -MOST_SHEAR, RIM - Phi, -MOST_TORSION])
    upper = np.array([MOST_DEPTH, MOST_SHEAR, math.pi - RIM - Phi, MOST_TORSION])
    if is_surface:
        lower[2], upper[2] = -MOST_SHEAR, MOST_SHEAR
    depth = plain_depth(law, Phi, bearing, wanted[2])
    start = np.array([depth / law.radius, 0.0, 0.0, 0.0])
    if not np.all(np.isfinite(excess(start))):
        raise LawError(
            f"law '{type(law).__name__}' answers the plain compression dr = {1e3 * depth:.3g} mm of {name} with NaN or "
            "infinity; there is no start. Mend the formula, or lower grasp.internal_force.",
            law=type(law).__name__,
        )
    scaled, left = find_root(excess, slope, [start], lower, upper, ANSWERED)
    if left > ANSWERED:
        raise GraspError(
            f"{name}: no deformation of the tip answers with the force {np.round(wanted[:3], 3).tolist()} N "
            f"(the best is off by {left:.1e} of it). Lower grasp.internal_force or stiffen it.",
            finger=name, quantity="force", value=wanted,
        )  # fmt: skip
    return scaled * lengths


def plain_depth(law: Law, Phi: float, bearing: float, pressing: float) -> float:
    """dr [m], within 5 %, at which the law first answers with that normal force [N] without shear.

    A law may have a second answer with less depth and much more shear, which a start from no depth would find.
    """
    depth = SHALLOWEST * law.radius
    while depth < DEEPEST * law.radius and law([depth, 0.0, 0.0, 0.0], Phi, bearing)[0] < pressing:
        depth *= DEEPER
    return depth
