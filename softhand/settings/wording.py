"""Settings in plain words: what one may be, and what it is."""

from __future__ import annotations

import difflib
import json
import math
import re
import types
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal, TypeGuard, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

_MOST_BITS = 1024  # of a whole number that is written out
_LONGEST_KEY = 100  # letters


def choices(word: str, words: Iterable[str]) -> str:
    """Which words there are, the nearest to the one given first."""
    near = nearest(word, words)
    return f"{f'Did you mean {show(near)}? ' if near else ''}There are: {', '.join(words)}."


def nearest(word: str, words: Iterable[str]) -> str | None:
    """Return the one of the words that looks most like the word, capitals ignored, or None."""
    if len(word) > _LONGEST_KEY:
        return None
    by_lower = {other.lower(): other for other in words}
    found = difflib.get_close_matches(word.lower(), by_lower, n=1)
    return by_lower[found[0]] if found else None


def show(value: Any) -> str:
    """Return the value as a TOML file has it, cut to a length fit for a message."""
    text = _as_toml(value)
    return text if len(text) <= 100 else text[:97] + "..."


def _as_toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, int) and value.bit_length() > _MOST_BITS:
        return f"a whole number of {int(value.bit_length() * math.log10(2)) + 1} digits"  # str() refuses the longest
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_as_toml, value)) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{as_key(key)} = {_as_toml(item)}" for key, item in value.items()) + "}"
    return str(value)


def short(key: str) -> str:
    """A key or another word of a stranger, cut to a length fit for a message."""
    return key if len(key) <= _LONGEST_KEY else f"{key[: _LONGEST_KEY - 3]}..."


def as_key(word: Any) -> str:
    """A key as a TOML file has it."""
    return word if re.fullmatch(r"[\w-]+", str(word), re.ASCII) else json.dumps(word, ensure_ascii=False, default=str)


_WORDS: dict[Any, tuple[str, str]] = {
    float: ("a number", "numbers"),
    int: ("a whole number", "whole numbers"),
    bool: ("true or false", "true or false"),
    str: ("text", "texts"),
    dict: ("a table", "tables"),
}


def describe(annotation: Any, metadata: Iterable[Any] = (), many: bool = False) -> str:
    """Say in plain words what a setting of this type may be, such as "a list of 3 numbers".

    Args:
        annotation: the type, as written in a class of settings.
        metadata: limits that belong to it, as pydantic keeps them apart from the type of a field.
        many: whether to say it of several ("numbers" in place of "a number").
    """
    origin, args = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return describe(args[0], [*args[1:], *metadata], many)
    if origin in (Union, types.UnionType):
        return ", or ".join(describe(arg, metadata, many) for arg in args if arg is not types.NoneType)
    if origin is Literal:
        return ("one of " if len(args) > 1 else "") + ", ".join(map(show, args))
    if origin in (tuple, list):
        return _describe_list(args, metadata, many)
    if is_table(annotation):
        more = " and further ones" if annotation.model_config.get("extra") == "allow" else ""
        return "a table with the keys " + ", ".join(annotation.model_fields) + more
    name = getattr(annotation, "__name__", str(annotation))
    return _WORDS.get(origin or annotation, (f"a {name}", f"values of {name}"))[many] + _describe_limits(metadata)


def unit_of(description: str | None) -> str:
    """The unit in brackets in the description of a setting, such as N/m in "Stiffness [N/m]."; "" without one."""
    unit, closed, _ = (description or "").partition("[")[2].partition("]")
    return unit if closed else ""


def is_table(annotation: Any) -> TypeGuard[type[BaseModel]]:
    """Whether a setting of this type is a table."""
    # Python 3.10 takes tuple[float, ...] for a type, but not for a class that could have a base.
    return isinstance(annotation, type) and get_origin(annotation) is None and issubclass(annotation, BaseModel)


def required(annotation: Any) -> Any:
    """The annotation without `| None`."""
    branches = [branch for branch in get_args(annotation) if branch is not types.NoneType]
    is_optional = get_origin(annotation) in (Union, types.UnionType) and len(branches) == 1
    return branches[0] if is_optional else annotation


def _describe_list(items: tuple[Any, ...], metadata: Iterable[Any], many: bool) -> str:
    least = max([getattr(limit, "min_length", None) or 0 for limit in _flat(metadata)], default=0)
    is_open = len(items) < 2 or items[-1] is Ellipsis
    count = (
        ("" if not least else "one or more " if least == 1 else f"at least {least} ") if is_open else f"{len(items)} "
    )
    return f"{'lists' if many else 'a list'} of {count}{describe(items[0], many=True) if items else 'values'}"


def _describe_limits(metadata: Iterable[Any]) -> str:
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    limits = [(sign, getattr(limit, name, None)) for limit in _flat(metadata) for name, sign in signs.items()]
    return " and".join(f" {sign} {bound:g}" for sign, bound in limits if bound is not None)


def _flat(metadata: Iterable[Any]) -> Iterator[Any]:
    for entry in metadata:
        yield from entry.metadata if isinstance(entry, FieldInfo) else [entry]
