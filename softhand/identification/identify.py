"""Coefficients of a fingertip law from measured forces, in one call."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from softhand.errors import MeasurementError
from softhand.identification.comparison import Score, compare_laws
from softhand.identification.files.lengths import read_length
from softhand.identification.fit import Fit, fit_law
from softhand.identification.measurements import read_measurements
from softhand.identification.record import Measurements
from softhand.identification.report import coefficient_rows, scatter_rows, score_rows, to_json, toml_snippet
from softhand.identification.residuals.estimates import Estimate
from softhand.identification.residuals.findings import Finding
from softhand.laws.law import Law
from softhand.plugins import find_plugin, plugin_names


@dataclass(frozen=True, eq=False)
class Identification:
    """A fingertip law identified from measurements.

    Attributes:
        law_name: of the law, as in a scenario.
        fit: values, intervals, residuals.
        scores: of all laws by cross-validation, the best first; empty if they were not compared.
        not_compared: why they were not; "" if they were, or were not to be.
        friction: coefficient mu that `to_toml` writes, if given.
    """

    law_name: str
    fit: Fit
    scores: tuple[Score, ...] = ()
    not_compared: str = ""
    friction: float | None = None

    @property
    def coefficients(self) -> tuple[Estimate, ...]:
        """Value, interval and note of each coefficient of the law."""
        return self.fit.estimates

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What the residuals show."""
        return self.fit.findings

    def law(self) -> Law:
        """The fitted law, for `softhand.simulate(..., law=...)`.

        Raises:
            MeasurementError: a coefficient is not told by the data.
        """
        return self.fit.law()

    def rows(self) -> list[tuple[str, ...]]:
        """Name, value, ends of the interval, unit and note of each coefficient, and of the offset of dr."""
        return coefficient_rows(self.fit)

    def scatter_rows(self) -> list[tuple[str, ...]]:
        """Component, standard deviation of its residuals and of its repeats, unit."""
        return scatter_rows(self.fit)

    def score_rows(self) -> list[tuple[str, ...]]:
        """Law, number of coefficients, error at settings that it was not fitted to, in all and by component."""
        return score_rows(self.scores)

    def to_json(self) -> str:
        """All of it as JSON: keys with units, null for what is not told."""
        return to_json(self.fit, self.law_name, self.scores)

    def to_toml(self) -> str:
        """The section `[fingertip]` of a scenario."""
        return toml_snippet(self.fit, self.law_name, self.friction)


def identify(
    data: str | Path | Measurements | Sequence[str | Path],
    *,
    law: str | type[Law] = "nakashima",
    radius: float | str | None = None,
    fix: Mapping[str, float] | None = None,
    friction: float | None = None,
    level: float = 0.95,
    compare: bool = False,
    progress: Callable[[float], None] | None = None,
) -> Identification:
    """Fit a fingertip law to measured forces, say how well its coefficients are known, and what the residuals show.

        J = sum {measured - law}^2 for each component, [Nakashima] section 2.3

    See `fit_law` for weights and intervals, `read_measurements` for files, docs/identification.md for what is assumed.

    Args:
        data: one or more CSV files, or measurements.
        law: name as in a scenario, or a class.
        radius: of the tip, in m or as a text such as "10 mm"; that of the file if None.
        fix: coefficients that are not to be fitted, SI; `dr_offset = 0` if dr is known to begin at touch.
        friction: coefficient mu, passed on to `to_toml`.
        level: of the confidence intervals, such as 0.95.
        compare: whether all laws are compared by cross-validation too.
        progress: called while laws are compared, with the number of laws done.

    Raises:
        MeasurementError: a file, a value or an argument cannot be used, or the law cannot be fitted.
        ScenarioError: no law has that name.
        LawError: the formula of the law does not give four numbers.
    """
    name = law if isinstance(law, str) else law.__name__.lower()
    law_class = find_plugin("laws", law, "law") if isinstance(law, str) else law
    if friction is not None and not 0.0 < friction < math.inf:
        raise MeasurementError(
            f"friction: got {friction}; it must be a positive number.", column="friction", value=friction
        )
    measurements = data if isinstance(data, Measurements) else read_measurements(
        [data] if isinstance(data, str | Path) else list(data))  # fmt: skip
    tip = _radius(measurements, radius)
    fit = fit_law(measurements, law_class, tip, fix, level)
    if not compare:
        return Identification(name, fit, friction=friction)
    laws = {other: find_plugin("laws", other, "laws") for other in plugin_names("laws")}
    laws |= {name: law_class}
    try:
        scores = compare_laws(measurements, laws, tip, {name: fix or {}}, progress=progress)
    except MeasurementError as error:
        return Identification(name, fit, not_compared=str(error), friction=friction)
    return Identification(name, fit, tuple(scores), friction=friction)


def _radius(measurements: Measurements, radius: float | str | None) -> float:
    if isinstance(radius, str):
        return read_length(radius, "radius")
    found = measurements.radius if radius is None else float(radius)
    if found is None:
        raise MeasurementError(
            "The radius of the tip is not known: give --radius 10mm, or write the line # radius [mm] = 10 into a file.",
            column="radius", value=None,
        )  # fmt: skip
    return found
