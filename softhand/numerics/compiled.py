"""The one way in which softhand compiles: numba, kept on disk, never stale.

numba finds out that a function's own file has changed, not that a function which it calls has. Therefore the folder
of the compiled kernels carries a digest of all sources of the package that hold kernels.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
import platformdirs

F = TypeVar("F", bound=Callable[..., Any])


def _digest() -> str:
    package = Path(__file__).parents[1]
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        if b"@compiled" in text or b"kernel_folder" in text:
            digest.update(text)
    return digest.hexdigest()[:16]


def _writable_folder(name: str) -> Path:
    """First folder of: SOFTHAND_CACHE_DIR, the user's cache folder, the folder for temporary files."""
    own = os.environ.get("SOFTHAND_CACHE_DIR")
    candidates = [Path(own)] if own else []
    candidates += [
        Path(platformdirs.user_cache_dir("softhand")),
        Path(tempfile.gettempdir()) / f"softhand-{os.getuid()}",
    ]
    for candidate in candidates:
        folder = candidate / name
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError:
            continue
        if os.access(folder, os.W_OK):
            return folder
    return Path(tempfile.mkdtemp(prefix="softhand-"))


CACHE = _writable_folder(_digest())


def is_first_run() -> bool:
    """True while no kernel is on disk, so that the first run will spend some seconds on compiling."""
    return not any(CACHE.rglob("*.nbi"))


@contextmanager
def kernel_folder() -> Iterator[None]:
    """Decorate inside this context to keep what numba compiles in `CACHE`."""
    config: Any = numba.config
    previous = config.CACHE_DIR
    config.CACHE_DIR = str(CACHE)
    try:
        yield
    finally:
        config.CACHE_DIR = previous


def compiled(function: F) -> F:
    """Compile `function` at its first call and keep the result on disk. Division by zero gives inf or NaN."""
    with kernel_folder():
        return cast(F, numba.njit(cache=True, error_model="numpy", fastmath={"contract"})(function))
