"""All checks, and the table of what they found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from softhand.validation import flow, holding, motion, onset, pressing, rolling, sliding
from softhand.validation.check import Check, Experiment

EXPERIMENTS: tuple[Experiment, ...] = (
    *sliding.EXPERIMENTS,
    *onset.EXPERIMENTS,
    *flow.EXPERIMENTS,
    *rolling.EXPERIMENTS,
    *pressing.EXPERIMENTS,
    *motion.EXPERIMENTS,
    *holding.EXPERIMENTS,
)

COLUMNS = ("check", "measured", "exact", "allowed", "unit", "pass")


def run_checks(experiments: Sequence[Experiment] = EXPERIMENTS) -> Iterator[tuple[int, Check]]:
    """Every check as it is made, with the count of the experiments done before it."""
    for done, experiment in enumerate(experiments):
        for check in experiment():
            yield done, check


def row_of(check: Check) -> tuple[str, ...]:
    """The texts of one line, as `COLUMNS`; as many digits as the allowed difference can tell apart."""
    digits = _digits(check)
    return (
        check.name,
        f"{check.measured:.{digits}g}",
        f"{check.exact:.{digits}g}",
        f"{check.allowed:.2g}",
        check.unit,
        "yes" if check.passed else "NO",
    )


def to_markdown(checks: Sequence[Check]) -> str:
    """The table for a page."""
    rows = [COLUMNS, ("---", "---:", "---:", "---:", "---", "---"), *map(row_of, checks)]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"


def _digits(check: Check) -> int:
    if check.exact == 0.0 or check.allowed == 0.0:
        return 3
    digits, share = 4, check.allowed / abs(check.exact)
    while 10.0 ** (2 - digits) > share and digits < 10:
        digits += 1
    return digits
