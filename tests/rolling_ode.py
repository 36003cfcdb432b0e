"""A rigid body that rolls on a plane without slip, integrated by itself: what soft supports must come near to."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

from softhand.numerics.arrays import Array


@dataclass(frozen=True)
class Rolling:
    """With r from the centre of mass to the point that touches, v = -w x r, and the force F of the plane at it

        m v' = F + m g,   (I w)' = r x F

    Attributes:
        lowest: the point of the body that is farthest out along a direction, both in its own axes [m].
        mass: [kg].
        inertia: about its axes [kg m^2], shape (3,).
        normal: of the plane, shape (3,).
        gravity: [m/s^2], shape (3,).
    """

    lowest: Callable[[Array], Array]
    mass: float
    inertia: Array
    normal: Array
    gravity: Array

    def arm(self, rotation: Array) -> Array:
        """r, in the world."""
        return np.asarray(rotation @ self.lowest(-rotation.T @ self.normal))

    def accelerations(self, rotation: Array, spin: Array) -> tuple[Array, Array]:
        """v' and w'."""
        step = 1e-6
        r = self.arm(rotation)
        ahead, behind = (self.arm(pin.exp3(sign * step * spin) @ rotation) for sign in (1.0, -1.0))
        r_rate = (ahead - behind) / (2.0 * step)
        inertia = rotation @ np.diag(self.inertia) @ rotation.T
        about_point = inertia + self.mass * (r @ r * np.eye(3) - np.outer(r, r))
        turning = np.cross(spin, inertia @ spin) + self.mass * np.cross(r, np.cross(spin, r_rate) + self.gravity)
        spin_rate = np.linalg.solve(about_point, -turning)
        return -np.cross(spin_rate, r) - np.cross(spin, r_rate), spin_rate

    def force(self, rotation: Array, spin: Array) -> Array:
        """F [N]."""
        return np.asarray(self.mass * (self.accelerations(rotation, spin)[0] - self.gravity))

    def after(self, duration: float, position: Array, rotation: Array, spin: Array) -> tuple[Array, Array]:
        """Position and rotation some time [s] later."""

        def rates(_: float, y: Array) -> Array:
            R, w = y[3:12].reshape(3, 3), y[12:]
            return np.concatenate([-np.cross(w, self.arm(R)), (pin.skew(w) @ R).ravel(), self.accelerations(R, w)[1]])

        start = np.concatenate([position, rotation.ravel(), spin])
        y = solve_ivp(rates, (0.0, duration), start, rtol=1e-10, atol=1e-12).y[:, -1]
        return y[:3], y[3:12].reshape(3, 3)
