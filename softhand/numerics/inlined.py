"""Kernels that become part of what calls them, which spares the handing over of records of many arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from softhand.numerics.compiled import kernels_of
from softhand.numerics.linking import kernel

F = TypeVar("F", bound=Callable[..., Any])


def inlined(function: F) -> F:
    """As `compiled`, for a short function that is called at few places; it makes no arrays."""
    folder = kernels_of(function.__module__.removeprefix("softhand."))
    return cast(F, kernel(function, folder, error_model="numpy", fastmath={"contract"}, _nrt=False, forceinline=True))
