"""What is kept of each run: which variables of a recording, and how often."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import prod

import numpy as np
from numpy.typing import NDArray

from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray, Array
from softhand.plant.plant import Plant
from softhand.recording.variables import COMMANDED, MEASURED_PREFIX, VARIABLES
from softhand.sensing.fields import RECORDED, Sizes, beginnings, room, shapes
from softhand.sensing.instruments import MEASURED
from softhand.settings.wording import nearest
from softhand.simulation.finishing import finished, measured_in

_OF_JOINTS = ("joint_limited", "coupled_position")
"""Told from the joint positions."""
_DRIVE = ("joint_torque", "torque_limited", "external_force")


@dataclass(frozen=True)
class Keep:
    """Variables of `recording.variables`, and the control periods between two samples."""

    variables: tuple[str, ...]
    every: int

    @classmethod
    def all(cls) -> Keep:
        """All variables, each control period."""
        return cls(tuple(name for name in VARIABLES if name != "time"), 1)

    @classmethod
    def of(cls, variables: Iterable[str], every: float, period: float) -> Keep:
        """As a user asks for it.

        Args:
            variables: names.
            every: time between two samples [s], a whole number of control periods.
            period: control period [s].

        Raises:
            ScenarioError: there is no such variable, or no such number of periods.
        """
        names = tuple(dict.fromkeys(variables))
        for name in names:
            if name not in VARIABLES or name == "time":
                near = nearest(str(name), VARIABLES)
                raise ScenarioError(
                    f"variables: {name!r} is no variable of a recording{f'; did you mean {near!r}?' if near else ''} "
                    f"There are: {', '.join(list(VARIABLES)[1:])}.",
                    key="variables", value=name,
                )  # fmt: skip
        periods = round(every / period) if np.isfinite(every) else 0
        if periods < 1 or abs(periods * period - every) > 1e-9 * period:
            raise ScenarioError(
                f"every: got {every:g} s; it must be a whole number of control periods of {period:g} s, at least one.",
                key="every", value=every,
            )  # fmt: skip
        return cls(names, periods)

    @property
    def fields(self) -> list[str]:
        """Of an observation, in their order."""
        wanted = {"joint_position" if name in _OF_JOINTS else name for name in self.variables}
        return [name for name in RECORDED if name in wanted]

    def samples(self, periods: int) -> int:
        """Of a run of so many control periods."""
        return periods // self.every + 1

    @property
    def measured(self) -> list[str]:
        """Fields of what the controller sees, in their order."""
        return [name for name in MEASURED if MEASURED_PREFIX + name in self.variables]

    @property
    def commanded(self) -> list[str]:
        """Of the commands, what is kept."""
        return [name for name in COMMANDED.values() if name in self.variables]

    def segments(self, sizes: Sizes) -> NDArray[np.int64]:
        """Begin and size of each field in the block of an observation, shape (fields, 2).

        Behind it stand those that are measured, in the block of what the controller sees, and the commands.
        """
        begins, every, size = beginnings(sizes), shapes(sizes), room(sizes)
        rows = [(begins[name], prod(every[name])) for name in self.fields]
        rows += [(size + begins[name], prod(every[name])) for name in self.measured]
        rows += [(2 * size, sizes.n)] * len(self.commanded)
        return np.array(rows, dtype=np.int64).reshape(-1, 2)

    def width(self, sizes: Sizes, nv: int) -> int:
        """Numbers of a row of the compiled loop."""
        return 1 + int(self.segments(sizes)[:, 1].sum()) + 2 * sizes.n + nv

    def variables_of(self, rows: Array, sizes: Sizes, plant: Plant) -> dict[str, AnyArray]:
        """The variables of a run from the rows of the compiled loop, and `time`."""
        found: dict[str, AnyArray] = {"time": rows[:, 0]}
        measured: dict[str, AnyArray] = {}
        end = 1
        for into, names in ((found, self.fields), (measured, self.measured), (found, self.commanded)):
            for name in names:
                shape = (sizes.n,) if name in self.commanded else shapes(sizes)[name]
                into[name] = rows[:, end : end + prod(shape)].reshape(len(rows), *shape)
                end += prod(shape)
        for name, size in zip(_DRIVE, (sizes.n, sizes.n, rows.shape[1] - end - 2 * sizes.n), strict=True):
            found[name] = rows[:, end : end + size]
            end += size
        found = finished(found, plant, {}) | measured_in(measured, plant, {})
        return {name: found[name] for name in ("time", *self.variables) if name in found}
