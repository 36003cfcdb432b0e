"""Machine code on disk: where it lies, and files that are known to be whole.

Code from disk is run, so it is read only from the package itself and from a folder that nobody else can write to, and
only if it is what was written there: each file carries a digest. What is damaged is made anew, what cannot be written
stays in memory.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import stat
import sys
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, partial
from pathlib import Path
from types import FunctionType
from typing import Any

import numba
import platformdirs
from llvmlite import binding as llvm
from numba.core import caching, ccallback, dispatcher
from numba.core.runtime import _nrt_python  # type: ignore[attr-defined]

from softhand.numerics.waiting import compiling

_DIGEST = 32  # bytes

SHIPPED = Path(__file__).parents[1] / "machine_code"
"""Made with the package, for the processor and the versions that it was built with."""


class KeptCodeWarning(UserWarning):
    """Machine code cannot be kept, or was damaged."""


class File:
    """The code of one function for all kinds of arguments, a file each.

    Args:
        folder: of the user, written to; what came with the package is read from `SHIPPED`, below the same name.
        base: begins the names of the files.
        stamp: tells one state of the source from another, where the name of the folder does not.
    """

    def __init__(self, folder: Path, base: str, stamp: Any = None) -> None:
        self._folder, self._base, self._stamp = folder, base, stamp

    def load(self, key: Any) -> Any:
        """What was saved under a key; None if there is nothing, or nothing that can be trusted."""
        own = self._file(key)
        for file, read in ((SHIPPED / own.parent.name / own.name, Path.read_bytes), (own, _read_own)):
            try:
                sealed = read(file)
            except OSError:
                continue
            content = sealed[_DIGEST:]
            if hashlib.sha256(content).digest() == sealed[:_DIGEST]:
                name, data = pickle.loads(content)
                return data if name == self._name(key) else None
            _warn_once(f"compiled code in {file.parents[1]} was damaged or not yours; it is made anew.")
        return None

    def save(self, key: Any, data: Any) -> None:
        """Keep data under a key.

        Raises:
            OSError: it cannot be written.
        """
        content = caching.dumps((self._name(key), data))
        file = self._file(key)
        handle, draft = tempfile.mkstemp(dir=self._folder)
        try:
            with os.fdopen(handle, "wb") as target:
                target.write(hashlib.sha256(content).digest() + content)
            os.replace(draft, file)
        except OSError:
            Path(draft).unlink(missing_ok=True)
            raise

    def flush(self) -> None:
        """Remove all that was saved."""
        for file in self._folder.glob(f"{self._base}.*.nbc"):
            file.unlink(missing_ok=True)

    def _name(self, key: Any) -> str:
        return repr((numba.__version__, self._base, self._stamp, key))

    def _file(self, key: Any) -> Path:
        digest = hashlib.sha256(self._name(key).encode()).hexdigest()[:24]
        return self._folder / f"{self._base}.{digest}.nbc"


def _read_own(file: Path) -> bytes:
    """The content of a file that only the user can have written; none of another, which might be anybody's."""
    status = file.lstat()
    if not stat.S_ISREG(status.st_mode) or status.st_uid != os.geteuid() or status.st_mode & 0o022:
        return b""
    return file.read_bytes()


