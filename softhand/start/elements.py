"""How the elements of a contact share the force that it carries at the start."""

from __future__ import annotations

import math

import numpy as np

from softhand.contact.elements import DISPLACEMENT, LAW, ROW
from softhand.contact.layer import respond_by_elements
from softhand.contact.pads import Fingertip, choose_limit, set_material
from softhand.contact.records import CONTACT, LEANING, PAD, REMEMBERED, STORED
from softhand.errors import GraspError
from softhand.laws.law import CompiledLaw
from softhand.numerics.arrays import Array
from softhand.numerics.roots import find_root
from softhand.start.answering import ANSWERED, LEAST_DEPTH, MOST_DEPTH, MOST_SHEAR, MOST_TORSION, RIM

_STEP = 1e-6  # of derivatives, of the lengths of a deformation


def load_elements(
    name: str,
    fingertip: Fingertip,
    code: CompiledLaw,
    friction: float,
    Phi: float,
    bearing: float,
    wanted: Array,
    deformation: Array,
    elements: Array,
) -> None:
    """Press a tip to a normal force, and load its elements together from nothing to a tangential one.

    Each goes with the displacement of all until it is at its limit, along whose normal it then slips, in one step.

    Args:
        name: of the tip.
        fingertip: its material.
        code: of its law; whoever calls it keeps it alive.
        friction: mu until it slips as a whole.
        Phi: [rad].
        bearing: of the axis of the tip in the face [rad].
        wanted: contact force in C_F before it relaxes, f_x, f_y, f_z [N], tau [N m], within the limit, shape (4,).
        deformation: that of a tip none of whose elements slips; dr and the mean of the elements are set, shape (4,).
        elements: displacement of each, force and slope of its law, set, shape (n, STORED + REMEMBERED + LEANING).

    Raises:
        GraspError: no such deformation is found.
    """
    n, radius = fingertip.elements, fingertip.law.radius
    pad, contact, rows = np.zeros(1, PAD)[0], np.zeros(1, CONTACT)[0], np.zeros((n + 1, ROW))
    set_material(pad, fingertip, code, 0)
    pad["slip_column"], pad["is_damped"], pad["relaxations"] = -1, 0, 0
    pad["radius"], pad["torsion_share"] = radius, fingertip.law.torsion_share or 0.0
    choose_limit(pad, fingertip.limit, fingertip.law.torsion_share)
    pad["elements"], pad["block"], pad["element_rows"] = n, STORED, rows.ctypes.data
    is_surface = bool(pad["is_surface"])
    contact["friction"], contact["angles"] = friction, (0.0, Phi)
    contact["lean"] = math.cos(Phi) * math.cos(bearing), math.cos(Phi) * math.sin(bearing)
    contact["theta_per_x"] = contact["phi_per_y"] = 1.0
    tangential = radius if is_surface else 1.0
    lengths, size = np.array([radius, tangential, tangential, 1.0]), np.linalg.norm(wanted)

    def excess(scaled: Array) -> Array:
        trial = scaled * lengths
        contact["deformation"], contact["distance"] = trial, radius - trial[0]
        if not is_surface:
            contact["phi_per_y"] = 1.0 / contact["distance"]
            contact["theta_per_x"] = contact["phi_per_y"] / math.cos(Phi)
            contact["psi_per_x"] = -math.sin(Phi) * contact["theta_per_x"]
        respond_by_elements(pad, contact, np.tile(trial[1:], n), 0.0, False)
        return np.asarray((contact["force"] - wanted) / (size * np.array([1.0, 1.0, 1.0, radius])))

    def slope(scaled: Array) -> Array:
        return np.column_stack([(excess(scaled + h) - excess(scaled - h)) / (2.0 * _STEP) for h in _STEP * np.eye(4)])

    lower = np.array([LEAST_DEPTH, -MOST_SHEAR, RIM - Phi, -MOST_TORSION])
    upper = np.array([MOST_DEPTH, MOST_SHEAR, math.pi - RIM - Phi, MOST_TORSION])
    if is_surface:
        lower[2], upper[2] = -MOST_SHEAR, MOST_SHEAR
    scaled, left = find_root(excess, slope, [deformation / lengths], lower, upper, ANSWERED)
    if left > ANSWERED:
        raise GraspError(
            f"{name}: with {n} slip elements no deformation of the tip answers with the force "
            f"{np.round(wanted[:3], 3).tolist()} N (the best is off by {left:.1e} of it). Raise grasp.internal_force "
            "or fingertip.friction, or set fingertip.slip_elements = 1.",
            finger=name, quantity="force", value=wanted,
        )  # fmt: skip
    excess(scaled)
    deformation[0] = scaled[0] * radius
    elements[:, :STORED] = rows[:n, DISPLACEMENT : DISPLACEMENT + STORED]
    elements[:, STORED:] = rows[:n, LAW : LAW + REMEMBERED + LEANING]
    deformation[1:] = elements[:, :STORED].mean(axis=0)
