"""The coefficients of a law: which of its fields can be fitted, within what limits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from softhand.errors import MeasurementError
from softhand.laws.law import Law
from softhand.settings.wording import unit_of

OFFSET = "dr_offset"
"""Not of the law but of the experiment: what is to be added to the column dr, since touch is hard to see."""

_LARGEST_OFFSET = 0.1  # of the radius


@dataclass(frozen=True)
class Coefficient:
    """A number that can be fitted.

    Attributes:
        name: of the field.
        default: of the field, None without one.
        lower: lowest value that the law takes.
        upper: highest.
        closed: whether it takes `lower` and `upper` themselves.
        unit: from the description of the field, "" if it says none.
    """

    name: str
    default: float | None
    lower: float
    upper: float
    closed: tuple[bool, bool]
    unit: str

    def takes(self, value: float) -> bool:
        """Whether the law takes this value."""
        above = self.lower < value or (self.closed[0] and value == self.lower)
        return above and (value < self.upper or (self.closed[1] and value == self.upper))

    @property
    def limits(self) -> str:
        """The limits in words."""
        below = "" if math.isinf(self.lower) else f"{'at least' if self.closed[0] else 'more than'} {self.lower:g}"
        above = "" if math.isinf(self.upper) else f"{'at most' if self.closed[1] else 'less than'} {self.upper:g}"
        return " and ".join(filter(None, (below, above))) or "a finite number"


def coefficients_of(law_class: type[Law]) -> list[Coefficient]:
    """The fields of a law that are numbers, without the radius."""
    found = []
    for name, field in law_class.model_fields.items():
        if name == "radius" or field.annotation is not float:
            continue
        limits = [(getattr(entry, sign, None), sign) for entry in field.metadata for sign in ("gt", "ge", "lt", "le")]
        lower = max((float(value) for value, sign in limits if value is not None and sign[0] == "g"), default=-math.inf)
        upper = min((float(value) for value, sign in limits if value is not None and sign[0] == "l"), default=math.inf)
        default = None if field.is_required() else float(field.default)
        signs = [sign for value, sign in limits if value is not None]
        closed = ("gt" not in signs, "lt" not in signs)
        found.append(Coefficient(name, default, lower, upper, closed, unit_of(field.description)))
    return found


def has_coefficients(law_class: type[Law]) -> bool:
    """Whether what its formula takes are its fields, so that they can be fitted; those of a table are not."""
    return law_class.parameter_names() == tuple(law_class.model_fields)


def offset_of(radius: float) -> Coefficient:
    """The offset of dr as a coefficient."""
    reach = _LARGEST_OFFSET * radius
    return Coefficient(OFFSET, 0.0, -reach, reach, (True, True), "m")


def check_fixed(law_class: type[Law], fixed: Mapping[str, object]) -> dict[str, object]:
    """The fields that are not fitted: those given, and those that are no numbers at their defaults.

    Raises:
        MeasurementError: no field of the law, a value that it does not take, or a field without a value.
    """
    if not has_coefficients(law_class):
        raise MeasurementError(
            f"{law_class.__name__} is a table and has no coefficients to be fitted; softhand material --table takes "
            "measured rows as they are.",
            column="law", value=law_class.__name__,
        )  # fmt: skip
    known = {coefficient.name: coefficient for coefficient in coefficients_of(law_class)}
    fields = law_class.model_fields
    for name, value in fixed.items():
        if name != OFFSET and (name not in fields or name == "radius"):
            raise MeasurementError(
                f'{law_class.__name__} has no coefficient "{name}"; it has {", ".join(known)}.', column=name, value=name
            )
        is_number = isinstance(value, int | float) and math.isfinite(value)
        if name in known and not (is_number and known[name].takes(float(value))):  # type: ignore[arg-type]
            raise MeasurementError(
                f"{law_class.__name__}: {name} cannot be fixed at {value}; it must be {known[name].limits}.",
                column=name, value=value,
            )  # fmt: skip
        if name == OFFSET and not (is_number and abs(float(value)) < 1.0):  # type: ignore[arg-type]
            what = "give a length in m, 0 where dr begins at touch"
            raise MeasurementError(f"{OFFSET} cannot be fixed at {value}; {what}.", column=name, value=value)
    kept = dict(fixed)
    for name, field in fields.items():
        if name == "radius" or name in known or name in kept:
            continue
        if field.is_required():
            raise MeasurementError(
                f'{law_class.__name__}: "{name}" is not a number to be fitted; fix its value.', column=name, value=None
            )
        kept[name] = field.default
    return kept
