"""Links that are fixed together as one rigid body, from the text of the URDF alone."""

from __future__ import annotations

from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from softhand.model.urdf.document import Element
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.tree import Joint
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of

_SMALLEST = 1e-18  # [kg m^2], a millimetre and a microgram
_SINGULAR = 1e-12  # of the largest moment
_THIN = 1e-3  # of the largest eigenvalue of the integral of x x^T: a body 3 % as thick as it is long
_SHORT = 1e-3  # [m] radius of gyration of the smallest body along an axis


class Part(NamedTuple):
    """A link with mass in the frame of the first link of its rigid body."""

    name: str
    element: Element
    mass: float
    centre: Array
    inertia: Array


def parts_of(links: list[Element], names: list[str], carriers: dict[str, Joint]) -> list[Part]:
    """The links of a rigid body that have a mass and an inertia that can be read.

    Args:
        links: elements of the links, the leader first.
        names: of the links.
        carriers: joint that carries each link.
    """
    poses: dict[str, tuple[Array, Array]] = {names[0]: (np.eye(3), np.zeros(3))}
    parts = []
    for name, link in zip(names, links, strict=True):
        if name not in poses:
            rotation, position = poses[carriers[name].parent]
            turned, moved = _origin(carriers[name].element.find("origin"))
            poses[name] = rotation @ turned, position + rotation @ moved
        inertial = link.find("inertial")
        element, mass = (None, None) if inertial is None else (inertial.find("inertia"), inertial.find("mass"))
        values = _numbers(element, "ixx", "ixy", "ixz", "iyy", "iyz", "izz")
        weight = _numbers(mass, "value")
        if inertial is None or not isinstance(element, Element) or values is None or weight is None or weight[0] <= 0.0:
            continue
        matrix = tensor_of(values)
        rotation, position = poses[name]
        turned, moved = _origin(inertial.find("origin"))
        axes = rotation @ turned
        parts.append(Part(name, element, weight[0], position + rotation @ moved, axes @ matrix @ axes.T))
    return parts


def tensor_of(values: list[float]) -> Array:
    """The matrix of ixx, ixy, ixz, iyy, iyz, izz, shape (3, 3)."""
    xx, xy, xz, yy, yz, zz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_of(parts: list[Part]) -> Array:
    """Inertia of all parts together about their common centre of mass [kg m^2], shape (3, 3)."""
    centre = sum(part.mass * part.centre for part in parts) / sum(part.mass for part in parts)
    return np.asarray(sum(part.inertia + part.mass * _spread(part.centre - centre) for part in parts))


def moments_of(inertia: Array) -> Array:
    """Its principal moments [kg m^2], the least first, shape (3,)."""
    return np.asarray(np.linalg.eigvalsh(inertia), dtype=float)


def is_positive(principal: Array) -> bool:
    """Whether principal moments [kg m^2], the least first, are those of a body, and not of a point or a rod."""
    return bool(principal[0] > _zero(principal))


def has_negative(principal: Array) -> bool:
    """Whether principal moments [kg m^2], the least first, are those of nothing at all."""
    return bool(principal[0] < -_zero(principal))


def breaks_triangle(principal: Array, rounding: float) -> bool:
    """Whether one of the principal moments, the least first, exceeds the others together by more than a share of it."""
    return bool(principal[2] - principal[0] - principal[1] > rounding * principal[2])


def balanced(inertia: Array, mass: float) -> Array:
    """The nearest inertia that a body of some thickness can have [kg m^2], shape (3, 3).

    An inertia I is that of a body if S = tr(I) / 2 - I, the integral of x x^T over its mass, is positive definite: that
    is the triangle inequality of all three moments, and with it they are > 0. The eigenvalues of S that are below 1e-3
    of its largest one, or below that of a body of 1 mm, are raised to it, which is the nearest such S in the Frobenius
    norm; the axes stay.

    Args:
        inertia: about the centre of mass [kg m^2], shape (3, 3).
        mass: [kg].
    """
    values, axes = np.linalg.eigh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    spread = (axes * np.maximum(values, max(_THIN * float(values[2]), mass * _SHORT**2))) @ axes.T
    spread = 0.5 * (spread + spread.T)
    return np.asarray(np.trace(spread) * np.eye(3) - spread)


def _zero(principal: Array) -> float:
    return max(_SMALLEST, _SINGULAR * float(principal[2]))


def _numbers(element: ElementTree.Element | None, *names: str) -> list[float] | None:
    found = [numbers_of(element, name, "nan") for name in names] if isinstance(element, Element) else []
    values = [value[0] for value in found if value]
    return values if len(values) == len(names) and np.isfinite(values).all() else None


def _origin(element: ElementTree.Element | None) -> tuple[Array, Array]:
    """Axes and position of an <origin>; at home where it cannot be read, which is told elsewhere."""
    rpy = numbers_of(element, "rpy", "0 0 0") or [0.0] * 3
    return rotation_of(rpy), np.array(numbers_of(element, "xyz", "0 0 0") or [0.0] * 3)


def _spread(arm: Array) -> Array:
    """Inertia of a unit mass at an arm."""
    return np.asarray(arm @ arm * np.eye(3) - np.outer(arm, arm))
