"""Every value of a scenario with its unit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from softhand.plugins import find_plugin
from softhand.scenario.fingertip import DampingSection, FingertipSection
from softhand.scenario.instruments import InstrumentSection, ServoSection
from softhand.scenario.joints import JointsSection
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import Settings
from softhand.settings.wording import show, unit_of


def list_values(scenario: Scenario, slides: NDArray[np.bool_]) -> list[tuple[str, str, str]]:
    """Key, value and unit of all settings of a resolved scenario.

    Args:
        scenario: with the defaults of all plugins written out.
        slides: which joints of its hand slide, shape (n,); where all do, or none, a unit of joints is that of them.
    """
    table = scenario.model_dump(exclude_none=True)
    rows = _flat(table, "", _units(Scenario), _section_units(table))
    return [(key, value, _unit_of_joints(unit, slides)) for key, value, unit in rows]


def unit_at(scenario: Scenario, key: str) -> str:
    """The unit of a dotted key, whether it has a value or not; "" where there is none."""
    section, _, name = key.rpartition(".")
    sections = _section_units(scenario.model_dump(exclude_none=True))
    return (sections.get(section, {}) if section else _units(Scenario)).get(name, "")


def _unit_of_joints(unit: str, slides: NDArray[np.bool_]) -> str:
    """Of "rad or m" and the like, for joints that turn or slide, the one that holds."""
    hinge, is_either, slide = unit.partition(" or ")
    if not is_either or (slides.any() and not slides.all()):
        return unit
    return slide if slides.all() else hinge


def _units(settings: type[Settings]) -> dict[str, str]:
    return {name: unit_of(field.description) for name, field in settings.model_fields.items()}


def _section_units(table: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """The units of the keys of each section, those of its plugin among them."""
    units = {
        name: _units(kind)
        for name, field in Scenario.model_fields.items()
        for kind in (field.annotation, *get_args(field.annotation))  # of a section that may be missing, too
        if isinstance(kind, type) and issubclass(kind, Settings)
    }
    for name, unit in units.get("sensing", {}).items():
        units[f"sensing.{name}"] = {
            **_units(InstrumentSection),
            **dict.fromkeys(("noise", "bias", "quantisation"), unit),
        }
    units["hand.joints"], units["actuation.servo"] = _units(JointsSection), _units(ServoSection)
    for name, value in table["hand"].get("joints", {}).items():
        if isinstance(value, Mapping):
            units[f"hand.joints.{name}"] = dict.fromkeys(value, units["hand.joints"][name])
    fingertip = table["fingertip"]
    chosen = [
        ("fingertip", "laws", fingertip["law"]),
        ("controller", "controllers", table["controller"]["name"]),
        ("reference", "references", table["reference"]["kind"]),
        ("stepper", "steppers", table["stepper"]["name"]),
    ]
    if "damping" in fingertip:
        units["fingertip.damping"] = _units(DampingSection)
        chosen.append(("fingertip.damping", "dampings", fingertip["damping"]["name"]))
    for tip, own in fingertip.get("tips", {}).items():
        path = f"fingertip.tips.{tip}"
        units[path] = _units(FingertipSection)
        chosen.append((path, "laws", own.get("law", fingertip["law"])))
        if "damping" in own:
            units[f"{path}.damping"] = _units(DampingSection)
            chosen.append((f"{path}.damping", "dampings", own["damping"]["name"]))
    for section, kind, name in chosen:
        units[section] |= _units(find_plugin(kind, name, section))
    return units


def _flat(
    table: Mapping[str, Any], path: str, units: Mapping[str, str], sections: Mapping[str, Mapping[str, str]]
) -> Iterator[tuple[str, str, str]]:
    for key, value in table.items():
        name = f"{path}.{key}".lstrip(".")
        if isinstance(value, Mapping):
            yield from _flat(value, name, sections.get(name, {}), sections)
        elif value != ():
            yield name, show(value), units.get(key, "")
