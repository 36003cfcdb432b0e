"""One control period of a plant as a function of what it begins with: state, torques, a wrench on the object."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softhand.closed_loop.linearize import is_memory
from softhand.derivatives.period import Moves, run_moves
from softhand.model.configuration import ADDITIVE, CONTINUOUS
from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import Array
from softhand.numerics.layouts import Layouts
from softhand.numerics.spatial import cross_matrix
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
    x[:, nv:] = ends[:, nq:] - base[nq:]
    for kind, i, j in plant.joints:
        if kind == ADDITIVE:
            x[:, j] = ends[:, i] - base[i]
        elif kind == CONTINUOUS:
            c, s = ends[:, i], ends[:, i + 1]
            x[:, j] = np.arctan2(base[i] * s - base[i + 1] * c, base[i] * c + base[i + 1] * s)
        else:
            x[:, j : j + 6] = _pose_beyond(ends[:, i : i + 7], base[i : i + 7])
    return x


def _pose_beyond(poses: Array, base: Array) -> Array:
    """R^T (p - p_base) and the rotation vector of R_base^T R."""
    r, w = base[3:6], base[6]
    by_r = cross_matrix(r)  # a x r = a [r]x for rows a
    moved = poses[:, :3] - base[:3]
    t = 2.0 * moved @ by_r  # of the inverse rotation: r -> -r
    translation = moved + w * t + t @ by_r
    vector = w * poses[:, 3:6] - poses[:, 6:7] * r + poses[:, 3:6] @ by_r
    scalar = w * poses[:, 6] + poses[:, 3:6] @ r
    length = np.linalg.norm(vector, axis=1)
    angle = 2.0 * np.arctan2(length, np.abs(scalar)) * np.where(scalar < 0.0, -1.0, 1.0)
    share = np.where(length > 0.0, angle / np.where(length > 0.0, length, 1.0), 2.0)
    return np.hstack([translation, share[:, None] * vector])


def _with_wrench(plant: Plant, pushes: Sequence[Push]) -> PushTable:
    """The pushes of the scenario, and one more for the wrench."""
    return push_table(plant, [*pushes, Push()])
