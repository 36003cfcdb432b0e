"""Thousands of grasps as arrays: what `sample_grasps` returns and keeps in one file."""

from __future__ import annotations

import io
import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softhand.errors import RecordingError
from softhand.numerics.arrays import Array
from softhand.recording.whole_file import write_whole
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import read_settings
from softhand.settings.toml import parse_toml
from softhand.settings.wording import nearest
from softhand.studies.grasps.variables import KEPT, LABELS

_TITLE = "softhand: grasps"


@dataclass(frozen=True, eq=False, repr=False)
class GraspCache:
    """Grasps at rest of one hand and one object; `len` is how many, `cache["margin"]` or `cache.margin` an array.

    Attributes:
        variables: arrays by their names in `variables.KEPT`, shape (grasps, ...).
        labels: names along `finger`, `joint` and `pair`.
        scenario: hand and object, as TOML text.
        seed: of the sampling.
        spread: of the poses: largest way along each axis [m], and turn [rad].
        poses: how many poses of the object were looked at to the end.
        refused: how often what stood in the way: of a pose, or of a choice of places.
        version: of softhand.
    """

    variables: dict[str, Array]
    labels: dict[str, tuple[str, ...]]
    scenario: str
    seed: int
    spread: tuple[float, float]
    poses: int
    refused: dict[str, int]
    version: str

    def __len__(self) -> int:
        return len(self.variables["margin"])

    def __getitem__(self, name: str) -> Array:
        try:
            return self.variables[name]
        except KeyError:
            raise KeyError(f"no array {name!r} in this cache; there are: {', '.join(self.variables)}") from None

    def __getattr__(self, name: str) -> Array:
        variables = self.__dict__.get("variables", {})
        if name in variables:
            array: Array = variables[name]
            return array
        near = nearest(name, variables)
        hint = f"; did you mean {near!r}?" if near else ""
        raise AttributeError(f"no array or attribute {name!r} in this cache{hint}")

    def __repr__(self) -> str:
        told = f"margin {self.margin.min():.3f} to {self.margin.max():.3f}" if len(self) else "none"
        return f"<GraspCache: {len(self)} grasps from {self.poses} poses, {told}>"

    def grasp(self, index: int) -> Scenario:
        """The scenario with one of the grasps, ready to run."""
        base = read_settings(Scenario, parse_toml(self.scenario), "")
        return base.with_values({
            "object.position": self.object_position[index].tolist(),
            "object.rpy": self.object_rpy[index].tolist(),
            "grasp.contact_points": self.contact_points[index].tolist(),
            "grasp.internal_force": self.internal_force[index].tolist(),
            "grasp.joint_guess": self.joint_position[index].tolist(),
        })  # fmt: skip

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Least, middle and largest of the numbers of a grasp, a line each; the first line are the headings."""
        rows = [("", "least", "median", "largest")]
        for name, kept in KEPT.items():
            if kept.dims in ((), ("finger",), ("joint",)) and name not in ("pose", "joint_position", "joint_torque"):
                values = self[name][np.isfinite(self[name])]
                if len(values):
                    unit = "" if kept.units == "1" else f" [{kept.units}]"
                    least, median, largest = (f"{np.quantile(values, q):.4g}" for q in (0.0, 0.5, 1.0))
                    rows.append((f"{name}{unit}", least, median, largest))
        return rows

    def to_xarray(self) -> Any:
        """As an `xarray.Dataset` with the dimension `grasp`.

        Raises:
            ImportError: xarray is not installed.
        """
        import xarray

        arrays = {
            name: (("grasp", *KEPT[name].dims), array, _attributes(name)) for name, array in self.variables.items()
        }
        coordinates = {dim: list(names) for dim, names in self._every_label().items()}
        return xarray.Dataset(arrays, coordinates, self._about())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write NetCDF-4, whole or not at all; `xarray.open_dataset` and `GraspCache.load` read it.

        Raises:
            RecordingError: the file cannot be written.
        """
        write_whole(Path(path), self._to_netcdf)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> GraspCache:
        """Read what `save` wrote.

        Raises:
            RecordingError: the file does not exist, is damaged, or holds no grasps.
        """
        try:
            return _from_netcdf(Path(path))
        except Exception as error:  # HDF5 answers a damaged file with almost any type
            raise RecordingError(f"{path}: cannot be read as grasps: {error}", file=path) from error

    def first(self, count: int, poses: int) -> GraspCache:
        """The first grasps alone, and so many poses as looked at to the end."""
        some = {name: array[:count] for name, array in self.variables.items()}
        return GraspCache(
            some, self.labels, self.scenario, self.seed, self.spread, poses, self.refused, self.version
        )  # fmt: skip

    def _every_label(self) -> dict[str, tuple[str, ...]]:
        return {**LABELS, **self.labels}

    def _about(self) -> dict[str, Any]:
        return {
            "title": _TITLE, "softhand_version": self.version, "scenario": self.scenario, "seed": self.seed,
            "spread": json.dumps(list(self.spread)), "poses": self.poses, "refused": json.dumps(self.refused),
        }  # fmt: skip

    def _to_netcdf(self) -> bytes:
        import h5netcdf
        import h5py

        buffer, labels = io.BytesIO(), self._every_label()
        with h5netcdf.File(buffer, "w") as file:
            file.attrs.update(**self._about())
            file.dimensions = {"grasp": len(self), **{dim: len(names) for dim, names in labels.items()}}
            for dim, names in labels.items():
                file.create_variable(dim, (dim,), data=np.array(names, h5py.string_dtype()))
            for name, array in self.variables.items():
                variable = file.create_variable(name, ("grasp", *KEPT[name].dims), data=array)
                variable.attrs.update(_attributes(name))
        return buffer.getvalue()


def _attributes(name: str) -> dict[str, str]:
    return {"units": KEPT[name].units, "long_name": KEPT[name].long_name}


def _from_netcdf(path: Path) -> GraspCache:
    import h5netcdf

    with h5netcdf.File(path.absolute(), "r", decode_vlen_strings=True) as file:
        if file.attrs.get("title") != _TITLE:
            raise RecordingError("it holds no grasps of softhand")
        about = file.attrs
        position, turn = json.loads(about["spread"])
        return GraspCache(
            variables={name: np.array(file[name][...]) for name in KEPT},
            labels={dim: tuple(file[dim][...]) for dim in ("finger", "joint", "pair")},
            scenario=about["scenario"],
            seed=int(about["seed"]),
            spread=(position, turn),
            poses=int(about["poses"]),
            refused=json.loads(about["refused"]),
            version=about["softhand_version"],
        )
