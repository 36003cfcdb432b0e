"""What varies in a study, as the axis of a figure."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

from softhand.numerics.arrays import AnyArray, Array

_BINS, _IN_BIN, _LONGEST = 8, 8, 22


class Varied(NamedTuple):
    """One key of a study, with its value of each run.

    Attributes:
        label: key and unit.
        places: of the runs along the axis: numbers, or which of the names, shape (runs,).
        names: of values that are no numbers.
        is_grid: whether there are few values, each of several runs.
        is_log: whether the axis is logarithmic.
    """

    label: str
    places: Array
    names: tuple[str, ...] = ()
    is_grid: bool = False
    is_log: bool = False

    def groups(self) -> list[tuple[float, AnyArray]]:
        """Runs that stand together: of each value of a grid, or of ranges with as many runs each.

        Returns:
            Where they are along the axis, and which they are, shape (runs,) of booleans.
        """
        if self.is_grid:
            return [(float(value), self.places == value) for value in np.unique(self.places)]
        order = np.argsort(self.places, kind="stable")
        found = []
        for part in np.array_split(order, int(np.clip(len(order) // _IN_BIN, 1, _BINS))):
            which = np.zeros(len(order), dtype=bool)
            which[part] = True
            found.append((float(np.median(self.places[part])), which))
        return found

    def edges(self) -> Array:
        """Of cells along the axis: about each value of a grid, or of even width."""
        values = np.unique(self.places)
        if self.is_grid:
            at = np.log(values) if self.is_log else values
            middles = 0.5 * (at[1:] + at[:-1])
            below, above = (at[1] - at[0], at[-1] - at[-2]) if len(at) > 1 else (1.0, 1.0)
            edges = np.array([at[0] - 0.5 * below, *middles, at[-1] + 0.5 * above])
            return np.exp(edges) if self.is_log else edges
        count = int(np.clip(np.sqrt(len(self.places) / _IN_BIN), 2, _BINS)) + 1
        return np.geomspace(values[0], values[-1], count) if self.is_log else np.linspace(values[0], values[-1], count)

    def prepare(self, axis: Axes, is_x: bool = True) -> None:
        """Label, scale and ticks of an axis."""
        own = axis.xaxis if is_x else axis.yaxis
        (axis.set_xlabel if is_x else axis.set_ylabel)(self.label)
        if self.is_log:
            (axis.set_xscale if is_x else axis.set_yscale)("log")
            own.set_major_locator(LogLocator(subs=(1.0, 2.0, 3.0, 5.0, 7.0)))
            own.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            own.set_minor_formatter(NullFormatter())
        elif not self.names:
            own.set_major_locator(MaxNLocator(5))
        if self.names:
            own.set_ticks(range(len(self.names)), [_cut(name) for name in self.names])
            if is_x:
                axis.tick_params(axis="x", labelrotation=20 if len(self.names) > 2 else 0)


def _cut(name: str) -> str:
    return name if len(name) <= _LONGEST else f"{name[: _LONGEST - 2]} .."
