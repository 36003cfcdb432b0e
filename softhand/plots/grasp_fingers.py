"""The fingers of a grasp on paper, their friction cones and their forces."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, Polygon

from softhand.numerics.arrays import Array
from softhand.plots.view import View, draw_arrow

FORCE = "0.12"
"""Colour of the force on the object."""
_WIDEST = 5.0  # mu of a cone as drawn
_HEIGHT = 0.6  # of the longest arrow: a cone without a force


class ForceScale(NamedTuple):
    """How long arrows are."""

    mm_per_newton: float
    longest: float
    """[mm]"""


class Touch(NamedTuple):
    """One contact: its point [mm], unit vector into the object, mu, and the force on the object [N] or NaN."""

    point: Array
    normal: Array
    friction: float
    force: Array


def draw_finger(axes: Axes, view: View, line: Array, radius: float, color: str) -> None:
    """Links as thick lines, joints as rings, the soft tip in its true size.

    Args:
        axes: where to.
        view: from where.
        line: base, joints and tip in the world [mm], shape (n, 3).
        radius: of the tip [mm].
        color: of the finger.
    """
    flat, orders = view.flat(line), [view.depth(np.array(link)) for link in pairwise(line)]
    for ends, order in zip(pairwise(flat), orders, strict=True):
        link = np.array(ends).T
        axes.plot(*link, color="white", lw=7.0, zorder=order, solid_capstyle="round")
        axes.plot(*link, color=color, lw=5.0, alpha=0.85, zorder=order + 0.01, solid_capstyle="round")
    tip, order = tuple(flat[-1]), view.depth(line[-1])
    axes.add_patch(Circle(tip, radius, fc=color, ec=color, alpha=0.30, lw=0.8, zorder=order + 0.02))
    axes.add_patch(Circle(tip, radius, fc="none", ec=color, lw=0.9, zorder=order + 0.03))
    for joint, before, after in zip(flat[:-1], [orders[0], *orders], orders, strict=False):
        axes.plot(*joint, "o", mfc="white", mec=color, mew=1.2, ms=4.6, zorder=max(before, after) + 0.04)
    axes.plot(*flat[0], "s", color="0.35", ms=6.5, zorder=orders[0] + 0.05)


def draw_touch(axes: Axes, view: View, touch: Touch, scale: ForceScale, color: str) -> None:
    """The friction cone, as high as the normal force, and the force."""
    from scipy.spatial import ConvexHull

    pressing = float(touch.normal @ touch.force)
    is_known = not np.isnan(pressing)
    height = scale.mm_per_newton * pressing if is_known and pressing > 0.0 else _HEIGHT * scale.longest
    base, apex = view.flat(_base(touch, height)), view.flat(touch.point)
    outline = np.vstack([apex, base])
    hull = ConvexHull(outline, qhull_options="QJ")
    axes.add_patch(Polygon(outline[hull.vertices], closed=True, fc=color, ec=color, alpha=0.20, lw=0.5, zorder=9.5))
    axes.plot(*base.T, color=color, lw=0.9, zorder=9.6)
    axes.plot(*apex, "o", color=color, ms=4.0, mec="white", mew=0.6, zorder=11.5)
    if is_known:
        draw_arrow(axes, apex, view.flat(touch.point + scale.mm_per_newton * touch.force), FORCE)


def _base(touch: Touch, height: float) -> Array:
    """The circle at the wide end of a friction cone [mm], shape (n, 3)."""
    first = np.cross(touch.normal, [0.3, 0.5, 0.8])
    first /= np.linalg.norm(first)
    a = np.linspace(0.0, 2.0 * math.pi, 61)[:, None]
    side = np.cos(a) * first + np.sin(a) * np.cross(touch.normal, first)
    circle: Array = touch.point + height * (touch.normal + min(touch.friction, _WIDEST) * side)
    return circle
