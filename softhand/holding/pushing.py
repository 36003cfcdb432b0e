"""Pushes in threads, each with a run of its own that it pushes again and again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from threading import Event, local
from typing import Any, TypeVar

from softhand.batch.rollout import Progress, thread_count
from softhand.holding.pushed_run import PushedRun

T = TypeVar("T")


class Pushing:
    """Threads that push.

    Args:
        made: makes a run that stops where a function says so.
        threads: as in `rollout`.
        progress: called with what is done, and with all, of each series.
    """

    def __init__(
        self, made: Callable[[Callable[[], bool]], PushedRun], threads: int | None, progress: Progress | None
    ) -> None:
        self._made, self._progress = made, progress
        self._seat, self._stop = local(), Event()
        self._runs: list[PushedRun] = []
        self._pool = ThreadPoolExecutor(thread_count(threads))

    def __enter__(self) -> Pushing:
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._pool.shutdown(cancel_futures=True)

    @property
    def runs(self) -> int:
        """That were simulated."""
        return sum(run.count for run in self._runs)

    def map(self, work: Callable[..., T], items: Sequence[tuple[Any, ...]]) -> list[T]:
        """What `work(run, *item)` gives for each item, in their order."""
        futures = [self._pool.submit(self._one, work, item) for item in items]
        waiting = set(futures)
        while waiting:
            ready, waiting = wait(waiting, timeout=0.5, return_when=FIRST_COMPLETED)  # ends, so that Ctrl-C is heard
            for future in ready:
                future.result()
            if self._progress is not None:
                self._progress(len(futures) - len(waiting), len(futures))
        return [future.result() for future in futures]

    def _one(self, work: Callable[..., T], item: tuple[Any, ...]) -> T:
        run = getattr(self._seat, "run", None)
        if run is None:
            run = self._seat.run = self._made(self._stop.is_set)
            self._runs.append(run)
        return work(run, *item)
