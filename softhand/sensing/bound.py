"""Kernels that read an observation by the names of its fields."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from softhand.numerics.addressed import Addressed, addressed
from softhand.numerics.arrays import Array
from softhand.numerics.prepared import prepared
from softhand.numerics.layouts import Layouts
from softhand.numerics.straight import Fixed, straight
from softhand.sensing.fields import pick
from softhand.sensing.observation import Observation


class Bound:
    """A kernel `kernel(observed, *settings, out)` as a function of an observation, which gives a new `out` each time.

    It reads what it is handed. Which arrays belong to the observation is looked up once and kept for the next call with
    the same one; another observation, a copy for instance, has arrays of its own.

    Args:
        size: of `out`, a vector.
        kernel: made by `compiled`; `observed` is a `reads`, `out` is set.
        reads: NamedTuple with the names of the fields that the kernel reads.
        settings: what comes between, the same at each call.
        renamed: names in `reads` that stand for fields of other names.
    """

    def __init__(self, size: int, kernel: Callable[..., Any], reads: type[Any], *settings: Any, **renamed: str) -> None:
        self._size, self._kernel, self._reads, self._settings = size, kernel, reads, settings
        self._renamed = renamed
        self._block: Array | None = None

    @property
    def reads(self) -> set[str]:
        """The fields of an observation that it reads."""
        return {self._renamed.get(name, name) for name in self._reads._fields}

    def addressed(self, observation: Observation, out: Array, layouts: Layouts) -> Addressed:
        """Ready to be called by other machine code, for one observation and one place of the answer."""
        observed = pick(self._reads, observation.fields, **self._renamed)
        return addressed(self._kernel, observed, *self._settings, out, layouts=layouts)

    def straight(self, observation: Observation, out: Array, layouts: Layouts) -> Addressed | None:
        """The same as straight code, where there is any."""
        observed = pick(self._reads, observation.fields, **self._renamed)
        return straight(self._kernel, [(observed, *self._settings, out)], Fixed(), layouts)[0]

    def __call__(self, observation: Observation) -> Array:
        """The kernel's answer to the numbers of the observation, shape (size,)."""
        out = np.empty(self._size)
        if observation.block is not self._block:
            self._block = observation.block
            observed = pick(self._reads, observation.fields, **self._renamed)
            self._call = prepared(self._kernel, observed, *self._settings, varying=(out,))
        self._call(out)
        return out

    def __getstate__(self) -> dict[str, Any]:
        kernel = self._kernel.py_func  # type: ignore[attr-defined]
        name = kernel.__module__, kernel.__qualname__
        return {"kernel": name, "size": self._size, "settings": (self._reads, *self._settings), **self._renamed}

    def __setstate__(self, state: dict[str, Any]) -> None:
        module, name = state.pop("kernel")
        size, settings = state.pop("size"), state.pop("settings")
        self.__init__(size, getattr(import_module(module), name), *settings, **state)  # type: ignore[misc]
