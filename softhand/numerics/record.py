"""Results that leave Python: records whose numbers have units, as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np


class Record:
    """Base of the results of analyses, which are frozen dataclasses.

    Class attributes:
        units: unit of each number, by the name of its field or property, "1" for one without dimension. The properties
            named here go into `to_json` beside the fields.
        unreported: fields that do not go into it.
    """

    units: ClassVar[Mapping[str, str]] = {}
    unreported: ClassVar[frozenset[str]] = frozenset()

    def to_json(self) -> str:
        """The record as JSON: its fields by name, and in `units` the unit of each number.

        Arrays are lists of lists. NaN, what is not known, is null; what has no limit is the text "Infinity" or
        "-Infinity", as JSON has no number for it.
        """
        return json.dumps(plain(self), allow_nan=False, ensure_ascii=False)


def plain(value: Any) -> Any:
    """A value made of what JSON knows.

    Args:
        value: a `Record`, numbers, texts, arrays, and mappings and sequences of these; an error becomes its message.

    Raises:
        TypeError: anything else.
    """
    if isinstance(value, Record):
        names = [field.name for field in fields(value)]  # type: ignore[arg-type]
        names += [name for name in value.units if name not in names]
        table = {name: plain(getattr(value, name)) for name in names if name not in value.unreported}
        return {**table, "units": dict(value.units)} if value.units else table
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, float):
        if math.isnan(value):
            return None
        return value if math.isfinite(value) else "Infinity" if value > 0.0 else "-Infinity"
    if value is None or isinstance(value, bool | int | str):
        return value
    if isinstance(value, Mapping):
        return {str(key): plain(entry) for key, entry in value.items()}
    if isinstance(value, Sequence):
        return [plain(entry) for entry in value]
    if isinstance(value, Exception):
        return str(value)
    raise TypeError(f"a {type(value).__name__} is no part of a result")
