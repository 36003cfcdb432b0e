"""Settings: checked, frozen tables of named values, and plain words for what is wrong with one."""

from __future__ import annotations

import difflib
import inspect
import json
import re
import sys
import types
from collections.abc import Iterable, Iterator, Mapping
from typing import Annotated, Any, Literal, TypeAlias, TypeGuard, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator
from pydantic.fields import FieldInfo

from softhand.errors import ScenarioError

Positive: TypeAlias = Annotated[float, Field(gt=0)]
NonNegative: TypeAlias = Annotated[float, Field(ge=0)]
Vector3: TypeAlias = tuple[float, float, float]
Vector: TypeAlias = Annotated[tuple[float, ...], Field(min_length=1)]
Gain: TypeAlias = NonNegative | Annotated[tuple[NonNegative, ...], Field(min_length=1)]

_LARGEST = 1e15
"""Beyond it a square or a product soon is no number any more; no quantity of a hand comes near it in SI units."""

_SettingsT = TypeVar("_SettingsT", bound="Settings")


class Settings(BaseModel):
    """Base of scenario sections, fingertip laws, controllers and steppers.

    Frozen and strict: no unknown keys, no NaN or infinity, a bool or a text is never a number, an int is a fine
    float. Arrays are kept as tuples; lists and NumPy arrays are turned into them. Read one from a table with
    `read_settings`, which reports mistakes in plain words; the constructor raises pydantic's own error. A validator
    of a subclass raises ValueError with a sentence for the user; the key's path is put in front of it.
    """

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True, allow_inf_nan=False)

    @field_validator("*", mode="before")
    @classmethod
    def _freeze_arrays(cls, value: Any, info: ValidationInfo) -> Any:
        annotation = cls.model_fields[info.field_name].annotation if info.field_name else None
        if get_origin(annotation) is list:
            return value
        value = frozen(value)
        for number in _numbers_in(value):
            if _LARGEST < abs(number) <= sys.float_info.max:  # pydantic tells of what is no number
                raise ValueError(f"{show(number)} is larger than {_LARGEST:g}; give SI units.")
        return value


def frozen(value: Any) -> Any:
    """Return the value with every list or NumPy array in it as a tuple, and NumPy scalars as plain numbers."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return tuple(frozen(item) for item in value)
    if isinstance(value, Mapping):
        return {key: frozen(item) for key, item in value.items()}
    return value


def _numbers_in(value: Any) -> Iterator[float]:
    """The numbers of an array; those of tables are looked at where these are read."""
    if isinstance(value, tuple):
        for item in value:
            yield from _numbers_in(item)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        yield value


def read_settings(cls: type[_SettingsT], table: Mapping[str, Any], path: str) -> _SettingsT:
    """Make settings of the class from a table, as read from TOML.

    Args:
        cls: the class to make.
        table: names and values.
        path: dotted path of the table, put before its keys in messages; "" for the top level.

    Raises:
        ScenarioError: with one line for each key that is wrong; `.key` and `.value` are those of the first.
    """
    if not isinstance(table, Mapping):
        raise ScenarioError(f"{path}: got {show(table)}, but it must be {describe(cls)}.", key=path, value=table)
    try:
        return cls.model_validate(dict(table))
    except ValidationError as error:
        problems = list(_problems(cls, table, path, error))
        text = "\n".join(message for _, _, message in problems)
        raise ScenarioError(text, key=problems[0][0], value=problems[0][1]) from error


def field_notes(cls: type[BaseModel]) -> dict[str, str]:
    """What the docstrings of a class and its bases say of each field, below `Attributes:`; a line each."""
    notes: dict[str, str] = {}
    for base in reversed(cls.__mro__):
        _, _, section = inspect.cleandoc(base.__doc__ or "").partition("Attributes:\n")
        block = re.match(r"(?:[ ]{4}.*\n?|\n)*", section)
        found = re.findall(r"^    (\w+): (.*(?:\n {8}.*)*)", block[0] if block else "", re.MULTILINE)
        notes |= {name: " ".join(text.split()) for name, text in found}
    return {name: notes[name] for name in cls.model_fields if name in notes}


def unit_of(note: str) -> str:
    """The unit in brackets in a note of `field_notes`; "" without one."""
    found = re.search(r"\[([^\]]+)\]", note)
    return found[1] if found else ""


def nearest(word: str, words: Iterable[str]) -> str | None:
    """Return the one of the words that looks most like the word, capitals ignored, or None."""
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
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_as_toml, value)) + "]"
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_as_key(key)} = {_as_toml(item)}" for key, item in value.items()) + "}"
    return str(value)


def _as_key(word: Any) -> str:
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
    if _is_table(annotation):
        more = " and further ones" if annotation.model_config.get("extra") == "allow" else ""
        return "a table with the keys " + ", ".join(annotation.model_fields) + more
    name = getattr(annotation, "__name__", str(annotation))
    return _WORDS.get(origin or annotation, (f"a {name}", f"values of {name}"))[many] + _describe_limits(metadata)


def _is_table(annotation: Any) -> TypeGuard[type[BaseModel]]:
    # Python 3.10 takes tuple[float, ...] for a type, but not for a class that could have a base.
    return isinstance(annotation, type) and get_origin(annotation) is None and issubclass(annotation, BaseModel)


def _required(annotation: Any) -> Any:
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


def _problems(
    cls: type[BaseModel], table: Mapping[str, Any], path: str, error: ValidationError
) -> Iterator[tuple[str, Any, str]]:
    """Yield (key, value, message), one for each key at fault, unknown keys first.

    Pydantic reports several errors for one key where it may be a number or a list; they make one message here.
    """
    by_keys: dict[tuple[str, ...], list[Any]] = {}
    for detail in sorted(error.errors(include_url=False), key=lambda detail: detail["type"] != "extra_forbidden"):
        by_keys.setdefault(_locate(cls, detail["loc"])[1], []).append(detail)
    excused = set()
    for keys, details in by_keys.items():
        model, _, field = _locate(cls, details[0]["loc"])
        value, shown = _look_up(table, keys), [*([path] if path else []), *map(_as_key, keys)]
        key, parent = ".".join(shown), ".".join(shown[:-1])
        if field is None and details[0]["type"] == "extra_forbidden":
            near = nearest(keys[-1], model.model_fields)
            excused.add((*keys[:-1], near))  # if it is missing, then because it is misspelt
            place, hint = (parent, near) if near else (path, _elsewhere(cls, keys[-1]))
            suggestion = f"{place}.{hint}".lstrip(".") if hint else None
            yield key, value, _unknown(key, value, parent, suggestion, model)
        elif keys not in excused or details[0]["type"] != "missing":
            yield key, value, _wrong(key, value, field, _look_up(table, keys[:-1]), model, details)


def _unknown(key: str, value: Any, parent: str, near: str | None, model: type[BaseModel]) -> str:
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
        table = None if field is None else _required(field.annotation)
        if not _is_table(table) or len(keys) == len(location):
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
        if _is_table(field.annotation) and word in field.annotation.model_fields:
            return f"{name}.{word}"
    return None
