"""Simulated time and the clock on the wall."""

from __future__ import annotations

import time as clock

from softhand.errors import SofthandError

SPEEDS = (1e-4, 1e4)
"""Slowest and fastest."""


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
        SofthandError: it is not within `SPEEDS`. Carries `.value`.
    """
    if not SPEEDS[0] <= speed <= SPEEDS[1]:
        must = f"from {SPEEDS[0]:g} to {SPEEDS[1]:g}, 1 is real time"
        raise SofthandError(f"speed: got {speed:g}; it must be {must}.", value=speed)
    return speed
