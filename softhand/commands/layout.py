"""Tables as text of a width: columns side by side, and no word cut; what does not fit stands on lines of its own."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterator, Sequence

_GAP = 2
_UNDER = 6  # letters by which a cell is moved in that stands below its row
_NUMBER = re.compile(r"[-+<]?[\d.,]*(e[-+]?\d+)?|never")


def lay_out(rows: Sequence[Sequence[str]], header: Sequence[str] = (), width: int = 80) -> list[str]:
    """The lines of a table.

    Args:
        rows: cells as text, as many in each row.
        header: names of the columns, which may have several lines; columns of numbers then stand to the right.
        width: letters of a line; a word that is longer than all of them runs over it.
    """
    if not rows:
        return []
    widths = _widths([*rows, *_header_lines(header)], width)
    is_right = [bool(header) and k > 0 and all(_NUMBER.fullmatch(row[k]) for row in rows) for k in range(len(widths))]
    lines = [_line(cells, widths, is_right) for cells in _header_lines(header)]
    if header:
        lines.append("  " + "-" * (sum(widths) + _GAP * (len(widths) - 1)))
    for row in rows:
        lines.extend(_row(row, widths, is_right, width))
    return lines


def _widths(rows: Sequence[Sequence[str]], width: int) -> list[int]:
    """Of the columns: as wide as what is in them, the widest ones down to their longest words if that is too wide."""
    columns = list(zip(*rows, strict=True))
    widths = [max(len(cell) for cell in column) for column in columns]
    least = [max((len(word) for cell in column for word in cell.split()), default=0) for column in columns]
    room = width - _GAP * len(widths)
    if sum(least) > room:  # the cells with the longest words will stand alone
        least[max((0, len(widths) - 1), key=lambda k: least[k])] = 1
    while sum(widths) > room and widths != least:
        widths[max(range(len(widths)), key=lambda k: (widths[k] > least[k], widths[k]))] -= 1
    return widths


def _header_lines(header: Sequence[str]) -> list[list[str]]:
    names = [name.split("\n") for name in header]
    depth = max(map(len, names), default=0)
    padded = [[""] * (depth - len(name)) + name for name in names]
    return [list(cells) for cells in zip(*padded, strict=True)]


def _row(row: Sequence[str], widths: Sequence[int], is_right: Sequence[bool], width: int) -> Iterator[str]:
    wrapped = [_wrap(cell, room) for cell, room in zip(row, widths, strict=True)]
    fits = [all(len(line) <= room for line in lines) for lines, room in zip(wrapped, widths, strict=True)]
    below: list[str] = []
    if not fits[0]:
        yield from ("  " + line for line in _wrap(row[0], width - _GAP))
        wrapped[0] = [""]
    if len(row) > 1 and not fits[-1]:
        below, wrapped[-1] = _wrap(row[-1], width - _UNDER), [""]
    for k in range(max(map(len, wrapped))):
        cells = [lines[k] if k < len(lines) else "" for lines in wrapped]
        if any(cells):
            yield _line(cells, widths, is_right)
    yield from (" " * _UNDER + line for line in below)


def _line(cells: Sequence[str], widths: Sequence[int], is_right: Sequence[bool]) -> str:
    placed = [
        cell.rjust(room) if right else cell.ljust(room)
        for cell, room, right in zip(cells, widths, is_right, strict=True)
    ]
    return ("  " + (" " * _GAP).join(placed)).rstrip()


def _wrap(text: str, width: int) -> list[str]:
    lines = [textwrap.wrap(line, max(width, 1), break_long_words=False, break_on_hyphens=False) or [""]
             for line in text.split("\n")]  # fmt: skip
    return [line for part in lines for line in part]
