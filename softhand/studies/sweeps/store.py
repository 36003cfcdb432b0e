"""The store of a sweep: arrays of all runs, a manifest of the chunks that are done, and what they are runs of."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from functools import cached_property
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from softhand.errors import ScenarioError, StudyError
from softhand.numerics.arrays import AnyArray
from softhand.plugins import plugin_files
from softhand.recording.variables import COMPONENTS, VARIABLES
from softhand.recording.whole_file import write_whole
from softhand.scenario.file import resolve_path
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import read_settings
from softhand.settings.toml import parse_toml
from softhand.studies.samples import Samples, draw
from softhand.studies.study import Study
from softhand.studies.sweeps.arrays import (
    Layout,
    checksum,
    read_array,
    read_group,
    remove_partial,
    write_chunk,
    write_group,
)
from softhand.version import __version__

FORMAT = 1
"""Of the store; another one is not read."""

NOT_RUN = "not run"
"""In place of an outcome and a message, as long as there is none."""

_MADE_WITH = ("pin", "numba", "numpy", "scipy")
_NAME, _MANIFEST = "runs.zarr", "manifest"
_FILES = ("hand.urdf", "hand.arm.urdf", "object.urdf", "controller.gain_file")
_LONGEST = 200  # letters of a message


def made_with() -> dict[str, str]:
    """Versions on which the bits of a run depend."""
    return {"softhand": __version__, **{name: version(name) for name in _MADE_WITH}}


class Entry(NamedTuple):
    """A chunk in the manifest."""

    chunk: int
    runs: int
    seconds: float
    """Of processor time that it took [s]."""
    ends: dict[str, int]
    """How many of its runs ended how."""
    checksums: dict[str, int]


class Store:
    """A store that is there; `make` makes one, `find` opens one.

    Attributes:
        folder: of the sweep.
        study: which its runs are of.
        base: the scenario that they share.
        chunk: runs in a chunk.
        runs: how many there are.
        layouts: of all arrays by name.
        made_with: versions that it was made with.
        digest: of all that a run depends on.
        plugins: files that were given.
    """

    def __init__(self, folder: Path, layouts: dict[str, Layout], about: Mapping[str, Any]) -> None:
        self.folder, self.layouts = folder, layouts
        self.study = read_settings(Study, parse_toml(about["study"]), "")
        self.base = read_settings(Scenario, parse_toml(about["scenario"]), "")
        self.chunk, self.runs, self.digest = int(about["chunk"]), int(about["runs"]), str(about["digest"])
        self.made_with: dict[str, str] = dict(about["made_with"])
        self.plugins: list[str] = list(about["plugins"])

    @property
    def group(self) -> Path:
        """The folder that `xarray.open_zarr` takes."""
        return self.folder / _NAME

    @cached_property
    def samples(self) -> Samples:
        """The values of all runs, drawn anew, which gives the same."""
        return draw(self.study)

    @cached_property
    def table(self) -> dict[str, Any]:
        """The base as tables."""
        return self.base.model_dump(exclude_none=True)

    @property
    def chunks(self) -> int:
        """How many there are."""
        return -(-self.runs // self.chunk)

    def runs_of(self, chunk: int) -> range:
        """Numbers of its runs."""
        return range(chunk * self.chunk, min((chunk + 1) * self.chunk, self.runs))

    def write(self, chunk: int, arrays: Mapping[str, AnyArray], seconds: float, ends: Mapping[str, int]) -> Entry:
        """Write a chunk, and only then its line of the manifest.

        Raises:
            RecordingError: it cannot be written.
        """
        sums = {
            name: write_chunk(self.group, name, self.layouts[name], chunk, values) for name, values in arrays.items()
        }
        entry = Entry(chunk, len(self.runs_of(chunk)), seconds, dict(ends), sums)
        text = json.dumps(entry._asdict())
        write_whole(self._line(chunk), lambda: text.encode())
        return entry

    def entry(self, chunk: int) -> Entry | None:
        """The line of a chunk that is done, and is on the disk as it was written; else None."""
        try:
            entry = Entry(**json.loads(self._line(chunk).read_text()))
        except (OSError, ValueError, TypeError):
            return None
        is_whole = all(self._checksum(name, chunk) == own for name, own in entry.checksums.items())
        return entry if is_whole else None

    def entries(self) -> dict[int, Entry]:
        """Those of all chunks that are done."""
        found = ((chunk, self.entry(chunk)) for chunk in range(self.chunks))
        return {chunk: entry for chunk, entry in found if entry is not None}

    def read(self, name: str) -> AnyArray:
        """An array of all runs, its fill value where they are not done."""
        return read_array(self.group, name, self.layouts[name])

    def _checksum(self, name: str, chunk: int) -> int | None:
        return checksum(self.group, name, self.layouts[name], chunk) if name in self.layouts else None

    def _line(self, chunk: int) -> Path:
        return self.folder / _MANIFEST / f"{chunk:07d}.json"


def find_store(folder: Path) -> Store | None:
    """The store in a folder; None if there is none.

    Raises:
        StudyError: it cannot be read, or is of another format.
    """
    group = folder / _NAME
    if not group.exists():
        return None
    try:
        layouts, about = read_group(group)
        found = about.get("softhand_sweep")
        if found == FORMAT:
            return Store(folder, layouts, about)
    except (OSError, KeyError, TypeError, ValueError, AttributeError, ScenarioError) as error:
        raise StudyError(f"{group}: cannot be read: {error}; choose another folder with --out.", file=folder) from error
    told = "no store of a sweep" if found is None else f"a store of format {found}, and format {FORMAT} is read here"
    raise StudyError(f"{group}: is {told}; choose another folder with --out.", file=folder)


def make_store(folder: Path, study: Study, base: Scenario, chunk: int, labels: Mapping[str, Any]) -> Store:
    """Make an empty store, whole or not at all.

    Args:
        folder: of the sweep; it is there.
        study: which the runs are of.
        base: the scenario that they share.
        chunk: runs in a chunk.
        labels: `time` and names along the dimensions of the variables that are kept; nothing if there are none.

    Raises:
        RecordingError, StudyError: it cannot be written.
    """
    samples = draw(study)
    given = _given(samples)
    layouts = {**{name: own for name, (own, _) in given.items()}, **_asked(study, len(samples), chunk, labels)}
    about = {
        "title": "softhand: a sweep",
        "coordinates": " ".join(given),
        "softhand_sweep": FORMAT,
        "made_with": made_with(),
        "digest": digest_of(study, base),
        "runs": len(samples),
        "chunk": chunk,
        "study": study.to_toml(),
        "scenario": base.to_toml(),
        "plugins": [str(file.absolute()) for file in plugin_files()],
    }
    new = folder / f"{_NAME}.{os.getpid()}.partial"
    shutil.rmtree(new, ignore_errors=True)
    try:
        write_group(new, layouts, about)
        (folder / _MANIFEST).mkdir(exist_ok=True)
        for name, (layout, values) in given.items():
            write_chunk(new, name, layout, 0, values)
        for name, own in _labels(labels).items():
            write_chunk(new, name, layouts[name], 0, own)
        os.replace(new, folder / _NAME)
    except OSError as error:
        raise StudyError(f"{folder}: cannot be written: {error.strerror or error}.", file=folder) from error
    finally:
        shutil.rmtree(new, ignore_errors=True)
    store = find_store(folder)
    assert store is not None
    return store


def mend(store: Store) -> None:
    """Remove what killed processes left half written, and put back what is known of the runs if it is gone."""
    remove_partial(store.folder)
    for name, (layout, values) in _given(store.samples).items():
        if checksum(store.group, name, layout, 0) is None:
            write_chunk(store.group, name, layout, 0, values)


def digest_of(study: Study, base: Scenario) -> str:
    """A digest of all that the runs of a study depend on: settings, scenario, its files, and files of plugins."""
    told = study.model_dump(mode="json", exclude={"description", "scenario"})
    parts = [json.dumps([told, base.model_dump(mode="json", exclude={"description"})], sort_keys=True)]
    parts += [f"{path} {_content(path)}" for path in sorted(_files_of(study, base))]
    parts += [_content(str(file)) for file in plugin_files()]
    return sha256("\n".join(parts).encode()).hexdigest()


def _files_of(study: Study, base: Scenario) -> set[str]:
    """URDFs and gain files that are named."""
    found = set()
    for key in _FILES:
        value: Any = base.model_dump()
        for part in key.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        varied = study.vary[key].ends if key in study.vary else []
        found |= {path for path in (value, *varied) if isinstance(path, str)}
    return found


def _content(path: str) -> str:
    try:
        return sha256(resolve_path(path).read_bytes()).hexdigest()
    except (OSError, ScenarioError):
        return "missing"  # told by whoever needs it


def _given(samples: Samples) -> dict[str, tuple[Layout, AnyArray]]:
    """What is known of each run before it is made."""
    columns = {"run": np.arange(len(samples)), "point": samples.point, "repeat": samples.repeat, **samples.columns}
    if samples.seeds is not None:
        columns["seed"] = samples.seeds
    found = {}
    for name, column in columns.items():
        if column.dtype == object:
            texts = [value if isinstance(value, str) else json.dumps(value) for value in column]
            column = np.array(texts, dtype=f"<U{max(map(len, texts), default=1) or 1}")
        found[name] = Layout(column.shape, column.shape, column.dtype.str, ("run",), None, {}), column
    return found


def _asked(study: Study, runs: int, chunk: int, labels: Mapping[str, Any]) -> dict[str, Layout]:
    """What is told of each run once it is made."""

    def of_runs(dtype: str, fill: Any, *dims: str, **attributes: str) -> Layout:
        sizes = [len(COMPONENTS.get(dim) or labels[dim]) for dim in dims]
        return Layout((runs, *sizes), (min(chunk, runs), *sizes), dtype, ("run", *dims), fill, attributes)

    found = {
        "outcome": of_runs("<U24", NOT_RUN, long_name="finished, or why a run ended early"),
        "stop_time": of_runs("<f8", np.nan, units="s", long_name="time of the last sample"),
        "message": of_runs(f"<U{_LONGEST}", NOT_RUN, long_name="why a run ended early, in words"),
        "success": of_runs("|i1", -1, long_name="1 for a success, 0 for none, -1 if not run"),
        **{name: of_runs("<f8", np.nan, units=outcome.units) for name, outcome in study.outcomes.items()},
    }
    for name, own in _labels(labels).items():
        found[name] = Layout(own.shape, own.shape, own.dtype.str, (name,), None, {})
    for name in study.keep.variables:
        variable = VARIABLES[name]
        found[name] = of_runs("<f8", np.nan, *variable.dims, units=variable.units, long_name=variable.long_name)
    return found


def _labels(labels: Mapping[str, Any]) -> dict[str, AnyArray]:
    return {name: np.array(own) for name, own in labels.items() if len(own)}


def cut(message: str) -> str:
    """A message of a length that the store has room for."""
    return message if len(message) <= _LONGEST else f"{message[: _LONGEST - 4]} ..."
