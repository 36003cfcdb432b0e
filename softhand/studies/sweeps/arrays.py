"""Arrays of many runs on disk, a chunk of runs a file: version 2 of the Zarr format.

    https://zarr-specs.readthedocs.io/en/latest/v2/v2.0.html

The format is a folder an array, JSON beside one file a chunk, which is why a chunk can be written by any process, whole
or not at all, and why what is not there yet reads as the fill value. `xarray.open_zarr` opens it.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from softhand.numerics.arrays import AnyArray
from softhand.recording.whole_file import write_whole

_LEVEL = 1  # of the compression


class Layout(NamedTuple):
    """What an array is like.

    Attributes:
        shape: of the whole array.
        chunks: shape of a chunk: of some runs, and of all else.
        dtype: as NumPy writes it, `<f8`, `<i8`, `|i1` or `<U24`.
        dims: names of its dimensions.
        fill: what is where nothing was written, and NaN for `xarray`; None for zeros and empty texts.
        attributes: such as `units`.
    """

    shape: tuple[int, ...]
    chunks: tuple[int, ...]
    dtype: str
    dims: tuple[str, ...]
    fill: Any
    attributes: Mapping[str, Any] = {}


def write_group(folder: Path, layouts: Mapping[str, Layout], attributes: Mapping[str, Any]) -> None:
    """Make an empty group of arrays: what they are like, without a chunk.

    Args:
        folder: to be made.
        layouts: of the arrays by name.
        attributes: of the group.
    """
    texts: dict[str, Any] = {".zgroup": {"zarr_format": 2}, ".zattrs": dict(attributes)}
    for name, layout in layouts.items():
        texts[f"{name}/.zarray"] = {
            "zarr_format": 2,
            "shape": layout.shape,
            "chunks": layout.chunks,
            "dtype": layout.dtype,
            "compressor": {"id": "zlib", "level": _LEVEL},
            "fill_value": _fill(layout.fill),
            "order": "C",
            "filters": None,
        }
        texts[f"{name}/.zattrs"] = {"_ARRAY_DIMENSIONS": layout.dims, **layout.attributes}
    for name, table in texts.items():
        file = folder / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(table, indent=1))
    (folder / ".zmetadata").write_text(json.dumps({"zarr_consolidated_format": 1, "metadata": texts}))


def read_group(folder: Path) -> tuple[dict[str, Layout], dict[str, Any]]:
    """What the arrays of a group are like, by name, and the attributes of the group.

    Raises:
        OSError, ValueError, KeyError, TypeError: it is none that `write_group` made.
    """
    texts = json.loads((folder / ".zmetadata").read_text())["metadata"]
    layouts = {}
    for name in (place.removesuffix("/.zarray") for place in texts if place.endswith("/.zarray")):
        own, attributes = texts[f"{name}/.zarray"], dict(texts[f"{name}/.zattrs"])
        fill = np.nan if own["fill_value"] == "NaN" else own["fill_value"]
        dims = tuple(attributes.pop("_ARRAY_DIMENSIONS"))
        layouts[name] = Layout(tuple(own["shape"]), tuple(own["chunks"]), own["dtype"], dims, fill, attributes)
    return layouts, texts[".zattrs"]


def _fill(value: Any) -> Any:
    return "NaN" if isinstance(value, float) and np.isnan(value) else value


def write_chunk(folder: Path, name: str, layout: Layout, chunk: int, values: AnyArray) -> int:
    """Write a chunk of an array, whole or not at all.

    Args:
        folder: of the group.
        name: of the array.
        layout: of it.
        chunk: its number along the first dimension.
        values: of it, at most as many runs as there are in a chunk.

    Returns:
        A checksum of the file.

    Raises:
        RecordingError: it cannot be written; a full disk for instance.
    """
    block = _empty(layout.chunks, layout)
    block[: len(values)] = values
    data = zlib.compress(block.tobytes(), _LEVEL)
    write_whole(_file(folder, name, layout, chunk), lambda: data)
    return zlib.crc32(data)


def checksum(folder: Path, name: str, layout: Layout, chunk: int) -> int | None:
    """The checksum of the file of a chunk; None if there is none."""
    try:
        return zlib.crc32(_file(folder, name, layout, chunk).read_bytes())
    except OSError:
        return None


def read_array(folder: Path, name: str, layout: Layout) -> AnyArray:
    """A whole array, its fill value where nothing was written.

    Args:
        folder: of the group.
        name: of the array.
        layout: of it.
    """
    array = _empty(layout.shape, layout)
    length = layout.chunks[0]
    for chunk in range(-(-layout.shape[0] // length)):
        file = _file(folder, name, layout, chunk)
        if file.exists():
            block = np.frombuffer(zlib.decompress(file.read_bytes()), dtype=layout.dtype).reshape(layout.chunks)
            part = array[chunk * length : (chunk + 1) * length]
            part[...] = block[: len(part)]
    return array


def _empty(shape: tuple[int, ...], layout: Layout) -> AnyArray:
    array = np.zeros(shape, dtype=layout.dtype)
    if layout.fill is not None:
        array[...] = layout.fill
    return array


def _file(folder: Path, name: str, layout: Layout, chunk: int) -> Path:
    return folder / name / ".".join(map(str, (chunk, *[0] * (len(layout.shape) - 1))))


def remove_partial(folder: Path) -> None:
    """Remove what a killed process left of a file that it had not finished."""
    for place, _, names in os.walk(folder):
        for name in names:
            if name.endswith(".partial"):
                (Path(place) / name).unlink(missing_ok=True)
