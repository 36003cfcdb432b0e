"""Types of arrays."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
"""Plain numbers."""

AnyArray: TypeAlias = NDArray[Any]
"""Of any kind, structured ones too."""


def as_numbers(value: Any) -> Array | None:
    """What a user gave as an array of plain numbers; None if it is none."""
    try:
        return None if np.iscomplexobj(value) else np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None


def overwrite(array: AnyArray, values: ArrayLike) -> None:
    """Set what is in an array, also in one that is otherwise only read."""
    writeable = array.flags.writeable
    array.flags.writeable = True
    array[...] = values
    array.flags.writeable = writeable
