"""Thousands of grasps of one hand and one object, brought to rest and judged, as one data set."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Generator
from functools import lru_cache
from itertools import count as count_from
from pathlib import Path

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError, ScenarioError, SimulationStopped
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.settings.settings import read_settings
from softhand.settings.toml import parse_toml
from softhand.studies.grasps.cache import GraspCache
from softhand.studies.grasps.sampling import Sampled, Sampler, Spread
from softhand.studies.grasps.variables import KEPT
from softhand.studies.workers import in_workers
from softhand.version import __version__

_BARREN = 200  # poses in a row without a grasp, after which there are none to be expected
_EVERY = 30.0  # [s] after which what is done is written
_MOST_POSES = 100_000  # that processes are told of at once


def sample_grasps(
    scenario: Scenario | str | Path,
    count: int = 10_000,
    seed: int = 0,
    *,
    position: float = 0.01,
    turn: float = 0.3,
    file: str | Path | None = None,
    jobs: int = 1,
    progress: Callable[[float], None] | None = None,
) -> GraspCache:
    """Grasps at rest by chance, with their figures: poses of the object, places that the fingers reach, squeezes.

        cache = softhand.sample_grasps("target-a", 10_000, file="grasps.nc")
        best = cache.grasp(int(cache.margin.argmax()))      # a scenario that runs

    The object is put at random poses about that of the scenario. At each, every finger keeps those of some random
    points of the surface that it reaches well, as `propose_grasps` has it, and random choices of them, a finger each,
    are squeezed as little as keeps the friction use below a random share, each tip pressing with a random force. What
    is then at rest, with the fingers apart and within their limits, is kept with the figures of `grasp_quality`. It is
    a wide sample, not an even one: grasps of one pose share it, and places that many fingers reach come more often.

    The same seed gives the same grasps, for any number of processes, and whether it was interrupted or not.

    Args:
        scenario: hand, object and its pose; of its grasp only the guess is used.
        count: of grasps.
        seed: of the sampling.
        position: largest way of the object along each axis [m].
        turn: largest turn of the object [rad].
        file: NetCDF-4 that is written now and then and at the end; one that is there goes on, if it is of the same
            scenario, seed and spread.
        jobs: processes to work in; a script then needs `if __name__ == "__main__":` around the call.
        progress: called with the number of grasps.

    Raises:
        ScenarioError: an argument is wrong, or the file is of another sampling.
        GraspError: no grasp is found in many poses; says what stands in the way.
        SimulationStopped: interrupted, with what is done in `.rows`, and in the file.
    """
    base = as_scenario(scenario)
    _check(count, seed, position, turn, jobs)
    spread, text = Spread(float(position), float(turn)), base.to_toml()
    path = None if file is None else Path(file)
    done = _Done(base, text, seed, spread)
    if path is not None and path.exists():
        done.go_on_from(_matching(path, text, seed, spread))
    if len(done) >= count:
        return done.cache(count)
    written = time.monotonic()
    poses = _poses(text, seed, spread, done.poses, jobs)
    try:
        for index, sampled in poses:
            done.take(index, sampled)
            if progress is not None:
                progress(float(min(len(done), count)))
            if len(done) >= count:
                break
            if path is not None and time.monotonic() - written > _EVERY:
                done.cache(count).save(path)
                written = time.monotonic()
    except KeyboardInterrupt as stop:
        found = done.cache(count)
        if path is not None:
            found.save(path)
        where = f" They are in {path}, and the same call goes on." if path is not None else ""
        raise SimulationStopped(
            f"interrupted after {len(found)} of {count} grasps.{where}", rows=found, reason="interrupted"
        ) from stop
    finally:
        poses.close()
    found = done.cache(count)
    if path is not None:
        found.save(path)
    return found


def _check(count: int, seed: int, position: float, turn: float, jobs: int) -> None:
    for name, value, least in (("count", count, 1), ("seed", seed, 0), ("jobs", jobs, 1)):
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise ScenarioError(f"{name}: got {value!r}; give a whole number, at least {least}.", key=name, value=value)
    for name, way, most in (("position", position, 1.0), ("turn", turn, np.pi)):
        if not 0.0 <= way <= most:
            raise ScenarioError(f"{name}: got {way!r}; give a number from 0 to {most:.3g}.", key=name, value=way)


def _matching(path: Path, text: str, seed: int, spread: Spread) -> GraspCache:
    """What is in a file, if the same call wrote it."""
    before = GraspCache.load(path)
    for what, own, asked in (
        ("scenario", before.scenario, text), ("seed", before.seed, seed), ("spread", before.spread, tuple(spread)),
        ("version of softhand", before.version, __version__),
    ):  # fmt: skip
        if own != asked:
            told = "" if what == "scenario" else f", {own} and not {asked}"
            raise ScenarioError(
                f"{path}: its grasps are of another {what}{told}; choose another file.", key="file", value=str(path)
            )
    return before


class _Done:
    """What is found, in the order of the poses."""

    def __init__(self, base: Scenario, text: str, seed: int, spread: Spread) -> None:
        self._text, self._seed, self._spread = text, seed, spread
        self._sampler = _sampler(text, spread)
        self._before: GraspCache | None = None
        self._grasps: list[dict[str, Array]] = []
        self._refused: Counter[str] = Counter()
        self._last: Counter[str] = Counter()
        self.poses = 0
        self._barren = 0

    def __len__(self) -> int:
        return len(self._grasps) + (0 if self._before is None else len(self._before))

    def go_on_from(self, before: GraspCache) -> None:
        """Grasps of a file; those of a pose that was not looked at to the end are left out."""
        whole = int(np.count_nonzero(before.pose < before.poses))
        self._before, self.poses = before.first(whole, before.poses), before.poses
        self._refused.update(before.refused)

    def take(self, index: int, sampled: Sampled) -> None:
        """What the next pose gave."""
        self._grasps += [{"pose": np.array(float(index)), **grasp} for grasp in sampled.grasps]
        self._refused.update(self._last)
        self._last = sampled.refused
        self.poses = index + 1
        self._barren = 0 if sampled.grasps else self._barren + 1
        if self._barren >= _BARREN:
            why = ", ".join(f"{what} {times} times" for what, times in (self._refused + self._last).most_common(4))
            raise GraspError(
                f"no grasp at rest was found in {_BARREN} poses of the object in a row. What stood in the way: {why}. "
                "See softhand grasp --propose for one pose, place the object in reach, or let it vary less.",
                finger="", quantity="reach", value=self._barren,
            )  # fmt: skip

    def cache(self, count: int) -> GraspCache:
        """So many grasps at most; if there are more, the last pose counts as not looked at to its end."""
        world = self._sampler.world
        tips = [tip.name for tip in world.tips]
        pairs = [f"{tips[i]}-{tips[j]}" for i, j in contact_pairs(len(tips))]
        sizes = {"finger": len(tips), "joint": world.n_joints, "pair": len(pairs), "xyz": 3, "rpy": 3,
                 "force_component": 4, "wrench": 6}  # fmt: skip
        variables = {}
        for name, kept in KEPT.items():
            own = np.array([grasp[name] for grasp in self._grasps]).reshape(-1, *(sizes[dim] for dim in kept.dims))
            variables[name] = own if self._before is None else np.concatenate([self._before[name], own])
        labels = {"finger": tuple(tips), "joint": tuple(world.joint_names), "pair": tuple(pairs)}
        is_whole = len(self) <= count
        refused = dict(self._refused + self._last if is_whole else self._refused)
        found = GraspCache(
            variables,
            labels,
            self._text,
            self._seed,
            (self._spread.position, self._spread.turn),
            self.poses,
            refused,
            __version__,
        )
        return found if is_whole else found.first(count, int(found.pose[count - 1]))


def _poses(text: str, seed: int, spread: Spread, first: int, jobs: int) -> Generator[tuple[int, Sampled], None, None]:
    """Numbers of poses and their grasps, one after the other without end."""
    if jobs == 1:
        for index in count_from(first):
            yield index, _work(text, seed, spread, index)
    while True:
        cases = [(text, seed, spread, index) for index in range(first, first + _MOST_POSES)]
        yield from enumerate(in_workers(jobs, _work, cases), first)
        first += _MOST_POSES


def _work(text: str, seed: int, spread: Spread, index: int) -> Sampled:
    return _sampler(text, spread).at(seed, index)


@lru_cache(maxsize=2)
def _sampler(text: str, spread: Spread) -> Sampler:
    """One for all poses of a process."""
    return Sampler(read_settings(Scenario, parse_toml(text), ""), spread)
