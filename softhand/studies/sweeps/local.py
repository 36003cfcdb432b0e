"""Chunks in threads of this process, each of which makes whole chunks by itself."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from itertools import islice
from threading import Event

from softhand.studies.sweeps.chunks import Work
from softhand.studies.sweeps.store import Entry

_AHEAD = 2  # chunks for each thread that are handed out


def in_threads(work: Work, chunks: Iterable[int], threads: int) -> Generator[Entry, None, None]:
    """Make chunks in threads; entries come as they are done, in any order.

    Whatever ends the caller ends the runs that are under way as well: their chunks are as if they had not begun.

    Raises:
        RecordingError: a chunk cannot be written.
    """
    stop, rest = Event(), iter(chunks)
    with ThreadPoolExecutor(threads) as pool:
        waiting: set[Future[Entry | None]] = set()
        try:
            while True:
                for chunk in islice(rest, max(_AHEAD * threads - len(waiting), 0)):
                    waiting.add(pool.submit(work.run, chunk, stop))
                if not waiting:
                    return
                ready, waiting = wait(waiting, timeout=0.5, return_when=FIRST_COMPLETED)  # so that Ctrl-C is heard
                for future in ready:
                    entry = future.result()
                    if entry is not None:
                        yield entry
        finally:
            stop.set()
            for future in waiting:
                future.cancel()
