"""The scenario as a JSON schema, by which editors complete and check keys.

Plugins are chosen by name: a section is any one of the tables of its plugins, or, under a name that is not known here,
a table of its own keys and anything else.
"""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

from softhand.plugins import describe_plugin, find_plugin, plugin_names
from softhand.scenario.fingertip import DampingSection, FingertipSection, TipSection
from softhand.scenario.scenario import Scenario
from softhand.scenario.task import ControllerSection, ReferenceSection, StepperSection

Schema = dict[str, Any]


def scenario_schema() -> Schema:
    """JSON schema, draft 2020-12, of a scenario file with all plugins that are installed."""
    damping = _choice(DampingSection, "dampings", "name")
    tips = {
        "description": _table(FingertipSection)["properties"]["tips"].get("description", ""),
        "type": "object",
        "additionalProperties": _tip(damping),
    }
    sections: dict[str, Schema] = {
        "fingertip": _choice(FingertipSection, "laws", "law", {"damping": damping, "tips": tips}),
        "controller": _choice(ControllerSection, "controllers", "name"),
        "reference": _choice(ReferenceSection, "references", "kind"),
        "stepper": _choice(StepperSection, "steppers", "name"),
    }
    table = _table(Scenario)
    for name, section in sections.items():
        table["properties"][name] = {"description": table["properties"][name].get("description", ""), **section}
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
        table = _table(find_plugin(kind, name, key))
        chosen = {key: {"const": name, "description": describe_plugin(kind, name)}}
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
    """A table of settings: its keys with types, limits, defaults and descriptions."""
    schema = cls.model_json_schema()
    return {"properties": {}, "required": [], **_tidied(schema, schema.get("$defs", {}))}


def _tidied(value: Any, tables: Schema) -> Any:
    """The schema with tables in the place of references to them, without titles and None, which TOML does not have."""
    if isinstance(value, list):
        return [_tidied(part, tables) for part in value]
    if not isinstance(value, dict):
        return value
    if "$ref" in value:
        table = tables[value["$ref"].removeprefix("#/$defs/")]
        return _tidied({**table, **{word: part for word, part in value.items() if word != "$ref"}}, tables)
    tidy = {word: _tidied(part, tables) for word, part in value.items() if word not in ("title", "$defs", "properties")}
    if "properties" in value:
        tidy["properties"] = {name: _tidied(part, tables) for name, part in value["properties"].items()}
    if "description" in tidy:
        tidy["description"] = " ".join(tidy["description"].partition("\n\n")[0].split())
    return _without_null(tidy)


def _without_null(value: Schema) -> Schema:
    if value.get("default", 0) is None:
        del value["default"]
    options = [option for option in value.get("anyOf", []) if option != {"type": "null"}]
    if len(options) == 1:
        del value["anyOf"]
        return {**options[0], **value}
    return {**value, "anyOf": options} if options else value
