"""Keys of a scenario by their last part, as keywords in Python have them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

from softhand.errors import ScenarioError
from softhand.plugins import find_plugin
from softhand.settings.wording import is_table, nearest, required, show

_PLUGINS = {
    "fingertip": ("laws", "law"),
    "controller": ("controllers", "name"),
    "reference": ("references", "kind"),
    "stepper": ("steppers", "name"),
}
"""Kind of the plugin of a section, and the key that has its name."""


def full_keys(values: Mapping[str, Any], table: Mapping[str, Any], model: type[BaseModel]) -> dict[str, Any]:
    """The values by dotted keys.

    A keyword is a key at the top, or the last part of one further down, be it of a section or of its plugin.

    Args:
        values: by keyword.
        table: the scenario as tables.
        model: class of the scenario.

    Raises:
        ScenarioError: no key ends so, or several do; names them.
    """
    keys: dict[str, list[str]] = {}
    for key in all_keys(table, model) if values else ():
        keys.setdefault(key.rpartition(".")[2], []).append(key)
    return {_the_one(word, value, keys): value for word, value in values.items()}


def all_keys(table: Mapping[str, Any], model: type[BaseModel]) -> list[str]:
    """All dotted keys that a scenario has or may have, those of its plugins too, each once."""
    return list(dict.fromkeys([*_keys(table, model, ""), *_plugin_keys(table, model)]))


def check_plugin_keys(values: Mapping[str, Any], table: Mapping[str, Any], model: type[BaseModel]) -> None:
    """Refuse keys such as `fingertip.frction`, which neither the section nor its plugin has.

    Args:
        values: by dotted key, what is put over a scenario.
        table: the scenario with them.
        model: class of the scenario.

    Raises:
        ScenarioError: with the nearest key.
    """
    for key, value in values.items():
        section, _, name = key.partition(".")
        if section not in _PLUGINS or not name or "." in name or value is None:  # None takes a key away
            continue
        of_plugin = [own for own in _plugin_keys(table, model) if own.startswith(f"{section}.")]
        of_section = model.model_fields[section].annotation
        if of_plugin and is_table(of_section) and key not in of_plugin and name not in of_section.model_fields:
            known = {**of_section.model_fields, **{own.partition(".")[2]: None for own in of_plugin}}
            near = nearest(name, known)
            hint = f" Did you mean {section}.{near}?" if near else ""
            message = (
                f"{key}: unknown key (with value {show(value)}).{hint} Valid keys in {section}: {', '.join(known)}."
            )
            raise ScenarioError(message, key=key, value=value)


def _the_one(word: str, value: Any, keys: Mapping[str, list[str]]) -> str:
    found = keys.get(word, [])
    if word in found or len(found) == 1:
        return word if word in found else found[0]
    if found:
        message = (
            f"{word}: several keys of the scenario end so: {', '.join(found)}; give the one that is meant as "
            f'overrides={{"{found[-1]}": {show(value)}}}.'
        )
    else:
        near = nearest(word, keys)
        hint = f" Did you mean {near}, for {' or '.join(keys[near])}?" if near else ""
        message = f"{word}: no key of the scenario ends so.{hint}"
    raise ScenarioError(message, key=word, value=value)


def _keys(table: Mapping[str, Any], model: type[BaseModel], path: str) -> Iterator[str]:
    """All keys that the tables have or may have; those of a section that may be missing only if it is there."""
    for name in {**model.model_fields, **table}:
        key, field, own = f"{path}{name}", model.model_fields.get(name), table.get(name)
        yield key
        section = None if field is None else required(field.annotation)
        if field is not None and is_table(section):
            if isinstance(own, Mapping) or field.default is not None:
                yield from _keys(own if isinstance(own, Mapping) else {}, section, f"{key}.")
        elif isinstance(own, Mapping):  # such as the tables of single tips
            yield from (f"{key}.{more}" for more in _set_keys(own))


def _set_keys(table: Mapping[str, Any]) -> Iterator[str]:
    for name, value in table.items():
        yield name
        if isinstance(value, Mapping):
            yield from (f"{name}.{more}" for more in _set_keys(value))


def _plugin_keys(table: Mapping[str, Any], model: type[BaseModel]) -> Iterator[str]:
    """Those of the chosen plugins; none of one that is not known, which is told elsewhere."""
    for section, (kind, key) in _PLUGINS.items():
        own, table_class = table.get(section, {}), model.model_fields[section].annotation
        default = table_class.model_fields[key].default if is_table(table_class) else None
        name = own.get(key, default) if isinstance(own, Mapping) else None
        try:
            fields = find_plugin(kind, name, key).model_fields if isinstance(name, str) else {}
        except ScenarioError:
            continue
        yield from (f"{section}.{field}" for field in fields)
