"""Many runs as named arrays with units: what `rollout` returns."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from softhand.batch.run import FINISHED, Outcome
from softhand.numerics.arrays import AnyArray, Array
from softhand.recording.named_arrays import Column, NamedArrays, labels_as_columns
from softhand.recording.variables import COMPONENTS, LABELLED_DIMS, VARIABLES


@dataclass(frozen=True, eq=False, repr=False)
class Runs(NamedArrays):
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

    kind: ClassVar = "runs"
    title: ClassVar = "softhand: many runs"

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

    def _columns(self) -> dict[str, Column]:
        return {
            name: Column(("run", *VARIABLES[name].dims), array, _attributes(name))
            for name, array in self.variables.items()
        }

    def _coordinates(self) -> dict[str, Column]:
        used = sorted({dim for name in self.variables for dim in VARIABLES[name].dims[1:]})
        told = {key: _column(values) for key, values in self.varied.items()}
        for field in Outcome._fields:
            told[_OUTCOME[field]] = _column([getattr(outcome, field) for outcome in self.outcomes])
        told["compiled"] = np.asarray(self.compiled, dtype=np.int8)
        return {
            "time": Column(("time",), self.time, _attributes("time")),
            **labels_as_columns({dim: COMPONENTS.get(dim) or self.labels[dim] for dim in used}),
            **{name: Column(("run",), column) for name, column in told.items()},
        }

    def _about(self) -> dict[str, str]:
        return {"softhand_version": self.version, "scenario": self.scenario, "varied": json.dumps(list(self.varied))}

    @classmethod
    def _read(cls, file: Any) -> Runs:
        keys = json.loads(file.attrs["varied"])
        told = zip(*(file[_OUTCOME[field]][...] for field in Outcome._fields), strict=True)
        kept = [name for name in VARIABLES if name in file.variables and name != "time"]
        labelled = [dim for dim in LABELLED_DIMS if dim in file.variables]
        return cls(
            time=np.array(file["time"][...]),
            variables={name: np.array(file[name][...]) for name in kept},
            labels={dim: tuple(file[dim][...]) for dim in labelled},
            varied={key: tuple(map(_read_cell, file[key][...])) for key in keys},
            outcomes=tuple(Outcome(str(reason), float(time), str(message)) for reason, time, message in told),
            compiled=np.array(file["compiled"][...]).astype(bool),
            scenario=file.attrs["scenario"],
            version=file.attrs["softhand_version"],
        )


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
