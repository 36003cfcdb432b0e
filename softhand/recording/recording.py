"""Recordings: a finished or interrupted run as named arrays with units, kept as NetCDF-4 or CSV.

`VARIABLES` is the one list of what a recording can hold. `Recording` is what a run returns, and what `Recording.load`
reads back bit for bit.
"""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from importlib import import_module
from itertools import product
from math import prod
from pathlib import Path
from typing import Any

import numpy as np

from softhand.errors import MissingArrayError, RecordingError
from softhand.numerics.arrays import AnyArray
from softhand.recording.reading import RESERVED, read_fields
from softhand.recording.units import units_along
from softhand.recording.variables import COMPONENTS, LABELLED_DIMS, VARIABLES
from softhand.recording.whole_file import fill_whole, write_whole

Attribute = float | int | str
_IN_MEMORY = 20_000_000  # bytes of a recording that is put together in memory before it is written
_TITLE = "softhand: recording of a run"
_REPORT, _EXPORT = "softhand.viewer.report.report", "softhand.export.writing"  # by name, since they lie far above


@dataclass(frozen=True, eq=False, repr=False)
class Recording:
    """A run as arrays by name: `recording["deformation"]` or `recording.deformation`; `len` is its samples.

    Attributes:
        variables: arrays by their names in `VARIABLES`, in its dims and units; `time` must be there.
        labels: names along `joint`, `contact`, `pair` and `support`, as far as the variables have these dimensions.
        scenario: the resolved scenario, as TOML text.
        version: version of softhand that computed the run.
        complete: whether the run reached its duration.
        reason: why it ended early; "" when complete.
        stop_time: simulated time at which it ended, [s].
        attributes: further figures of the run, such as `steps_per_second`.
        hand_urdf: text of the hand's URDF as it was loaded; "" in files of versions that did not keep it.
        object_urdf: text of the object's URDF, likewise.

    Raises:
        RecordingError: an array is unknown or has another shape than its dims and labels give.
    """

    variables: dict[str, AnyArray]
    labels: dict[str, tuple[str, ...]]
    scenario: str
    version: str
    complete: bool
    reason: str
    stop_time: float
    attributes: dict[str, Attribute] = field(default_factory=dict)
    hand_urdf: str = ""
    object_urdf: str = ""

    def __post_init__(self) -> None:
        labels = {dim: tuple(names) for dim, names in self.labels.items()}
        object.__setattr__(self, "labels", labels)
        object.__setattr__(self, "variables", _checked_variables(self.variables, labels))
        object.__setattr__(self, "attributes", _checked_attributes(self.attributes))

    def __getitem__(self, name: str) -> AnyArray:
        try:
            return self.variables[name]
        except KeyError:
            raise MissingArrayError(f"no array {name!r} in this recording; {_suggest(name, self.variables)}") from None

    def __getattr__(self, name: str) -> AnyArray:
        variables = self.__dict__.get("variables", {})  # not there yet while a copy is being unpickled
        if name in variables:
            array: AnyArray = variables[name]
            return array
        raise MissingArrayError(f"no array or attribute {name!r} in this recording; {_suggest(name, variables)}")

    def __len__(self) -> int:
        return len(self.variables["time"])

    def __repr__(self) -> str:
        end = "complete" if self.complete else f"incomplete: {self.reason}"
        contacts = len(self.labels.get("contact", ()))
        return f"<Recording: {self.stop_time:g} s, {len(self)} samples, {contacts} contacts, {end}>"

    def units(self, name: str) -> tuple[str, ...]:
        """Unit of an array, or one for each place along its last dimension where they differ.

        A joint that slides has m, m/s and N, as far as the URDF of the hand is in the recording.
        """
        return units_along(name, self.labels, self.hand_urdf)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write NetCDF-4, whole or not at all: first to a file beside it, which then takes the name PATH.

        Args:
            path: file to write; an older one is replaced.

        Raises:
            RecordingError: the file cannot be written.
        """
        size = sum(array.nbytes for array in self.variables.values())
        if size <= _IN_MEMORY:
            write_whole(Path(path), lambda: _to_netcdf(self))
        else:
            fill_whole(Path(path), lambda partial: _write_netcdf(self, partial), size)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one row a sample, with columns such as `object_position_x_m`, whole or not at all.

        Numbers keep all their digits; labels, scenario and attributes do not go along: use `save` to load again.

        Args:
            path: file to write; an older one is replaced.

        Raises:
            RecordingError: the file cannot be written.
        """
        write_whole(Path(path), lambda: _to_csv(self))

    def to_html(self, path: str | os.PathLike[str], *others: Recording) -> None:
        """Write a report, one HTML file with film, curves and numbers that works offline; see `softhand.write_report`.

        Args:
            path: file to write; an older one is replaced.
            others: runs to be shown beside this one, with the same clock.

        Raises:
            RecordingError: a recording lacks what the report shows, or the file cannot be written.
        """
        import_module(_REPORT).write_report(path, self, *others)

    def to_mcap(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Write a log for Foxglove, Lichtblick and others; see `softhand.write_mcap`, which has the options.

        Args:
            path: file to write; an older one is replaced.
            options: `rate`, `picture`, `progress`.

        Raises:
            RecordingError: the recording lacks what a picture needs, or the file cannot be written.
            SofthandError: the extra `export` is not installed.
        """
        import_module(_EXPORT).write_mcap(self, path, **options)

    def to_rrd(self, path: str | os.PathLike[str], **options: Any) -> None:
        """Write a recording of Rerun; as `to_mcap`, with the extra `rerun`.

        Raises:
            RecordingError: the recording lacks what a picture needs, or the file cannot be written.
            SofthandError: the extra `rerun` is not installed.
        """
        import_module(_EXPORT).write_rrd(self, path, **options)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Recording:
        """Read what `save` wrote. Arrays that others added under names of their own are left out.

        Args:
            path: file to read.

        Returns:
            The recording, each number bit-equal to the one saved.

        Raises:
            RecordingError: the file does not exist, is damaged, or is no recording.
        """
        path = Path(path)
        try:
            if not path.is_file():
                raise RecordingError("there is no such file" if not path.exists() else "it is not a file")
            return cls(**read_fields(path))
        except Exception as error:  # HDF5 answers a damaged file with almost any type
            why = "a part of it is missing" if "truncated file" in str(error) else str(error) or type(error).__name__
            raise RecordingError(
                f"{path}: cannot be read as a recording: {why}; give the run.nc of a softhand run", file=path
            ) from error


def load_recording(path: str | os.PathLike[str]) -> Recording:
    """Read what `Recording.save` wrote, or the `run.nc` in the folder of a run.

    Args:
        path: of the file, or of its folder.

    Raises:
        RecordingError: the file does not exist, is damaged, or is no recording.
    """
    return Recording.load(Path(path) / "run.nc" if Path(path).is_dir() else path)


def _suggest(name: str, names: Iterable[str]) -> str:
    nearest = get_close_matches(name, names, n=1)
    return f"did you mean {nearest[0]!r}?" if nearest else f"there are: {', '.join(names)}"


def _labels_of(dim: str, labels: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    return COMPONENTS[dim] if dim in COMPONENTS else labels[dim]


def _checked_variables(variables: Mapping[str, Any], labels: Mapping[str, tuple[str, ...]]) -> dict[str, AnyArray]:
    """Return the arrays in the dtype of the table; refuse names and shapes that table and labels do not give."""
    for name in variables:
        if name not in VARIABLES:
            raise RecordingError(f"unknown variable {name!r}; {_suggest(name, VARIABLES)}")
    for dim in labels:
        if dim not in LABELLED_DIMS:
            raise RecordingError(f"labels for unknown dimension {dim!r}; {_suggest(dim, LABELLED_DIMS)}")
    if "time" not in variables:
        raise RecordingError("a recording needs the variable 'time'")
    samples = np.size(variables["time"])
    return {name: _checked_array(name, value, samples, labels) for name, value in variables.items()}


def _checked_array(name: str, value: Any, samples: int, labels: Mapping[str, tuple[str, ...]]) -> AnyArray:
    dims = VARIABLES[name].dims
    for dim in dims[1:]:
        if dim not in COMPONENTS and dim not in labels:
            raise RecordingError(f"variable {name!r} needs labels for dimension {dim!r}")
    expected = (samples, *(len(_labels_of(dim, labels)) for dim in dims[1:]))
    if np.shape(value) != expected:
        raise RecordingError(f"variable {name!r} has shape {np.shape(value)}, expected {expected} for {dims}")
    return np.asarray(value, dtype=VARIABLES[name].dtype, order="C")


def _checked_attributes(attributes: Mapping[str, Any]) -> dict[str, Attribute]:
    """Return the attributes as plain Python numbers and text."""
    plain = {name: value.item() if isinstance(value, np.generic) else value for name, value in attributes.items()}
    for name, value in plain.items():
        if name in RESERVED:
            raise RecordingError(f"attribute {name!r} has a field of its own; choose another name")
        if not isinstance(value, (float, int, str)):
            raise RecordingError(f"attribute {name!r} is a {type(value).__name__}; allowed are float, int and str")
    return {name: int(value) if isinstance(value, bool) else value for name, value in plain.items()}


def _to_netcdf(recording: Recording) -> bytes:
    """Encode the recording as NetCDF-4.

    Built in memory: a full disk then fails in one plain write, where HDF5 would be left with a file it cannot close.
    Not compressed: deflate with shuffle takes 45 % longer and saves a fifth.
    """
    buffer = io.BytesIO()
    _write_netcdf(recording, buffer)
    return buffer.getvalue()


def _write_netcdf(recording: Recording, target: Path | io.BytesIO) -> None:
    # Imported here, since HDF5 takes 0.1 s to load and most commands do without.
    import h5netcdf
    import h5py

    used = {dim for name in recording.variables for dim in VARIABLES[name].dims[1:]}
    labels = {**recording.labels, **{dim: names for dim, names in COMPONENTS.items() if dim in used}}
    with h5netcdf.File(target, "w") as file:
        file.attrs.update(title=_TITLE, softhand_version=recording.version, scenario=recording.scenario)
        file.attrs.update(complete=int(recording.complete), reason=recording.reason)
        file.attrs.update(stop_time=float(recording.stop_time), **recording.attributes)
        file.attrs.update(hand_urdf=recording.hand_urdf, object_urdf=recording.object_urdf)
        file.dimensions = {"time": len(recording), **{dim: len(names) for dim, names in labels.items()}}
        for dim, names in labels.items():
            variable = file.create_variable(dim, (dim,), data=np.array(names, h5py.string_dtype()))
            variable.attrs["long_name"] = f"label along {dim}"
        for name, array in recording.variables.items():
            variable = file.create_variable(name, VARIABLES[name].dims, data=array)
            units = recording.units(name)
            key, value = ("units", units[0]) if len(units) == 1 else ("component_units", list(units))
            variable.attrs.update({key: value, "long_name": VARIABLES[name].long_name})


def _to_csv(recording: Recording) -> bytes:
    """Encode the recording as CSV, each float as the shortest text that reads back the same."""
    header = [column for name in recording.variables for column in _columns(name, recording)]
    samples = len(recording)
    columns = [
        c for array in recording.variables.values() for c in array.reshape(samples, prod(array.shape[1:])).T.tolist()
    ]
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(zip(*columns, strict=True))
    return text.getvalue().encode()


def _columns(name: str, recording: Recording) -> list[str]:
    """Name the columns of one variable: its name, the label along each dimension, and the unit."""
    units = [unit.replace("/", "_per_").replace(" ", "_") for unit in recording.units(name)]
    cells = product(*(_labels_of(dim, recording.labels) for dim in VARIABLES[name].dims[1:]))
    return ["_".join((name, *cell, units[i % len(units)])).removesuffix("_1") for i, cell in enumerate(cells)]
