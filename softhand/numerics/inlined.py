"""Kernels that become part of what calls them, which spares the handing over of records of many arrays."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

from softhand.numerics.compiled import kernel_folder

F = TypeVar("F", bound=Callable[..., Any])

_OPTIONS: dict[str, Any] = {
    "cache": True, "error_model": "numpy", "fastmath": {"contract"}, "_nrt": False, "forceinline": True,
}  # fmt: skip


def inlined(function: F) -> F:
    """As `compiled`, for a short function that is called at few places; it makes no arrays."""
    with kernel_folder(function.__module__):
        return cast(F, numba.njit(**_OPTIONS)(function))
