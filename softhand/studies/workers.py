"""Work in several processes, none of which stays behind."""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from softhand.errors import SofthandError
from softhand.plugins import load_plugin_files, plugin_files

T = TypeVar("T")


class WorkerLost(SofthandError):
    """A process was ended from outside."""


def in_workers(jobs: int, function: Callable[..., T], cases: Sequence[tuple[Any, ...]]) -> Iterator[T]:
    """The results of a function, case by case, from processes of its own, which know the same plugin files.

    What asks the program to end is for this process alone: it ends the others when it is done with them for any reason,
    and they end by themselves when it is not there any more, however it went.

    Raises:
        WorkerLost: a process was ended by somebody else.
    """
    context = get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    with ProcessPoolExecutor(jobs, context, _begin, (theirs, plugin_files())) as pool, theirs:
        try:
            with _terminal_blocked():
                results = pool.map(function, *zip(*cases, strict=True))
            yield from results
        except BrokenProcessPool as error:
            raise WorkerLost("A process of the work was ended from outside, perhaps for want of memory.") from error
        except BaseException:
            ours.close()
            raise


def _begin(parent: Connection, files: Any) -> None:
    """What a process does first."""
    threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    load_plugin_files(files)


def _end_with(parent: Connection) -> None:
    """Wait for the other end of a pipe to be closed, by hand or because its process is no more, and end this process.

    Nothing is lost: a process of work has no file that is not written whole or not at all.
    """
    parent.poll(None)
    os._exit(0)


@contextmanager
def _terminal_blocked() -> Iterator[None]:
    """Processes that are started in here never see what a terminal sends to all of them, Ctrl-C and its end."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
