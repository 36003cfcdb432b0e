"""Files that are written whole or not at all."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from softhand.errors import RecordingError

_OTHER_DISK = "free some space or choose a path on another disk"
_OTHER_FOLDER = "choose a folder that exists and that you may write to"
_REMEDIES = {
    **dict.fromkeys((errno.ENOSPC, errno.EDQUOT, errno.EFBIG), _OTHER_DISK),
    **dict.fromkeys((errno.ENOENT, errno.ENOTDIR, errno.EACCES, errno.EPERM, errno.EROFS), _OTHER_FOLDER),
}


def write_whole(path: Path, encode: Callable[[], bytes]) -> None:
    """Write what `encode` returns so that PATH is either the whole new content or untouched."""
    with _partial(path) as partial:
        partial.write_bytes(encode())
        os.replace(partial, path)


def fill_whole(path: Path, fill: Callable[[Path], None], size: int) -> None:
    """The same for content that `fill` writes itself, of about so many bytes; without room for them it is not begun."""
    with _partial(path) as partial:
        partial.touch()
        if shutil.disk_usage(partial.parent).free < size + _MARGIN:
            raise OSError(errno.ENOSPC, f"{size / 1e6:.0f} MB are needed, and {os.strerror(errno.ENOSPC)}")
        fill(partial)
        os.replace(partial, path)


_MARGIN = 10_000_000  # [bytes]


def check_place(path: Path) -> None:
    """Refuse a path that cannot be written, before the work for its content is done."""
    with _partial(path) as partial:
        partial.touch()


@contextmanager
def _partial(path: Path) -> Iterator[Path]:
    """A file beside PATH, gone at the end; what fails is told of PATH."""
    partial = Path(f"{path}.{os.getpid()}.partial")  # two processes may write the same file
    try:
        if path.exists() and not path.is_file():  # a device or a pipe would be replaced by a file
            raise IsADirectoryError(errno.EISDIR, "it is a folder or a device")
        yield partial
    except Exception as error:
        why = getattr(error, "strerror", None) or error
        remedy = _REMEDIES.get(getattr(error, "errno", None) or 0, "choose another path")
        raise RecordingError(f"{path}: cannot be written: {why}; {remedy}", file=path) from error
    finally:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
