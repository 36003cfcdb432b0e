"""Coefficients of a fingertip law from measured forces, in one call."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from softhand.errors import MeasurementError
from softhand.identification.comparison import Score, compare_laws
from softhand.identification.files.lengths import read_length
from softhand.identification.fit import Fit, fit_law
from softhand.identification.fitting.coefficients import has_coefficients
from softhand.identification.measurements import read_measurements
from softhand.identification.record import Measurements
from softhand.identification.report import coefficient_rows, scatter_rows, score_rows, toml_snippet
from softhand.identification.residuals.estimates import Estimate
from softhand.identification.residuals.findings import Finding
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.plugins import find_plugin, plugin_names

_LARGEST_FRICTION = 100.0


@dataclass(frozen=True, eq=False)
class Identification(Record):
    """A fingertip law identified from measurements.

    Attributes:
        law_name: of the law, as in a scenario.
        radius: of the tip [m].
        level: of the intervals, such as 0.95.
        coefficients: value, interval and note of each coefficient of the law, by its name.
        dr_offset: the same of what is to be added to the column dr [m].
        findings: what the residuals show, in words.
        noise: standard deviation of the residuals of Fr [N], Ftheta, Fphi, Fpsi [N m], shape (4,).
        repeats: the same of repeated settings about their means, shape (4,).
        scores: of all laws by cross-validation, the best first; empty if they were not compared.
        not_compared: why they were not; "" if they were, or were not to be.
        friction: coefficient mu that `to_toml` writes, if given.
        fit: the law at these coefficients, and the measurements.
    """

    units: ClassVar = {
        "radius": "m", "level": "1", "noise": "N, N m, N m, N m", "repeats": "N, N m, N m, N m", "friction": "1",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"fit"})

    law_name: str
    radius: float
    level: float
    coefficients: dict[str, Estimate]
    dr_offset: Estimate
    findings: tuple[Finding, ...]
    noise: Array
    repeats: Array
    scores: tuple[Score, ...]
    not_compared: str
    friction: float | None
    fit: Fit

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
    if friction is not None and not 0.0 < friction <= _LARGEST_FRICTION:
        raise MeasurementError(
            f"friction: got {friction:g}; it must be above 0, at most {_LARGEST_FRICTION:g}.",
            column="friction",
            value=friction,
        )
    measurements = data if isinstance(data, Measurements) else read_measurements(
        [data] if isinstance(data, str | Path) else list(data))  # fmt: skip
    fit = fit_law(measurements, law_class, _radius(measurements, radius), fix, level)
    scores, not_compared = _compare(fit, name, fix or {}, progress) if compare else ((), "")
    return Identification(
        name, fit.radius, level, {estimate.name: estimate for estimate in fit.estimates}, fit.offset, fit.findings,
        fit.noise, fit.repeats, scores, not_compared, friction, fit,
    )  # fmt: skip


def _compare(
    fit: Fit, name: str, fixed: Mapping[str, float], progress: Callable[[float], None] | None
) -> tuple[tuple[Score, ...], str]:
    """Scores of all laws, and why there are none."""
    every = {other: find_plugin("laws", other, "laws") for other in plugin_names("laws")}
    laws = {other: law_class for other, law_class in every.items() if has_coefficients(law_class)}
    laws[name] = fit.law_class
    try:
        return tuple(compare_laws(fit.measurements, laws, fit.radius, {name: fixed}, progress=progress)), ""
    except MeasurementError as error:
        return (), str(error)


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
