"""How often something succeeds, with the interval that so few trials leave."""

from __future__ import annotations

from typing import NamedTuple

from scipy.stats import binomtest

CONFIDENCE = 0.95


class Rate(NamedTuple):
    """A rate of success.

    Attributes:
        successes: of the trials.
        trials: how many there were.
        low: lower end of the Wilson interval at `CONFIDENCE`.
        high: upper end.
    """

    successes: int
    trials: int
    low: float
    high: float

    @property
    def value(self) -> float:
        """Successes over trials; NaN without any."""
        return self.successes / self.trials if self.trials else float("nan")


def rate_of(successes: int, trials: int) -> Rate:
    """The rate with its score interval [Wilson 1927, J. Am. Stat. Assoc. 22, 209-212].

        (p + z^2/2n +- z sqrt(p (1 - p)/n + z^2/4n^2)) / (1 + z^2/n)

    It stays within 0 and 1, and is no point where all or none succeed.
    """
    if not trials:
        return Rate(0, 0, 0.0, 1.0)
    found = binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return Rate(successes, trials, float(found.low), float(found.high))
