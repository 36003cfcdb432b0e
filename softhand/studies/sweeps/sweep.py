"""All runs of a study, in threads or on a cluster, into a store that loses none; the same call goes on."""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Mapping
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event
from typing import Any

import numpy as np

from softhand.assembly.build import build
from softhand.batch.rollout import thread_count
from softhand.batch.run import FINISHED
from softhand.errors import RecordingError, SofthandError, StudyError, SweepStopped
from softhand.recording.variables import COMPONENTS, VARIABLES
from softhand.scenario.scenario import Scenario
from softhand.simulation.keep import Keep
from softhand.simulation.samples import labels_of
from softhand.studies.loading import Studied, as_study
from softhand.studies.study import Study
from softhand.studies.sweeps import cluster
from softhand.studies.sweeps.chunks import Work
from softhand.studies.sweeps.local import in_threads
from softhand.studies.sweeps.lock import locked
from softhand.studies.sweeps.result import Sweep
from softhand.studies.sweeps.store import Entry, Store, digest_of, find_store, made_with, make_store, mend

CHUNK = 1.0
"""Processor time of a chunk that is aimed at [s]: long beside what it costs to hand one out, short to lose."""

_HANDING = 0.005  # [s] of a chunk for each thread: five times what a scheduler takes to hand one out
_PROBES = 5  # runs by which the time of one is told
_EACH = 4  # chunks for each thread, at least
_MOST = 10_000  # runs in a chunk

Progress = Callable[[int, int], None]
"""Called with the number of runs that are done, and of all."""


def sweep(
    study: str | Path | Mapping[str, Any],
    out: str | Path | None = None,
    threads: int | None = None,
    scheduler: str | None = None,
    chunk: int | None = None,
    progress: Progress | None = None,
) -> Sweep:
    """Make all runs of a study, or those that are still missing.

        swept = softhand.sweep("study.toml")
        swept.rate(), swept.numbers["position_error"], swept.to_xarray()

    Runs are made and written in chunks. A chunk is in the store whole or not at all, so whatever ends this call, the
    same call goes on where it was. The numbers do not depend on chunks, threads, workers and interruptions, to the last
    bit.

    Args:
        study: path of a TOML file, or its tables.
        out: folder of the store and of what is made of it; `runs/sweep-NAME` if not given, by the name of the file.
        threads: at work at the same time on this machine; as many as there are processors if not given.
        scheduler: address of a Dask scheduler whose workers make the runs instead; they must see the folder.
        chunk: runs in a chunk; as many as take about `CHUNK` if not given.
        progress: called after each chunk.

    Raises:
        StudyError: the study is wrong, or the folder has the store of another one, or of other versions.
        SweepStopped: interrupted, or disk or workers were lost; the same call goes on.
    """
    studied = as_study(study)
    folder = Path(out) if out is not None else folder_of(studied)
    _check_names(studied)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StudyError(f"{folder}: cannot make this folder: {error.strerror}.", file=folder) from error
    with locked(folder):
        store = find_store(folder)
        if store is not None:
            _check_same(store, studied, chunk)
            mend(store)
        count = thread_count(threads)
        done = store.entries() if store else {}
        if store is None or len(done) < store.chunks:
            if store is None:
                store = _new(folder, studied, chunk, _at_work(scheduler, count))
            elif store.made_with != made_with():
                raise StudyError(_other_versions(store, len(done)), file=folder)
            _make(store, done, count, scheduler, progress or (lambda done, runs: None))
    return Sweep(store)


def folder_of(studied: Studied) -> Path:
    """Where a study goes if nobody says."""
    return Path("runs") / f"sweep-{studied.file.path.stem}"


def _at_work(scheduler: str | None, threads: int) -> int:
    """Threads that will share the chunks."""
    if scheduler is None:
        return threads
    client = cluster.connect(scheduler)
    try:
        return cluster.thread_count(client)
    finally:
        client.close()


def _new(folder: Path, studied: Studied, chunk: int | None, threads: int) -> Store:
    """An empty store."""
    study, base = studied.study, studied.base
    if chunk is not None and (isinstance(chunk, bool) or not isinstance(chunk, int) or chunk < 1):
        raise StudyError(f"chunk: got {chunk!r}; give a whole number, at least 1.", key="chunk", value=chunk)
    labels = _labels(studied) if study.keep.variables else {}
    if chunk is None:
        chunk = _chunk(study, base, threads)
    return make_store(folder, study, base, chunk, labels)


