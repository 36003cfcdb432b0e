"""Chunks on the workers of a Dask cluster: the scheduler carries numbers of chunks, and the workers write them."""

from __future__ import annotations

import asyncio
import socket
from collections import Counter
from collections.abc import Generator, Iterable, Iterator
from itertools import islice
from threading import Event
from typing import Any
from urllib.parse import urlsplit

from softhand.errors import StudyError, SweepStopped
from softhand.studies.sweeps.chunks import work_in
from softhand.studies.sweeps.store import Entry, Store

_AHEAD = 4  # chunks for each thread of the cluster that are handed out: the scheduler never sees the others
_TRIES = 3  # of a chunk whose worker is lost; Dask itself gives each of them four
_LATE = (TimeoutError, asyncio.TimeoutError)  # two before Python 3.11
_CONNECT, _WAIT = 20.0, 120.0  # [s]
_PATIENCE = "2s"


def in_cluster(store: Store, chunks: Iterable[int], scheduler: str) -> Generator[Entry, None, None]:
    """Make chunks on a cluster; entries come as they are done, in any order.

    Args:
        store: on a disk that all workers see under the same path.
        chunks: their numbers.
        scheduler: address of the scheduler, such as `tcp://localhost:8786`.

    Raises:
        StudyError: dask is missing, or there is no scheduler at that address, or a worker does not see the store or
            has other versions.
        SweepStopped: the scheduler was lost, or a chunk ended one worker after the other.
        RecordingError: a chunk cannot be written.
    """
    client = connect(scheduler)
    try:
        yield from _as_done(client, store, iter(chunks))
    finally:
        client.close(timeout=_PATIENCE)


def connect(scheduler: str) -> Any:
    """A client of the cluster; StudyError if there is none."""
    try:
        from distributed import Client
    except ImportError as error:
        raise StudyError(
            "--scheduler needs dask, which is not installed: pip install 'softhand[studies]'. Without it a sweep runs "
            "in threads of this machine.",
            key="scheduler", value=scheduler,
        ) from error  # fmt: skip
    try:
        _knock(scheduler)
        client = Client(scheduler, timeout=f"{_CONNECT}s", set_as_default=False)
    except (OSError, *_LATE, ValueError) as error:
        raise StudyError(
            f"{scheduler}: no scheduler of Dask answers there: {error}; start one with `dask scheduler`, and workers "
            "with `dask worker`.",
            key="scheduler", value=scheduler,
        ) from error  # fmt: skip
    try:
        client.wait_for_workers(1, timeout=_WAIT)
    except _LATE as error:
        client.close(timeout=_PATIENCE)
        raise StudyError(
            f"{scheduler}: no worker has come within {_WAIT:g} s; start some with `dask worker {scheduler}`.",
            key="scheduler", value=scheduler,
        ) from error  # fmt: skip
    return client


def _knock(scheduler: str) -> None:
    """Whether anybody listens at an address; a client that finds nobody leaves threads that keep a process alive.

    Raises:
        ValueError: it is no address.
        OSError: nobody listens.
    """
    place = urlsplit(scheduler if "://" in scheduler else f"tcp://{scheduler}")
    if place.scheme in ("tcp", "tls"):
        if not (place.hostname and place.port):
            raise ValueError("an address has a host and a port, such as tcp://head:8786")
        socket.create_connection((place.hostname, place.port), timeout=_CONNECT).close()


def thread_count(client: Any) -> int:
    """Threads of all workers, at least 1."""
    return max(sum(client.nthreads().values()), 1)


def _as_done(client: Any, store: Store, rest: Iterator[int]) -> Generator[Entry, None, None]:
    from distributed import CancelledError, KilledWorker, as_completed

    tries: Counter[int] = Counter()
    chunk_of: dict[str, int] = {}
    lost: list[int] = []

    def submit(chunk: int) -> Any:
        tries[chunk] += 1
        future = client.submit(
            make, str(store.folder.absolute()), store.digest, chunk,
            key=f"softhand-{store.digest[:16]}-{chunk}-{tries[chunk]}", pure=False,
        )  # fmt: skip
        chunk_of[future.key] = chunk
        return future

    futures = as_completed(loop=client.loop)  # holds no chunk that is done: a lost worker would have to repeat it
    futures.update([submit(chunk) for chunk in islice(rest, _AHEAD * thread_count(client))])
    for future in futures:
        chunk = chunk_of.pop(future.key)
        try:
            yield Entry(**future.result())
        except KilledWorker:
            if tries[chunk] < _TRIES:
                futures.add(submit(chunk))
            else:
                lost.append(chunk)
        except CancelledError as error:
            raise SweepStopped("The scheduler of the cluster was lost.", reason="lost") from error
        for more in islice(rest, max(_AHEAD * thread_count(client) - futures.count(), 0)):
            futures.add(submit(more))
    if lost:
        told = ", ".join(map(str, lost[:5]))
        raise SweepStopped(
            f"{len(lost)} chunks ended every worker that they were given to, perhaps for want of memory: {told}.",
            reason="lost",
        )


def make(folder: str, digest: str, chunk: int) -> dict[str, Any]:
    """The task: one chunk on a worker, by its number alone; one that a lost worker has written is not made again."""
    work = work_in(folder, digest)
    entry = work.store.entry(chunk) or work.run(chunk, Event())
    assert entry is not None
    return entry._asdict()
