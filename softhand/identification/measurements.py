"""Measured forces of a fingertip: CSV files whose header names quantities and units."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softhand.errors import MeasurementError
from softhand.identification.units import UNITS, scale_of
from softhand.numerics.arrays import Array
from softhand.settings.wording import nearest

DEFORMATION = {"dr": "length", "dtheta": "angle", "dphi": "angle", "dpsi": "angle"}
FORCE = {"Fr": "force", "Ftheta": "moment", "Fphi": "moment", "Fpsi": "moment"}
COLUMNS = {"phi": "angle", **DEFORMATION, **FORCE}
"""Columns that a file may have, and the kind of each."""

EXAMPLE = Path(__file__).with_name("example.csv")
"""Measurements to try things with: generated, not measured, as their first lines say."""

_HEADER = re.compile(r"(?P<name>[^\[\]]*?)\s*(\[(?P<unit>[^\[\]]*)\])?")
_RADIUS = re.compile(r"#\s*radius\s*(\[(?P<unit>[^\]]*)\])?\s*=\s*(?P<value>\S+)\s*(?P<after>[^#]*)")


@dataclass(frozen=True, eq=False)
class Measurements:
    """What was imposed on a hemispherical tip and what was measured.

    Attributes:
        phi: contact angle of the undeformed tip, phi = Phi + dphi [rad], shape (n,).
        deformation: dr [m], dtheta, dphi, dpsi [rad], shape (n, 4).
        force: Fr [N], Ftheta, Fphi, Fpsi [N m], NaN where not measured, shape (n, 4).
        radius: of the undeformed tip [m], if the file says so.
    """

    phi: Array
    deformation: Array
    force: Array
    radius: float | None = None

    def __len__(self) -> int:
        return len(self.phi)

    @property
    def settings(self) -> NDArray[np.int64]:
        """Number of the imposed setting of each row: rows that repeat a setting have the same, shape (n,)."""
        imposed = np.column_stack([self.phi, self.deformation])
        _, number = np.unique(np.round(imposed, 9), axis=0, return_inverse=True)
        return number.ravel()

    def select(self, rows: NDArray[np.bool_]) -> Measurements:
        """Some of the rows."""
        return Measurements(self.phi[rows], self.deformation[rows], self.force[rows], self.radius)


def read_measurements(files: Sequence[str | Path]) -> Measurements:
    """Read and join CSV files.

    The first line that does not begin with `#` is the header: names of `COLUMNS`, each with its unit in square
    brackets, such as `dr [mm]`. `phi` and `dr` must be there, `dtheta`, `dphi` and `dpsi` are zero where they are not.
    An empty cell of a force was not measured. `force` is another name of `Fr`, and `moment` one of the moment about the
    only angle of deformation that the file has. A line `# radius [mm] = 10` gives the radius of the tip.

    Raises:
        MeasurementError: a column or a cell cannot be understood; names file, column and line.
    """
    parts = [_read_file(Path(file)) for file in files]
    radii = {part.radius for part in parts if part.radius is not None}
    if len(radii) > 1:
        values = ", ".join(f"{1e3 * radius:g}" for radius in sorted(radii))
        raise MeasurementError(
            f"The files are of tips of different radii, {values} mm; fit them one by one.", column="radius", value=radii
        )
    return Measurements(
        np.concatenate([part.phi for part in parts]),
        np.concatenate([part.deformation for part in parts]),
        np.concatenate([part.force for part in parts]),
        radii.pop() if radii else None,
    )


def _read_file(file: Path) -> Measurements:
    try:
        lines = file.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        why = getattr(error, "strerror", None) or f"it is not UTF-8 text ({error})"
        raise MeasurementError(f"{file}: cannot be read: {why}.", column="", value=str(file)) from error
    numbered = [(k, line) for k, line in enumerate(lines, start=1) if line.strip() and line.lstrip()[0] != "#"]
    if len(numbered) < 2:
        raise MeasurementError(f"{file}: needs a header and at least one row of numbers.", column="", value=str(file))
    (_, header), *body = numbered
    delimiter = max(",;\t", key=header.count)
    names, scales = _read_header(file, next(csv.reader([header], delimiter=delimiter)))
    rows = [_read_row(file, k, next(csv.reader([line], delimiter=delimiter)), names) for k, line in body]
    table = dict(zip(names, np.array(rows).T * np.array(scales)[:, None], strict=True))
    count = len(rows)
    found = Measurements(
        table["phi"],
        np.column_stack([table.get(name, np.zeros(count)) for name in DEFORMATION]),
        np.column_stack([table.get(name, np.full(count, np.nan)) for name in FORCE]),
        _read_radius(file, lines),
    )
    _check_range(file, found, [k for k, _ in body])
    return found


def _read_header(file: Path, cells: Iterable[str]) -> tuple[list[str], list[float]]:
    """Names of `COLUMNS` and the factor of each column to SI."""
    labels = [cell.strip() for cell in cells]
    split = [_HEADER.fullmatch(label) for label in labels]
    known: list[str] = []
    for label, match in zip(labels, split, strict=True):
        name = match["name"].strip() if match else label
        name = _alias(file, name, [other["name"].strip() for other in split if other])
        if name not in COLUMNS:
            near = nearest(name, COLUMNS)
            hint = f' Did you mean "{near}"?' if near else ""
            raise _bad(file, label, f"is no known column.{hint} Known: {', '.join(COLUMNS)}; remove what is not data")
        if name in known:
            raise _bad(file, label, "is there twice")
        known.append(name)
    for name in ("phi", "dr"):
        if name not in known:
            raise _bad(file, name, "is missing; add this column, with its unit")
    if not set(known) & set(FORCE):
        raise _bad(file, ", ".join(FORCE), "are all missing; add what was measured, with its unit")
    scales: list[float] = []
    units: dict[str, tuple[str, float]] = {}
    for label, name, match in zip(labels, known, split, strict=True):
        kind = COLUMNS[name]
        unit = (match["unit"] or "").strip() if match else ""
        if not unit:
            allowed = ", ".join(f"[{known_unit}]" for known_unit in UNITS[kind])
            raise _bad(file, label, f"has no unit; write one of {allowed} behind its name")
        scale = scale_of(unit, kind, f'{file}: column "{label}"')
        first, first_scale = units.setdefault(kind, (label, scale))
        if scale != first_scale:
            raise _bad(file, label, f'is in another unit than "{first}"; use one unit for each {kind} of a file')
        scales.append(scale)
    return known, scales


def _alias(file: Path, name: str, others: Sequence[str]) -> str:
    """`force` and `moment` by their own names."""
    if name == "force":
        return "Fr"
    if name != "moment":
        return name
    angles = [other for other in others if DEFORMATION.get(other) == "angle"]
    if len(angles) != 1:
        which = "several angles" if angles else "no angle"
        raise _bad(file, name, f"can be any moment, as the file has {which} of deformation; write Ftheta, Fphi or Fpsi")
    return f"F{angles[0].removeprefix('d')}"


def _read_row(file: Path, line: int, cells: Sequence[str], names: Sequence[str]) -> list[float]:
    if len(cells) != len(names):
        raise MeasurementError(
            f"{file}, line {line}: {len(cells)} cells, but the header has {len(names)} columns.", column="", value=cells
        )
    row = []
    for cell, name in zip(cells, names, strict=True):
        if not cell.strip() and name in FORCE:
            row.append(math.nan)
            continue
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not math.isfinite(value):
            raise MeasurementError(
                f'{file}, line {line}, column "{name}": {cell.strip() or "an empty cell"} is no finite number; units '
                "belong into the header, and only a force may be empty.",
                column=name, value=cell,
            )  # fmt: skip
        row.append(value)
    return row


def _read_radius(file: Path, lines: Iterable[str]) -> float | None:
    for line in lines:
        match = _RADIUS.fullmatch(line.strip())
        if match:
            return read_length(f"{match['value']} {match['unit'] or match['after']}", f"{file}: radius")
    return None


def read_length(text: str, where: str) -> float:
    """A positive length [m] from a text such as "10 mm".

    Raises:
        MeasurementError: no number, not positive, no unit or another one.
    """
    match = re.fullmatch(r"\s*([-+.\deE]*\d\.?)\s*([^\d\s]*)\s*", text)
    try:
        value = float(match[1]) if match else math.nan
    except ValueError:
        value = math.nan
    if not match or not match[2] or not (0.0 < value < math.inf):
        raise MeasurementError(
            f'{where}: got "{text.strip()}"; give a length, such as 10 mm.', column=where, value=text
        )
    return value * scale_of(match[2], "length", where)


def _check_range(file: Path, found: Measurements, lines: Sequence[int]) -> None:
    """Refuse what no tip can be put at; most often a wrong unit."""
    degrees = np.degrees(found.phi)
    too_deep = found.deformation[:, 0] >= (found.radius or math.inf)
    checks = (
        ("phi", (found.phi <= 0.0) | (found.phi >= math.pi), degrees, "deg; it must be from 0 to 180 deg"),
        ("dr", (found.deformation[:, 0] < 0.0) | too_deep, 1e3 * found.deformation[:, 0],
         "mm; it must be from 0 to the radius"),
    )  # fmt: skip
    for name, wrong, values, must in checks:
        if wrong.any():
            worst = int(np.argmax(wrong))
            raise MeasurementError(
                f'{file}, line {lines[worst]}, column "{name}": {values[worst]:g} {must}. Is the unit right?',
                column=name, value=values[worst],
            )  # fmt: skip


def _bad(file: Path, column: str, what: str) -> MeasurementError:
    return MeasurementError(f'{file}: column "{column}" {what}.', column=column, value=column)
