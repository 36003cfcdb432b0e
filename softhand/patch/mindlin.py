"""Cattaneo, Mindlin and Lubkin: a ball pressed on a face and pushed across it or spun, in closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import ellipe, ellipk

from softhand.numerics.arrays import Array


@dataclass(frozen=True)
class CattaneoMindlin:
    """An elastic ball on a rigid face under a constant normal force and a shear that grows, returns and grows again.

        Q_0 = mu P,   D = 3 (2 - nu) mu P / (16 G a),   c = a (1 - Q / Q_0)^(1/3)
        loading:    x = D {1 - (1 - Q / Q_0)^(2/3)}
        unloading:  x = D {2 (1 - (Q* - Q) / (2 Q_0))^(2/3) - (1 - Q* / Q_0)^(2/3) - 1}   from the turn at Q*

    Cattaneo 1938, Mindlin 1949, Mindlin and Deresiewicz 1953; K. L. Johnson, Contact Mechanics, 7.2 and 7.4. Exact for
    nu = 0, where the force of each place is along the shear; else nearly so, as theirs.

    Attributes:
        friction: mu.
        normal: P [N].
        radius: a [m].
        G: shear modulus of the ball [N/m^2].
        nu: its Poisson's ratio.
    """

    friction: float
    normal: float
    radius: float
    G: float
    nu: float = 0.0

    @property
    def most(self) -> float:
        """Q_0, the shear at which all slips [N]."""
        return self.friction * self.normal

    @property
    def reach(self) -> float:
        """D, the displacement at which all slips [m]."""
        return 3.0 * (2.0 - self.nu) * self.most / (16.0 * self.G * self.radius)

    def stick_radius(self, shear: ArrayLike) -> Array:
        """c, within which the ball sticks, at first loading [m]."""
        return self.radius * np.cbrt(1.0 - np.asarray(shear) / self.most)

    def spin(self, stick_radius: ArrayLike) -> Array:
        """The spin at which the ball sticks within c, without shear [rad]; it has no bound as c goes to 0.

            3 mu P / (4 pi G a^2) {K(k) - E(k)},   k^2 = 1 - (c / a)^2          Lubkin 1951

        with K and E the complete elliptic integrals.
        """
        m = 1.0 - (np.asarray(stick_radius) / self.radius) ** 2
        scale = 3.0 * self.most / (4.0 * np.pi * self.G * self.radius**2)
        return scale * np.asarray(ellipk(m) - ellipe(m))

    def loading(self, shear: ArrayLike) -> Array:
        """x at first loading [m]."""
        return self.reach * (1.0 - (1.0 - np.asarray(shear) / self.most) ** (2.0 / 3.0))

    def unloading(self, shear: ArrayLike, turn: float) -> Array:
        """x on the way back from the shear `turn`, down to -turn [m]."""
        back = 2.0 * (1.0 - (turn - np.asarray(shear)) / (2.0 * self.most)) ** (2.0 / 3.0)
        return self.reach * (back - (1.0 - turn / self.most) ** (2.0 / 3.0) - 1.0)

    def loss(self, turn: float) -> float:
        """Energy lost in a cycle between -turn and turn [J].

        (24 / 5) Q_0 D {1 - (1 - q)^(5/3) - (5 q / 6) (1 + (1 - q)^(2/3))},   q = turn / Q_0
        """
        q = turn / self.most
        left = 1.0 - q
        bracket = 1.0 - left ** (5.0 / 3.0) - 5.0 / 6.0 * q * (1.0 + left ** (2.0 / 3.0))
        return 4.8 * self.most * self.reach * bracket
