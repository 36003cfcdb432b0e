"""A fit in words: rows of tables, and the section of a scenario."""

from __future__ import annotations

import math
from collections.abc import Sequence

from softhand.identification.comparison import Score
from softhand.identification.files.header import FORCE
from softhand.identification.fit import Fit
from softhand.settings.wording import show

_SHOWN = {"force": ("N", 1.0), "moment": ("N mm", 1e3)}


def coefficient_rows(fit: Fit) -> list[tuple[str, ...]]:
    """Name, value, ends of the interval, unit and note of each coefficient, and of the offset of dr."""
    offset = [] if fit.offset.note == "fixed" and fit.offset.value == 0.0 else [fit.offset]
    rows = []
    for estimate in (*fit.estimates, *offset):
        numbers = (
            "-" if math.isnan(value) else f"{value:.5g}" for value in (estimate.value, estimate.low, estimate.high)
        )
        rows.append((estimate.name, *numbers, estimate.coefficient.unit, estimate.note))
    return rows


def scatter_rows(fit: Fit) -> list[tuple[str, ...]]:
    """Component, scatter of the residuals and of the repeats, for what was measured."""
    rows: list[tuple[str, ...]] = []
    for (name, kind), noise, repeats in zip(FORCE.items(), fit.noise, fit.repeats, strict=True):
        unit, scale = _SHOWN[kind]
        if not math.isnan(noise):
            rows.append((name, f"{scale * noise:.3g}", "-" if math.isnan(repeats) else f"{scale * repeats:.3g}", unit))
    return rows


def score_rows(scores: Sequence[Score]) -> list[tuple[str, ...]]:
    """Law, number of coefficients, held-out error in all and of each component, for the laws that could be fitted."""
    rows = []
    for score in scores:
        if score.failure:
            continue
        errors = ("-" if math.isnan(error) else f"{_SHOWN[kind][1] * error:.3g}"
                  for error, kind in zip(score.error, FORCE.values(), strict=True))  # fmt: skip
        name = f"{score.name} (best)" if score.is_best else score.name
        rows.append((name, f"{score.fitted}", f"{100.0 * score.total:.3g} %", *errors))
    return rows


def toml_snippet(fit: Fit, name: str, friction: float | None = None) -> str:
    """The section `[fingertip]` of a scenario; what the data do not tell, and what the residuals show, is a comment.

    Args:
        fit: of the law.
        name: of the law, as in a scenario.
        friction: coefficient mu, a line of its own if given.
    """
    lines = ["[fingertip]", f"law = {show(name)}"]
    lines += [f"# {finding.text}" for finding in fit.findings if finding.is_warning and finding.kind != "file"]
    if friction is None:
        lines.append("# friction is not told by these measurements: keep the line of your scenario")
    else:
        lines.append(f"friction = {friction!r}")
    lines.append(f"radius = {fit.radius!r}  # [m]")
    for estimate in fit.estimates:
        unit = f"[{estimate.coefficient.unit}]" if estimate.coefficient.unit else ""
        if math.isnan(estimate.value):
            lines.append(f"# {estimate.name} = ...  # {unit} {estimate.note}")
        elif math.isnan(estimate.low):
            lines.append(f"{estimate.name} = {estimate.value!r}  # {unit} {estimate.note}")
        else:
            ends = f"{100.0 * fit.level:g} %: {estimate.low:.5g} to {estimate.high:.5g}"
            lines.append(f"{estimate.name} = {estimate.value!r}  # {unit} {ends}")
    lines += [f"{key} = {show(value)}" for key, value in fit.others().items()]
    return "\n".join(lines) + "\n"
