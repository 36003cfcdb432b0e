"""In a kernel: one finger at rest on its contact, joint angles and deformation in turn."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from softhand.model.chain import place_tip, reach
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.start.answering import APEX, RIM, answer_force

TURNS = 50
"""Most turns."""

SETTLED = 1e-14
"""Change of the deformation in the last turn [m, rad]."""


class Settled(NamedTuple):
    """A finger at rest, each set by `settle`."""

    deformation: Array
    """Shape (4,)."""
    angles: Array
    """Theta, Phi [rad], shape (2,)."""
    contact_force: Array
    """f_x, f_y, f_z [N], tau [N m] on the object in C_F, shape (4,)."""
    law_force: Array
    """Of the law, before it relaxes, shape (4,)."""
    elements: Array
    """Displacement of each element of the contact and the force of its law, by `elements.load_elements`, shape (n, 7);
    one row, of no meaning, where it slips as a whole."""


@compiled
def settle(chain, formula, point, frame, force, relaxed, limits, tolerance, joints, settled):
    """The grasp of one finger, as `finger.settle_finger` finds it, by Newton's iteration alone.

    Args:
        chain: of the finger, with one to three joints that move it alone.
        formula: of its law.
        point: of contact, in the world [m], shape (3,).
        frame: tangent and inward normal of the face in the world, as columns, shape (3, 2).
        force: on the object, in the world [N], and torsion about the inward normal [N m], shape (4,).
        relaxed: share of the law's force that is left at rest.
        limits: lower and upper limit of each joint, shape (2, n).
        tolerance: of the place of the tip [m].
        joints: angles of all joints [rad or m]; those of the finger are set, shape (n,).
        settled: a `Settled`, set.

    Returns:
        Whether it has been found; if not, the joints are lost.
    """
    deformation, wanted = settled.deformation, settled.contact_force
    radius = formula.arguments[6 if formula.is_surface else 5]
    target, tip, axes, J = np.empty(3), np.empty(3), np.empty((3, 3)), np.empty((3, chain.kinds.shape[0]))
    before, asked = np.empty(4), np.empty(4)
    for k in range(4):
        deformation[k] = 0.0
    for _ in range(TURNS):
        # joints
        for k in range(3):
            target[k] = point[k] - (radius - deformation[0]) * frame[k, 1]
        if not reach(chain, target, joints, limits, tolerance) <= tolerance:
            return False
        place_tip(chain, joints, tip, axes, J)
        # angles and force in C_F
        bearing, Phi = _aim(formula.is_surface, axes, frame, force, settled), settled.angles[1]
        if not RIM < Phi < (math.inf if formula.is_surface else APEX):
            return False
        # deformation
        for k in range(4):
            before[k], asked[k] = deformation[k], wanted[k] / relaxed
        if not answer_force(formula, Phi, bearing, asked, deformation, settled.law_force):
            return False
        change = 0.0
        for k in range(4):
            change = max(change, abs(deformation[k] - before[k]))
        if change < SETTLED:
            break
    return True


@compiled
def _aim(is_surface, axes, frame, force, settled):
    """Theta, Phi and the force in C_F for a tip with these axes; returns the bearing of its axis in the face [rad]."""
    z = frame[0, 1], frame[1, 1], frame[2, 1]
    u = (
        axes[0, 0] * z[0] + axes[1, 0] * z[1] + axes[2, 0] * z[2],
        axes[0, 1] * z[0] + axes[1, 1] * z[1] + axes[2, 1] * z[2],
        axes[0, 2] * z[0] + axes[1, 2] * z[1] + axes[2, 2] * z[2],
    )
    Theta, Phi = math.atan2(u[2], u[1]), math.asin(min(max(u[0], -1.0), 1.0))
    c, s = math.cos(Theta), math.sin(Theta)  # x_C lies along growing Theta, or the tangent of the face
    x = c * axes[0, 2] - s * axes[0, 1], c * axes[1, 2] - s * axes[1, 1], c * axes[2, 2] - s * axes[2, 1]
    if is_surface:
        x = frame[0, 0], frame[1, 0], frame[2, 0]
    y = z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]
    settled.angles[0], settled.angles[1] = Theta, Phi
    f = settled.contact_force
    f[0] = x[0] * force[0] + x[1] * force[1] + x[2] * force[2]
    f[1] = y[0] * force[0] + y[1] * force[1] + y[2] * force[2]
    f[2] = z[0] * force[0] + z[1] * force[1] + z[2] * force[2]
    f[3] = force[3]
    along_x = axes[0, 0] * x[0] + axes[1, 0] * x[1] + axes[2, 0] * x[2]
    return math.atan2(axes[0, 0] * y[0] + axes[1, 0] * y[1] + axes[2, 0] * y[2], along_x)
