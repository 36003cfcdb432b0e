"""Tables of tips as CSV: depth, force, shear and torsion with their units in the header."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from softhand.identification.files.header import split_label
from softhand.identification.files.table import Table, read_table
from softhand.laws.tabulated import Tabulated
from softhand.settings.settings import read_settings
from softhand.settings.wording import show

UNITS = {
    "depths": {"m": 1.0, "mm": 1e-3},
    "normal": {"N": 1.0, "mN": 1e-3},
    "shear": {"N/m": 1.0, "N/mm": 1e3},
    "torsion": {"N m/rad": 1.0, "N mm/rad": 1e-3, "N m/deg": 180.0 / math.pi, "N mm/deg": 0.18 / math.pi},
}
"""SI value of each unit of a column."""

LABELS = {"depth": "depths", "dr": "depths", "force": "normal", "Fr": "normal", "shear": "shear", "torsion": "torsion"}
"""Names that a column may have in a file."""


def read_tip_table(file: Path, radius: float) -> Tabulated:
    """The law of a table.

    Args:
        file: CSV with the columns depth, force, shear and torsion, each with its unit, such as `shear [N/mm]`.
        radius: of the tip [m].

    Raises:
        MeasurementError: it cannot be read, or a column is missing, unknown, without unit, or has no numbers.
        ScenarioError: the table is none of a tip, such as one whose force does not grow.
    """
    table = read_table(file)
    columns: dict[str, tuple[float, ...]] = {}
    for place, label in enumerate(table.labels):
        name, unit = split_label(label) if "[" in label or "(" in label else (label, "")
        own = LABELS.get(name)
        if own is None:
            raise table.refused(f"{show(label)} is no column of a tip; they are depth, force, shear and torsion.")
        if own in columns:
            raise table.refused(f"{show(label)} is there twice.")
        if unit not in UNITS[own]:
            allowed = ", ".join(f"[{known}]" for known in UNITS[own])
            raise table.refused(f"{show(label)} must have one of the units {allowed} behind its name.")
        columns[own] = tuple(UNITS[own][unit] * value for value in _numbers(table, place, label))
    for name, own in LABELS.items():
        if own not in columns:
            raise table.refused(f"the column {name} is missing; a tip has depth, force, shear and torsion.")
    return read_settings(Tabulated, {"radius": radius, **columns}, str(file))


def _numbers(table: Table, place: int, label: str) -> list[float]:
    values = [table.number(row[place]) for row in table.rows]
    for row, value in enumerate(values):
        if math.isnan(value):
            raise table.refused(
                f"got {show(table.rows[row][place])}; give a number.", row, label, table.rows[row][place]
            )
    return values


def tip_table(law: Tabulated) -> str:
    """The rows of a law as CSV, as `read_tip_table` reads them."""
    lines = ["depth [mm],force [N],shear [N/mm],torsion [N mm/rad]"]
    rows = np.array([law.depths, law.normal, law.shear, law.torsion]).T * [1e3, 1.0, 1e-3, 1e3]
    return "\n".join([*lines, *(",".join(f"{value:.6g}" for value in row) for row in rows)]) + "\n"
