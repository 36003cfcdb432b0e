"""A fit whose coefficients are all told, at a limit, or known to be lost."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from softhand.errors import MeasurementError
from softhand.identification.fitting.coefficients import Coefficient
from softhand.identification.fitting.model import Model
from softhand.identification.fitting.solving import Solution, solve
from softhand.identification.fitting.starts import find_linear
from softhand.identification.fitting.told import find_lost, held_at_limits
from softhand.identification.record import Measurements
from softhand.laws.law import Law


@dataclass(frozen=True, eq=False)
class Settled:
    """A fit, and what became of coefficients that it could not tell.

    Attributes:
        solution: the fit of those that it could.
        lost: what the data do not tell and has no default either, with the reason.
        notes: the reason by the name of each coefficient that was held at a limit or left at its default.
    """

    solution: Solution
    lost: dict[Coefficient, str]
    notes: dict[str, str]


def settle(
    measurements: Measurements, law_class: type[Law], radius: float, fixed: Mapping[str, object] | None = None
) -> Settled:
    """Fit; hold what ends at a limit that the law takes, leave what is not told at its default, and fit the rest anew.

    Raises:
        MeasurementError: nothing to fit, too few numbers, or the best value lies outside of what the law allows.
    """
    law, known, notes = law_class.__name__, dict(fixed or {}), dict[str, str]()
    while True:
        model = Model(measurements, law_class, radius, known)
        if not model.free:
            raise MeasurementError(f"{law}: all is fixed, nothing is left to fit.", column="", value=None)
        solution = solve(model, find_linear(model))
        found = find_lost(solution)
        lost = found.reasons
        limited = held_at_limits(solution, lost)
        told = len(model.free) - len(lost)
        if len(model.measured) <= told:
            raise MeasurementError(
                f"{len(model.measured)} measured numbers cannot tell {told} coefficients of {law} and their intervals; "
                "give more rows.",
                column="", value=len(model.measured),
            )  # fmt: skip
        if limited:
            known |= limited
            notes |= {name: f"held at {value:g}, a limit of the law" for name, value in limited.items()}
        elif found.spare:
            known |= {coefficient.name: coefficient.default for coefficient in found.spare}
            notes |= {coefficient.name: f"default; {note}" for coefficient, note in found.spare.items()}
        else:
            return Settled(solution, lost, notes)
