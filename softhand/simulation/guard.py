"""What may end a run beside its faults: something that looks at the configuration now and then."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from softhand.errors import SimulationStopped
from softhand.numerics.arrays import Array


class Guard(NamedTuple):
    """Asked in Python at the beginning of every so many control periods, before the step; not by the kernels."""

    look: Callable[[Array], str]
    """Says of a configuration q why the run ends there; "" if it goes on. It has no memory."""
    stride: int
    """Control periods between two looks."""
    reason: str
    """One word, see `SimulationStopped.reason`."""

    def stopped(self, k: int, time: float, q: Array) -> SimulationStopped | None:
        """The error that ends a run in a control period; None if it goes on.

        Args:
            k: number of the period.
            time: of its sample, which is the last one [s].
            q: configuration there, shape (nq,).
        """
        why = self.look(q) if k % self.stride == 0 else ""
        if not why:
            return None
        return SimulationStopped(f"{why} (at t = {time:g} s)", reason=self.reason, time=time)
