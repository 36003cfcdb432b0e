"""The variables of a run on tape, and what derivatives by them are by the numbers of its samples."""

from __future__ import annotations

from collections.abc import Mapping
from math import prod

import numpy as np

from softhand.derivatives.taped_run import TapedRun
from softhand.numerics.arrays import AnyArray, Array
from softhand.sensing.fields import shapes
from softhand.simulation.keep import Keep


class Outputs:
    """Variables of a recording over the samples of a run.

    Attributes:
        time: of the samples [s].

    Args:
        keep: which variables.
        taped: the run, recorded.
    """

    def __init__(self, keep: Keep, taped: TapedRun) -> None:
        self._keep, self._plant = keep, taped.plant
        self._sizes = taped.run.sizes
        self._rows: Array = taped.play.rows
        self.time: Array = self._rows[:, 0].copy()

    def values(self) -> dict[str, AnyArray]:
        """The variables, shape (samples, ...) each."""
        return self._keep.variables_of(self._rows.copy(), self._sizes, self._plant)

    def seed(self, slopes: Mapping[str, Array]) -> Array:
        """Derivatives by the numbers of the rows from those by the variables."""
        seed = np.zeros(self._rows.shape)
        for name, (begin, shape) in self._places().items():
            if name in slopes:
                by = self._by_displacement(slopes[name]) if name == "deformation" else slopes[name]
                seed[:, begin : begin + prod(shape)] += by.reshape(len(seed), -1)
        return seed

    def _places(self) -> dict[str, tuple[int, tuple[int, ...]]]:
        """Where each variable begins in a row, and its shape."""
        found, end = {}, 1
        for name in self._keep.fields:
            shape = shapes(self._sizes)[name]
            found[name] = end, shape
            end += prod(shape)
        n = self._sizes.n
        nv = self._rows.shape[1] - end - 2 * n
        return {**found, "joint_torque": (end, (n,)), "external_force": (end + 2 * n, (nv,))}

    def _by_displacement(self, by: Array) -> Array:
        """Laws in surface coordinates are recorded as the angles s / R, R = r - dr."""
        pads = self._plant.pads[: self._plant.world.n_tips]
        surface = np.flatnonzero(pads["is_surface"])
        if not surface.size:
            return by
        by = by.copy()
        begin, shape = self._places()["deformation"]
        stored = self._rows[:, begin : begin + prod(shape)].reshape(-1, *shape)[:, surface]
        distance = pads["radius"][surface] - stored[..., 0]
        by[:, surface, 0] += np.sum(by[:, surface, 1:3] * stored[..., 1:3], axis=2) / distance**2
        by[:, surface, 1:3] /= distance[..., None]
        return by
