"""Pictures of a world."""

from __future__ import annotations

from typing import Any

MODES = ("human", "rgb_array")


class Renderer:
    @classmethod
    def of(cls, mode, episodes): return None
