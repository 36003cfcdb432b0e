"""The one way in which softhand compiles: numba, kept on disk, never stale.

numba finds out that a function's own file has changed, not that a function which it calls has. Therefore the folder of
the compiled kernels of a module carries a digest of all that they are made of: the module, and the modules from which
it takes kernels or constants, and so on.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

from softhand.numerics.kept import kept_in, own_folder
from softhand.numerics.linking import kernel

F = TypeVar("F", bound=Callable[..., Any])


_PACKAGE = Path(__file__).parents[1]
_IMPORT = re.compile(r"^from softhand\.([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
_IS_KERNEL = re.compile(r"^ *@(?:compiled|inlined|intrinsic)|kernel_folder\(", re.MULTILINE)


_MAKERS = ("numerics.compiled", "numerics.inlined", "numerics.linking")
"""What kernels are compiled by, and with which options."""


@cache
def _parts(module: str) -> tuple[bytes, bool, frozenset[str]]:
    """Source of a module of the package, whether it has machine code, and the modules that its kernels may need."""
    file = _PACKAGE.joinpath(*module.split(".")).with_suffix(".py")
    if not file.is_file():
        return b"", False, frozenset()
    source = file.read_text()
    needed = {
        target
        for target, names in _IMPORT.findall(source)
        if any(name.isupper() for name in re.findall(r"\w+", names)) or _parts(target)[1]
    }
    return source.encode(), _IS_KERNEL.search(source) is not None, frozenset(needed)


@cache
def _digest(module: str) -> str:
    """Of numba and of all that the kernels of a module are made of; for a module of others, of the whole package."""
    found: set[str] = set()
    waiting = (
        [module, *_MAKERS]
        if _parts(module)[0]
        else [".".join(file.relative_to(_PACKAGE).with_suffix("").parts) for file in _PACKAGE.rglob("*.py")]
    )
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += _parts(name)[2]
    digest = hashlib.sha256(numba.__version__.encode())
    for name in sorted(found):
        digest.update(_parts(name)[0])
    return digest.hexdigest()[:16]


@cache
def kernels_of(module: str) -> Path:
    """The folder of the machine code of a module, by its `__name__` or its dotted name below the package."""
    module = module.removeprefix("softhand.")
    return own_folder(f"{module.rpartition('.')[2]}-{_digest(module)}")


@contextmanager
def kernel_folder(module: str) -> Iterator[None]:
    """Decorate inside this context to keep what numba compiles for a module, by its `__name__`."""
    with kept_in(kernels_of(module)):
        yield


def compiled(function: F) -> F:
    """Compile `function` at its first call and keep the result on disk. Division by zero gives inf or NaN.

    A function that makes no arrays of its own, by `np.empty` or `np.zeros`, is compiled without the counting of
    references, which takes a tenth of a step and a third of an observation; it must return no array.
    """
    allocates = not {"empty", "zeros"}.isdisjoint(function.__code__.co_names)
    return made(function, _nrt=allocates)


def made(function: F, **options: bool) -> F:
    """A kernel with further options of numba; arithmetic and place on disk are the same for all."""
    folder = kernels_of(function.__module__)
    return cast(F, kernel(function, folder, error_model="numpy", fastmath={"contract"}, **options))
