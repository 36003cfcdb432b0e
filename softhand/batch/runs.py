"""Many runs as named arrays with units: what `rollout` returns."""

from __future__ import annotations

import io
import json
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softhand.batch.run import FINISHED, Outcome
from softhand.errors import RecordingError
from softhand.numerics.arrays import AnyArray, Array
from softhand.recording.variables import COMPONENTS, LABELLED_DIMS, VARIABLES
from softhand.recording.whole_file import write_whole
from softhand.settings.wording import nearest

_TITLE = "softhand: many runs"


@dataclass(frozen=True, eq=False, repr=False)
class Runs:
    """Many runs as arrays by name, `runs["object_position"]` or `runs.object_position`; `len` is how many there are.

    Attributes:
        time: of the samples since the start of a run [s], shape (samples,).
        variables: arrays by their names in `recording.variables`, shape (runs, samples, ...), in its dims and units;
            NaN behind the end of a run, and where a run has no such joint, contact or pair.
        labels: names along `joint`, `contact`, `pair`, `support` and `velocity`, those of all runs together.
        varied: values of each run by dotted key.
        outcomes: how each run ended.
        compiled: whether a run was in the compiled loop; the others went through Python, slower, shape (runs,).
        scenario: the base of all, as TOML text.
        version: of softhand.
    """

    time: Array
    variables: dict[str, Array]
    labels: dict[str, tuple[str, ...]]
    varied: dict[str, tuple[Any, ...]]
    outcomes: tuple[Outcome, ...]
    compiled: AnyArray
    scenario: str
    version: str

    def __len__(self) -> int:
        return len(self.outcomes)

    def __getitem__(self, name: str) -> Array:
        try:
            return self.variables[name]
        except KeyError:
            raise KeyError(f"no array {name!r} was kept; there are: {', '.join(self.variables)}") from None

    def __getattr__(self, name: str) -> Array:
        variables = self.__dict__.get("variables", {})
        if name in variables:
            array: Array = variables[name]
            return array
        near = nearest(name, variables)
        hint = f"; did you mean {near!r}?" if near else ""
        raise AttributeError(f"no array or attribute {name!r} in these runs{hint}")

    def __repr__(self) -> str:
        ends = Counter(outcome.reason for outcome in self.outcomes)
        told = ", ".join(f"{count} {reason}" for reason, count in ends.most_common())
        return f"<Runs: {len(self)}, {told}; {', '.join(self.variables)} at {len(self.time)} samples>"

    @property
    def finished(self) -> AnyArray:
        """Which runs reached their end, shape (runs,)."""
        return np.array([outcome.reason == FINISHED for outcome in self.outcomes])

    def rows(self) -> list[dict[str, Any]]:
        """A row a run: what was varied, how it ended [s], and why."""
        return [
            {**{key: values[i] for key, values in self.varied.items()}, **outcome._asdict()}
            for i, outcome in enumerate(self.outcomes)
        ]

    def to_json(self) -> str:
        """The rows as JSON text."""
        return json.dumps(self.rows())

    def to_xarray(self) -> Any:
        """As an `xarray.Dataset` with the dimensions `run` and `time`; what was varied are coordinates along `run`.

        Raises:
            ImportError: xarray is not installed.
        """
        import xarray

        named = {dim: list(names) for dim, names in self._every_label().items()}
        arrays = {
            name: (("run", *VARIABLES[name].dims), array, _attributes(name)) for name, array in self.variables.items()
        }
        along = {name: ("run", column) for name, column in self._columns().items()}
        return xarray.Dataset(
            arrays, {"time": ("time", self.time, _attributes("time")), **named, **along}, dict(self._about())
        )

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write NetCDF-4, whole or not at all; `xarray.open_dataset` and `Runs.load` read it.

        Raises:
            RecordingError: the file cannot be written.
        """
        write_whole(Path(path), self._to_netcdf)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Runs:
        """Read what `save` wrote.

        Raises:
            RecordingError: the file does not exist, is damaged, or holds no runs.
        """
        try:
            return _from_netcdf(Path(path))
        except Exception as error:  # HDF5 answers a damaged file with almost any type
            raise RecordingError(f"{path}: cannot be read as runs: {error}", file=path) from error

    def _every_label(self) -> dict[str, tuple[str, ...]]:
        used = {dim for name in self.variables for dim in VARIABLES[name].dims[1:]}
        return {dim: COMPONENTS.get(dim) or self.labels[dim] for dim in sorted(used)}

    def _columns(self) -> dict[str, AnyArray]:
        """What is told of each run, as arrays of numbers or texts."""
        told: dict[str, AnyArray] = {key: _column(values) for key, values in self.varied.items()}
        for field in Outcome._fields:
            told[_OUTCOME[field]] = _column([getattr(outcome, field) for outcome in self.outcomes])
        return {**told, "compiled": np.asarray(self.compiled, dtype=np.int8)}

    def _about(self) -> dict[str, str]:
        return {"title": _TITLE, "softhand_version": self.version, "scenario": self.scenario,
                "varied": json.dumps(list(self.varied))}  # fmt: skip

    def _to_netcdf(self) -> bytes:
        import h5netcdf
        import h5py

        buffer, labels, columns = io.BytesIO(), self._every_label(), self._columns()
        with h5netcdf.File(buffer, "w") as file:
            file.attrs.update(**self._about())
            file.dimensions = {"run": len(self), "time": len(self.time), **{dim: len(n) for dim, n in labels.items()}}
            for dim, names in labels.items():
                file.create_variable(dim, (dim,), data=np.array(names, h5py.string_dtype()))
            file.create_variable("time", ("time",), data=self.time).attrs.update(_attributes("time"))
            for name, column in columns.items():
                text = column.dtype.kind in "UO"
                file.create_variable(name, ("run",), data=column.astype(h5py.string_dtype()) if text else column)
            for name, array in self.variables.items():
                variable = file.create_variable(name, ("run", *VARIABLES[name].dims), data=array)
                variable.attrs.update(_attributes(name))
        return buffer.getvalue()


_OUTCOME = {"reason": "outcome", "time": "stop_time", "message": "message"}
"""Names of the fields of `Outcome` in files."""


def _attributes(name: str) -> dict[str, str]:
    return {"units": VARIABLES[name].units, "long_name": VARIABLES[name].long_name}


def _column(values: Sequence[Any]) -> AnyArray:
    """Numbers as they are; all else as text, tables and lists as JSON."""
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values):
        return np.array(values, dtype=float)
    return np.array([value if isinstance(value, str) else json.dumps(value) for value in values], dtype=object)


def _read_cell(value: Any) -> Any:
    if not isinstance(value, str):
        return float(value)
    try:
        return json.loads(value)
    except ValueError:
        return value


def _from_netcdf(path: Path) -> Runs:
    import h5netcdf

    with h5netcdf.File(path.absolute(), "r", decode_vlen_strings=True) as file:
        if file.attrs.get("title") != _TITLE:
            raise RecordingError("it holds no runs of softhand")
        keys = json.loads(file.attrs["varied"])
        told = zip(*(file[_OUTCOME[field]][...] for field in Outcome._fields), strict=True)
        kept = [name for name in VARIABLES if name in file.variables and name != "time"]
        labelled = [dim for dim in LABELLED_DIMS if dim in file.variables]
        return Runs(
            time=np.array(file["time"][...]),
            variables={name: np.array(file[name][...]) for name in kept},
            labels={dim: tuple(file[dim][...]) for dim in labelled},
            varied={key: tuple(map(_read_cell, file[key][...])) for key in keys},
            outcomes=tuple(Outcome(str(reason), float(time), str(message)) for reason, time, message in told),
            compiled=np.array(file["compiled"][...]).astype(bool),
            scenario=file.attrs["scenario"],
            version=file.attrs["softhand_version"],
        )


def together(
    parts: Sequence[Mapping[str, AnyArray]],
    labels: Sequence[Mapping[str, tuple[str, ...]]],
    names: Sequence[str],
    time: Array,
) -> tuple[dict[str, Array], dict[str, tuple[str, ...]]]:
    """The variables of many runs in one array each, by the labels of all of them together.

    Args:
        parts: variables of each run, shape (samples, ...) each; none of a run that could not begin.
        labels: names along its dimensions, likewise.
        names: of the variables.
        time: of the samples of the longest run [s].

    Returns:
        Arrays of shape (runs, samples, ...), NaN where there is nothing, and the names along their dimensions.
    """
    every: dict[str, tuple[str, ...]] = {}
    for own in labels:
        for dim, named in own.items():
            every[dim] = tuple(dict.fromkeys((*every.get(dim, ()), *named)))
    found: dict[str, Array] = {}
    for name in names:
        dims = VARIABLES[name].dims[1:]
        if any(dim not in COMPONENTS and dim not in every for dim in dims):
            continue  # of supports, where no run has any
        sizes = [len(COMPONENTS.get(dim) or every[dim]) for dim in dims]
        array = np.empty((len(parts), len(time), *sizes))
        for target, part, own in zip(array, parts, labels, strict=True):
            values = part.get(name, np.empty((0, *sizes)))
            if all(dim in COMPONENTS or own.get(dim) == every[dim] for dim in dims):
                target[: len(values)], target[len(values) :] = values, np.nan
                continue
            target[...] = np.nan
            if name in part:
                places = [
                    range(size) if dim in COMPONENTS else list(map(every[dim].index, own[dim]))
                    for dim, size in zip(dims, sizes, strict=True)
                ]
                target[np.ix_(range(len(values)), *places)] = values
        found[name] = array
    return found, every
