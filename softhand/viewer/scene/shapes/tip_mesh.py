"""The surface of a soft tip and the net drawn on it, as vertices that follow its deformation."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.numerics.arrays import Array
from softhand.tactile.tip_shape import Indentation, deformed, material_axes
from softhand.viewer.scene.shapes.mesh import Faces, grid_faces

_SPOKES = 48
_DISC_RINGS = 6
_SIDE_RINGS = 14
_FINE = 33  # vertices along a line of the net
_MERIDIANS, _PARALLELS = 12, (0.35, 0.7, 1.05)  # [rad] above the flat face


def tip_faces() -> Faces:
    """Triangles of `tip_surface`, the same for every deformation: rings around the contact, then the flat face."""
    rings = _DISC_RINGS + _SIDE_RINGS
    side = grid_faces(rings, _SPOKES)[:, ::-1]
    last = (rings - 1) * _SPOKES
    k = np.arange(_SPOKES)
    flat = np.stack([last + (k + 1) % _SPOKES, last + k, np.full(_SPOKES, rings * _SPOKES)], axis=-1)
    return np.concatenate([side, flat]).astype(np.int32)


def tip_surface(indentation: Indentation) -> Array:
    """Vertices of the closed surface of a tip in F [m], shape (n, 3), for the triangles of `tip_faces`.

    The rings lie around the contact, the edge of the contact disc on one of them; the last ring is the rim.
    """
    axes = material_axes(indentation)
    spoke = np.linspace(0.0, 2.0 * np.pi, _SPOKES, endpoint=False)
    outward = np.cos(spoke)[:, None] * axes[:, 0] + np.sin(spoke)[:, None] * axes[:, 1]
    rim = np.arctan2(axes[0, 2], -outward[:, 0])  # where the great circle along a spoke meets the flat face
    edge = np.minimum(indentation.disc_angle, rim)
    inside = np.linspace(0.0, 1.0, _DISC_RINGS)[:, None] * edge
    beside = edge + np.linspace(0.0, 1.0, _SIDE_RINGS + 1)[1:, None] * (rim - edge)
    angle = np.concatenate([inside, beside])[..., None]
    sphere = np.cos(angle) * axes[:, 2] + np.sin(angle) * outward
    sphere[-1, :, 0] = 0.0
    points = deformed(indentation, sphere.reshape(-1, 3))
    return np.concatenate([points, np.zeros((1, 3))])


def net_segments() -> NDArray[np.int32]:
    """Segments of `tip_net`, shape (m, 2)."""
    lines = _MERIDIANS + len(_PARALLELS)
    first = np.arange(lines)[:, None] * _FINE + np.arange(_FINE - 1)
    return np.stack([first, first + 1], axis=-1).reshape(-1, 2).astype(np.int32)


def tip_net(indentation: Indentation) -> Array:
    """Meridians and parallels drawn on the material of the tip, in F [m]: they show shear and twist, shape (n, 3)."""
    return 1.004 * deformed(indentation, _NET)


def _net() -> Array:
    up = np.linspace(0.0, 0.5 * np.pi, _FINE)
    around = np.linspace(0.0, 2.0 * np.pi, _FINE)
    lines = [_on_sphere(theta, up) for theta in np.linspace(0.0, 2.0 * np.pi, _MERIDIANS, endpoint=False)]
    lines += [_on_sphere(around, np.full(_FINE, phi)) for phi in _PARALLELS]
    return np.concatenate(lines)


def _on_sphere(theta: ArrayLike, phi: ArrayLike) -> Array:
    """Unit vectors at the angles (theta, phi) of F, Eq. (14), shape (n, 3)."""
    return np.stack(np.broadcast_arrays(np.sin(phi), np.cos(theta) * np.cos(phi), np.sin(theta) * np.cos(phi)), axis=-1)


_NET = _net()
