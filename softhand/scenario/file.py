"""Scenario files: finding them, reading TOML, paths in them, and single values put over them."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from softhand.errors import ScenarioError
from softhand.files import read_regular
from softhand.scenario.packages import package_file
from softhand.settings.settings import frozen
from softhand.settings.toml import LONGEST, parse_toml
from softhand.settings.wording import nearest, show

_PACKAGE = Path(__file__).parents[1]


def scenario_names() -> list[str]:
    """Return the names of the scenarios that ship with softhand."""
    return sorted(file.stem for file in (_PACKAGE / "scenarios").glob("*.toml"))


def scenarios() -> dict[str, str]:
    """The scenarios that ship with softhand: what each is about, by name."""
    return {name: str(read_toml(find_scenario(name)).get("description", "")) for name in scenario_names()}


def resolve_path(urdf: str) -> Path:
    """Return the file that a scenario names: a path, or `package://NAME/PATH`, see `packages.package_file`.

    Raises:
        ScenarioError: no URDF of that name ships, or the package is not installed.
    """
    return package_file(urdf) if urdf.startswith("package:") else Path(_absolute(urdf, Path.cwd()))


def parse_override(text: str, example: str = "object.mass=0.3") -> tuple[str, Any]:
    """Split `key=value`, as given on a command line; a value that is no TOML value and starts none is text.

    Args:
        text: to be split.
        example: what one may look like there, for the message.

    Raises:
        ScenarioError: no `=`, nothing on one side of it, or a list, table or quoted text that does not end.
    """
    key, sign, value = (part.strip() for part in text.partition("="))
    if not (key and sign and value):
        raise ScenarioError(f"{show(text)} must have the form key=value, such as {example}.", key=key, value=value)
    try:
        table = parse_toml(f"value = {value}")
    except ValueError as error:
        if value[0] not in "[{\"'":
            return key, value
        message = f"{key}: {show(value)} is no TOML value: {_reason(error)}."
        raise ScenarioError(message, key=key, value=value) from error
    return key, table["value"] if len(table) == 1 else value


def find_scenario(source: str | Path) -> Path:
    """File of a scenario that ships, by its name, or the path as given."""
    names = scenario_names()
    if source in names:
        return _PACKAGE / "scenarios" / f"{source}.toml"
    text = os.fspath(source)
    is_path = isinstance(source, Path) or text.endswith(".toml") or os.path.basename(text) != text
    if is_path or (text and os.path.exists(text)):
        return Path(text)
    near = nearest(text, names)
    hint = f" Did you mean {near}?" if near else ""
    message = (
        f"No scenario is called {show(text)}.{hint} Shipped: {', '.join(names)}; or give the path of a .toml file."
    )
    raise ScenarioError(message, key="scenario", value=text)


def read_toml(file: Path) -> dict[str, Any]:
    """Tables of a TOML file; ScenarioError says why it cannot be read, with line and column."""
    try:
        text = read_regular(file, LONGEST).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = error.object.count(b"\n", 0, error.start) + 1
        raise _unreadable(file, f"is not UTF-8 text: byte 0x{error.object[error.start]:02x} in line {line}") from error
    except FileNotFoundError as error:
        raise _unreadable(file, f"does not exist. Shipped scenarios: {', '.join(scenario_names())}") from error
    except OSError as error:
        raise _unreadable(file, f"cannot be read: {error}") from error
    except ValueError as error:
        raise _unreadable(file, f"{error}; a .toml file is needed") from error
    try:
        return parse_toml(text)
    except ValueError as error:
        raise _unreadable(file, f"is not TOML{_where(error, text)}: {_reason(error)}") from error


def _unreadable(file: Path, why: str) -> ScenarioError:
    return ScenarioError(f"Scenario file {file} {why}.", key="scenario", value=str(file))


def _where(error: Exception, text: str) -> str:
    found = re.search(r"\(at line (\d+), column (\d+)\)$", str(error))
    if found:
        return f" (line {found[1]}, column {found[2]})"
    if str(error).endswith("(at end of document)"):
        return f" (line {text.count(chr(10)) + 1}, column {len(text) - text.rfind(chr(10))})"
    return ""


def _reason(error: Exception) -> str:
    return re.sub(r" \(at [^()]*\)$", "", str(error))


_PATHS = ("hand.urdf", "hand.arm.urdf", "object.urdf", "controller.gain_file")
"""Keys that are the path of a file."""


def _absolute(urdf: Any, folder: Path) -> Any:
    urdf = os.fspath(urdf) if isinstance(urdf, os.PathLike) else urdf
    if not isinstance(urdf, str) or not urdf or urdf.startswith("package:"):
        return urdf
    return os.path.abspath(folder / os.path.expanduser(urdf))


def with_absolute_paths(table: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """The tables with the paths of hand, arm, object and gains taken as relative to a folder."""
    return {name: _with_absolute(name, value, folder) for name, value in table.items()}


def _with_absolute(key: str, value: Any, folder: Path) -> Any:
    """The value of a dotted key, or a table of such keys."""
    if key in _PATHS:
        return _absolute(value, folder)
    if isinstance(value, Mapping) and any(path.startswith(f"{key}.") for path in _PATHS):
        return {name: _with_absolute(f"{key}.{name}", inner, folder) for name, inner in value.items()}
    return value


def overridden(table: Mapping[str, Any], overrides: Mapping[str, Any]) -> dict[str, Any]:
    """The tables with the values of dotted keys put over them; None removes a key."""
    changed: dict[str, Any] = frozen(table)
    for key, value in overrides.items():
        *parents, last = key.split(".")
        if not all((*parents, last)):
            raise ScenarioError(f"{show(key)} is no key; a key is like object.mass.", key=key, value=value)
        place = changed
        for depth, name in enumerate(parents, start=1):
            place = place.setdefault(name, {})
            if not isinstance(place, dict):
                path = ".".join(parents[:depth])
                raise ScenarioError(f"{path}: got {show(place)}, but {key} needs a table there.", key=path, value=place)
        place[last] = frozen(_with_absolute(key, value, Path.cwd()))
        if value is None:
            del place[last]
    return changed
