"""Units that a column of measurements may be in."""

from __future__ import annotations

import math

from softhand.errors import MeasurementError
from softhand.settings.wording import nearest

UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180.0},
    "force": {"N": 1.0, "mN": 1e-3},
    "moment": {"N m": 1.0, "N mm": 1e-3, "mN m": 1e-3},
    "velocity": {"m/s": 1.0, "mm/s": 1e-3},
    "angular velocity": {"rad/s": 1.0, "deg/s": math.pi / 180.0, "mrad/s": 1e-3},
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
}
"""SI value of each unit, by the kind of the quantity."""

_LONGEST = 20  # letters of a unit that are repeated in a message


def scale_of(unit: str, kind: str, where: str) -> float:
    """SI value of one unit. "Nmm", "N*mm" and "N·mm" are the same as "N mm".

    Args:
        unit: as written in a header.
        kind: a key of `UNITS`.
        where: what carries the unit, for the message.

    Raises:
        MeasurementError: no unit of that kind.
    """
    plain = {_squeeze(name): scale for name, scale in UNITS[kind].items()}
    if _squeeze(unit) in plain:
        return plain[_squeeze(unit)]
    allowed = ", ".join(f"[{name}]" for name in UNITS[kind])
    shown = unit if len(unit) <= _LONGEST else unit[: _LONGEST - 3] + "..."
    other = next((name for name, units in UNITS.items() if _squeeze(unit) in map(_squeeze, units)), None)
    near = nearest(shown, UNITS[kind])
    hint = f" [{unit}] is a unit of {other}." if other else f" Did you mean [{near}]?" if near else ""
    raise MeasurementError(
        f"{where}: got the unit [{shown}], but it is a {kind} and must be in one of {allowed}.{hint}",
        column=where, value=unit,
    )  # fmt: skip


def _squeeze(unit: str) -> str:
    for sign in " .*·":
        unit = unit.replace(sign, "")
    return {"°": "deg", "µm": "um", "μm": "um"}.get(unit, unit)
