"""Coefficients of a fingertip law by least squares, with intervals and with what the data cannot tell."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from pydantic import ValidationError

from softhand.errors import MeasurementError
from softhand.identification.fitting.coefficients import OFFSET
from softhand.identification.fitting.settling import settle
from softhand.identification.fitting.solving import Solution
from softhand.identification.plausible import check_plausible
from softhand.identification.record import Measurements, repeats_scatter
from softhand.identification.residuals.estimates import Estimate, find_estimates
from softhand.identification.residuals.findings import Finding, find_findings
from softhand.identification.residuals.judgement import judge
from softhand.laws.law import Law
from softhand.numerics.arrays import Array


@dataclass(frozen=True, eq=False)
class Fit:
    """A law fitted to measurements.

    Attributes:
        law_class: the law.
        radius: of the tip [m].
        estimates: of all coefficients of the law.
        offset: of dr, what is to be added to its column [m].
        level: of the confidence intervals, such as 0.95.
        measurements: what was fitted.
        findings: what the residuals show, in words.
        repeats: standard deviation of repeated settings about their own means, NaN without repeats, shape (4,).
    """

    law_class: type[Law]
    radius: float
    estimates: tuple[Estimate, ...]
    offset: Estimate
    level: float
    measurements: Measurements
    findings: tuple[Finding, ...]
    repeats: Array
    _solution: Solution

    @property
    def noise(self) -> Array:
        """Standard deviation of the residuals of each component, NaN where none was measured, shape (4,)."""
        return self._solution.noise

    @property
    def predicted(self) -> Array:
        """Forces of the fitted law at the measured settings, shape (n, 4)."""
        return self.force(self.measurements.imposed)

    @property
    def residual(self) -> Array:
        """Measured less predicted force, NaN where not measured, shape (n, 4)."""
        return self.measurements.force - self.predicted

    def estimate(self, name: str) -> Estimate:
        """The estimate of that name.

        Raises:
            MeasurementError: the law has no such coefficient.
        """
        for estimate in (*self.estimates, self.offset):
            if estimate.name == name:
                return estimate
        names = ", ".join(estimate.name for estimate in self.estimates)
        raise MeasurementError(
            f'{self.law_class.__name__} has no coefficient "{name}"; it has {names}.', column=name, value=name
        )

    def law(self) -> Law:
        """The fitted law.

        Raises:
            MeasurementError: a coefficient is not told by the data.
        """
        lost = [estimate.name for estimate in self.estimates if not math.isfinite(estimate.value)]
        if lost:
            raise MeasurementError(
                f"{self.law_class.__name__}: the data do not tell {', '.join(lost)}; fix or measure them.",
                column=lost[0], value=None,
            )  # fmt: skip
        values = {estimate.name: estimate.value for estimate in self.estimates}
        try:
            return self.law_class(radius=self.radius, **values, **self.others())
        except ValidationError as error:  # a law takes no number of any size
            what = "; ".join(f"{entry['loc'][0]}: {entry['msg']}" for entry in error.errors())
            raise MeasurementError(
                f"{self.law_class.__name__} does not take what the data tell: {what}.", column="", value=values
            ) from error

    def others(self) -> dict[str, object]:
        """Fields of the law that are no numbers, with the values that were used."""
        known = {OFFSET, *(estimate.name for estimate in self.estimates)}
        return {name: value for name, value in self._solution.model.fixed.items() if name not in known}

    def force(self, settings: Array) -> Array:
        """Forces of the fitted law, those too whose coefficients are not all told.

        Args:
            settings: dr as measured, dtheta, dphi, dpsi, phi, shape (n, 5).

        Returns:
            Fr [N], Ftheta, Fphi, Fpsi [N m], shape (n, 4).
        """
        return self._solution.model.at(self._solution.values, settings)


def fit_law(
    measurements: Measurements,
    law_class: type[Law],
    radius: float,
    fixed: Mapping[str, object] | None = None,
    level: float = 0.95,
) -> Fit:
    """Fit the coefficients of a law.

    Minimises the weighted sum of J = sum {measured - law}^2 of each component of dF, [Nakashima] section 2.3 with J_r
    for Fr. A component weighs as the inverse square of the scatter of its own residuals. Where the law is linear in all
    coefficients this is one linear solve, else scipy's least_squares from several starts. Where the residuals show that
    scatter grows with the force, small forces weigh more; where they show that dr has an offset, it is fitted too.

    The intervals allow for noise that grows with the force, for a gain of each series and for neighbours that err
    alike, as far as the residuals call for it, and always for an offset of dr, unless `fixed` has `dr_offset`.

    Args:
        measurements: at least as many numbers as coefficients.
        law_class: any law; each field that is a number is fitted, except the radius.
        radius: of the tip [m].
        fixed: values of fields that are not to be fitted; `dr_offset = 0` if dr is known to begin at touch.
        level: of the confidence intervals.

    Raises:
        MeasurementError: nothing to fit, too few numbers, or the best value lies outside of what the law allows.
        LawError: the formula of the law does not give four numbers.
    """
    if not 0.0 < level < 1.0:
        what = f"The level of the intervals is {level}; it must lie between 0 and 1."
        raise MeasurementError(what, column="level", value=level)
    check_plausible(measurements, radius)
    settled = settle(measurements, law_class, radius, fixed)
    judgement = judge(settled.solution, measurements)
    estimates, offset = find_estimates(settled, judgement, level)
    findings = find_findings(judgement, offset, level, measurements.notes)
    return Fit(law_class, radius, estimates, offset, level, measurements, findings, repeats_scatter(measurements),
               judgement.solution)  # fmt: skip
