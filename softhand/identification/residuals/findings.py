"""What the residuals of a fit show, in words."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from softhand.identification.files.header import FORCE
from softhand.identification.fitting.coefficients import OFFSET
from softhand.identification.residuals.estimates import Estimate
from softhand.identification.residuals.intervals import find_intervals
from softhand.identification.residuals.judgement import Judgement
from softhand.identification.residuals.patterns import SHOWN
from softhand.numerics.record import Record

_ROUNDING = 1e-12  # [m]; data without noise have such an offset
_MATTERS = 1.3  # times that a known touch would make an interval narrower, from which it is told


@dataclass(frozen=True)
class Finding(Record):
    """One thing that the residuals show or hide.

    Attributes:
        kind: `file`, `offset`, `gain`, `proportional`, `hysteresis`, `correlation` or `form`.
        text: in words, with what follows from it.
        is_warning: whether something was found, not only what could not be told.
    """

    kind: str
    text: str
    is_warning: bool = True


def find_findings(judgement: Judgement, offset: Estimate, level: float, notes: Sequence[str]) -> tuple[Finding, ...]:
    """All findings: of the file, of dr, of the series, of the noise, of the law."""
    return (
        *(Finding("file", note) for note in notes),
        *_of_offset(judgement, offset, level),
        *_of_series(judgement),
        *_of_noise(judgement),
        *_of_form(judgement),
    )


def _of_offset(judgement: Judgement, offset: Estimate, level: float) -> Iterator[Finding]:
    kind = judgement.offset.kind
    ends = f"{1e3 * offset.low:.3g} to {1e3 * offset.high:.3g} mm"
    if kind == "beyond":
        yield Finding(
            "offset",
            "no offset of dr within a tenth of the radius fits: the law has another form than the data, or dr is not "
            "the compression",
        )
    elif kind == "unseen":
        yield Finding("offset", "the data cannot tell an offset of dr; the intervals take dr as exact", False)
    elif judgement.has_offset:
        yield Finding(
            "offset",
            f"the forces begin as if dr had an offset of {1e3 * offset.value:.3g} mm ({ends}); the coefficients are "
            "those with it added to dr. If dr is known to begin at touch, the law has another form than the data",
        )
    elif kind == "fitted" and offset.high - offset.low > _ROUNDING:
        name, factor = _narrowed(judgement, level)
        if factor > _MATTERS:
            yield Finding(
                "offset",
                f"an offset of dr, {ends}, cannot be told from none, and the intervals allow for it; where dr is known "
                f"to begin at touch, --fix {OFFSET}=0 makes that of {name} {factor:.2g} times narrower",
                False,
            )


def _narrowed(judgement: Judgement, level: float) -> tuple[str, float]:
    """The coefficient whose interval an unknown offset widens most, and how much."""
    wide, plain = judgement.offset.solution, judgement.plain
    widths = [np.subtract(*find_intervals(solution, judgement.noise, level)) for solution in (wide, plain)]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.nan_to_num(widths[0][:-1] / widths[1], posinf=0.0)
    best = int(np.argmax(ratio))
    return plain.model.free[best].name, float(ratio[best])


def _of_series(judgement: Judgement) -> Iterator[Finding]:
    gains = judgement.patterns.gains
    if gains.chance < SHOWN and judgement.noise.gain > 0.0:
        yield Finding(
            "gain",
            f"each series has a gain of its own, with a standard deviation of {100 * judgement.noise.gain:.2g} %; the "
            f"intervals are those of {gains.count} series, not of single numbers",
        )
    elif not gains.count:
        yield Finding(
            "gain",
            "each coefficient rests on one series: a gain of that series, as from mounting the tip, cannot be seen and "
            "is not in the intervals; measure more series",
            False,
        )
    for name, loop in zip(FORCE, judgement.patterns.hysteresis, strict=True):
        if loop.chance < SHOWN:
            yield Finding(
                "hysteresis",
                f"{name} is {100 * abs(loop.size):.2g} % {'more' if loop.size > 0.0 else 'less'} while the deformation "
                f"grows than while it falls back, in {loop.count} series: a loop and no noise (hysteresis). A law has "
                "no memory and goes through the middle; fit loading alone, or give the tip a damping",
            )


def _of_noise(judgement: Judgement) -> Iterator[Finding]:
    growing, correlation = judgement.patterns.growing, judgement.patterns.correlation
    if growing.chance < SHOWN:
        yield Finding(
            "proportional",
            f"scatter grows with the force, by {100 * judgement.noise.growth:.2g} % of it: small forces weigh more",
        )
    if correlation.chance < SHOWN:
        alike = (1.0 + correlation.size) / (1.0 - correlation.size)
        yield Finding(
            "correlation",
            f"neighbours in a series err alike (correlation {correlation.size:.2g}), as from drift or a law of another "
            f"form; the intervals count {alike:.2g} numbers as one",
        )


def _of_form(judgement: Judgement) -> Iterator[Finding]:
    for name, form in zip(FORCE, judgement.patterns.form, strict=True):
        if form.chance < SHOWN:
            yield Finding(
                "form",
                f"{name}: residuals scatter {form.size:.2g} times as much as repeats of a setting: the law has another "
                "form than the data, and the intervals do not hold",
            )
