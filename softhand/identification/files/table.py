"""A CSV file as a header and rows of cells: commas, semicolons or tabs, decimal points or decimal commas."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from softhand.errors import MeasurementError
from softhand.identification.files.text import read_lines
from softhand.settings.wording import show

MOST_ROWS = 20_000
"""Of a file. Beyond it a fit takes minutes and tells no more than means would."""

_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d*,\d+([eE][-+]?\d+)?\s*")


@dataclass(frozen=True)
class Table:
    """The cells of a file.

    Attributes:
        file: where it is from.
        labels: cells of the header, stripped.
        lines: number of the line of each row.
        rows: as many cells as labels in each.
        remarks: lines that begin with `#`, without it.
        has_commas: whether a comma is the decimal mark.
    """

    file: Path
    labels: tuple[str, ...]
    lines: tuple[int, ...]
    rows: tuple[tuple[str, ...], ...]
    remarks: tuple[str, ...]
    has_commas: bool

    def number(self, cell: str) -> float:
        """The number in a cell, NaN if there is none or it is infinite."""
        text = cell.strip().replace("\N{MINUS SIGN}", "-")
        if self.has_commas:
            text = text.replace(",", ".")
        try:
            value = float(text) if "_" not in text else math.nan
        except ValueError:
            return math.nan
        return value if math.isfinite(value) else math.nan

    def refused(self, what: str, row: int | None = None, column: str = "", value: object = None) -> MeasurementError:
        """An error that names the file, and the line and column if they are given."""
        line = "" if row is None else f", line {self.lines[row]}"
        where = f', column "{column}"' if column and row is not None else ""
        return MeasurementError(f"{self.file}{line}{where}: {what}", column=column, value=value)


def read_table(file: Path, most: int = MOST_ROWS) -> Table:
    """Read a CSV file of at most so many rows. Separators behind the last cell of a line are passed over.

    Raises:
        MeasurementError: it cannot be read, is empty or too long, or a row has another number of cells than the header.
    """
    lines = read_lines(file)
    filled = [(number, line) for number, line in enumerate(lines, start=1) if line.strip()]
    remarks = tuple(line.strip().lstrip("#") for _, line in filled if line.lstrip()[0] == "#")
    body = [(number, line) for number, line in filled if line.lstrip()[0] != "#"]
    if not 2 <= len(body) <= most + 1:
        what = "needs a header and at least one row of numbers" if len(body) < 2 else (
            f"has {len(body) - 1} rows, more than {most}; take means, or every tenth row")  # fmt: skip
        raise MeasurementError(f"{file}: {what}.", column="", value=len(body))
    delimiter = max(",;\t", key=body[0][1].count)
    labels, *rows = ([cell.strip() for cell in _cells(file, *line, delimiter)] for line in body)
    while len(labels) > 1 and not labels[-1]:
        labels.pop()
    if len(labels) == 1:
        raise MeasurementError(
            f"{file}: its header is one column, {show(labels[0])}; separate columns by commas, semicolons or tabs, and "
            "put # before lines above the header.",
            column=labels[0], value=labels[0],
        )  # fmt: skip
    table = Table(file, tuple(labels), tuple(number for number, _ in body[1:]),
                  tuple(_trimmed(row, len(labels)) for row in rows), remarks,
                  delimiter != "," and _has_decimal_commas(file, rows))  # fmt: skip
    for k, row in enumerate(table.rows):
        if len(row) != len(labels):
            hint = " Decimal commas need semicolons between the columns." if delimiter == "," else ""
            what = f"{len(row)} cells, but the header has {len(labels)} columns.{hint}"
            raise table.refused(what, row=k, value=len(row))
    return table


def _cells(file: Path, number: int, line: str, delimiter: str) -> list[str]:
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=True))
    except csv.Error as error:
        raise MeasurementError(f"{file}, line {number}: is no row of CSV: {error}.", column="", value=None) from error


def _trimmed(row: Sequence[str], count: int) -> tuple[str, ...]:
    """The row without empty cells that stand behind the last column."""
    return tuple(row[:count]) if not any(row[count:]) else tuple(row)


def _has_decimal_commas(file: Path, rows: Sequence[Sequence[str]]) -> bool:
    cells = [cell for row in rows for cell in row]
    comma = next((cell for cell in cells if _DECIMAL_COMMA.fullmatch(cell)), None)
    point = next((cell for cell in cells if re.fullmatch(r"\s*[-+]?\d*\.\d+([eE][-+]?\d+)?\s*", cell)), None)
    if comma is not None and point is not None:
        raise MeasurementError(
            f"{file}: has decimal commas, as {show(comma)}, and decimal points, as {show(point)}; use one of them.",
            column="", value=comma,
        )  # fmt: skip
    return comma is not None
