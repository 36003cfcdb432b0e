"""Chromium as a process of our own: found, started with a pair of pipes, and ended."""

from __future__ import annotations

import contextlib
import fcntl
import os
import selectors
import shutil
import signal
import tempfile
import time
from pathlib import Path
from typing import IO

from softhand.errors import BrowserError

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome")
VARIABLE = "SOFTHAND_CHROMIUM"
_APPLICATION = Path("/Applications/Google Chrome.app/Contents/MacOS/Google Chrome")

_FLAGS = (
    "--headless",
    "--no-sandbox",  # it shows files of ours alone, and in most containers there is no sandbox to be had
    "--use-angle=swiftshader",  # WebGL without a graphics card, with the same picture everywhere
    "--enable-unsafe-swiftshader",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--mute-audio",
    "--no-first-run",
    "--no-default-browser-check",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-default-apps",
    "--disable-extensions",
    "--disable-sync",
    "--remote-debugging-pipe",
)
_READ_BY_CHROMIUM, _WRITTEN_BY_CHROMIUM = 3, 4  # file descriptors, fixed by --remote-debugging-pipe
_GRACE = 5.0  # [s] for Chromium to end by itself
_SHORT_FOLDER = "/tmp"
_LONGEST_FOLDER = 57  # characters; Chromium makes a socket 46 below it, and macOS takes 103 for the whole path


def find_chromium() -> str:
    """Path of the Chromium to use.

    Raises:
        BrowserError: there is none, or what SOFTHAND_CHROMIUM names is no program.
    """
    asked = os.environ.get(VARIABLE)
    if asked:
        found = shutil.which(asked)
        if found is None:
            raise BrowserError(f"{VARIABLE}: {asked!r} is no program; give the path of Chromium or unset it.")
        return found
    for name in (*NAMES, str(_APPLICATION)):
        found = shutil.which(name)
        if found is not None:
            return found
    raise BrowserError(
        "Chromium is not installed: install it, for instance with `apt install chromium`, "
        f"or give the path of Chromium or Chrome in {VARIABLE}."
    )


class Chromium:
    """A headless Chromium with an empty profile, as the leader of a process group: a Ctrl-C for us does not reach it.

    Attributes:
        path: of the program.
        folder: of its profile and its log.
        group: of its processes; 0 once it has ended.

    Args:
        path: of the program, see `find_chromium`.

    Raises:
        BrowserError: there is no place for its profile, or it does not start.
    """

    def __init__(self, path: str) -> None:
        self.path, self.group = path, 0
        with contextlib.ExitStack() as closing:  # of all that is there when something fails
            self.folder = _new_folder()
            closing.callback(shutil.rmtree, self.folder, ignore_errors=True)
            closing.callback(self._end_group)
            read_end, write_end = os.pipe()
            closing.callback(_close, to_chromium := os.fdopen(write_end, "wb"))
            from_chromium, far_end = os.pipe()
            closing.callback(os.close, from_chromium)
            self.group = self._spawn(read_end, far_end)
            ready = closing.enter_context(selectors.DefaultSelector())
            ready.register(from_chromium, selectors.EVENT_READ)
            self._to_chromium, self._from_chromium, self._ready = to_chromium, from_chromium, ready
            self._closing = closing.pop_all()

    def write(self, message: bytes) -> None:
        """Hand over bytes; OSError where Chromium is gone."""
        self._to_chromium.write(message)
        self._to_chromium.flush()

    def read(self, timeout: float) -> bytes | None:
        """What it says next; None if it says nothing in time [s], nothing at all if it has ended."""
        return os.read(self._from_chromium, 1 << 20) if self._ready.select(timeout) else None

    def last_words(self) -> str:
        """The last line that Chromium wrote, as the end of a message."""
        with contextlib.suppress(OSError):
            lines = Path(self.folder, "log").read_text(errors="replace").strip().splitlines()
            return f" Its last words: {lines[-1].strip()}" if lines else ""
        return ""

    def end(self) -> None:
        """End all its processes and remove its profile; may be called twice."""
        self._closing.close()

    def _spawn(self, *ends: int) -> int:
        """Start the program with its ends of the pipes, to read from and to write to; returns its process."""
        theirs = [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 10) for end in ends]  # clear of the numbers they get there
        log = os.path.join(self.folder, "log")
        try:
            return os.posix_spawn(
                self.path,
                [self.path, *_FLAGS, f"--user-data-dir={self.folder}", "about:blank"],
                {**os.environ, "TMPDIR": self.folder},
                file_actions=[
                    (os.POSIX_SPAWN_OPEN, 0, os.devnull, os.O_RDONLY, 0),
                    (os.POSIX_SPAWN_OPEN, 1, log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600),
                    (os.POSIX_SPAWN_DUP2, 1, 2),
                    (os.POSIX_SPAWN_DUP2, theirs[0], _READ_BY_CHROMIUM),
                    (os.POSIX_SPAWN_DUP2, theirs[1], _WRITTEN_BY_CHROMIUM),
                ],
                setpgroup=0,
            )
        except OSError as error:
            raise BrowserError(f"Chromium ({self.path}) cannot be started: {error.strerror}.") from error
        finally:
            for end in (*ends, *theirs):
                os.close(end)

    def _end_group(self) -> None:
        if self.group:
            _end(self.group)
            self.group = 0


def _close(pipe: IO[bytes]) -> None:
    """Close a pipe; what is left to be written is lost when Chromium is gone."""
    with contextlib.suppress(OSError):
        pipe.close()


def _new_folder() -> str:
    """For the profile and all else that Chromium leaves: among the temporary files, if that path is short enough."""
    longest = _LONGEST_FOLDER - len("/softhand-chromium-") - 8
    place = tempfile.gettempdir()
    if len(os.fsencode(place)) > longest:
        place = _SHORT_FOLDER
    try:
        return tempfile.mkdtemp(prefix="softhand-chromium-", dir=place)
    except OSError as error:
        raise BrowserError(
            f"{place}: cannot make a folder for Chromium here: {error.strerror}; "
            f"set TMPDIR to a folder that you may write to, of at most {longest} characters."
        ) from error


def _end(process: int) -> None:
    """Wait for a process that was told to end, then kill what is left of its group."""
    end = time.monotonic() + _GRACE
    while os.waitpid(process, os.WNOHANG) == (0, 0):
        if time.monotonic() > end:
            os.killpg(process, signal.SIGKILL)
            os.waitpid(process, 0)
            return
        time.sleep(0.01)
    with contextlib.suppress(ProcessLookupError, PermissionError):  # macOS denies it where the group is gone
        os.killpg(process, signal.SIGKILL)
