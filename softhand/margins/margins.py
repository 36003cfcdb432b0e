"""How far a loop is from where it is lost: delay, control period, gains, torques."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

from softhand.margins.delay import LONGEST, delay_margin
from softhand.margins.gains import GainMargin, JointMargin, gain_margin, joint_margins, numeric_settings
from softhand.margins.loop import Loop
from softhand.margins.period import largest_period
from softhand.margins.place import Place
from softhand.numerics.record import Record


@dataclass(frozen=True, eq=False)
class Margins(Record):
    """How far single things may change before some motion grows.

    Attributes:
        delay: between sample and torque, beyond what the loop has [s]; NaN for a loop that is not stable, infinite if
            40 control periods do no harm.
        period: the longest control period up to which no motion grows [s]; of a loop that is not stable the longest
            below its own; NaN if none is known, infinite if 200 times as long does no harm.
        gains: of each numeric setting of the controller.
        joints: of the torques.
        now: the control period [s].
    """

    units: ClassVar = {"delay": "s", "period": "s", "now": "s"}

    delay: float
    period: float
    gains: tuple[GainMargin, ...]
    joints: tuple[JointMargin, ...]
    now: float

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        rows = [("delay until some motion grows", self._delay()), ("longest control period", self._period())]
        rows += [(f"controller.{one.name} times", f"{one.factors}  (now {_shown(one.value)})") for one in self.gains]
        if all(math.isnan(one.factors.low) for one in self.joints):
            return [*rows, ("torques times", f"{self.joints[0].factors}, of any joint or all")]
        for one in self.joints:
            disk = "" if math.isnan(one.disk) else f"; {one.gain:.3g} and {one.phase:.0f} deg late at once"
            rows.append((f"torque of {one.joint} times", f"{one.factors}{disk}"))
        return rows

    def _delay(self) -> str:
        if math.isnan(self.delay):
            return "some motion grows without"
        if math.isinf(self.delay):
            return f"beyond {LONGEST} control periods"
        return f"{1e3 * self.delay:.4g} ms  ({self.delay / self.now:.3g} control periods)"

    def _period(self) -> str:
        if math.isnan(self.period):
            return "none found: some motion grows with 1/200 of it"
        if math.isinf(self.period):
            return "beyond 200 times that of now"
        return f"{1e3 * self.period:.4g} ms  (now {1e3 * self.now:g} ms)"


def find_margins(loop: Loop, place: Place, progress: Callable[[float], None] | None = None) -> Margins:
    """All margins of a loop.

    Args:
        loop: at the place.
        place: where.
        progress: called with the share that is done.
    """
    names = list(numeric_settings(place))
    tell = progress or (lambda done: None)
    total = len(names) + 2.0
    delay = delay_margin(loop, place)
    tell(1.0 / total)
    period = largest_period(place)
    tell(2.0 / total)
    gains = []
    for k, name in enumerate(names):
        gains.append(gain_margin(loop, place, name))
        tell((k + 3.0) / total)
    return Margins(delay, period, tuple(gains), joint_margins(loop), place.period)


def _shown(value: Any) -> str:
    return f"[{', '.join(f'{one:g}' for one in value)}]" if isinstance(value, tuple | list) else f"{value:g}"
