"""Many of a kind as named arrays: by name, as a data set of xarray, and as one file of NetCDF-4."""

from __future__ import annotations

import io
import os
from abc import abstractmethod
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np

from softhand.errors import RecordingError
from softhand.numerics.arrays import AnyArray
from softhand.recording.whole_file import write_whole
from softhand.settings.wording import nearest

if TYPE_CHECKING:
    from typing_extensions import Self


class Column(NamedTuple):
    """An array with the names of its dimensions and its attributes, such as `units`."""

    dims: tuple[str, ...]
    values: AnyArray
    attributes: Mapping[str, str] = {}


class NamedArrays:
    """Arrays by name along one first dimension; `all["name"]` and `all.name` are an array."""

    kind: ClassVar[str]
    """What these are, such as `runs`."""
    title: ClassVar[str]
    """By which a file of them is known."""
    variables: dict[str, AnyArray]

    def __getitem__(self, name: str) -> AnyArray:
        try:
            return self.variables[name]
        except KeyError:
            raise KeyError(f"no array {name!r} in these {self.kind}; there are: {', '.join(self.variables)}") from None

    def __getattr__(self, name: str) -> AnyArray:
        variables = self.__dict__.get("variables", {})
        if name in variables:
            array: AnyArray = variables[name]
            return array
        near = nearest(name, variables)
        hint = f"; did you mean {near!r}?" if near else ""
        raise AttributeError(f"no array or attribute {name!r} in these {self.kind}{hint}")

    def to_xarray(self) -> Any:
        """As an `xarray.Dataset`.

        Raises:
            ImportError: xarray is not installed.
        """
        import xarray

        return xarray.Dataset(self._columns(), self._coordinates(), self._attributes())

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write NetCDF-4, whole or not at all; `xarray.open_dataset` and `load` read it.

        Raises:
            RecordingError: the file cannot be written.
        """
        write_whole(Path(path), self._to_netcdf)

    @classmethod
    def load(cls, path: str | os.PathLike[str]) -> Self:
        """Read what `save` wrote.

        Raises:
            RecordingError: the file does not exist, is damaged, or holds something else.
        """
        import h5netcdf

        try:
            with h5netcdf.File(Path(path).absolute(), "r", decode_vlen_strings=True) as file:
                if file.attrs.get("title") != cls.title:
                    raise RecordingError(f"it holds no {cls.kind} of softhand")
                return cls._read(file)
        except Exception as error:  # HDF5 answers a damaged file with almost any type
            raise RecordingError(f"{path}: cannot be read as {cls.kind}: {error}", file=path) from error

    @abstractmethod
    def _columns(self) -> dict[str, Column]:
        """The variables."""

    @abstractmethod
    def _coordinates(self) -> dict[str, Column]:
        """What stands along the dimensions."""

    @abstractmethod
    def _about(self) -> dict[str, Any]:
        """Attributes of the whole."""

    @classmethod
    @abstractmethod
    def _read(cls, file: Any) -> Self:
        """From an open file whose title is right."""

    def _attributes(self) -> dict[str, Any]:
        return {"title": self.title, **self._about()}

    def _to_netcdf(self) -> bytes:
        import h5netcdf
        import h5py

        buffer, columns = io.BytesIO(), {**self._coordinates(), **self._columns()}
        with h5netcdf.File(buffer, "w") as file:
            file.attrs.update(self._attributes())
            file.dimensions = {
                dim: size for one in columns.values() for dim, size in zip(one.dims, one.values.shape, strict=True)
            }
            for name, (dims, values, attributes) in columns.items():
                text = values.dtype.kind in "UO"
                data = values.astype(h5py.string_dtype()) if text else values
                file.create_variable(name, dims, data=data).attrs.update(attributes)
        return buffer.getvalue()


def labels_as_columns(labels: Mapping[str, tuple[str, ...]]) -> dict[str, Column]:
    """Names along dimensions."""
    return {dim: Column((dim,), np.array(names, object)) for dim, names in labels.items()}
