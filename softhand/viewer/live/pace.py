"""Simulated time and the clock on the wall."""

from __future__ import annotations

import math
import time as clock

from softhand.errors import SofthandError


class Pace:
    """Holds a simulation back to the time of the clock on the wall, times a speed."""

    def __init__(self, speed: float = 1.0) -> None:
        self._speed = checked_speed(speed)
        self._start: float | None = None

    def wait(self, time: float) -> None:
        """Wait until the simulated time [s] is due; the first call sets the start."""
        now = clock.perf_counter()
        if self._start is None:
            self._start = now - time / self._speed
        delay = self._start + time / self._speed - now
        if delay > 0.0:
            clock.sleep(delay)


def checked_speed(speed: float) -> float:
    """The speed, simulated time over time of the clock.

    Raises:
        SofthandError: it is not above 0. Carries `.value`.
    """
    if not (math.isfinite(speed) and speed > 0.0):
        raise SofthandError(f"speed: got {speed:g}; it must be above 0, 1 is real time.", value=speed)
    return speed
