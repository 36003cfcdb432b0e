"""Recordings: a finished or interrupted run as named arrays with units, kept as NetCDF-4 or CSV.

`VARIABLES` is the one list of what a recording can hold. `Recording` is what a run returns, and what `Recording.load`
reads back bit for bit.
"""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softhand.errors import MissingArrayError, RecordingError
from softhand.numerics.arrays import AnyArray
from softhand.numerics.table import folded, html_table
from softhand.recording.reading import RESERVED, read_fields
from softhand.recording.units import table_of, units_along
from softhand.recording.variables import COMPONENTS, LABELLED_DIMS, VARIABLES
from softhand.recording.whole_file import fill_whole, write_whole
from softhand.settings.guesses import did_you_mean

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from xarray import Dataset

Attribute = float | int | str
_IN_MEMORY = 20_000_000  # bytes of a recording that is put together in memory before it is written
_ENCODING = "softhand.recording.encoding"  # by name, this and the following, since they know recordings
_REPORT, _EXPORT = "softhand.viewer.report.report", "softhand.export.writing"
_FIGURE, _SUMMARY = "softhand.plots", "softhand.analysis.summary"


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
            raise MissingArrayError(f"no array {name!r} in this recording{_suggest(name, self.variables)}") from None

    def __getattr__(self, name: str) -> AnyArray:
        variables = self.__dict__.get("variables", {})  # not there yet while a copy is being unpickled
        if name in variables:
            array: AnyArray = variables[name]
            return array
        hint = _suggest(name, variables, [known for known in dir(type(self)) if not known.startswith("_")])
        raise MissingArrayError(f"no array or attribute {name!r} in this recording{hint}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self.variables]

    def __len__(self) -> int:
        return len(self.variables["time"])

    def __repr__(self) -> str:
        end = "complete" if self.complete else f"incomplete: {self.reason}"
        contacts = len(self.labels.get("contact", ()))
        return f"<Recording: {self.stop_time:g} s, {len(self)} samples, {contacts} contacts, {end}>"

    def _repr_html_(self) -> str:
        """How the run ended, and its arrays behind a line to be opened, for a notebook."""
        ends = "reached its duration" if self.complete else f"ended early: {self.reason}"
        rows = [("run", f"{self.stop_time:g} s, {len(self)} samples; it {ends}")]
        rows += [(f"{dim}s", ", ".join(names)) for dim, names in self.labels.items() if dim != "velocity" and names]
        arrays = [
            (name, str(array.shape), ", ".join(self.units(name)), VARIABLES[name].long_name)
            for name, array in self.variables.items()
        ]
        inside = html_table("", ("array", "shape", "unit", "meaning"), arrays)
        return html_table("Recording", (), rows) + folded(f"{len(arrays)} arrays", inside)

    def units(self, name: str) -> tuple[str, ...]:
        """Unit of an array, or one for each place along its last dimension where they differ.

        A joint that slides has m, m/s and N, as far as the URDF of the hand is in the recording.
        """
        return units_along(name, self.labels, self.hand_urdf, table_of(self.attributes.get("sliding_motors")) or ())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write NetCDF-4, whole or not at all: first to a file beside it, which then takes the name PATH.

        Args:
            path: file to write; an older one is replaced.

        Raises:
            RecordingError: the file cannot be written.
        """
        size = sum(array.nbytes for array in self.variables.values())
        if size <= _IN_MEMORY:
            write_whole(Path(path), lambda: import_module(_ENCODING).to_netcdf(self))
        else:
            fill_whole(Path(path), lambda partial: import_module(_ENCODING).write_netcdf(self, partial), size)

    def to_csv(self, path: str | os.PathLike[str]) -> None:
        """Write one row a sample, with columns such as `object_position_x_m`, whole or not at all.

        Numbers keep all their digits; labels, scenario and attributes do not go along: use `save` to load again.

        Args:
            path: file to write; an older one is replaced.

        Raises:
            RecordingError: the file cannot be written.
        """
        write_whole(Path(path), lambda: import_module(_ENCODING).to_csv(self))

    def to_xarray(self) -> Dataset:
        """As an `xarray.Dataset`, equal to what xarray reads from a saved file: dimensions, labels, units.

        Raises:
            SofthandError: xarray is not installed.
        """
        dataset: Dataset = import_module(_ENCODING).to_dataset(self)
        return dataset

    def plot(self) -> Figure:
        """The figure of the run, by `softhand.draw_run`. A notebook shows it, `softhand.save_figure` writes it.

        Raises:
            RecordingError: an array that the figure shows is not in the recording.
        """
        figure: Figure = import_module(_FIGURE).draw_run(self)
        # without pyplot, nobody else tells a notebook how to show it
        figure._repr_png_ = partial(_as_png, figure)  # type: ignore[attr-defined]
        return figure

    def summary(self) -> Any:
        """The figures that one looks at first: `softhand.summarize`."""
        return import_module(_SUMMARY).summarize(self)

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


def _as_png(figure: Figure) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100)
    return buffer.getvalue()


def _suggest(name: str, names: Iterable[str], others: Iterable[str] = ()) -> str:
    return did_you_mean(name, [*names, *others]) or f"; there are: {', '.join(names)}"


def _labels_of(dim: str, labels: Mapping[str, tuple[str, ...]]) -> tuple[str, ...]:
    return COMPONENTS[dim] if dim in COMPONENTS else labels[dim]


def _checked_variables(variables: Mapping[str, Any], labels: Mapping[str, tuple[str, ...]]) -> dict[str, AnyArray]:
    """Return the arrays in the dtype of the table; refuse names and shapes that table and labels do not give."""
    for name in variables:
        if name not in VARIABLES:
            raise RecordingError(f"unknown variable {name!r}{_suggest(name, VARIABLES)}")
    for dim in labels:
        if dim not in LABELLED_DIMS:
            raise RecordingError(f"labels for unknown dimension {dim!r}{_suggest(dim, LABELLED_DIMS)}")
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
