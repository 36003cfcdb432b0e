"""Tells the user that kernels are being compiled, once he has waited for it a while."""

from __future__ import annotations

from collections.abc import Callable
from time import monotonic

_PATIENCE = 2.0  # s

_tell: Callable[[], None] | None = None
_waited = 0.0
_last = monotonic()


def tell_of_compiling(tell: Callable[[], None] | None) -> None:
    """Call `tell` once, as soon as compiling has taken more than two seconds; None: nobody wants to know."""
    global _tell
    _tell = tell


def compiling() -> None:
    """Something is about to be compiled; what was before has taken a second at most."""
    global _tell, _waited, _last
    now = monotonic()
    _waited += min(now - _last, 1.0)
    _last = now
    if _tell is not None and _waited > _PATIENCE:
        tell, _tell = _tell, None
        tell()
