"""Straight code on disk, in the folder of the kernels that it is made from."""

from __future__ import annotations

import hashlib
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from softhand.numerics.compiled import kernels_of
from softhand.numerics.kept import File
from softhand.numerics.llvm_text import processor

_MAKERS = ("symbols", "blocks", "tracing", "assembling", "llvm_text", "straight", "layouts",
           "followed", "partials", "eliminated", "lanes_text")  # fmt: skip


@cache
def _makers() -> str:
    """Digest of what makes straight code of a kernel."""
    sources = [Path(__file__).with_name(f"{name}.py").read_bytes() for name in _MAKERS]
    return hashlib.sha256(b"".join(sources)).hexdigest()


class KeptCodes:
    """A place for the codes of one kernel and one structure.

    Args:
        module: of the kernel; that of others, of which nothing tells when it is stale, has no place.
        text: tells the structure.
    """

    def __init__(self, module: str, text: str) -> None:
        self._key = text, processor(), _makers()
        self._file = None
        if module.startswith("softhand."):
            folder = kernels_of(module)
            self._file = File(folder, "straight")

    def found(self) -> Any:
        """What was kept; None if there is nothing."""
        return self._file.load(self._key) if self._file is not None else None

    def keep(self, codes: Any) -> None:
        """Where that is possible."""
        if self._file is not None:
            with suppress(OSError):  # kept.py has warned where nothing can be written
                self._file.save(self._key, codes)
