"""What a page may ask for, read from its messages: anything else is no wish."""

from __future__ import annotations

import json
import math
from typing import Any

NEXT = "next"
"""The message that asks for another frame."""

LONGEST = 256
"""Bytes of a message at most."""

_FASTEST = 1000.0  # times real time


def read_wish(message: str | bytes) -> dict[str, Any] | None:
    """A message as `{"playing": bool, "time": s, "speed": times real time}`, each if asked for; None if it is none."""
    if not isinstance(message, str) or len(message) > LONGEST:
        return None
    try:
        wish = json.loads(message)
        if not (isinstance(wish, dict) and all(name in _READ for name in wish)):
            return None
        return {name: _READ[name](value) for name, value in wish.items()}
    except (ValueError, OverflowError, RecursionError):
        return None


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError
    return value


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError
    return float(value)


def _speed(value: Any) -> float:
    if not 0.0 < _number(value) <= _FASTEST:
        raise ValueError
    return float(value)


_READ = {"playing": _flag, "time": _number, "speed": _speed}
