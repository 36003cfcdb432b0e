"""What a NetCDF-4 file says of a run, read without trust: nothing from elsewhere, nothing larger than the file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from softhand.errors import RecordingError
from softhand.numerics.arrays import AnyArray
from softhand.recording.variables import LABELLED_DIMS, VARIABLES

RESERVED = (
    "title", "softhand_version", "scenario", "complete", "reason", "stop_time", "hand_urdf", "object_urdf",
)  # fmt: skip
"""Attributes of a file that are fields of a recording."""

_NUMBERS = ("wall_time", "steps_per_second")  # further attributes that are read
_SIGNATURE = b"\x89HDF\r\n\x1a\n"
_FREE = 100_000_000  # bytes that any file may claim
_MOST_COMPRESSED = 20  # bytes in memory for one in the file beyond that; of a run a fifth can be saved
_MOST_LABELS, _LONGEST_LABELS = 1000, 100_000  # of one dimension, and letters of them all
_MOST_ATTRIBUTES = 1000


def read_fields(path: Path) -> dict[str, Any]:
    """The fields of a `Recording` from a file.

    Raises:
        RecordingError: it is no recording, or claims what no recording has; without the name of the file.
        Exception: HDF5 answers a damaged file with almost any type.
    """
    import h5py  # here, since HDF5 takes 0.1 s to load and most commands do without

    with path.open("rb") as content:
        if content.read(len(_SIGNATURE)) != _SIGNATURE:
            raise RecordingError("it is no NetCDF-4 file")
    with h5py.File(path, "r") as hdf:
        if "softhand_version" not in hdf.attrs or "time" not in hdf:
            raise RecordingError("it was not written by softhand")
        arrays = {name: _dataset(hdf, name) for name in VARIABLES if name in hdf}
        labels = {name: _dataset(hdf, name) for name in LABELLED_DIMS if name in hdf}
        _check_sizes(arrays, path.stat().st_size)
        found = dict(_attributes(hdf))
        for name in set(_NUMBERS) & set(found):
            _number(found, name)
        return {
            "scenario": _text(found, "scenario"),
            "version": _text(found, "softhand_version"),
            "complete": bool(_number(found, "complete")),
            "reason": _text(found, "reason"),
            "stop_time": _number(found, "stop_time"),
            "hand_urdf": _text(found, "hand_urdf", ""),
            "object_urdf": _text(found, "object_urdf", ""),
            "attributes": {name: value for name, value in found.items() if name not in RESERVED},
            "labels": {name: tuple(_labels(name, item)) for name, item in labels.items()},
            "variables": {name: _array(name, item) for name, item in arrays.items()},
        }


def _dataset(hdf: Any, name: str) -> Any:
    """An array that lies in the file itself."""
    import h5py

    item = hdf[name] if isinstance(hdf.get(name, getlink=True), h5py.HardLink) else None
    if not isinstance(item, h5py.Dataset) or item.is_virtual or item.external:
        raise RecordingError(f"its array {name!r} is not in the file itself")
    return item


def _check_sizes(arrays: dict[str, Any], size: int) -> None:
    """Arrays, and the pieces in which they are unpacked, are no larger than what is stored of them can be."""
    needed, stored = 0, 0
    for name, item in arrays.items():
        if item.dtype.kind not in "fiu":
            raise RecordingError(f"its array {name!r} is of {item.dtype}, not of numbers")
        needed += item.size * max(item.dtype.itemsize, 8)
        stored += item.id.get_storage_size()
        if math.prod(item.chunks or ()) * item.dtype.itemsize > _FREE:
            raise RecordingError(f"its array {name!r} is packed in pieces of {item.chunks}, more than {_FREE} bytes")
    stored = min(stored, size)  # several pieces may lie at one place
    if needed > max(_FREE, _MOST_COMPRESSED * stored):
        raise RecordingError(
            f"its arrays claim {needed:.3g} bytes, which a file of {size} bytes cannot hold, {stored} of them arrays"
        )


def _array(name: str, item: Any) -> AnyArray:
    return np.asarray(item[...], dtype=VARIABLES[name].dtype, order="C")


def _labels(name: str, item: Any) -> Iterator[str]:
    """The labels one by one, since many may point to one long text."""
    import h5py

    if item.ndim != 1 or h5py.check_string_dtype(item.dtype) is None:
        raise RecordingError(f"its labels {name!r} are no row of texts, but {item.dtype} of shape {item.shape}")
    if item.size > _MOST_LABELS:
        raise RecordingError(f"it has {item.size} labels {name!r}, more than {_MOST_LABELS}")
    texts, length = item.asstr("utf-8", "replace"), 0
    for k in range(item.size):
        text = str(texts[k])
        length += len(text)
        if length > _LONGEST_LABELS:
            raise RecordingError(f"its labels {name!r} are longer than {_LONGEST_LABELS} letters")
        yield text


def _attributes(hdf: Any) -> Iterator[tuple[str, Any]]:
    """Name and value of each attribute that is one text or one number; others and those of NetCDF are passed over."""
    import h5py

    if len(hdf.attrs) > _MOST_ATTRIBUTES:
        raise RecordingError(f"it has {len(hdf.attrs)} attributes, more than {_MOST_ATTRIBUTES}")
    for name in hdf.attrs:
        entry = hdf.attrs.get_id(name)
        is_text = h5py.check_string_dtype(entry.dtype) is not None
        if name.startswith("_") or math.prod(entry.shape) != 1 or not (is_text or entry.dtype.kind in "fiub"):
            if name in RESERVED:
                raise RecordingError(f"its attribute {name!r} is {entry.dtype} of shape {entry.shape}, not one value")
            continue
        value = hdf.attrs[name]
        if isinstance(value, h5py.Empty):
            yield name, ""
            continue
        value = np.asarray(value).ravel()[0]
        if isinstance(value, bytes):
            value = value.decode("utf-8", "replace")
        is_str = isinstance(value, str)
        yield name, str(value).encode("utf-8", "surrogateescape").decode("utf-8", "replace") if is_str else value.item()


def _text(found: dict[str, Any], name: str, default: str | None = None) -> str:
    value = found.get(name, default)
    if not isinstance(value, str):
        raise RecordingError(f"its attribute {name!r} is {'missing' if value is None else f'{value!r}, not a text'}")
    return value


def _number(found: dict[str, Any], name: str) -> float:
    value = found.get(name)
    if not isinstance(value, int | float) or not math.isfinite(value):
        raise RecordingError(f"its attribute {name!r} is {'missing' if value is None else f'{value!r}, not a number'}")
    return float(value)
