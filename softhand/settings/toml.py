"""TOML of bounded length, in keys of bounded depth, as the standard library reads it on each version of Python."""

from __future__ import annotations

import re
import sys
from typing import Any

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

LONGEST = 1_000_000  # characters
_DEEPEST = 20  # parts of a key; the reader takes memory with the square of them

_PART = r"""(?:[\w-]+|"[^"\n]*"|'[^'\n]*')"""
_DEEP_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*\.[ \t]*{_PART}){{{_DEEPEST}}}")


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises:
        ValueError: it is no TOML, longer than `LONGEST`, or nested too deeply; says where, if the reader knows.
    """
    if len(text) > LONGEST:
        raise ValueError(f"longer than {LONGEST} characters")
    deep = _DEEP_KEY.search(text)
    if deep:
        line = text.count("\n", 0, deep.start()) + 1
        column = deep.start() - text.rfind("\n", 0, deep.start())
        raise ValueError(f"a key of more than {_DEEPEST} parts (at line {line}, column {column})")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    except ValueError as error:
        if "integer string conversion" in str(error):
            raise ValueError("a whole number of thousands of digits") from error
        raise
