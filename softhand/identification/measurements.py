"""Measurements from CSV files."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softhand.errors import MeasurementError
from softhand.identification.files.header import DEFORMATION, FORCE, Column, read_header, split_label
from softhand.identification.files.lengths import read_length
from softhand.identification.files.table import MOST_ROWS, Table, read_table
from softhand.identification.plausible import LARGEST
from softhand.identification.record import EXAMPLE, Measurements
from softhand.numerics.arrays import Array
from softhand.settings.wording import show

__all__ = ["EXAMPLE", "Measurements", "read_length", "read_measurements"]


def read_measurements(files: Sequence[str | Path]) -> Measurements:
    """Read and join CSV files.

    The first line that does not begin with `#` is the header: names of `files.header.COLUMNS`, each with its unit, such
    as `dr [mm]` or `dr (mm)`. `phi` and `dr` must be there, `dtheta`, `dphi` and `dpsi` are zero where they are not.
    An empty cell of a force was not measured. `force` is another name of `Fr`, and `moment` one of the moment about
    the only angle of deformation that the file has. `series` says which rows were measured in one go; without it
    series are found from the order of the rows. A `time` that falls begins a new one. Rows before touch, dr < 0, are
    left out with a note. A line `# radius [mm] = 10` gives the radius of the tip.

    Raises:
        MeasurementError: a column or a cell cannot be understood; names file, column and line.
    """
    if not files:
        raise MeasurementError("There are no files of measurements; give at least one.", column="", value=None)
    parts = [_read_file(Path(file)) for file in files]
    count = sum(len(part) for part in parts)
    if count > MOST_ROWS:
        raise MeasurementError(
            f"The files have {count} rows, more than {MOST_ROWS}; take means, or every tenth row.",
            column="",
            value=count,
        )
    radii = {part.radius for part in parts if part.radius is not None}
    if len(radii) > 1:
        values = ", ".join(f"{1e3 * radius:g}" for radius in sorted(radii))
        raise MeasurementError(
            f"The files are of tips of different radii, {values} mm; fit them one by one.", column="radius", value=radii
        )
    if len({part.has_series for part in parts}) > 1:
        raise MeasurementError(
            "Some files have a column series and some have none; give all of them one.", column="series", value=None
        )
    before = np.cumsum([0, *(part.runs.max(initial=-1) + 1 for part in parts[:-1])])
    return Measurements(
        np.concatenate([part.phi for part in parts]),
        np.concatenate([part.deformation for part in parts]),
        np.concatenate([part.force for part in parts]),
        radii.pop() if radii else None,
        np.concatenate([part.runs + first for part, first in zip(parts, before, strict=True)]),
        parts[0].has_series,
        tuple(note for part in parts for note in part.notes),
    )


def _read_file(file: Path) -> Measurements:
    table = read_table(file)
    columns = read_header(table)
    numbers = {column.name: _numbers(table, k, column) for k, column in enumerate(columns) if column.name != "series"}
    count, radius = len(table.rows), _radius(table)
    _check_ranges(table, numbers, radius)
    run = np.zeros(count, dtype=np.int64)
    labels = [row[k] for k, column in enumerate(columns) if column.name == "series" for row in table.rows]
    if labels:
        run = np.unique(labels, return_inverse=True)[1].ravel()
    elif "time" in numbers:
        run = np.concatenate([[0], np.cumsum(np.diff(numbers["time"]) < 0.0)])
    found = Measurements(
        numbers["phi"],
        np.column_stack([numbers.get(name, np.zeros(count)) for name in DEFORMATION]),
        np.column_stack([numbers.get(name, np.full(count, np.nan)) for name in FORCE]),
        radius, run, bool(labels),
    )  # fmt: skip
    return _in_touch(table, found)


def _numbers(table: Table, k: int, column: Column) -> Array:
    """A column in SI; an empty cell of a force is NaN."""
    values = np.empty(len(table.rows))
    for row, cells in enumerate(table.rows):
        cell = cells[k].strip()
        values[row] = table.number(cell) * column.scale
        if math.isnan(values[row]) and (cell or column.name not in FORCE):
            hint = "leave the cell of a force empty where it was not measured, and put units into the header"
            what = f"{show(cell) if cell else 'an empty cell'} is no finite number; {hint}."
            raise table.refused(what, row, column.name, cell)
    return values


def _radius(table: Table) -> float | None:
    """Of a remark `radius [mm] = 10` or `radius = 10 mm`."""
    for remark in table.remarks:
        label, sign, value = remark.partition("=")
        name, unit = split_label(label.strip())
        if sign and name == "radius":
            return read_length(f"{value.partition('#')[0]} {unit}", f"{table.file}: radius")
    return None


def _check_ranges(table: Table, numbers: Mapping[str, Array], radius: float | None) -> None:
    """Refuse what no tip can be put at; most often a wrong unit."""
    degrees = {name: np.degrees(numbers[name]) for name in ("phi", "dtheta", "dphi", "dpsi") if name in numbers}
    checks: list[tuple[str, Array, NDArray[np.bool_], str]] = [
        ("phi", degrees["phi"], np.abs(numbers["phi"] - 0.5 * math.pi) >= 0.5 * math.pi,
         "deg; it must be from 0 to 180 deg"),
        ("dr", 1e3 * numbers["dr"], numbers["dr"] >= (radius or 1.0), "mm; it must be from 0 to the radius"),
        *((name, values, np.abs(values) > 360.0, "deg; it must be a turn at most")
          for name, values in degrees.items() if name != "phi"),
        *((name, numbers[name], np.abs(numbers[name]) > LARGEST, f"{'N' if kind == 'force' else 'N m'} is none "
           "that a fingertip bears") for name, kind in FORCE.items() if name in numbers),
    ]  # fmt: skip
    for name, values, wrong, must in checks:
        if wrong.any():
            worst = int(np.argmax(wrong))
            raise table.refused(f"{values[worst]:g} {must}. Is the unit right?", worst, name, float(values[worst]))


def _in_touch(table: Table, found: Measurements) -> Measurements:
    """The rows with the tip in touch; the others tell nothing of a law."""
    before = found.deformation[:, 0] < 0.0
    if not before.any():
        return found
    first, count = int(np.argmax(before)), int(before.sum())
    if 2 * count > len(found):
        what = (f"{1e3 * found.deformation[first, 0]:g} mm, and most rows are negative; compression is positive: turn "
                "the sign of the column, or let it begin at touch.")  # fmt: skip
        raise table.refused(what, first, "dr", float(found.deformation[first, 0]))
    note = f"{table.file}: {count} row{'s' * (count > 1)} before touch, dr < 0, left out"
    kept = found.select(~before)
    return Measurements(kept.phi, kept.deformation, kept.force, kept.radius, kept.run, kept.has_series, (note,))
