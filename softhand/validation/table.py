"""All checks, and the table of what they found."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from softhand.validation import flow, holding, motion, onset, pressing, rolling, sliding
from softhand.validation.check import Check, Experiment

KINDS: dict[str, tuple[Experiment, ...]] = {
    "slip of a block": sliding.EXPERIMENTS,
    "where slip begins": onset.EXPERIMENTS,
    "friction while a tip slides": flow.EXPERIMENTS,
    "rolling": rolling.EXPERIMENTS,
    "pressing": pressing.EXPERIMENTS,
    "conservation, order of convergence": motion.EXPERIMENTS,
    "holding": holding.EXPERIMENTS,
}
"""The experiments by what they are about."""

EXPERIMENTS: tuple[Experiment, ...] = tuple(experiment for kind in KINDS.values() for experiment in kind)

COLUMNS = ("check", "measured", "exact", "allowed", "unit", "pass")


def run_checks(experiments: Sequence[Experiment] = EXPERIMENTS) -> Iterator[tuple[int, Check]]:
    """Every check as it is made, with the count of the experiments done before it."""
    for done, experiment in enumerate(experiments):
        for check in experiment():
            yield done, check


def kind_of(experiment: Experiment) -> str:
    """What an experiment is about, one of `KINDS`."""
    return next(kind for kind, experiments in KINDS.items() if experiment in experiments)


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
