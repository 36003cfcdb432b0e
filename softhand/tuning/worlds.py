"""The worlds of a study: values that nobody can choose, drawn once for the search and once for the judgement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from softhand.assembly.resolve import Setup
from softhand.batch.variations import varied
from softhand.derivatives.parameters import Parameter, find_parameters
from softhand.errors import ScenarioError, SofthandError
from softhand.numerics.arrays import Array
from softhand.studies.keys import full_key, values_at
from softhand.studies.samples import at_unit, seed_keys, unit_points
from softhand.studies.study import Sample, Varied
from softhand.studies.study_file import StudyFile
from softhand.tuning.figures import has_noise
from softhand.tuning.knobs import leaves
from softhand.tuning.settings import Spread, Worlds


@dataclass(frozen=True)
class Drawn:
    """Values of the scenario by key, a table a world.

    Attributes:
        search: worlds of the search: a Latin hypercube.
        held_out: those that it never sees: independent of each other, so that the interval of a mean is known.
        keys: that vary.
    """

    search: list[dict[str, Any]]
    held_out: list[dict[str, Any]]
    keys: tuple[str, ...]


def read_worlds(file: StudyFile, settings: Worlds, table: Mapping[str, Any], setup: Setup) -> Drawn:
    """The worlds that `[worlds]` asks for; one of each kind where nothing varies and nothing is noisy.

    Raises:
        StudyError: a key is unknown or there twice, or the scenario does not take a value of it.
    """
    base = setup.scenario
    known = base.model_dump(exclude_none=True)
    entries: dict[str, Varied] = {}
    for keys, entry in leaves(table, Spread):
        key, place = ".".join(keys), ["worlds", "vary", *keys]
        own = file.section(Spread, entry, place)
        try:
            full, *also = (full_key(each, known) for each in (key, *own.also))
            read = Varied(**_resolved(own, full, setup), also=tuple(also))
            for end in read.ends:
                varied(base, values_at([(each, end) for each in (full, *also)], known), 0)
        except SofthandError as error:
            told = str(error).removeprefix("run 0 ").removeprefix("parameters: ")
            raise file.error(f"worlds.vary.{key}: {told}", place, key) from error
        taken = {each for one, old in entries.items() for each in (one, *old.also)}
        if twice := taken & {full, *also}:
            raise file.error(f"worlds.vary.{key}: {min(twice)} varies twice.", place, key)
        entries[full] = read
    seeds = seed_keys(base) if has_noise(base) else []
    counts = (settings.count, settings.held_out) if entries or seeds else (1, 1)
    methods = ("latin-hypercube", "random")
    drawn = []
    for k, (count, method) in enumerate(zip(counts, methods, strict=True)):
        stream = int(np.random.SeedSequence([settings.seed, k]).generate_state(1)[0]) % 10**9
        units = unit_points(Sample(method=method, count=count, seed=stream), len(entries))  # type: ignore[arg-type]
        drawn.append(_tables(entries, units, seeds, stream, known))
    every = [each for one, own in entries.items() for each in (one, *own.also)]
    return Drawn(drawn[0], drawn[1], tuple(every))


def _resolved(own: Spread, full: str, setup: Setup) -> dict[str, Any]:
    """The entry as a sweep has it: a factor becomes a range."""
    told = own.model_dump(exclude_none=True, exclude={"factor", "also"})
    if own.factor is None:
        return told
    found = find_parameters(setup.scenario, setup.world, [full])
    value = found[0].value if len(found) == 1 and isinstance(found[0], Parameter) else 0.0
    if value == 0.0:
        what = f"has {len(found)} numbers; give one of them, as {full}[0]" if len(found) > 1 else "is 0; give a range"
        raise ScenarioError(
            f"a factor needs one number of the scenario that is not 0, and {full} {what}.", key=full, value=own.factor
        )
    return {**told, "range": tuple(sorted(value * end for end in own.factor))}


def _tables(
    entries: Mapping[str, Varied], units: Array, seeds: list[str], stream: int, known: Mapping[str, Any]
) -> list[dict[str, Any]]:
    columns = {key: at_unit(entry, units[:, k]) for k, (key, entry) in enumerate(entries.items())}
    noise = np.random.default_rng([stream, 1]).integers(10**9, size=len(units))
    tables = []
    for row in range(len(units)):
        pairs: list[tuple[str, Any]] = []
        for key, entry in entries.items():
            value = columns[key][row]
            value = value.item() if isinstance(value, np.generic) else value
            pairs += [(each, value) for each in (key, *entry.also)]
        tables.append({**values_at(pairs, known), **{key: int(noise[row]) for key in seeds}})
    return tables
