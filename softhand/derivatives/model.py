"""One control period of a plant as a function of what it begins with: state, torques, a wrench on the object."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.unmodelled import must_slip_as_a_whole
from softhand.closed_loop.linearize import is_memory
from softhand.derivatives.period import Moves, run_moves
from softhand.model.configuration import ADDITIVE, CONTINUOUS
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import Array
from softhand.numerics.compiled import compiled
from softhand.numerics.layouts import Layouts
from softhand.numerics.straight import put
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.simulation.pushes import Push, PushTable, push_table
from softhand.steppers.kernels import MIDPOINT, mechanics_of
from softhand.steppers.stepper import Stepper
from softhand.steppers.straight_steps import straight_start, straight_steps

ROOM = 512
"""Periods in one call."""


class PeriodModel:
    """The end of a control period beside one state.

    Attributes:
        plant: with compiled terms.
        remembered: row and column of the numbers of z that belong to x, shape (nz, 2).
        n_states: numbers of x.
        mechanics: what a step works with.
        moves: where the periods begin and end.
        count: how many there are, shape (1,).
        layouts: of all arrays.

    Args:
        plant: as the attribute.
        stepper: and its kind in `steppers.kernels`.
        steps: in a period.
        state: unmoved, at its time.
        torque: held there [N m, N], shape (n,).
        pushes: of the scenario.
        straight: whether straight code is made for the steps, which pays for many periods.
    """

    def __init__(
        self,
        plant: Plant,
        stepper: tuple[Stepper, int],
        steps: int,
        state: State,
        torque: Array,
        pushes: Sequence[Push],
        straight: bool,
    ) -> None:
        self.plant = plant
        must_slip_as_a_whole("A linear model", plant.fingertips)
        self.remembered = remembered_in(plant)
        nq, nv, n = plant.world.nq, plant.world.nv, plant.world.n_joints
        self.n_states = 2 * nv + len(self.remembered)
        self.mechanics = mechanics_of(plant, state.copy(), np.zeros(n))
        live = plant.contacts.view(np.int64)
        live[:] = 0
        self.count = np.zeros(1, np.int64)
        self.moves = Moves(
            kind=stepper[1],
            step=stepper[0].step,
            steps=steps,
            time=np.array([state.time], dtype=float),
            base=state.copy().arrays,
            torque=np.array(torque, dtype=float),
            contacts=live.copy(),
            live=live,
            remembered=self.remembered,
            along=np.zeros(nv),
            pushes=_with_wrench(plant, pushes),
            start=np.zeros((1, 2), np.int64),
            entry=np.full(ROOM, -1, np.int64),
            amount=np.zeros(ROOM),
            ends=np.zeros((ROOM, nq + nv + len(self.remembered))),
            sides=np.zeros((ROOM, 1 + steps, len(plant.contacts)), np.int64),
        )
        self.layouts = layouts = Layouts()
        self._codes: list[Addressed | None] = []
        if straight and stepper[1] == MIDPOINT:
            self._codes += straight_steps(self.mechanics, stepper[0].step, layouts)
            self._codes.append(put(straight_start(self.mechanics, stepper[0].step, layouts), self.moves.start[0]))
        self._run = addressed(run_moves, self.mechanics, self.moves, self.count, layouts=layouts)

    def put(self, state: State, torque: Array) -> None:
        """Beside another state, at its time, with other torques."""
        base = self.moves.base
        base.q[:], base.v[:], base.z[:] = state.q, state.v, state.z
        self.moves.time[0], self.moves.torque[:] = state.time, torque

    def ends(
        self, index: NDArray[np.int64], amount: Array, shares: Array | None = None
    ) -> tuple[Array, NDArray[np.int64]]:
        """Where periods end that begin with one entry moved, and the sides of the switches that they saw.

        Args:
            index: entry of (q, v, z, u, wrench), or -1, shape (k,).
            amount: by how much, shape (k,).
            shares: of their shear that all tips that may slip let go before, shape (k,); none if not given.

        Returns:
            q, v and z, shape (k, nq + nv + nz), and bits, shape (k, (1 + steps) nc).
        """
        return self.rows(self._run, self.moves.ends, self.moves.sides, index, amount, shares)

    def rows(
        self,
        run: Addressed,
        values: Array,
        sides: NDArray[np.int64],
        index: NDArray[np.int64],
        amount: Array,
        shares: Array | None,
    ) -> tuple[Array, NDArray[np.int64]]:
        """What a compiled loop over the moves writes, as `ends`.

        Args:
            run: the loop.
            values: where it writes, a row a move.
            sides: likewise.
            index: as in `ends`, like all that follow.
            amount: likewise.
            shares: likewise.
        """
        if shares is not None and np.any(shares != 0.0):
            return self._after_letting_go(run, values, sides, index, amount, shares)
        found, seen = [], []
        for first in range(0, len(index), ROOM):
            count = min(ROOM, len(index) - first)
            self.moves.entry[:count] = index[first : first + count]
            self.moves.amount[:count] = amount[first : first + count]
            self.count[0] = count
            run()
            found.append(values[:count].copy())
            seen.append(sides[:count].reshape(count, -1).copy())
        return np.concatenate(found), np.concatenate(seen)

    def _after_letting_go(
        self,
        run: Addressed,
        values: Array,
        sides: NDArray[np.int64],
        index: NDArray[np.int64],
        amount: Array,
        shares: Array,
    ) -> tuple[Array, NDArray[np.int64]]:
        """One by one, each from a z of its own."""
        z = self.moves.base.z
        held, found = z.copy(), []
        for k, share in enumerate(shares):
            z[:] = less_shear(self.plant, held, share)
            found.append(self.rows(run, values, sides, index[k : k + 1], amount[k : k + 1], None))
        z[:] = held
        return np.concatenate([rows for rows, _ in found]), np.concatenate([seen for _, seen in found])

    def inertias(self) -> Array:
        """Diagonal of the mass matrix where the last period ended, shape (nv,)."""
        return np.diag(self.plant.snapshot.terms.M).copy()


def remembered_in(plant: Plant) -> NDArray[np.int64]:
    """Row and column of the numbers of z that belong to x: three of each contact, then what relaxation remembers."""
    stored = np.broadcast_to(np.arange(plant.n_memory) < 3, (len(plant.contacts), plant.n_memory))
    rows: NDArray[np.int64] = np.concatenate([np.argwhere(stored), np.argwhere(is_memory(plant) & ~stored)])
    return rows.astype(np.int64)


def less_shear(plant: Plant, z: Array, share: float) -> Array:
    """z whose contacts that may slip have let go a share of what they store."""
    less = z.copy()
    less[plant.pads["can_slip"] > 0, :3] *= 1.0 - share
    return less


def beyond(plant: Plant, ends: Array, base: Array) -> Array:
    """x of some ends in the tangent space of another.

    Args:
        plant: of both.
        ends: rows of `PeriodModel.ends`, shape (k, nq + nv + nz).
        base: one of them.

    Returns:
        Joints, then translation and rotation vector of the object in its own axes at the base, rates, z, shape (k, s).
    """
    nq, nv = plant.world.nq, plant.world.nv
    x = np.empty((len(ends), nv + ends.shape[1] - nq))
    displacements(plant.joints, ends, base, x)
    return x


@compiled
def displacements(joints, ends, base, x):
    """As `beyond`, into the rows of x."""
    nv = x.shape[1]
    for k in range(joints.shape[0]):
        kind, i, j = joints[k, 0], joints[k, 1], joints[k, 2]
        for row in range(ends.shape[0]):
            end = ends[row]
            if kind == ADDITIVE:
                x[row, j] = end[i] - base[i]
            elif kind == CONTINUOUS:
                c, s = end[i], end[i + 1]
                x[row, j] = math.atan2(base[i] * s - base[i + 1] * c, base[i] * c + base[i + 1] * s)
            else:
                _pose_beyond(end[i : i + 7], base[i : i + 7], x[row, j : j + 6])
    first, last = 0, 0
    for k in range(joints.shape[0]):
        size = 1 if joints[k, 0] == ADDITIVE else 2 if joints[k, 0] == CONTINUOUS else 7
        first, last = max(first, joints[k, 1] + size), max(last, joints[k, 2] + (6 if size == 7 else 1))
    for row in range(ends.shape[0]):
        for k in range(nv - last):
            x[row, last + k] = ends[row, first + k] - base[first + k]


@compiled
def _pose_beyond(pose, base, out):
    """R^T (p - p_base) and the rotation vector of R_base^T R."""
    x, y, z, w = base[3], base[4], base[5], base[6]
    a, b, c = pose[0] - base[0], pose[1] - base[1], pose[2] - base[2]
    tx, ty, tz = 2.0 * (z * b - y * c), 2.0 * (x * c - z * a), 2.0 * (y * a - x * b)
    out[0], out[1], out[2] = a + w * tx + z * ty - y * tz, b + w * ty + x * tz - z * tx, c + w * tz + y * tx - x * ty
    u, v, t, s = pose[3], pose[4], pose[5], pose[6]
    vx, vy, vz = w * u - x * s - y * t + z * v, w * v - y * s - z * u + x * t, w * t - z * s - x * v + y * u
    scalar = w * s + x * u + y * v + z * t
    length = math.sqrt(vx * vx + vy * vy + vz * vz)
    share = 2.0
    if length > 0.0:
        share = math.copysign(2.0 * math.atan2(length, abs(scalar)) / length, scalar)
    out[3], out[4], out[5] = share * vx, share * vy, share * vz


def _with_wrench(plant: Plant, pushes: Sequence[Push]) -> PushTable:
    """The pushes of the scenario, and one more for the wrench."""
    return push_table(plant, [*pushes, Push()])
