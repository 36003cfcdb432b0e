"""A contact patch: motion or load in, force, slipped share and energy out, with a history."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from softhand.errors import SofthandError
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.patch.disc import disc
from softhand.patch.partial_slip import (
    FORCE,
    LEADING,
    LOST,
    RESULTS,
    STORED,
    SWEEPS,
    carry,
    load,
    slipped_share,
    use_of,
)
from softhand.patch.pressure import power_shares

HERTZ = 2.0
"""Exponent k of Hertz's pressure (1 - (rho / a)^k)^(1/k)."""
MOST = 0.995
"""Share of what friction holds up to which a load is followed."""
_AT_LIMIT = 0.01  # how far below its limit a column still counts as one that slips


@dataclass(frozen=True, eq=False)
class PatchState(Record):
    """A patch after one step.

    Attributes:
        force: f_x, f_y [N], tau [N m] on the object, shape (3,).
        displacement: x, y [m], spin [rad] of the tip over the object, shape (3,).
        slipped: share of the pressed area whose columns are at their limit, within 1 %.
        use: of what friction holds: how much the load took that was asked for, or the force that there is.
        stored: elastic energy [J].
        lost: to slip since the start [J].
    """

    units: ClassVar = {
        "force": "N, N, N m", "displacement": "m, m, rad", "slipped": "1", "use": "1", "stored": "J", "lost": "J",
    }  # fmt: skip

    force: Array
    displacement: Array
    slipped: float
    use: float
    stored: float
    lost: float


