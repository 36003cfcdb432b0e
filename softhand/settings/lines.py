"""The line of a key in a TOML text, which the standard library's reader does not tell."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from softhand.settings.toml import parse_toml

_MOST = 5000  # lines that are looked through


def line_of(text: str, keys: Sequence[str]) -> int:
    """Line, counted from 1, of the statement that first brings a key, or as many of its parts as there are; 0 if none.

    The text is read up to each of its lines in turn. Where that is whole TOML, statements end; the first end at which
    the key is there is that of its own statement.

    Args:
        text: whole TOML.
        keys: parts of the key, those of its tables first.
    """
    lines = text.splitlines()
    found, begins = 0, 1
    depth = 0
    for number in range(1, min(len(lines), _MOST) + 1):
        if not lines[number - 1].partition("#")[0].strip():
            begins += begins == number
            continue
        try:
            table = parse_toml("\n".join(lines[:number]) + "\n")
        except ValueError:  # within a text or a list of several lines
            continue
        there = _depth(table, keys)
        if there > depth:
            found, depth = begins, there
        begins = number + 1
    return found


def _depth(table: Any, keys: Sequence[str]) -> int:
    """How many parts of a key there are."""
    for count, key in enumerate(keys):
        if not isinstance(table, Mapping) or key not in table:
            return count
        table = table[key]
    return len(keys)