def _chunk(study: Study, base: Scenario, threads: int) -> int:
    """Runs that take about `CHUNK`, by the first of them; fewer where all threads would not have their share.

    With many threads chunks are longer, so that the scheduler has no more to do than it can, see docs/scale.md.
    """
    bare = study.model_copy(update={"keep": study.keep.model_copy(update={"variables": ()})})
    whole: list[float] = []
    others: list[float] = []
    with TemporaryDirectory() as place:
        work = Work(make_store(Path(place), bare, base, _MOST, {}))
        runs = work.store.runs
        for run in range(min(_PROBES, runs)):
            begun = time.thread_time()
            is_whole = work.one(run, Event()).outcome.reason == FINISHED
            (whole if is_whole else others).append(time.thread_time() - begun)
    one = max(min(whole or others), 1e-6)  # the first compiles
    length = max(CHUNK, _HANDING * threads)
    return max(1, min(int(length / one), -(-runs // (_EACH * threads)), _MOST))


def _labels(studied: Studied) -> dict[str, Any]:
    """Times and names along the arrays that are kept, of the scenario that all runs share."""
    base, keep = studied.base, studied.study.keep
    for key in studied.study.vary:
        if key in ("duration", "control_period"):
            raise studied.file.error(
                f"vary.{key}: arrays that are kept have the same times in all runs; leave out keep.variables.",
                ["keep", "variables"],
            )
    try:
        named = labels_of(build(base).plant, is_pushed=True)
    except SofthandError as error:
        raise studied.file.error(f"keep: the scenario of the study cannot begin: {error}", ["keep"]) from error
    samples = Keep.of(keep.variables, keep.every, base.control_period).samples(
        round(base.duration / base.control_period)
    )
    used = {dim for name in keep.variables for dim in VARIABLES[name].dims[1:] if dim not in COMPONENTS}
    time_of = np.round(keep.every * np.arange(samples), 12)
    return {"time": time_of, **{dim: named[dim] for dim in used}}


def _check_names(studied: Studied) -> None:
    """Names of outcomes beside those that a store has anyway."""
    taken = {"run", "point", "repeat", "seed", "outcome", "stop_time", "message", "success", "time"}
    taken |= {*studied.study.vary, *studied.study.keep.variables}
    for name in studied.study.outcomes:
        if name in taken or not name.isidentifier():
            why = "is taken by the store" if name in taken else "is no name of letters, digits and _"
            raise studied.file.error(f"outcomes.{name}: this name {why}; choose another.", ["outcomes", name])


def _check_same(store: Store, studied: Studied, chunk: int | None) -> None:
    """Refuse the store of another study."""
    if store.digest != digest_of(studied.study, studied.base):
        raise StudyError(
            f"{store.folder}: holds the runs of another study: {_difference(store, studied)}. It is not overwritten; "
            "choose another folder with --out, or remove this one.",
            file=store.folder,
        )
    if chunk is not None and chunk != store.chunk:
        raise StudyError(
            f"chunk: got {chunk}, and the store in {store.folder} has chunks of {store.chunk} runs; leave it out.",
            file=store.folder, key="chunk", value=chunk,
        )  # fmt: skip


def _difference(store: Store, studied: Studied) -> str:
    """What is not the same, in words."""
    pairs = (("", store.study.model_dump(), studied.study.model_dump()),
             ("scenario ", store.base.model_dump(), studied.base.model_dump()))  # fmt: skip
    for what, before, now in pairs:
        for key in {**before, **now}:
            if key != "description" and before.get(key) != now.get(key):
                return f"{what}{key} was {_short(before.get(key))}, and is {_short(now.get(key))}"
    return "a file that it names, a URDF or a plugin, has changed"


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:76]} ..."


def _other_versions(store: Store, done: int) -> str:
    own = made_with()
    told = ", ".join(
        f"{name} {store.made_with.get(name)} (here {own[name]})"
        for name in own
        if own[name] != store.made_with.get(name)
    )
    return (
        f"{store.folder}: {done} of {store.chunks} chunks were made with {told}, and runs of two versions are not "
        "mixed in one store. Go on with those versions, or choose another folder with --out."
    )


def _make(store: Store, done: dict[int, Entry], threads: int, scheduler: str | None, progress: Progress) -> None:
    """The chunks that are missing."""
    missing = [chunk for chunk in range(store.chunks) if chunk not in done]
    count = sum(entry.runs for entry in done.values())
    progress(count, store.runs)
    try:
        with closing(_entries(store, missing, threads, scheduler)) as entries:
            for entry in entries:
                count += entry.runs
                progress(count, store.runs)
    except (KeyboardInterrupt, SweepStopped, RecordingError) as error:
        is_ctrl_c = isinstance(error, KeyboardInterrupt)
        why = "interrupted:" if is_ctrl_c else f"{str(error).rstrip('.')}."
        count = sum(entry.runs for entry in store.entries().values())  # others than those that were told of, too
        raise SweepStopped(
            f"{why} {count} of {store.runs} runs are done and kept in {store.folder}; the same command goes on.",
            reason="interrupted" if is_ctrl_c else "lost", done=count, runs=store.runs, folder=store.folder,
        ) from error  # fmt: skip


def _entries(store: Store, missing: list[int], threads: int, scheduler: str | None) -> Generator[Entry, None, None]:
    if scheduler is None:
        return in_threads(Work(store), missing, min(threads, len(missing)))
    return cluster.in_cluster(store, missing, scheduler)
