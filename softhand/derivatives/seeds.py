"""Derivatives of the numbers of a state by the entries of x, which those of all else begin with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.model.configuration import ADDITIVE, CONTINUOUS, coordinate_rate
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled


def put_seeds(
    joints: AnyArray,
    remembered: NDArray[np.int64],
    width: int,
    rows: tuple[int, ...],
    D: Array,
    spans: NDArray[np.int64],
) -> None:
    """What does not depend on the state: of v and z; and which seeds each row may depend on.

    Args:
        joints: as `World.joints`.
        remembered: row and column of the numbers of z that belong to x.
        width: numbers of a row of z.
        rows: where those of q, v and z begin, and where those of z end.
        D: set, a column an entry of x.
        spans: set, begin and end of the columns of each row that may be there.
    """
    q, v, z, end = rows
    nv = z - v
    for kind, i, j in joints:
        spans[q + i] = j, j + 1
        if kind == CONTINUOUS:
            spans[q + i + 1] = j, j + 1
        elif kind != ADDITIVE:
            spans[q + i : q + i + 3] = j, j + 3
            spans[q + i + 3 : q + i + 7] = j + 3, j + 6
    spans[z:end] = 0
    for k in range(nv):
        D[v + k, nv + k], spans[v + k] = 1.0, (nv + k, nv + k + 1)
    for k, (row, column) in enumerate(remembered.tolist()):
        place = z + row * width + column
        D[place, 2 * nv + k], spans[place] = 1.0, (2 * nv + k, 2 * nv + k + 1)


@compiled
def seed_configuration(joints, q, first, D, spans, along, rate):
    """Derivatives of q by the displacements; `along` and `rate` are scratch, shape (nv,) and (nq,)."""
    for j in range(along.shape[0]):
        along[:] = 0.0
        along[j] = 1.0
        coordinate_rate(joints, q, along, rate)
        for i in range(rate.shape[0]):
            if spans[first + i, 0] <= j < spans[first + i, 1]:
                D[first + i, j] = rate[i]
