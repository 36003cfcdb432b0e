"""What a sweep costs beside its runs, and how a million runs go over 100 machines: python benchmarks/bench_sweep.py.

The first part is measured here, in processor time, which does not depend on what else the machine does: runs of
examples/study.toml, chunks of them as a sweep makes them, the size of the store, and what Dask takes to hand out a
task. The second part is a simulation of a cluster with these figures: machines of 16 workers, one scheduler, one file
system, and machines that fail. It writes docs/images/scale.png and prints the tables of docs/scale.md.
"""

from __future__ import annotations

import heapq
import time
from dataclasses import dataclass, replace
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from threading import Event

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from softhand import save_figure
from softhand.batch.series import Done
from softhand.plots.style import FINGERS, STYLE
from softhand.studies.loading import load_study
from softhand.studies.sweeps.chunks import Work
from softhand.studies.sweeps.store import Store, make_store

ROOT = Path(__file__).parent.parent
RUNS = 1_000_000
MEASURED = 240  # runs
SLOW = 50.0  # times longer: a controller in plain Python, or a task of a minute


@dataclass(frozen=True)
class Measured:
    """Of this machine.

    Attributes:
        runs: processor time of each run alone [s].
        overhead: of a chunk beside its runs [s], by runs in it.
        size: of the store [bytes a run].
        files: that a chunk writes.
    """

    runs: np.ndarray
    overhead: dict[int, float]
    size: float
    files: int


@dataclass(frozen=True)
class Cluster:
    """What is simulated; times in seconds."""

    machines: int = 100
    workers: int = 16
    """On each machine."""
    hand_out: float = 1e-3
    """Of the scheduler for a task."""
    create: float = 2e-4
    """Of the file system for a file: 5,000 a second."""
    start: float = 30.0
    """Until a worker has imported all and has its kernels."""
    between_failures: float = 30 * 86400.0
    """Of one machine, mean."""
    noticed: float = 60.0
    """Until the scheduler knows that a machine is gone."""
    repair: float = 600.0
    """Until the machine is there again."""
    spread: float = 0.1
    """Of the speed of machines, standard deviation."""


def measure() -> Measured:
    """Chunks of some lengths, and in each what goes into its runs: the rest is overhead."""
    studied = load_study(ROOT / "examples/study.toml")
    overhead = {}
    with TemporaryDirectory() as place:
        for length in (8, 40, MEASURED):
            folder = Path(place) / str(length)
            folder.mkdir()
            store = make_store(folder, studied.study, studied.base, length, {})
            work = Clocked(store)
            for run in range(20):
                work.one(run, Event())  # compiles
            work.taken.clear()
            begun = time.thread_time()
            for chunk in range(store.chunks):
                work.run(chunk, Event())
            total = time.thread_time() - begun
            overhead[length] = (total - sum(work.taken)) / store.chunks
        size = sum(file.stat().st_size for file in store.folder.rglob("*") if file.is_file()) / MEASURED
        files = 1 + sum(layout.fill is not None for layout in store.layouts.values())
    return Measured(np.array(work.taken), overhead, size, files)


class Clocked(Work):
    """Work that notes what each run takes [s]."""

    def __init__(self, store: Store) -> None:
        super().__init__(store)
        self.taken: list[float] = []

    def one(self, run: int, stop: Event) -> Done:
        """One run, by its number."""
        begun = time.thread_time()
        done = super().one(run, stop)
        self.taken.append(time.thread_time() - begun)
        return done


def measure_scheduler(tasks: int = 2000, ahead: int = 200) -> float | None:
    """Processor time of scheduler and driver for a task that does nothing [s]; None without Dask."""
    try:
        from distributed import Client, LocalCluster, as_completed
    except ImportError:
        return None
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        client.gather(client.map(int, range(100)))
        begun = time.process_time()
        futures = as_completed([client.submit(int, k, key=f"task-{k}") for k in range(ahead)])
        following = count(ahead)
        for future in futures:
            future.result()
            if (k := next(following)) < tasks:
                futures.add(client.submit(int, k, key=f"task-{k}"))
        return (time.process_time() - begun) / tasks


