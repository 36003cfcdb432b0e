"""Bristles: LuGre and elasto-plastic friction of a contact with spin, coupled by the ellipse; to compare with."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from softhand.errors import SofthandError
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.triples import dot, length, moved, times_number

_SHORT = 0.002  # of the limit: change of the load within one step
_BRIM = 0.9999  # share of the limit up to which a load is followed


class BristleState(NamedTuple):
    """Bristles after a step."""

    force: Array
    """f_x, f_y [N], tau [N m] on the object, shape (3,)."""
    displacement: Array
    """x, y [m], spin [rad] of the tip over the object, shape (3,)."""
    slip: Array
    """The part of it that does not come back when the load goes, shape (3,)."""


class Bristles:
    """Averaged bristles z between two surfaces that move with v, all in (x, y, l w) with the lever l of the spin:

        s = sigma_0 z,   z' = v - alpha(z, v) |v| sigma_0 z / (mu f_z)

    In steady sliding s = mu f_z v / |v|, on the ellipse of force and torsion and along its normal. alpha = 1 is LuGre
    (Canudas de Wit, Olsson, Astrom, Lischinsky 1995) without its terms of speed, thus Dahl's: below the limit it slips
    a little whenever the load changes, and under one that goes to and fro it drifts. alpha of the elasto-plastic model
    (Dupont, Hayward, Armstrong, Altpeter 2002) is 0 below a share b of the limit and where the bristles are let go,

        alpha = (1 + sin(pi (|s| / (mu f_z) - (1 + b) / 2) / (1 - b))) / 2   between b and 1,

    so that nothing is lost there. Coupled by a limit surface as by Waltersson and Karayiannidis (arXiv 2308.01123).

    Args:
        stiffness: sigma_0 [N/m].
        limit: mu f_z [N].
        lever: l = tau_max / (mu f_z) [m].
        breakaway: b, from 0 to below 1; None is LuGre.

    Raises:
        SofthandError: a number is out of range.
    """

    def __init__(self, stiffness: float, limit: float, lever: float, breakaway: float | None = None) -> None:
        if not 0.0 < stiffness < math.inf:
            raise SofthandError(f"Bristles: stiffness is {stiffness:g}; it must be above 0 [N/m].")
        if breakaway is not None and not 0.0 <= breakaway < 1.0:
            raise SofthandError(f"Bristles: breakaway is {breakaway:g}; it is from 0 to below 1, a share of the limit.")
        self._stiffness = stiffness
        self._scale = np.ones(3)
        self._z = self._x = (0.0, 0.0, 0.0)
        self.press(limit, lever)
        self._breakaway = -1.0 if breakaway is None else breakaway

    def press(self, limit: float, lever: float) -> None:
        """Another limit mu f_z [N] and lever [m] from the next step on; bristles and displacement stay as they are.

        Raises:
            SofthandError: a number is not above 0.
        """
        for name, value, unit in (("limit", limit, "N"), ("lever", lever, "m")):
            if not 0.0 < value < math.inf:
                raise SofthandError(f"Bristles: {name} is {value:g}; it must be above 0 [{unit}].")
        ratio = lever / float(self._scale[2])
        self._limit, self._scale = limit, np.array([1.0, 1.0, lever])
        # the spin counts by the lever
        self._z, self._x = (*self._z[:2], ratio * self._z[2]), (*self._x[:2], ratio * self._x[2])

    def move(self, x: float, y: float, spin: float) -> BristleState:
        """Carry the tip straight to a displacement [m, m, rad], counted from where the history began.

        Raises:
            SofthandError: it is none.
        """
        wanted = np.array([x, y, spin]) * self._scale
        if not np.all(np.isfinite(wanted)):
            raise SofthandError(f"Bristles: a displacement of {[x, y, spin]}; all three must be numbers.")
        way = wanted - self._x
        count = max(1, math.ceil(self._stiffness * float(np.linalg.norm(way)) / (_SHORT * self._limit)))
        step = _triple(way / count)
        for _ in range(count):
            self._z = _carried(self._z, step, self._stiffness / self._limit, self._breakaway)
        self._x = _triple(wanted)
        return self._state()

    def load(self, f_x: float, f_y: float, tau: float) -> BristleState:
        """Let the load go straight to another one within the limit [N, N, N m].

        Raises:
            SofthandError: the load is not below the limit.
        """
        wanted = np.array([f_x, f_y, tau]) / self._scale
        use = float(np.linalg.norm(wanted)) / self._limit
        if not use < _BRIM:
            raise SofthandError(f"Bristles: a load of {use:.4g} of the limit; only what is below it can be held.")
        way = wanted / self._stiffness - self._z
        count = max(1, math.ceil(self._stiffness * float(np.linalg.norm(way)) / (_SHORT * self._limit)))
        step = _triple(way / count)
        for _ in range(count):
            slip = _slip_under(self._z, step, self._stiffness / self._limit, self._breakaway)
            self._z = moved(self._z, 1.0, step)
            self._x = moved(moved(self._x, 1.0, step), 1.0, slip)
        return self._state()

    def _state(self) -> BristleState:
        z, x = np.array(self._z), np.array(self._x)
        return BristleState(self._stiffness * z * self._scale, x / self._scale, (x - z) / self._scale)


def _triple(values: ArrayLike) -> tuple[float, float, float]:
    x, y, w = np.asarray(values).tolist()
    return x, y, w


@compiled
def _alpha(w, v, breakaway):
    """How much of the bristles at w, over their limit, slips where the surfaces move by v."""
    if breakaway < 0.0:
        return 1.0
    size = length(w)
    if size <= breakaway or dot(w, v) <= 0.0:
        return 0.0
    if size >= 1.0:
        return 1.0
    return 0.5 + 0.5 * math.sin(math.pi * (size - 0.5 * (1.0 + breakaway)) / (1.0 - breakaway))


@compiled
def _carried(z, step, per_limit, breakaway):
    """z after a straight step of the surfaces; exact for the alpha in the middle of it."""
    rate = _alpha(times_number(per_limit, moved(z, 0.5, step)), step, breakaway) * length(step) * per_limit
    if rate == 0.0:
        return moved(z, 1.0, step)
    left = math.exp(-rate)
    return moved(times_number(left, z), (1.0 - left) / rate, step)


@compiled
def _slip_under(z, step, per_limit, breakaway):
    """v - z' over a straight step of z.

    v = z' + alpha |v| w with w = z over its limit: (1 - alpha^2 w^2) |v|^2 - 2 alpha (z' w) |v| - z'^2 = 0.
    """
    w = times_number(per_limit, moved(z, 0.5, step))
    alpha = _alpha(w, step, breakaway)
    along = alpha * dot(w, step)
    rest = 1.0 - alpha * alpha * dot(w, w)
    speed = (along + math.sqrt(along * along + rest * dot(step, step))) / rest
    return times_number(alpha * speed, w)
