"""Links that are fixed together as one rigid body, from the text of the URDF alone."""

from __future__ import annotations

import math
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np

from softhand.model.urdf.document import Element
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.tree import Joint
from softhand.numerics.arrays import Array


class Part(NamedTuple):
    """A link with mass in the frame of the first link of its rigid body."""

    name: str
    element: Element
    mass: float
    centre: Array
    inertia: Array


def parts_of(links: list[Element], names: list[str], carriers: dict[str, Joint]) -> list[Part]:
    """The links of a rigid body that have a mass and a positive definite inertia.

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
        xx, xy, xz, yy, yz, zz = values
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if not np.linalg.eigvalsh(matrix)[0] > 0.0:
            continue
        rotation, position = poses[name]
        turned, moved = _origin(inertial.find("origin"))
        axes = rotation @ turned
        parts.append(Part(name, element, weight[0], position + rotation @ moved, axes @ matrix @ axes.T))
    return parts


def _numbers(element: ElementTree.Element | None, *names: str) -> list[float] | None:
    found = [numbers_of(element, name, "nan") for name in names] if isinstance(element, Element) else []
    values = [value[0] for value in found if value]
    return values if len(values) == len(names) and np.isfinite(values).all() else None


def _origin(element: ElementTree.Element | None) -> tuple[Array, Array]:
    """Axes and position of an <origin>; at home where it cannot be read, which is told elsewhere."""
    roll, pitch, yaw = numbers_of(element, "rpy", "0 0 0") or [0.0, 0.0, 0.0]
    return _turn(2, yaw) @ _turn(1, pitch) @ _turn(0, roll), np.array(numbers_of(element, "xyz", "0 0 0") or [0.0] * 3)


def _turn(axis: int, angle: float) -> Array:
    matrix, (j, k) = np.eye(3), ((axis + 1) % 3, (axis + 2) % 3)
    matrix[j, j] = matrix[k, k] = math.cos(angle)
    matrix[k, j], matrix[j, k] = math.sin(angle), -math.sin(angle)
    return matrix


def _spread(arm: Array) -> Array:
    """Inertia of a unit mass at an arm."""
    return np.asarray(arm @ arm * np.eye(3) - np.outer(arm, arm))


def inertia_of(parts: list[Part]) -> Array:
    """Inertia of all parts together about their common centre of mass [kg m^2], shape (3, 3)."""
    centre = sum(part.mass * part.centre for part in parts) / sum(part.mass for part in parts)
    return np.asarray(sum(part.inertia + part.mass * _spread(part.centre - centre) for part in parts))


def breaks_triangle(matrix: Array, rounding: float) -> bool:
    """Whether one principal moment exceeds the sum of the others by more than a share of it."""
    principal = np.linalg.eigvalsh(matrix)
    return bool(principal[2] - principal[0] - principal[1] > rounding * principal[2])
