"""The limit surface of a contact that is not flat: force and moment in all six directions."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

from softhand.errors import SofthandError
from softhand.numerics.arrays import Array
from softhand.patch.pressure import power_shares

_EDGE = 1e-12  # [m/s] below which a place does not slide
_NOTHING = 1e-6  # [W] of a wrench that drives with 1 W, and is then not held at all


@dataclass(frozen=True, eq=False)
class CurvedLimit:
    """The wrenches that friction of a cap holds, about the middle of the contact, z the outward normal of the tip.

    A soft tip on a curved face touches over a cap of radius a, about z = rho^2 / (2 R), R > 0 where the object bulges
    into the tip and R < 0 where it is hollow. As it slides with the twist (v, w), each place drags along the surface,
    against its way:

        h(v, w) = int mu p |t| dA,   t = P (v + w x r),   P = 1 - n n^T
        (f, m) = dh / d(v, w) = int mu p (t / |t|, r x t / |t|) dA

    h is the power lost and the support function of all wrenches that friction can hold (Goyal, Ruina, Papadopoulos
    1991; for area contacts that are not plane, Xu and others, 6DLS, 2021); so the wrench on the object that a twist of
    the tip over it drags along is the one that takes most power of it: its flow is associated. A flat contact has no
    moments about its tangents, and its f_z is 0: it is the limit surface of `contact.limit`. What pressure alone does,
    and how far its centre can go out as the tip rolls, is not in it.

    Attributes:
        places: r of each place [m], shape (N, 3).
        normals: n there, shape (N, 3).
        limits: mu p dA there [N], shape (N,).
    """

    places: Array
    normals: Array
    limits: Array

    @classmethod
    def of(
        cls,
        friction: float,
        normal: float,
        radius: float,
        curvature: float = 0.0,
        exponent: float = 2.0,
        rings: int = 24,
        sectors: int = 48,
    ) -> CurvedLimit:
        """A round contact.

        Args:
            friction: mu.
            normal: f_z, the integral of the pressure [N].
            radius: a [m].
            curvature: 1 / R of the face [1/m], positive where the object bulges into the tip.
            exponent: k of the pressure (1 - (rho / a)^k)^(1/k).
            rings: of the quadrature.
            sectors: of a ring.

        Raises:
            SofthandError: a number is out of range, or the face curves by more than a half ball within the contact.
        """
        for name, value, unit in (("friction", friction, "1"), ("normal", normal, "N"), ("radius", radius, "m")):
            if not 0.0 < value < math.inf:
                raise SofthandError(f"CurvedLimit: {name} is {value:g}; it must be above 0 [{unit}].")
        if not (0.0 < exponent < math.inf and rings > 0 and sectors > 2):
            raise SofthandError(
                f"CurvedLimit: exponent {exponent:g}, {rings} rings, {sectors} sectors; the first must be above 0, and "
                "there must be a ring of at least 3 sectors."
            )
        if not abs(curvature) * radius < 1.0:
            raise SofthandError(
                f"CurvedLimit: a contact of {radius:g} m on a face of curvature {curvature:g} 1/m; their product must "
                "be below 1."
            )
        edges = np.sin(0.5 * math.pi * np.linspace(0.0, 1.0, rings + 1))
        shares = power_shares(edges, exponent) / sectors
        rho = radius * 2.0 / 3.0 * np.diff(edges**3) / np.diff(edges**2)
        angle = 2.0 * math.pi * (np.arange(sectors) + 0.5) / sectors
        x, y = np.outer(rho, np.cos(angle)).ravel(), np.outer(rho, np.sin(angle)).ravel()
        # a ball of radius R through the middle; cos is that of its slope
        cosine = np.sqrt(1.0 - (curvature * np.hypot(x, y)) ** 2)
        z = curvature * (x * x + y * y) / (1.0 + cosine)
        places = np.stack([x, y, z], axis=1)
        normals = np.stack([-curvature * x, -curvature * y, cosine], axis=1)
        # the share is that of f_z, so that the pressure on the slope bears 1 / cos of it
        return cls(places, normals, friction * normal * np.repeat(shares, sectors) / cosine)

    def power(self, twist: ArrayLike) -> float:
        """h, what is lost as the tip slides with (v [m/s], w [rad/s]) over the object [W]; shape (6,)."""
        return float(self.limits @ np.linalg.norm(self._slide(twist), axis=1))

    def wrench(self, twist: ArrayLike) -> Array:
        """(f [N], m [N m]) on the object at the limit, dragged along by a twist of the tip, shape (6,)."""
        t = self._slide(twist)
        drag = (self.limits / np.maximum(np.linalg.norm(t, axis=1), _EDGE))[:, None] * t
        return np.concatenate([np.sum(drag, axis=0), np.sum(np.cross(self.places, drag), axis=0)])

    def _slide(self, twist: ArrayLike) -> Array:
        v, w = np.split(np.asarray(twist, dtype=float), 2)
        moved = v + np.cross(w, self.places)
        return np.asarray(moved - np.sum(moved * self.normals, axis=1)[:, None] * self.normals)

    def use(self, wrench: ArrayLike) -> float:
        """How much of the limit a wrench takes, shape (6,): 1 on it, infinite where friction cannot hold it at all.

        One over the least power of a twist that the wrench drives with 1 W, which is a convex problem.
        """
        scale = self._scale()
        along = scale * np.asarray(wrench, dtype=float)
        size = float(np.linalg.norm(along))
        if size == 0.0:
            return 0.0
        axes = np.linalg.svd(along[None, :] / size)[2]
        start, others = axes[0] * np.sign(axes[0] @ along) / size, axes[1:]

        def lost(y: Array) -> tuple[float, Array]:
            twist = scale * (start + y @ others / size)
            return self.power(twist), others @ (scale * self.wrench(twist)) / size

        found = minimize(lost, np.zeros(5), jac=True, method="BFGS", options={"gtol": 1e-9})
        least = float(found.fun)
        return 1.0 / least if least > _NOTHING else math.inf

    def ellipsoid(self) -> Array:
        """The usual approximation: E of the ellipsoid w^T E^+ w = 1, whose support function is sqrt(t^T E t).

        E_ii = h(e_i)^2 and 4 E_ij = h(e_i + e_j)^2 - h(e_i - e_j)^2, e_i a twist of 1 m/s or of 1 m/s at the rim, so
        that it is exact for these; shape (6, 6), units N and N m.
        """
        scale = self._scale()
        unit = np.diag(scale)
        E = np.zeros((6, 6))
        for i in range(6):
            for j in range(6):
                both, apart = self.power(unit[i] + unit[j]), self.power(unit[i] - unit[j])
                E[i, j] = 0.25 * (both**2 - apart**2) / (scale[i] * scale[j])
        return E

    def _scale(self) -> Array:
        """Twists of 1 m/s: of translation, and of turning at the rim."""
        reach = float(np.max(np.hypot(self.places[:, 0], self.places[:, 1])))
        return np.array([1.0, 1.0, 1.0, 1.0 / reach, 1.0 / reach, 1.0 / reach])
