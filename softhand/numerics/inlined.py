"""Kernels that become part of what calls them, which spares the handing over of records of many arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

from softhand.numerics.compiled import made

F = TypeVar("F", bound=Callable[..., Any])


def inlined(function: F) -> F:
    """As `compiled`, for a short function that is called at few places; it makes no arrays."""
    return made(function, _nrt=False, forceinline=True)
