"""Designed gains as a result: what the loop does with them, beside what it did before."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from softhand.controllers.controller import Controller
from softhand.margins.modes import Mode
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record


@dataclass(frozen=True, eq=False)
class GainDesign(Record):
    """Gains, and what the loop does with them, at the worst of the poses that were looked at.

    Attributes:
        name: of the controller.
        settings: its gains by name.
        poses: where the loop was looked at, in words.
        wanted: bandwidth that was asked for [Hz].
        wanted_damping: least damping ratio that was asked for [1].
        wanted_delay: between sample and torque, that the loop has to bear [s].
        bandwidth: reached along and about each axis of the object [Hz], shape (6,).
        damping: least damping ratio of the motions of the pose.
        growth: of the slowest motion to die out [1/s].
        delay: at which some motion begins to grow [s].
        limit: what moves in the motion that is the nearest to be lost.
        before: the controller of the scenario.
        growth_before: with it [1/s].
        delay_before: likewise [s]; NaN if some motion grows without.
        modes: at the pose where the slowest motion is.
        modes_before: there, with the controller of the scenario.
        controller: ready to be used.
    """

    units: ClassVar = {
        "wanted": "Hz", "wanted_damping": "1", "wanted_delay": "s", "bandwidth": "Hz", "damping": "1", "growth": "1/s",
        "delay": "s", "growth_before": "1/s", "delay_before": "s",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"controller"})

    name: str
    settings: dict[str, Any]
    poses: tuple[str, ...]
    wanted: float
    wanted_damping: float
    wanted_delay: float
    bandwidth: Array
    damping: float
    growth: float
    delay: float
    limit: str
    before: str
    growth_before: float
    delay_before: float
    modes: tuple[Mode, ...]
    modes_before: tuple[Mode, ...]
    controller: Controller

    header: ClassVar = ("before", "after")

    def rows(self) -> list[tuple[str, str, str]]:
        """Label, value with the controller of the scenario and with the new gains."""
        found = ", ".join(f"{value:.3g}" for value in self.bandwidth)
        return [
            ("controller", self.before, self.name),
            ("slowest motion", f"{self.growth_before:+.3g} 1/s", f"{self.growth:+.3g} 1/s"),
            ("delay until some motion grows", _ms(self.delay_before), _ms(self.delay)),
            ("bandwidth, x y z and turns", "", f"{found} Hz"),
            ("least damping ratio of the pose", "", f"{self.damping:.2g}"),
            ("nearest to be lost", "", self.limit),
        ]

    def toml(self) -> str:
        """The section `[controller]` of a scenario, with these gains."""
        import tomli_w

        return tomli_w.dumps({"controller": {"name": self.name, **self.settings}})

    def __repr__(self) -> str:
        return f"<GainDesign: {self.name}, {np.min(self.bandwidth):.3g} Hz, slowest motion {self.growth:+.3g} 1/s>"


def _ms(seconds: float) -> str:
    if math.isnan(seconds):
        return "some motion grows without"
    return f"{1e3 * seconds:.3g} ms" if math.isfinite(seconds) else "beyond 40 periods"
