"""Types of arrays."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]
"""Plain numbers."""

AnyArray: TypeAlias = NDArray[Any]
"""Of any kind, structured ones too."""
