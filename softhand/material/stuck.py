"""What it takes to move a plane that a pressed body sticks to: twist, shear and tilt, about the pressed state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softhand.material.neo_hookean import NeoHookean
from softhand.material.press import PENALTY, Pressed
from softhand.material.section import Motion, Section
from softhand.numerics.arrays import Array


@dataclass(frozen=True)
class Stuck:
    """Stiffnesses of a body that sticks to the plane; G = 1, lengths as those of the mesh.

    Attributes:
        twist: of the plane about its normal, moment per angle.
        shear: of the plane along itself without turning, force per length.
        coupling: moment about the tangent, in the plane, per length of shear, without that of the shifted normal force.
        tilt: of the plane about a tangent, moment per angle.
    """

    twist: float
    shear: float
    coupling: float
    tilt: float


def stuck(section: Section, nu: float, pressed: Pressed) -> Stuck:
    """The stiffnesses where all that touches sticks."""
    out = pressed.outward
    one, none = np.ones_like(out), np.zeros_like(out)
    twist = _response(section, nu, pressed, "twist", {"T": out[:, None]})
    # along x: u_R = cos, u_Theta = -sin; about y: u_Z = R cos
    plane = {"R": np.stack([one, none], 1), "T": np.stack([-one, none], 1), "Z": np.stack([none, out], 1)}
    lean = _response(section, nu, pressed, "lean", plane)
    return Stuck(float(twist[0, 0]), float(lean[0, 0]), float(lean[0, 1]), float(lean[1, 1]))


def _response(section: Section, nu: float, pressed: Pressed, motion: Motion, plane: dict[str, Array]) -> Array:
    """Forces by motions of the plane that the touching points follow.

    `plane` has the displacement of the points of the edge by each motion of the plane, shape (points, motions), by
    field. The result is symmetric, shape (motions, motions).
    """
    from scipy.sparse.linalg import spsolve

    body, free = section.body(motion), section.free(motion)
    tangent = body.tangent(NeoHookean(nu), pressed.state)
    motions = next(iter(plane.values())).shape[1]
    pull, own = np.zeros((body.size, motions)), np.zeros((motions, motions))
    for field, moved in plane.items():
        across, _, areas = section.edge(motion, field)
        weights = (PENALTY * areas * pressed.touching)[:, None]
        held = across.multiply(weights).tocsr()
        tangent = tangent + across.T @ held
        pull = pull + held.T @ moved
        own = own + moved.T @ (weights * moved)
    answer = np.zeros_like(pull)
    answer[free] = spsolve(tangent[free][:, free].tocsc(), pull[free]).reshape(len(free), -1)
    return own - pull.T @ answer