class Patch:
    """The contact of a soft tip with a rigid face as columns on an elastic half-space that stick or slip one by one.

    Quasi-static. The normal pressure is given and not changed by friction, as Cattaneo and Mindlin have it; the columns
    stay where they are on the tip, so that rolling carries none of them out of the contact. Each column holds mu p dA.
    The columns move each other as a half-space does, see `Disc.compliance`; what gives way behind the contact is in
    series and changes nothing here. A step goes straight, and its loss is of second order in it: follow turns in steps.
    Sign and axes are those of a fingertip law in surface coordinates: the force on the object has the sign of the
    displacement of the tip.

    Args:
        reach: the largest contact radius that is to come [m]; the grid of columns is so large, a smaller contact has
            fewer of them.
        G: shear modulus of the tip [N/m^2].
        nu: its Poisson's ratio.
        friction: mu.
        rings: how many rings there are over the reach.
        sectors: how many columns a ring has.

    Raises:
        SofthandError: a number is out of range.
    """

    def __init__(
        self, reach: float, G: float, nu: float = 0.5, friction: float = 0.5, rings: int = 12, sectors: int = 12
    ) -> None:
        for name, value, unit in (("reach", reach, "m"), ("G", G, "N/m^2"), ("friction", friction, "1")):
            if not 0.0 < value < math.inf:
                raise SofthandError(f"Patch: {name} is {value:g}; it must be above 0 [{unit}].")
        if not 0.0 <= nu <= 0.5:
            raise SofthandError(f"Patch: nu is {nu:g}; Poisson's ratio is from 0 to 0.5.")
        if not (3 <= rings <= 40 and 6 <= sectors <= 40):
            raise SofthandError(f"Patch: {rings} rings of {sectors} columns; 3 to 40 rings of 6 to 40 can be used.")
        grid = disc(rings, sectors)
        self.edges = reach * grid.edges
        """Radii of the rings [m], shape (rings + 1,)."""
        self.points = reach * grid.points
        """Centres of the columns [m], ring by ring, shape (N, 2)."""
        self.areas = reach * reach * np.pi * grid.areas
        """[m^2], shape (N,)."""
        self.friction = friction
        self.limits = np.zeros(len(self.points))
        """mu p dA of each column [N], shape (N,)."""
        self._reach, self._sectors = reach, sectors
        self._C = grid.compliance(nu) / (G * reach)
        self._stiffness = stuck_stiffness(self.points, self._C, rings)
        self._history = np.zeros(LEADING + 4 * len(self.points))
        self._scratch = np.zeros(4 * len(self.points))
        self._results = np.zeros(RESULTS)
        self._lost = 0.0

    def press(self, normal: float, radius: float, pressure: float | ArrayLike = HERTZ) -> None:
        """Press with a normal force over a contact radius from the next step on.

        Args:
            normal: f_z [N]; none or a pull holds nothing.
            radius: a [m], at most the reach.
            pressure: k of (1 - (rho / a)^k)^(1/k); or the share of each ring, shape (rings,).

        Raises:
            SofthandError: the contact is larger than the reach, or a number is none.
        """
        if not (math.isfinite(normal) and 0.0 <= radius <= self._reach * (1.0 + 1e-9)):
            raise SofthandError(
                f"Patch: a force of {normal:g} N over a radius of {radius:g} m; the radius is from 0 to the reach, "
                f"{self._reach:g} m."
            )
        if normal <= 0.0 or radius == 0.0:
            self.limits[:] = 0.0
            return
        shares = np.asarray(pressure, dtype=float)
        if shares.ndim == 0:
            if not 0.0 < float(shares) < math.inf:
                raise SofthandError(f"Patch: the exponent of the pressure is {float(shares):g}; it must be above 0.")
            shares = power_shares(self.edges / radius, float(shares))
        if shares.shape != (len(self.edges) - 1,):
            raise SofthandError(f"Patch: shares of shape {shares.shape}; one for each of {len(self.edges) - 1} rings.")
        self.limits[:] = np.repeat(self.friction * normal / self._sectors * shares, self._sectors)

    def move(self, x: float, y: float, spin: float) -> PatchState:
        """Carry the tip to a displacement [m, m, rad] over the object, counted from where the history began."""
        self._history[:3] = _numbers("displacement", x, y, spin)
        carry(self.points, self._C, self.limits, self._history, self._scratch, self._results)
        return self._state(use_of(self.points, self.limits, self._results[:3]))

    def load(self, f_x: float, f_y: float, tau: float) -> PatchState:
        """Let the tip go to where it transmits a load [N, N, N m].

        What takes more than `MOST` of what friction holds is cut to that, in proportion; `use` tells.
        """
        wanted = _numbers("load", f_x, f_y, tau)
        use = use_of(self.points, self.limits, wanted)
        pressed = np.count_nonzero(self.limits[:: self._sectors])
        if pressed == 0:
            carry(self.points, self._C, self.limits, self._history, self._scratch, self._results)
        else:
            within = wanted * min(1.0, MOST / use) if use > 0.0 else wanted
            load(
                self.points, self._C, self.limits, self._stiffness[pressed - 1], within, self._history, self._scratch,
                self._results,
            )  # fmt: skip
        return self._state(use)

    def _state(self, use: float) -> PatchState:
        results = self._results
        if results[SWEEPS] == 0:
            raise SofthandError(
                f"Patch: no forces of the columns were found at {self._history[:3]}; take shorter steps."
            )
        self._lost += float(results[LOST])
        slipped = slipped_share(self.areas, self.limits, self._history, _AT_LIMIT) if use < MOST else 1.0
        return PatchState(
            results[FORCE : FORCE + 3].copy(),
            self._history[:3].copy(),
            slipped,
            use,
            float(results[STORED]),
            self._lost,
        )

    @property
    def forces(self) -> Array:
        """Force of each column on the object [N], shape (N, 2)."""
        return self._history[LEADING + 2 * len(self.points) :].reshape(-1, 2).copy()

    @property
    def slips(self) -> Array:
        """How far each column has slipped [m], shape (N, 2); of one that does not press, where it goes along."""
        return self._history[LEADING : LEADING + 2 * len(self.points)].reshape(-1, 2).copy()

    def save(self) -> Array:
        """All that what comes depends on: displacement, slip and force of each column, the loss so far."""
        return np.append(self._history, self._lost)

    def restore(self, saved: ArrayLike) -> None:
        """Go on from what `save` gave; the pressure is set by the next `press`."""
        values = np.asarray(saved, dtype=float)
        if values.shape != (len(self._history) + 1,):
            raise SofthandError(
                f"Patch: a history of shape {values.shape}; this patch has {(len(self._history) + 1,)}: "
                "restore into one of as many rings and sectors."
            )
        self._history[:], self._lost = values[:-1], float(values[-1])


def _numbers(what: str, *values: float) -> Array:
    found = np.array(values, dtype=float)
    if not np.all(np.isfinite(found)):
        raise SofthandError(f"Patch: a {what} of {found.tolist()}; all three must be numbers.")
    return found


def stuck_stiffness(points: Array, C: Array, rings: int) -> Array:
    """Stiffness against shear [N/m] and spin [N m/rad] of the first so many rings, stuck, shape (rings, 2)."""
    sectors, stiffness = len(points) // rings, np.zeros((rings, 2))
    motion = np.zeros((len(C), 2))
    motion[0::2, 0], motion[0::2, 1], motion[1::2, 1] = 1.0, -points[:, 1], points[:, 0]
    for ring in range(rings):
        size = 2 * sectors * (ring + 1)
        held = np.linalg.solve(C[:size, :size], motion[:size])
        stiffness[ring] = np.sum(motion[:size] * held, axis=0)
    return stiffness
