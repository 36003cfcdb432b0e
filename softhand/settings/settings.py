"""Settings: checked, frozen tables of named values, and plain words for what is wrong with one."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, get_origin

from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator, model_validator

from softhand.errors import ScenarioError
from softhand.settings.guesses import did_you_mean
from softhand.settings.problems import list_problems
from softhand.settings.wording import describe, show

Positive: TypeAlias = Annotated[float, Field(gt=0)]
NonNegative: TypeAlias = Annotated[float, Field(ge=0)]
Vector3: TypeAlias = tuple[float, float, float]
Vector: TypeAlias = Annotated[tuple[float, ...], Field(min_length=1)]
Gain: TypeAlias = NonNegative | Annotated[tuple[NonNegative, ...], Field(min_length=1)]

_LARGEST = 1e15
"""Beyond it a square or a product soon is no number any more; no quantity of a hand comes near it in SI units."""
_SMALLEST = 1e-30
"""What is less and not zero has an inverse that is soon no number."""

_OTHERS = frozenset((str, bool, type(None)))
_PLAIN = _OTHERS | {float, int}
"""Most values, which can be left as they are."""

_SettingsT = TypeVar("_SettingsT", bound="Settings")


class Settings(BaseModel):
    """Base of scenario sections, fingertip laws, controllers and steppers.

    Frozen and strict: no unknown keys, no NaN or infinity, a bool or a text is never a number, an int is a fine
    float. Arrays are kept as tuples; lists and NumPy arrays are turned into them. Read one from a table with
    `read_settings`, which reports mistakes in plain words; the constructor raises pydantic's own error. A validator
    of a subclass raises ValueError with a sentence for the user; the key's path is put in front of it.
    """

    model_config = ConfigDict(
        strict=True, extra="forbid", frozen=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    if not TYPE_CHECKING:  # or else editors take any name for a field

        def __getattr__(self, name: str) -> Any:
            try:
                return super().__getattr__(name)
            except AttributeError as error:
                if name.startswith("_") or hasattr(type(self), name):
                    raise
                raise AttributeError(f"{error}{did_you_mean(name, self._names())}") from None

        def __setattr__(self, name: str, value: Any) -> None:
            raise AttributeError(
                f"{type(self).__name__}.{name} cannot be set, as settings stay what they were checked as; make another "
                f"scenario by scenario.replace({name}=...)"
            )

    def _names(self) -> list[str]:
        """What a wrong name is compared with."""
        return [*type(self).model_fields, *(self.model_extra or ())]

    @field_validator("*", mode="before")
    @classmethod
    def _freeze_arrays(cls, value: Any, info: ValidationInfo) -> Any:
        if type(value) in _OTHERS or (info.field_name and _is_list(cls, info.field_name)):
            return value
        value = frozen(value)
        for number in _numbers_in(value):
            if _LARGEST < abs(number) <= sys.float_info.max:  # pydantic tells of what is no number
                raise ValueError(f"{show(number)} is larger than {_LARGEST:g}; give SI units.")
            if 0.0 < abs(number) < _SMALLEST:
                raise ValueError(f"{show(number)} is smaller than {_SMALLEST:g}; give SI units, or 0.")
        return value


class OpenSettings(Settings):
    """A section whose further keys belong to a plugin, which checks them."""

    model_config = ConfigDict(extra="allow")

    @model_validator(mode="before")
    @classmethod
    def _freeze_parameters(cls, table: Any) -> Any:
        return frozen(table)

    @property
    def parameters(self) -> dict[str, Any]:
        """The keys that are not the section's own, unchecked, arrays as tuples."""
        return dict(self.model_extra or {})


@cache
def _is_list(cls: type[BaseModel], name: str) -> bool:
    return get_origin(cls.model_fields[name].annotation) is list


def frozen(value: Any) -> Any:
    """Return the value with every list or NumPy array in it as a tuple, and NumPy scalars as plain numbers."""
    if type(value) in _PLAIN:
        return value
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
        problems = list(list_problems(cls, table, path, error))
        text = "\n".join(message for _, _, message in problems)
        raise ScenarioError(text, key=problems[0][0], value=problems[0][1]) from error
