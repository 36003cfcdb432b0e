"""How the pose of the object answers to what is asked for: bandwidth along and about each axis, on the linear loop."""

from __future__ import annotations

import numpy as np

from softhand.margins.loop import Loop
from softhand.margins.place import Place
from softhand.numerics.arrays import Array
from softhand.numerics.rotations import set_rotation, set_rpy
from softhand.numerics.spatial import cross_matrix

_SHIFT, _TURN = 1e-6, 1e-6  # [m], [rad]
_LOWEST, _COUNT = 0.02, 400  # [Hz], frequencies up to that of Nyquist
_DOWN = np.sqrt(0.5)


def push_of_pose(place: Place) -> Array:
    """Torques by the pose that is asked for, in axes of the object that is asked for [N/.., N m/..], shape (n, 6)."""
    at = place.situation()
    seen = at.probe.seen(at.state, at.state.time).copy()
    position, rpy = seen.object_position_desired.copy(), seen.object_rpy_desired.copy()
    R, turned, angles = np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    set_rotation(rpy, R)
    columns = []
    for k in range(6):
        told = []
        for sign in (1.0, -1.0):
            axis = np.eye(3)[k % 3]
            shift = R @ axis * (sign * _SHIFT if k < 3 else 0.0)
            turned[...] = R @ (np.eye(3) + cross_matrix(axis) * sign * _TURN) if k >= 3 else R
            set_rpy(turned, angles)
            seen.object_coordinates_desired[...] = np.concatenate([position + shift, angles])
            told.append(np.asarray(place.controller.torque(seen, at.memory)[0]))
        columns.append((told[0] - told[1]) / (2.0 * (_SHIFT if k < 3 else _TURN)))
    return np.column_stack(columns)


def answer(loop: Loop, push: Array, frequencies: Array) -> Array:
    """Object along and about its axes by what is asked for along and about the same, complex, shape (frequencies, 6).

    Args:
        loop: at the place.
        push: of `push_of_pose`.
        frequencies: [Hz], below that of Nyquist.
    """
    size, s, nv = len(loop.step), len(loop.A), loop.moving
    into = np.zeros((size, 6))
    into[:s] = loop.B @ push
    values, ways = np.linalg.eig(loop.step)
    left = np.linalg.solve(ways, into.astype(complex))
    right = ways[nv - 6 : nv]
    z = np.exp(2j * np.pi * frequencies * loop.period)
    return np.asarray(np.einsum("kj,fj,jk->fk", right, 1.0 / (z[:, None] - values), left))


def bandwidths(loop: Loop, push: Array) -> Array:
    """Frequency at which the answer along and about each axis falls below 71 % [Hz], shape (6,)."""
    frequencies = np.geomspace(_LOWEST, 0.49 / loop.period, _COUNT)
    size = np.abs(answer(loop, push, frequencies))
    found = np.empty(6)
    for k in range(6):
        below = np.flatnonzero(size[:, k] < _DOWN)
        if not len(below):
            found[k] = frequencies[-1]
            continue
        i = int(below[0])
        if i == 0:
            found[k] = frequencies[0]
            continue
        share = (size[i - 1, k] - _DOWN) / (size[i - 1, k] - size[i, k])
        found[k] = frequencies[i - 1] * (frequencies[i] / frequencies[i - 1]) ** share
    return found
