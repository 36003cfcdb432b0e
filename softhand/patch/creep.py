"""How the limit of a viscoelastic tip grows under a steady force, and shrinks at a steady depth."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm
from scipy.optimize import brentq

from softhand.contact.limit import spin_length
from softhand.contact.records import PAD
from softhand.dampings.damping import Damping
from softhand.errors import SofthandError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.patch.tip import contact_radius

_UPRIGHT = 0.5 * math.pi  # Phi at which the tip is pressed [rad]
_LEANING = math.pi / 3.0  # that of a law in polar coordinates, which has a pole upright


@dataclass(frozen=True, eq=False)
class LimitOverTime(Record):
    """The limit of friction of a tip that is pressed from time 0 on; arrays of shape (times,).

    Attributes:
        time: [s].
        depth: dr [m].
        radius: of the contact [m].
        normal: f_z [N].
        shear: the largest tangential force mu f_z, without torsion [N].
        torsion: the largest torsion kappa mu f_z a, without tangential force [N m].
    """

    units: ClassVar = {
        "time": "s", "depth": "m", "radius": "m", "normal": "N", "shear": "N", "torsion": "N m",
    }  # fmt: skip

    time: Array
    depth: Array
    radius: Array
    normal: Array
    shear: Array
    torsion: Array


def limit_under_force(law: Law, damping: Damping, friction: float, normal: float, time: ArrayLike) -> LimitOverTime:
    """A tip pressed with a steady force from time 0 on: it creeps deeper, so that it holds more torsion.

    Tiezzi and Kao (2007) have the limit surface of a viscoelastic contact grow so. The force F_e of the law and what
    each relaxation remembers are linear in time, whatever the law:

        F_e - sum c_k w_k = f_z,   w_k' = nu_k (F_e - w_k),   w_k(0) = 0

    F_e goes from f_z to f_z / c_0, and the depth is where the law presses with it.

    Args:
        law: of the tip, pressed upright.
        damping: relaxes, as `fung`; dashpots are left out.
        friction: mu.
        normal: f_z [N].
        time: from 0 on [s], shape (times,).

    Raises:
        SofthandError: a number is not positive, or the law cannot press so hard.
    """
    _check(friction, normal, "normal", "N")
    times = _times(time)
    c, nu = _series(damping)
    # w' = A w + nu f_z, from the equations above
    A = nu[:, None] * (np.outer(np.ones(len(c)), c) - np.eye(len(c)))
    rest = -np.linalg.solve(A, nu * normal) if len(c) else np.zeros(0)
    elastic = np.array([normal + c @ (rest - expm(t * A) @ rest) for t in times])
    depth = np.array([depth_of(law, force) for force in elastic])
    return _limits(law, friction, times, depth, np.full_like(times, normal))


def limit_at_depth(law: Law, damping: Damping, friction: float, depth: float, time: ArrayLike) -> LimitOverTime:
    """A tip at a depth [m] from time 0 on: its force relaxes, f_z = F_e (c_0 + sum c_k e^(-nu_k t))."""
    _check(friction, depth, "depth", "m")
    times = _times(time)
    c, nu = _series(damping)
    left = 1.0 - np.sum(c) + np.exp(-np.outer(times, nu)) @ c
    return _limits(law, friction, times, np.full_like(times, depth), left * _press(law, depth))


def depth_of(law: Law, force: float) -> float:
    """dr at which the law presses with a force [m].

    Raises:
        SofthandError: it does not, up to dr = 0.99 r.
    """
    deepest = 0.99 * law.radius
    if not _press(law, deepest) >= force:
        raise SofthandError(
            f"law '{type(law).__name__}': a tip of r = {1e3 * law.radius:g} mm does not press with {force:.4g} N up to "
            f"dr = {1e3 * deepest:.3g} mm; give a smaller force."
        )
    return float(brentq(lambda depth: _press(law, depth) - force, 0.0, deepest, xtol=1e-12 * law.radius, rtol=1e-13))


def _press(law: Law, depth: float) -> float:
    return float(law((depth, 0.0, 0.0, 0.0), _UPRIGHT if law.coordinates == "surface" else _LEANING)[0])


def _series(damping: Damping) -> tuple[Array, Array]:
    pairs = np.array(damping.relaxation() or np.empty((0, 2)), dtype=float)
    return pairs[:, 0], pairs[:, 1]


def _limits(law: Law, friction: float, time: Array, depth: Array, normal: Array) -> LimitOverTime:
    pad = np.zeros(1, PAD)
    pad["radius"], pad["torsion_share"] = law.radius, law.torsion_share or 0.0
    lever = np.array([spin_length(pad[0], law.radius - d) for d in depth])
    radius = np.array([contact_radius(law, d) for d in depth])
    return LimitOverTime(time, depth, radius, normal, friction * normal, friction * normal * lever)


def _times(time: ArrayLike) -> Array:
    times = np.atleast_1d(np.asarray(time, dtype=float))
    if not (times.ndim == 1 and np.all((times >= 0.0) & (times < math.inf))):
        raise SofthandError(f"time is {times.tolist()}; give times from 0 on [s].")
    return times


def _check(friction: float, value: float, name: str, unit: str) -> None:
    for what, number, its in (("friction", friction, "1"), (name, value, unit)):
        if not 0.0 < number < math.inf:
            raise SofthandError(f"{what} is {number:g}; it must be above 0 [{its}].")
