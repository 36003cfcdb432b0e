"""How things in space are put on paper."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patches import FancyArrowPatch
from numpy.typing import ArrayLike

from softhand.numerics.arrays import Array
from softhand.numerics.spatial import upright

_SHORTEST = 0.8  # [mm] of an arrow


class View(NamedTuple):
    """Unit vectors to the right, upwards and to the eye, in the world, and the middle of what is looked at [mm]."""

    right: Array
    up: Array
    eye: Array
    middle: Array

    def flat(self, points: Array) -> Array:
        """Points of the world [mm] on the paper, shape (..., 2)."""
        return points @ np.stack([self.right, self.up], axis=1)

    def depth(self, points: Array) -> float:
        """Where points of the world [mm] lie on the way to the eye: a zorder from 1 to 9."""
        return 5.0 + 4.0 * math.tanh(float(np.mean(np.atleast_2d(points - self.middle) @ self.eye)) / 60.0)


def view_from(azimuth: float, elevation: float, gravity: ArrayLike, middle: Array) -> View:
    """How a place [mm] looks from a side [deg], with gravity downwards, whatever it is in the world."""
    a, e = math.radians(azimuth), math.radians(elevation)
    right = np.array([-math.sin(a), math.cos(a), 0.0])
    eye = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
    turn = upright(gravity)
    return View(right @ turn, np.cross(eye, right) @ turn, eye @ turn, middle)


def name_axis(axis: Axis, direction: Array, otherwise: str) -> None:
    """Label an axis of the paper by that of the world which it shows, if it shows one."""
    k = int(np.argmax(np.abs(direction)))
    if abs(direction[k]) < 1.0 - 1e-9:
        axis.set_label_text(f"{otherwise} [mm]")
        return
    axis.set_label_text(f"{'xyz'[k]} [mm]")
    if direction[k] < 0.0:
        axis.set_major_formatter(lambda value, _: f"{0.0 - value:g}".replace("-", "\N{MINUS SIGN}"))


def draw_arrow(axes: Axes, start: Array, end: Array, color: str) -> None:
    """From one point of the paper to another; none for next to nothing."""
    if np.linalg.norm(end - start) < _SHORTEST:
        return
    axes.add_patch(FancyArrowPatch(tuple(start), tuple(end), arrowstyle="-|>", mutation_scale=9.0, lw=1.6, color=color,
                                   shrinkA=0.0, shrinkB=0.0, zorder=11.0))  # fmt: skip
