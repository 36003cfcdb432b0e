"""Arrays for a page, packed behind each other."""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np

from softhand.numerics.arrays import AnyArray

Data = dict[str, Any]

_EFFORT = 7  # of deflate, 0 to 9: the last two take four times as long for 0.4 % less
_TYPES = {"f4": "<f4", "i4": "<i4", "i2": "<i2", "u1": "|u1"}


class Store:
    """Arrays behind each other in one block of bytes; the page is told where each begins."""

    def __init__(self) -> None:
        self._bytes = bytearray()

    def add(self, array: AnyArray, kind: str) -> Data:
        """Keep an array as little-endian `f4`, `i4`, `i2` or `u1`; returns where it is."""
        data = np.ascontiguousarray(array, dtype=_TYPES[kind])
        place = {"type": kind, "start": len(self._bytes), "count": data.size}
        self._bytes += data.tobytes() + bytes(-data.nbytes % 4)
        return place

    def text(self) -> str:
        """All bytes, deflated, as base64."""
        return base64.b64encode(zlib.compress(self._bytes, _EFFORT)).decode()
