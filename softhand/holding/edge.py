"""The edge between pushes along one way that are survived and pushes that are lost."""

from __future__ import annotations

from collections.abc import Callable

from softhand.holding.pushed_run import Trial

NOTHING = "nothing that was tried"
_MORE, _FARTHER = 1.08, 8  # times the edge that a survived push promises, so often
_BELOW, _LESS = 0.93, 0.86  # of what a lost push had borne; of a lost push that tells nothing
_TRIES = 14
_KNOWN = 0.97  # of a push, below which it was lost while it grew

Try = Callable[[float], Trial]
"""Runs a push of a size [N or N m]."""


class Edge:
    """A bracket of the largest push along one way that is survived.

    Every push grows from nothing. One that is lost on its way tells by what it had borne where the edge is; one that is
    survived tells by how near its tips came to their limit surfaces.

    Attributes:
        low: largest push that was survived [N or N m], 0 if none was.
        high: smallest that was lost, infinite if none was.
        end: what ended that; "" if none was.
        guess: of the edge.

    Args:
        use: the largest use of a limit surface without push.
    """

    def __init__(self, use: float) -> None:
        self._use = use
        self.low, self.high, self.end, self.guess = 0.0, float("inf"), "", float("inf")

    def find(self, push: Try, first: float) -> None:
        """Push so much, more until one is lost, then less until one is survived.

        That is 14 % below one that is lost, or 7 % below what it had borne.
        """
        size, share = first, self.look(push, first)
        for _ in range(_FARTHER):
            if self.end:
                break
            size = _MORE * self.guess
            share = self.look(push, size)
        for _ in range(_TRIES if self.end else 0):
            size *= _BELOW * share if 0.0 < share < _KNOWN else _LESS
            if size <= self.low:
                break
            share = self.look(push, size)
            if self.low == size:
                break

    def close(self, push: Try, tolerance: float) -> None:
        """Push between the two, until no more than this share of the smaller is between them, or is promised."""
        while 0.0 < self.low * (1.0 + tolerance) < min(self.high, self.guess) and self.end:
            near, middle = self.guess * (1.0 + 0.5 * tolerance), 0.5 * (self.low + self.high)
            self.look(push, min(max(near, self.low * (1.0 + 0.9 * tolerance)), middle))

    def look(self, push: Try, size: float) -> float:
        """Push so much; the share of it that was borne."""
        trial = push(size)
        if trial.end:
            self.high, self.end = size, trial.end
            self.guess = min(self.guess, max(trial.share, 0.5) * size)
        else:
            gained = (trial.use - self._use) / (1.0 - self._use)
            self.low, self.guess = size, size / min(max(gained, 0.5), 1.0)
        return trial.share
