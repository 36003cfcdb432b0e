"""Lengths as users write them."""

from __future__ import annotations

import math
import re

from softhand.errors import MeasurementError
from softhand.identification.files.units import scale_of
from softhand.settings.wording import show

_LONGEST = 60


def read_length(text: str, where: str) -> float:
    """A positive length [m] from a text such as "10 mm" or "12,5mm".

    Args:
        text: number and unit.
        where: what the length is of, for the message.

    Raises:
        MeasurementError: no number, not positive, no unit or another one.
    """
    found = re.fullmatch(r"([-+.\deE]*\d\.?)\s*([^\d\s]*)", text.strip().replace(",", ".")[:_LONGEST])
    try:
        value = float(found[1]) if found else math.nan
    except ValueError:
        value = math.nan
    if not found or not found[2] or not 0.0 < value < math.inf:
        raise MeasurementError(
            f"{where}: got {show(text.strip())}; give a length, such as 10 mm.", column=where, value=text
        )
    return value * scale_of(found[2], "length", where)