def simulate(cluster: Cluster, here: Measured, length: int, seed: int = 0) -> dict[str, float]:
    """A million runs in chunks of a length, event by event.

    A worker asks the scheduler, which serves one after the other; makes a chunk; writes its files through the file
    system, which serves one after the other too. A machine that fails takes its chunks with it; they are handed out
    anew once that is noticed.

    Returns:
        Wall time [s], share of the workers' time that went into runs, chunks made twice, and the load of the scheduler
        and of the file system.
    """
    rng = np.random.default_rng(seed)
    speed = np.exp(cluster.spread * rng.standard_normal(cluster.machines))
    chunks = -(-RUNS // length)
    mean, deviation = here.runs.mean() * length, here.runs.std() * np.sqrt(length)
    overhead = max(here.overhead[40] - here.overhead[8], 0.0) / 32 * length + here.overhead[8]
    ticket, events = count(), []
    for machine in range(cluster.machines):
        for _ in range(cluster.workers):
            heapq.heappush(events, (cluster.start * rng.uniform(0.7, 1.3), next(ticket), "free", machine, 0))
        heapq.heappush(events, (rng.exponential(cluster.between_failures), next(ticket), "fail", machine, 0))
    epoch = [0] * cluster.machines  # of each machine: how often it has failed
    waiting, done, again = chunks, 0, 0
    at_work = [0] * cluster.machines
    scheduler = disk = scheduler_busy = disk_busy = now = useful = 0.0
    idle: list[tuple[int, int]] = []
    while done < chunks:
        now, _, what, machine, age = heapq.heappop(events)
        if what == "fail":
            epoch[machine] += 1
            lost, at_work[machine] = at_work[machine], 0
            again += lost
            heapq.heappush(events, (now + cluster.noticed, next(ticket), "noticed", machine, lost))
            for _ in range(cluster.workers):
                heapq.heappush(
                    events, (now + cluster.repair + cluster.start, next(ticket), "free", machine, epoch[machine])
                )
            heapq.heappush(events, (now + cluster.repair + rng.exponential(cluster.between_failures), next(ticket),
                                    "fail", machine, 0))  # fmt: skip
            continue
        if what == "noticed":
            waiting += age
            ready, idle = idle, []
            for one, its_age in ready:
                heapq.heappush(events, (now, next(ticket), "free", one, its_age))
            continue
        if age != epoch[machine]:
            continue  # of a machine that is gone
        if what == "write":
            disk = max(disk, now) + here.files * cluster.create
            disk_busy += here.files * cluster.create
            heapq.heappush(events, (disk, next(ticket), "done", machine, age))
            continue
        if what == "done":
            done += 1
            at_work[machine] -= 1
            useful += mean / speed[machine]
        if waiting == 0:
            idle.append((machine, age))
            continue
        waiting -= 1
        at_work[machine] += 1
        scheduler = max(scheduler, now) + cluster.hand_out
        scheduler_busy += cluster.hand_out
        work = max(mean + deviation * rng.standard_normal(), 0.2 * mean) + overhead
        heapq.heappush(events, (scheduler + work / speed[machine], next(ticket), "write", machine, age))
    everyone = cluster.machines * cluster.workers * now
    return {"wall": now, "useful": useful / everyone, "again": again, "scheduler": scheduler_busy / now,
            "disk": disk_busy / now}  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One simulation: seconds of processor time of a chunk, runs in it, and what `simulate` found."""

    seconds: float
    length: int
    found: dict[str, float]


def draw(cases: dict[str, list[Row]], ideals: dict[str, float]) -> Figure:
    """Wall time over the length of a chunk, and what is at its limit."""
    with rc_context(STYLE):
        figure = Figure(figsize=(9.0, 3.6), facecolor="white")
        left, right = figure.subplots(1, 2, gridspec_kw={
            "left": 0.07, "right": 0.98, "top": 0.92, "bottom": 0.14, "wspace": 0.2})  # fmt: skip
        for k, (name, rows) in enumerate(cases.items()):
            x = [row.seconds for row in rows]
            left.loglog(x, [row.found["wall"] for row in rows], marker="o", ms=4, color=FINGERS[k], label=name)
            left.axhline(ideals[name], color=FINGERS[k], ls="--", lw=0.8)
        rows = next(iter(cases.values()))
        for k, (key, name) in enumerate((("scheduler", "scheduler"), ("disk", "file system"), ("useful", "workers"))):
            share = [100.0 * row.found[key] for row in rows]
            right.semilogx([row.seconds for row in rows], share, marker="o", ms=4, color=FINGERS[k], label=name)
        left.set_ylim(top=5e4)
        left.set_ylabel("wall time of a million runs [s]")
        right.set_ylabel("share of the time that it is at work [%]")
        right.set_ylim(0.0, 102.0)
        for axes, title in ((left, "(a)  how long it takes"), (right, "(b)  what is at its limit, 20 ms a run")):
            axes.set_xlabel("processor time of a chunk [s]")
            axes.set_title(title, loc="left", weight="normal")
            axes.legend()
            axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        left.yaxis.set_major_formatter(lambda value, _: f"{value:g}")
        left.yaxis.set_minor_formatter(NullFormatter())
    return figure


def main() -> None:
    """Measure, simulate, print and draw."""
    here = measure()
    one, spread, most = (1e3 * value for value in (here.runs.mean(), here.runs.std(), here.runs.max()))
    print(f"run: {one:.1f} ms mean, {spread:.1f} ms standard deviation, {most:.0f} ms at most")
    for length, own in here.overhead.items():
        share = 1e5 * own / (length * one)
        print(f"chunk of {length} runs, {length * one / 1e3:.2f} s: {1e3 * own:.1f} ms beside them, {share:.1f} %")
    print(f"store: {here.size:.0f} bytes a run in chunks of {MEASURED}; {here.files} files a chunk")
    slow = replace(here, runs=SLOW * here.runs)
    usual = Cluster()
    asked = {
        "20 ms a run, 100 machines": (usual, here, (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)),
        "20 ms a run, 10 machines": (replace(usual, machines=10), here, (0.3, 1.0, 3.0, 10.0, 30.0, 100.0)),
        "1 s a run, 100 machines": (usual, slow, (10.0, 30.0, 100.0, 300.0, 1000.0)),
        "1 s a run, each machine fails once an hour": (
            replace(usual, between_failures=3600.0), slow, (10.0, 30.0, 100.0, 300.0, 1000.0),
        ),
    }  # fmt: skip
    cases, ideals = {}, {}
    for name, (cluster, own, seconds) in asked.items():
        cases[name] = rows = []
        ideals[name] = RUNS * own.runs.mean() / (cluster.machines * cluster.workers)
        print(f"\n{name}: {ideals[name]:.0f} s if all were always at work\n")
        print("| chunk | runs in it | chunks | wall time | workers | scheduler | file system | chunks made twice |")
        print("|---|---|---|---|---|---|---|---|")
        for aimed in seconds:
            length = max(1, round(aimed / own.runs.mean()))
            row = Row(length * own.runs.mean(), length, simulate(cluster, own, length))
            rows.append(row)
            shares = " | ".join(f"{100.0 * row.found[key]:.0f} %" for key in ("useful", "scheduler", "disk"))
            wall, again = row.found["wall"], row.found["again"]
            parts = (
                f"{row.seconds:.3g} s",
                f"{length:,}",
                f"{-(-RUNS // length):,}",
                f"{wall:.0f} s",
                shares,
                f"{again:.0f}",
            )
            print(f"| {' | '.join(parts)} |", flush=True)
    print(f"\na million runs: {RUNS * one / 3.6e6:.1f} core hours; {RUNS * here.size / 1e6:.0f} MB")
    save_figure(draw(cases, ideals), ROOT / "docs/images/scale.png")
    task = measure_scheduler()
    print("Dask is not installed" if task is None else f"scheduler and driver: {1e3 * task:.2f} ms a task")


if __name__ == "__main__":
    main()
