"""The soft tip as it deforms: flattened where it touches, sheared and twisted with the contact.

The contact laws know four numbers (dr, dtheta, dphi, dpsi) and no shape. The shape drawn here is the simplest that
agrees with them and with the picture behind them: the material at the contact has moved with it, the rim of the flat
face is bonded and stays, all between follows smoothly, nothing lies beyond the object's face, and what the face takes
from the volume of the half sphere bulges out beside the contact.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import Array

_BONDED = 0.35  # [rad] above the flat face, where the rim holds the material back


class Indentation(NamedTuple):
    """How one tip is deformed, in its finger frame F."""

    radius: float
    """r of the undeformed half sphere [m]."""
    distance: float
    """R = r - dr [m]."""
    angles: tuple[float, float]
    """Theta, Phi of the contact [rad]."""
    shear: tuple[float, float, float]
    """dtheta, dphi, dpsi [rad]."""

    @property
    def disc_radius(self) -> float:
        """Of the contact, sqrt(r^2 - R^2), 0 without contact [m]."""
        return float(np.sqrt(max(self.radius**2 - self.distance**2, 0.0)))

    @property
    def disc_angle(self) -> float:
        """Half the angle under which the contact disc is seen from the centre of the flat face [rad]."""
        return float(np.arccos(np.clip(self.distance / self.radius, 0.0, 1.0)))


def contact_axes(theta: float, phi: float) -> Array:
    """Axes of the contact frame in F as columns, R_X(theta) R_Z(-phi) [0 1 0; 0 0 1; 1 0 0], [Nakashima] Eq. (17)."""
    c, s, C, S = np.cos(theta), np.sin(theta), np.cos(phi), np.sin(phi)
    return np.array([[0.0, C, S], [-s, -c * S, c * C], [c, -s * S, s * C]])


def contact_turn(indentation: Indentation) -> Array:
    """How the material at the contact has turned in F, shape (3, 3).

    R(Theta, Phi) R_Z(-dpsi) R(theta, phi)^T with theta = Theta + dtheta, phi = Phi + dphi, Eq. (15): the place (theta,
    phi) of the undeformed tip is now at (Theta, Phi). dpsi is the turn of the finger against the object about the
    outward normal, so that the contact, which stays with the object, has turned by -dpsi in F.
    """
    Theta, Phi = indentation.angles
    dtheta, dphi, dpsi = indentation.shear
    c, s = np.cos(dpsi), np.sin(dpsi)
    twist = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return contact_axes(Theta, Phi) @ twist @ contact_axes(Theta + dtheta, Phi + dphi).T


def deformed(indentation: Indentation, sphere: Array) -> Array:
    """Where points of the tip's surface have moved.

    Args:
        indentation: how the tip is deformed.
        sphere: places on the undeformed tip as unit vectors in F, shape (n, 3).

    Returns:
        Their places in F [m], shape (n, 3).
    """
    r, R = indentation.radius, indentation.distance
    near = _nearness(indentation, sphere)
    bulge = 4.0 * near * (1.0 - near) * _bulge_height(indentation)
    follow = near * np.minimum(_elevation(sphere) / _BONDED, 1.0)  # the rim holds even where the disc reaches it
    weight = follow**2 * (3.0 - 2.0 * follow)  # level at both ends, so that no crease is seen
    points = (r + bulge)[:, None] * _turned(contact_turn(indentation), weight, sphere)
    points[:, 0] = np.maximum(points[:, 0], 0.0)
    normal = contact_axes(*indentation.angles)[:, 2]
    height = points @ normal
    beyond = height > R
    points[beyond] *= (R / height[beyond])[:, None]
    return points


def material_axes(indentation: Indentation) -> Array:
    """Contact frame at the place of the undeformed tip that is the contact's centre now."""
    (Theta, Phi), (dtheta, dphi, _) = indentation.angles, indentation.shear
    return contact_axes(Theta + dtheta, Phi + dphi)


def _elevation(sphere: Array) -> Array:
    """Angle of points above the flat face [rad]."""
    return np.arcsin(np.clip(sphere[:, 0], 0.0, 1.0))


def _nearness(indentation: Indentation, sphere: Array) -> Array:
    """How near each point is to the contact: 1 in the contact disc, 0 at the rim."""
    centre = material_axes(indentation)[:, 2]
    to_disc = np.arccos(np.clip(sphere @ centre, -1.0, 1.0)) - indentation.disc_angle
    to_rim = _elevation(sphere)
    return to_rim / (to_rim + np.maximum(to_disc, 0.0) + 1e-12)


def _bulge_height(indentation: Indentation) -> float:
    """Height of the bulge that holds the volume of the cap that the face cuts off [m]."""
    r, dr = indentation.radius, indentation.radius - indentation.distance
    if dr <= 0.0:
        return 0.0
    near = _nearness(indentation, _EVEN)
    area = 2.0 * np.pi * r * r / len(_EVEN)
    cap = np.pi * dr * dr * (3.0 * r - dr) / 3.0
    return float(cap / max(area * np.sum(4.0 * near * (1.0 - near)), 0.5 * r * r))


def _even_points(count: int = 400) -> Array:
    """Points spread evenly over the half sphere, on a spiral."""
    x = (np.arange(count) + 0.5) / count
    angle = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count)
    flat = np.sqrt(1.0 - x * x)
    return np.stack([x, flat * np.cos(angle), flat * np.sin(angle)], axis=-1)


_EVEN = _even_points()


def _turned(turn: Array, share: Array, vectors: Array) -> Array:
    """Vectors turned about the axis of a rotation, each by a share of its angle [Rodrigues]."""
    twice = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    sine = 0.5 * float(np.linalg.norm(twice))
    angle = share * np.arctan2(sine, 0.5 * (np.trace(turn) - 1.0))
    if sine < 1e-12:
        return vectors.copy()
    axis = twice / (2.0 * sine)
    along = (vectors @ axis)[:, None] * axis
    return along + np.cos(angle)[:, None] * (vectors - along) + np.sin(angle)[:, None] * np.cross(axis, vectors)
