"""The header of measurements: what each column is, and the factor of its unit to SI."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from softhand.errors import MeasurementError
from softhand.identification.files.table import Table
from softhand.identification.files.units import UNITS, scale_of
from softhand.settings.wording import nearest, show

DEFORMATION = {"dr": "length", "dtheta": "angle", "dphi": "angle", "dpsi": "angle"}
FORCE = {"Fr": "force", "Ftheta": "moment", "Fphi": "moment", "Fpsi": "moment"}
COLUMNS = {"phi": "angle", **DEFORMATION, **FORCE, "time": "time", "series": ""}
"""Columns that a file may have, and the kind of each; a series has none."""


class Column(NamedTuple):
    """One column: its name in `COLUMNS`, its label in the file, the SI value of its unit."""

    name: str
    label: str
    scale: float


def split_label(label: str) -> tuple[str, str]:
    """Name and unit of `dr [mm]`, `dr (mm)` or `dr / mm`; the unit is "" where there is none."""
    for opening, closing in ("[]", "()"):
        if label.endswith(closing) and opening in label:
            name, _, unit = label[:-1].partition(opening)
            return name.strip(), unit.strip()
    name, _, unit = label.partition("/")
    return name.strip(), unit.strip()


def read_header(table: Table) -> list[Column]:
    """The columns of a table, in their order.

    Raises:
        MeasurementError: a column is unknown, there twice, without unit or in a wrong one; or a needed one is missing.
    """
    pairs = [split_label(label) for label in table.labels]
    names = [_alias(table, name, [other for other, _ in pairs]) for name, _ in pairs]
    for label, name in zip(table.labels, names, strict=True):
        if name not in COLUMNS:
            near = nearest(name, COLUMNS) if len(name) < 100 else None
            hint = f' Did you mean "{near}"?' if near else ""
            raise _bad(table, label, f"is no known column.{hint} Known: {', '.join(COLUMNS)}; remove what is not data, "
                                     "and put # before lines above the header")  # fmt: skip
        if names.count(name) > 1:
            raise _bad(table, label, "is there twice")
    for name in ("phi", "dr"):
        if name not in names:
            raise _bad(table, name, "is missing; add this column, with its unit")
    if not set(names) & set(FORCE):
        raise _bad(table, ", ".join(FORCE), "are all missing; add what was measured, with its unit")
    return _with_scales(table, names, [unit for _, unit in pairs])


def _with_scales(table: Table, names: Sequence[str], units: Sequence[str]) -> list[Column]:
    columns: list[Column] = []
    first: dict[str, Column] = {}
    for label, name, unit in zip(table.labels, names, units, strict=True):
        kind = COLUMNS[name]
        if kind and not unit:
            allowed = ", ".join(f"[{known}]" for known in UNITS[kind])
            raise _bad(table, label, f"has no unit; write one of {allowed} behind its name")
        scale = scale_of(unit, kind, f"{table.file}: column {show(label)}") if kind else 1.0
        column = Column(name, label, scale)
        other = first.setdefault(kind, column)
        if scale != other.scale:
            raise _bad(table, label, f'is in another unit than "{other.label}"; use one unit for each {kind} of a file')
        columns.append(column)
    return columns


def _alias(table: Table, name: str, others: Sequence[str]) -> str:
    """`force`, `moment` and `t` by their own names."""
    if name != "moment":
        return {"force": "Fr", "t": "time"}.get(name, name)
    angles = [other for other in others if DEFORMATION.get(other) == "angle"]
    if len(angles) != 1:
        which = "several angles" if angles else "no angle"
        what = f"can be any moment, as the file has {which} of deformation; write Ftheta, Fphi or Fpsi"
        raise _bad(table, name, what)
    return f"F{angles[0].removeprefix('d')}"


def _bad(table: Table, column: str, what: str) -> MeasurementError:
    return table.refused(f"column {show(column)} {what}.", column=column, value=column)
