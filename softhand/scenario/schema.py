"""The scenario as a JSON schema, by which editors complete and check keys.

Plugins are chosen by name: a section is any one of the tables of its plugins, or, under a name that is not known here,
a table of its own keys and anything else.
"""

from __future__ import annotations

import inspect
from typing import Any

from pydantic import BaseModel

from softhand.plugins import find_plugin, plugin_names
from softhand.scenario import scenario
from softhand.scenario.fingertip import DampingSection, FingertipSection, TipSection
from softhand.scenario.scenario import Scenario
from softhand.scenario.task import ControllerSection, ReferenceSection, StepperSection
from softhand.settings.notes import field_notes

Schema = dict[str, Any]


def scenario_schema() -> Schema:
    """JSON schema, draft 2020-12, of a scenario file with all plugins that are installed."""
    damping = _choice(DampingSection, "dampings", "name")
    tips = {
        "description": field_notes(FingertipSection)["tips"],
        "type": "object",
        "additionalProperties": _tip(damping),
    }
    sections: dict[str, Schema] = {
        "fingertip": _choice(FingertipSection, "laws", "law", {"damping": damping, "tips": tips}),
        "controller": _choice(ControllerSection, "controllers", "name"),
        "reference": _choice(ReferenceSection, "references", "kind"),
        "stepper": _choice(StepperSection, "steppers", "name"),
    }
    fields = Scenario.model_fields
    for name, field in fields.items():
        section = field.annotation
        if name not in sections and isinstance(section, type) and issubclass(section, BaseModel):
            sections[name] = _table(section)
    table = _table(Scenario)
    notes = field_notes(Scenario)
    table["properties"] |= {name: {"description": notes[name], **section} for name, section in sections.items()}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "softhand scenario", **table}


def _tip(damping: Schema) -> Schema:
    """What differs at one fingertip: keys of all laws, as its law may be named elsewhere."""
    own = _table(TipSection)
    laws = [_table(find_plugin("laws", name, "law"))["properties"] for name in plugin_names("laws")]
    properties = {key: {"type": value.get("type", "number")} for law in laws for key, value in law.items()}
    own["properties"] = {**properties, **own["properties"], "damping": damping}
    return {**own, "additionalProperties": True}


def _choice(section: type[BaseModel], kind: str, key: str, more: Schema | None = None) -> Schema:
    """A section whose further keys depend on the name of its plugin."""
    own = _table(section)
    own["properties"] |= more or {}
    names, default = plugin_names(kind), section.model_fields[key].default
    choices = []
    for name in names:
        plugin = find_plugin(kind, name, key)
        table = _table(plugin)
        chosen = {key: {"const": name, "description": table["description"]}}
        needed = {*own["required"], *table["required"], key}
        if name == default:
            needed.discard(key)
        choices.append(
            {
                "type": "object",
                "title": name,
                "properties": table["properties"] | own["properties"] | chosen,
                "required": sorted(needed),
                "additionalProperties": False,
            }
        )
    other = {
        "type": "object",
        "title": "of another package",
        "properties": own["properties"] | {key: {"type": "string", "not": {"enum": names}}},
        "required": sorted({*own["required"], key}),
    }
    return {"anyOf": [*choices, other]}


def _table(cls: type[BaseModel]) -> Schema:
    """A table of settings: its keys with types, limits, defaults and what the docstring says."""
    schema = cls.model_json_schema()
    schema["properties"] = _inlined(schema["properties"], schema.get("$defs", {}))
    notes = field_notes(cls)
    properties = {
        name: _without_null({word: value for word, value in schema["properties"][name].items() if word != "title"})
        for name in cls.model_fields
    }
    for name, note in notes.items():
        properties[name] = {"description": note, **properties[name]}
    return {
        "description": _first_line(cls),
        "type": "object",
        "properties": properties,
        "required": schema.get("required", []),
        "additionalProperties": False,
    }


def _inlined(value: Any, tables: Schema) -> Any:
    """The value with every reference to a table replaced by it; those of `softhand.scenario` with their notes."""
    if isinstance(value, list):
        return [_inlined(part, tables) for part in value]
    if not isinstance(value, dict):
        return value
    if "$ref" in value:
        name = value["$ref"].removeprefix("#/$defs/")
        section = getattr(scenario, name, None)
        return _table(section) if section else _inlined(tables[name], tables)
    return {word: _inlined(part, tables) for word, part in value.items()}


def _without_null(value: Schema) -> Schema:
    """Leave None out, which TOML does not have."""
    if value.get("default", 0) is None:
        del value["default"]
    options = [option for option in value.get("anyOf", []) if option != {"type": "null"}]
    if len(options) == 1:
        del value["anyOf"]
        return {**options[0], **value}
    return {**value, "anyOf": options} if options else value


def _first_line(cls: type[Any]) -> str:
    return (inspect.getdoc(cls) or "").partition("\n")[0]
