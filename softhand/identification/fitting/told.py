"""What the data do not tell: coefficients that nothing depends on, that come only together, that end at a limit."""

from __future__ import annotations

from collections.abc import Container
from dataclasses import dataclass

import numpy as np

from softhand.errors import MeasurementError
from softhand.identification.files.header import FORCE
from softhand.identification.fitting.coefficients import Coefficient
from softhand.identification.fitting.model import BAD
from softhand.identification.fitting.solving import SINGULAR, Solution, scaled

_SILENT = 1e-10  # a coefficient that moves the forces less than this share of them is not seen
_SHARE = 0.05  # of a direction that the data do not see, from which a coefficient belongs to it
_AT_LIMIT, _NEAR = 1e-7, 1e-3  # of the change of a coefficient that makes forces of the size of those measured


@dataclass(frozen=True)
class Lost:
    """What the data do not tell.

    Attributes:
        silent: coefficients that no measured number depends on.
        together: sets of which only something in common is told, such as a product or a ratio.
    """

    silent: tuple[Coefficient, ...]
    together: tuple[tuple[Coefficient, ...], ...]

    @property
    def reasons(self) -> dict[Coefficient, str]:
        """Each of them with its reason."""
        found = {one: "not told: no measured number depends on it" for one in self.silent}
        for some in self.together:
            names = " and ".join(one.name for one in some)
            found |= {one: f"not told: the data depend on {names} only together" for one in some}
        return found

    @property
    def spare(self) -> dict[Coefficient, str]:
        """Those that are to be left at their defaults next, with the reason: one of a set tells the others."""
        some = [one for one in self.silent if one.default is not None]
        if not some:
            some = [one for group in self.together[:1] for one in group if one.default is not None][-1:]
        return {one: self.reasons[one] for one in some}


def find_lost(solution: Solution) -> Lost:
    """The coefficients that the data do not tell."""
    free, largest = solution.model.free, np.max(np.abs(solution.model.measured), initial=1e-300)
    reach = np.max(np.abs(solution.slope * solution.values), axis=0, initial=0.0) / largest
    # a linear coefficient that is not seen leaves exact zeros, the differences of another one leave rounding
    silent = np.where(solution.linear, ~solution.slope.any(axis=0), reach <= _SILENT)
    heard, together = np.flatnonzero(~silent), []
    if heard.size:
        _, singular, right = np.linalg.svd(scaled(solution.weighted_slope[:, heard])[0], full_matrices=False)
        for direction in right[singular <= SINGULAR * singular[0]]:
            together.append(tuple(free[heard[k]] for k in np.flatnonzero(np.abs(direction) > _SHARE)))
    return Lost(tuple(free[k] for k in np.flatnonzero(silent)), tuple(together))


def find_limits(solution: Solution) -> dict[Coefficient, float]:
    """Coefficients whose best value is a limit of the law, with that limit.

    A solver within limits stops a little before them: a coefficient near one whose next step would go beyond is there.
    """
    model = solution.model
    there = (model.component == np.unique(model.component)[:, None]).astype(float)
    size, length = np.sqrt(there @ model.measured**2), np.sqrt(there @ solution.slope**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.nanmin(np.where(length > 0.0, size[:, None] / length, np.inf), axis=0)
    A, lengths = scaled(solution.weighted_slope)
    beyond = solution.values + np.linalg.lstsq(A, solution.residual, rcond=SINGULAR)[0] / lengths
    found = {}
    for k, coefficient in enumerate(model.free):
        for limit, sign in ((coefficient.lower, -1.0), (coefficient.upper, 1.0)):
            if not (np.isfinite(limit) and np.isfinite(scale[k])):
                continue
            apart = abs(solution.values[k] - limit)
            if apart <= _AT_LIMIT * scale[k] or (apart <= _NEAR * scale[k] and sign * (beyond[k] - limit) > 0.0):
                found[coefficient] = limit
    return found


def held_at_limits(solution: Solution, lost: Container[Coefficient]) -> dict[str, float]:
    """Coefficients whose best value is a limit that the law takes, with that limit.

    Raises:
        MeasurementError: the law does not take the limit, so that the best value lies outside of what it allows.
    """
    law = solution.model.law_class.__name__
    limits = {coefficient: limit for coefficient, limit in find_limits(solution).items() if coefficient not in lost}
    for coefficient, limit in limits.items():
        if not coefficient.takes(limit):
            raise MeasurementError(
                f"{law}: the best {coefficient.name} lies at {limit:g} or beyond, outside of what the law allows "
                f"({coefficient.limits}). Either the law does not fit the data, or a sign is wrong: positive dr, "
                f"dtheta, dphi, dpsi give positive {', '.join(FORCE)}.",
                column=coefficient.name, value=limit,
            )  # fmt: skip
    if np.any(solution.model.forces(solution.values) >= BAD):
        raise MeasurementError(
            f"{law}: no coefficients were found at which the law gives a number at all settings.", column="", value=None
        )
    return {coefficient.name: limit for coefficient, limit in limits.items()}
