"""What a camera in the flat face of a tip sees: markers on the skin that move, and how far the skin is pushed in."""

from __future__ import annotations

import math

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.rotations import turn_rotation
from softhand.tactile.tip_shape import Indentation, contact_axes, deformed


def indentation_of(radius: float, deformation: Array, is_surface: bool, contact: Array, tip: Array) -> Indentation:
    """How a tip is deformed, from what an observation has of it.

    A law in surface coordinates has turned the material by the vector (s2 / R, -s1 / R, -psi) in the contact frame;
    that is dtheta, dphi, dpsi of the same turn.

    Args:
        radius: r [m].
        deformation: dr and its three others, in the coordinates of the law, shape (4,).
        is_surface: whether these are s1, s2, psi.
        contact: axes of the contact frame in the world, shape (3, 3).
        tip: axes of F in the world, shape (3, 3).
    """
    distance, in_F = radius - float(deformation[0]), tip.T @ contact
    Theta, Phi = _angles(in_F[:, 2])
    if not is_surface:
        a, b, c = (float(value) for value in deformation[1:])
        return Indentation(radius, distance, (Theta, Phi), (a, b, c))
    s1, s2, psi = deformation[1:]
    turned = np.empty((3, 3))
    turn_rotation(s2 / distance, -s1 / distance, -psi, np.ascontiguousarray(in_F.T), turned)
    turn = in_F @ turned
    theta, phi = _angles(turn.T @ in_F[:, 2])
    theta = Theta + math.remainder(theta - Theta, 2.0 * math.pi)
    twist = contact_axes(Theta, Phi).T @ turn @ contact_axes(theta, phi)
    return Indentation(radius, distance, (Theta, Phi), (theta - Theta, phi - Phi, math.atan2(twist[0, 1], twist[0, 0])))


def seen_markers(indentation: Indentation, places: Array) -> Array:
    """How far markers move in the picture, along y and z of F [m], shape (n, 2).

    Args:
        indentation: of the tip.
        places: of the markers on the undeformed tip, unit vectors in F, shape (n, 3).
    """
    moved = deformed(indentation, places) - indentation.radius * places
    return np.asarray(moved[:, 1:])


def seen_depth(indentation: Indentation, pixels: int) -> Array:
    """How far the skin is pushed towards the flat face by the tangent plane of the object, along x of F [m].

    Args:
        indentation: of the tip.
        pixels: rows and columns; columns go along y of F from -r to r, rows along z.

    Returns:
        Shape (pixels, pixels); 0 outside of the tip.
    """
    r, (Theta, Phi) = indentation.radius, indentation.angles
    middle = r * ((np.arange(pixels) + 0.5) * 2.0 / pixels - 1.0)
    y, z = np.meshgrid(middle, middle)
    free = np.sqrt(np.maximum(r * r - y * y - z * z, 0.0))
    normal = contact_axes(Theta, Phi)[:, 2]
    if normal[0] <= 1e-6:
        return np.where(y * normal[1] + z * normal[2] > indentation.distance, free, 0.0)
    plane = (indentation.distance - normal[1] * y - normal[2] * z) / normal[0]
    return np.clip(free - np.maximum(plane, 0.0), 0.0, free)


def _angles(direction: Array) -> tuple[float, float]:
    """Theta, Phi of a direction in F, (14)."""
    x, y, z = (float(part) for part in direction)
    return math.atan2(z, y), math.atan2(x, math.hypot(y, z))
