"""Machine code on disk: where it lies, and files that are known to be whole.

Code from disk is run, so it is read only from a folder that nobody else can write to, and only if it is what was
written there: each file carries a digest. What is damaged is made anew, what cannot be written stays in memory.
"""

from __future__ import annotations

import hashlib
import os
import pickle
import stat
import tempfile
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import platformdirs
from numba.core import caching, ccallback, dispatcher

_DIGEST = 32  # bytes


class KeptCodeWarning(UserWarning):
    """Machine code cannot be kept, or was damaged."""


class File:
    """The code of one function for all kinds of arguments, a file each; stands in for numba's index and data files."""

    def __init__(self, folder: str, base: str, stamp: Any) -> None:
        self._folder, self._base, self._stamp = Path(folder), base, stamp

    def load(self, key: Any) -> Any:
        """What was saved under a key; None if there is nothing, or nothing that can be trusted."""
        try:
            sealed = _read_own(self._file(key))
        except OSError:
            return None
        content = sealed[_DIGEST:]
        if hashlib.sha256(content).digest() != sealed[:_DIGEST]:
            _warn_once(f"compiled code in {self._folder.parent} was damaged or not yours; it is made anew.")
            return None
        name, data = pickle.loads(content)
        return data if name == self._name(key) else None

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
        return repr((numba.__version__, self._stamp, key))

    def _file(self, key: Any) -> Path:
        digest = hashlib.sha256(self._name(key).encode()).hexdigest()[:24]
        return self._folder / f"{self._base}.{digest}.nbc"


def _read_own(file: Path) -> bytes:
    """The content of a file that only the user can have written; none of another, which might be anybody's."""
    status = file.lstat()
    if not stat.S_ISREG(status.st_mode) or status.st_uid != os.geteuid() or status.st_mode & 0o022:
        return b""
    return file.read_bytes()


class _Keeper(caching.FunctionCache):
    """numba's cache of a function, on files that are whole; it never ends a run."""

    def __init__(self, function: Any) -> None:
        super().__init__(function)
        locator = self._impl.locator
        self._cache_file: Any = File(locator.get_cache_path(), self._impl.filename_base, locator.get_source_stamp())

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception as error:
            _warn_once(f"compiled code in {self.cache_path} cannot be used ({error}); it is made anew.")
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _warn_once(f"compiled code cannot be kept in {self.cache_path} ({error}); the next start compiles again.")


@contextmanager
def kept_in(folder: Path) -> Iterator[None]:
    """Decorate inside this context to keep what numba compiles in a folder."""
    config: Any = numba.config
    users: list[Any] = [dispatcher, ccallback]
    before = config.CACHE_DIR, [user.FunctionCache for user in users]
    config.CACHE_DIR = str(folder)
    for user in users:
        user.FunctionCache = _Keeper
    try:
        yield
    finally:
        config.CACHE_DIR = before[0]
        for user, kept in zip(users, before[1], strict=True):
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
