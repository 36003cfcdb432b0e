"""What is wrong with a table of settings, a message for each key."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from softhand.settings.wording import as_key, describe, is_table, nearest, required, short, show

_MOST = 10  # keys that are told of


def list_problems(
    cls: type[BaseModel], table: Mapping[str, Any], path: str, error: ValidationError
) -> Iterator[tuple[str, Any, str]]:
    """Yield (key, value, message), one for each key at fault, unknown keys first.

    Behind the first `_MOST` stands one that counts the others. Pydantic reports several errors for one key where it
    may be a number or a list; they make one message here.
    """
    by_keys: dict[tuple[str, ...], list[Any]] = {}
    for detail in sorted(error.errors(include_url=False), key=lambda detail: detail["type"] != "extra_forbidden"):
        by_keys.setdefault(_locate(cls, detail["loc"])[1], []).append(detail)
    excused, told = set(), 0
    for done, (keys, details) in enumerate(by_keys.items()):
        if told == _MOST:
            yield path, None, f"And {len(by_keys) - done} more keys are wrong."
            return
        model, _, field = _locate(cls, details[0]["loc"])
        value, shown = _look_up(table, keys), [*([path] if path else []), *(short(as_key(part)) for part in keys)]
        key, parent = ".".join(shown), ".".join(shown[:-1])
        if field is None and details[0]["type"] == "extra_forbidden":
            near = nearest(keys[-1], model.model_fields)
            excused.add((*keys[:-1], near))  # if it is missing, then because it is misspelt
            place, hint = (parent, near) if near else (path, _elsewhere(cls, keys[-1]))
            suggestion = f"{place}.{hint}".lstrip(".") if hint else None
            told += 1
            yield key, value, unknown_key(key, value, parent, suggestion, model)
        elif keys not in excused or details[0]["type"] != "missing":
            told += 1
            yield key, value, _wrong(key, value, field, _look_up(table, keys[:-1]), model, details)


def unknown_key(key: str, value: Any, parent: str, near: str | None, model: type[BaseModel]) -> str:
    """The message for a key that a table does not have; `near` is the one that may be meant."""
    hint = f" Did you mean {near}?" if near else ""
    shown = " (a table)" if isinstance(value, Mapping) else f" (with value {show(value)})"
    place = f"in {parent}" if parent else "at the top level"
    return f"{key}: unknown key{shown}.{hint} Valid keys {place}: {', '.join(model.model_fields)}."


def _wrong(
    key: str, value: Any, field: FieldInfo | None, siblings: Any, model: type[BaseModel], details: list[Any]
) -> str:
    own = details[0].get("ctx", {}).get("error")
    if own is not None:
        got = "" if isinstance(value, Mapping) else f"got {show(value)}: "
        return f"{key}: {got}{own}" if key else str(own)
    if field is None:
        return f"{key}: got {show(value)}: {details[0]['msg']}"
    allowed = describe(field.annotation, field.metadata)
    if value is None and details[0]["type"] == "missing":
        near = nearest(key.rpartition(".")[2], set(siblings or ()) - set(model.model_fields))
        return f"{key}: missing; it must be {allowed}." + (f" Is it misspelt as {near}?" if near else "")
    finite = ", not NaN or infinite" if any(detail["type"] == "finite_number" for detail in details) else ""
    item = next(filter(None, (_item(value, detail["loc"]) for detail in details)), "")
    return f"{key}: got {show(value)}{item}, but it must be {allowed}{finite}.{_unquoted(value, allowed)}"


def _locate(
    cls: type[BaseModel], location: tuple[int | str, ...]
) -> tuple[type[BaseModel], tuple[str, ...], FieldInfo | None]:
    """Follow a pydantic location down to the last key of a table; leave out list indices and union branches."""
    model, keys, field = cls, [], None
    for part in location:
        keys.append(str(part))
        field = model.model_fields.get(str(part))
        table = None if field is None else required(field.annotation)
        if not is_table(table) or len(keys) == len(location):
            break
        model = table
    return model, tuple(keys), field


def _look_up(table: Any, keys: Iterable[str]) -> Any:
    for key in keys:
        table = table.get(key) if isinstance(table, Mapping) else None
    return table


def _item(value: Any, location: Iterable[int | str]) -> str:
    """Name the item of a list that is at fault, counted from 1, as far down as there is one."""
    numbers = []
    for index in (part for part in location if isinstance(part, int)):
        if not isinstance(value, list | tuple) or index >= len(value):
            break
        value = value[index]
        numbers.append(f"item {index + 1}")
    return f" ({' of '.join(reversed(numbers))} is {show(value)})" if numbers else ""


def _unquoted(value: Any, allowed: str) -> str:
    if not (isinstance(value, str) and allowed.startswith("a number")):
        return ""
    try:
        return f" Write {float(value)!r}, without quotes."
    except ValueError:
        return ""


def _elsewhere(cls: type[BaseModel], word: str) -> str | None:
    """Return the dotted key of another section that has the word as its last part."""
    for name, field in cls.model_fields.items():
        if is_table(field.annotation) and word in field.annotation.model_fields:
            return f"{name}.{word}"
    return None
