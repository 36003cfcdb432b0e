"""A box that fits between opposing fingertips, and where it lies."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from softhand.assistant.fingers import TipOnBody
from softhand.assistant.opposition import Opposition
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of

_DENSITY = 700.0  # [kg/m^3], of wood
_LIGHTEST, _HEAVIEST = 0.02, 0.2  # [kg]
_LEVEL = 1e-6
_HANGING = 5e-3  # [m] by which the centre of mass is below the line between two tips


@dataclass(frozen=True, eq=False)
class Block:
    """A box at its place, and where the tips touch it.

    Attributes:
        size: along its axes [m], shape (3,); the tips touch the faces +x and -x.
        mass: [kg].
        position: of its middle in the world [m], shape (3,).
        rpy: roll, pitch, yaw of its axes [rad].
        points: of contact in its axes [m], shape (tips, 3).
        hand_rpy: how the hand is turned, so that two tips hold it level [rad].
    """

    size: tuple[float, float, float]
    mass: float
    position: Array
    rpy: tuple[float, float, float]
    points: Array
    hand_rpy: tuple[float, float, float]

    def urdf(self, name: str) -> str:
        """The text of its URDF."""
        x, y, z = self.size
        moments = [self.mass / 12.0 * (a * a + b * b) for a, b in ((y, z), (x, z), (x, y))]
        shape = f'<geometry><box size="{x:g} {y:g} {z:g}"/></geometry>'
        return f"""<?xml version="1.0"?>
<!-- A solid box of {1e3 * x:g} x {1e3 * y:g} x {1e3 * z:g} mm; its origin is in the middle. -->
<robot name="{name}">
  <link name="{name}">
    <inertial>
      <mass value="{self.mass:g}"/>
      <inertia ixx="{moments[0]:.6e}" ixy="0" ixz="0" iyy="{moments[1]:.6e}" iyz="0" izz="{moments[2]:.6e}"/>
    </inertial>
    <visual>{shape}<material name="{name}"><color rgba="0.85 0.65 0.35 1"/></material></visual>
    <collision>{shape}</collision>
  </link>
</robot>
"""


def fit_block(opposition: Opposition, tips: list[TipOnBody], margin: float) -> Block:
    """The box between tips.

    Args:
        opposition: of them.
        tips: those that touch, in its order.
        margin: of the faces around the contacts, over the largest radius of a tip.
    """
    sides, count = opposition.sides, len(opposition.sides.fingers)
    turned = (0.0, 0.0, 0.0)
    if count == 2 and abs(opposition.normal[2]) > _LEVEL:
        turned = tuple(np.round(pin.rpy.matrixToRpy(_to_level(opposition.normal)), 6) + 0.0)
    R_hand = rotation_of(turned)
    u, centres = R_hand @ opposition.normal, opposition.tips.centres @ R_hand.T
    axes, rpy = _axes(u, level=count == 2)
    along = centres @ axes
    rim = margin * max(tip.radius for tip in tips)
    low, high = along[:, 1:].min(axis=0), along[:, 1:].max(axis=0)
    if count == 2:  # they meet on one line, above the middle
        low = high = along[:, 1:].mean(axis=0)
    extent = high - low + 2.0 * rim
    middle = 0.5 * (low + high)
    if count == 2:
        extent[1] += 2.0 * _HANGING
        middle[1] -= _HANGING
    width = round(float(opposition.width), 5)
    size = (width, *(math.ceil(1e3 * value - 1e-6) / 1e3 for value in extent))
    position = axes @ np.array([0.5 * sum(opposition.planes), *middle])
    points = np.column_stack([0.5 * width * sides.signs, along[:, 1:] - middle])
    if count == 2:
        points[:, 1:] = 0.0, _HANGING
    volume = float(np.prod(size))
    mass = round(min(max(_DENSITY * volume, _LIGHTEST), _HEAVIEST), 3)
    return Block(size, mass, np.round(position, 6) + 0.0, rpy, np.round(points, 6) + 0.0, turned)


def _to_level(normal: Array) -> Array:
    """The least rotation that makes a normal level."""
    flat = np.array([normal[0], normal[1], 0.0])
    size = float(np.linalg.norm(flat))
    flat = flat / size if size > 1e-3 else np.array([1.0, 0.0, 0.0])
    axis = np.cross(normal, flat)
    sine, cosine = float(np.linalg.norm(axis)), float(normal @ flat)
    return np.asarray(pin.exp3(math.atan2(sine, cosine) * axis / max(sine, 1e-12)))


def _axes(u: Array, level: bool) -> tuple[Array, tuple[float, float, float]]:
    """Axes of the box with x along u and z up as far as can be, and their roll, pitch, yaw."""
    yaw = math.atan2(u[1], u[0])
    pitch = 0.0 if level else -math.asin(float(np.clip(u[2], -1.0, 1.0)))
    rpy = (0.0, round(pitch, 6) + 0.0, round(yaw, 6) + 0.0)
    return rotation_of(rpy), rpy