class Keeper(caching._Cache):
    """What numba compiles of a function, on files that are whole; in place of numba's cache. It never ends a run.

    Args:
        function: as Python.
        folder: of the files.
        kind: how a compile result becomes data and is made from it.
        suffix: of the names of the files.
    """

    def __init__(
        self, function: Any, folder: Path, kind: Any = caching.CompileResultCacheImpl, suffix: str = ""
    ) -> None:
        self._function, self._folder, self._kind = function, folder, kind
        self._file = File(folder, _file_name(function) + suffix, _stamp(function))

    @property
    def cache_path(self) -> str:
        """The folder."""
        return str(self._folder)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """The compile result for arguments of these kinds, or None."""
        try:
            data = self._file.load(self._key(sig, target_context))
            if data is None:
                compiling()
                return None
            _provide_run_time()
            return self._kind.rebuild(self, target_context, data)
        except Exception as error:
            _warn_once(f"compiled code in {self._folder} cannot be used ({error}); it is made anew.")
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep one, unless it holds addresses of this process or needs more than to be loaded."""
        if data.library.has_dynamic_globals or data.reload_init:
            return
        try:
            self._file.save(self._key(sig, data.target_context), self._kind.reduce(self, data))
        except OSError as error:
            _warn_once(f"compiled code cannot be kept in {self._folder} ({error}); the next start compiles again.")

    def enable(self) -> None:
        """It always is."""

    def disable(self) -> None:
        """It never is."""

    def flush(self) -> None:
        """Remove all that was saved."""
        self._file.flush()

    def _key(self, sig: Any, target_context: Any) -> Any:
        function = self._function
        enclosed = [_name_of(cell.cell_contents) for cell in function.__closure__ or ()]
        return sig, target_context.codegen().magic_tuple(), sys.version_info[:2], function.__code__.co_code, enclosed


@cache
def _provide_run_time() -> None:
    """Functions that numba's code calls; numba itself names them once it compiles."""
    for name, address in _nrt_python.c_helpers.items():
        llvm.add_symbol(name if name.startswith("_") else f"NRT_{name}", address)


def _file_name(function: Any) -> str:
    return f"{function.__qualname__.replace('<locals>', 'of')}-{function.__code__.co_firstlineno}"


def _stamp(function: Any) -> Any:
    """Of the file, where no digest of the sources is part of the name of the folder."""
    if function.__module__.startswith("softhand."):
        return None
    status = Path(function.__code__.co_filename).stat()
    return status.st_mtime, status.st_size


def _name_of(value: Any) -> Any:
    """An enclosed value, as text that is the same in each process; the folder tells states of functions of softhand."""
    if isinstance(value, FunctionType) and value.__module__.startswith("softhand."):
        return value.__module__, value.__qualname__
    return hashlib.sha256(caching.dumps(value)).hexdigest()


@contextmanager
def kept_in(folder: Path) -> Iterator[None]:
    """Decorate inside this context to keep what numba compiles in a folder."""
    users: list[Any] = [dispatcher, ccallback]
    before = [user.FunctionCache for user in users]
    for user in users:
        user.FunctionCache = partial(Keeper, folder=folder)
    try:
        yield
    finally:
        for user, kept in zip(users, before, strict=True):
            user.FunctionCache = kept


def own_folder(name: str) -> Path:
    """A folder of that name which can be written by its owner alone, who is the user.

    Below the first of: `SOFTHAND_CACHE_DIR`, the user's cache folder, `softhand-UID` in the folder for temporary files;
    else a new folder for this process.
    """
    given = os.environ.get("SOFTHAND_CACHE_DIR")
    places = [Path(given)] if given else []
    places += [Path(platformdirs.user_cache_dir("softhand")), Path(tempfile.gettempdir()) / f"softhand-{os.getuid()}"]
    for place in places:
        if _is_own(place, is_given=str(place) == given) and _is_own(place / name):
            return place / name
    return Path(tempfile.mkdtemp(prefix="softhand-"))


def _is_own(folder: Path, is_given: bool = False) -> bool:
    """Whether a folder is there, or can be made, that only the user writes to; one that was given may be shared."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if is_given:
            return os.access(folder, os.W_OK)
        status = folder.lstat()
        if not stat.S_ISDIR(status.st_mode) or status.st_uid != os.geteuid():
            return False
        if stat.S_IMODE(status.st_mode) & 0o077:
            folder.chmod(0o700)
    except OSError:
        return False
    return os.access(folder, os.W_OK)


_warned: set[str] = set()


def _warn_once(text: str) -> None:
    kind = text.split("(")[0][:40]
    if kind not in _warned:
        _warned.add(kind)
        warnings.warn(text, KeptCodeWarning, stacklevel=3)
