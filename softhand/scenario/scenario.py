"""Scenarios: everything that one run needs, read from a TOML file and checked."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from pydantic import field_validator, model_validator

from softhand.errors import ScenarioError
from softhand.numerics.table import folded, html_table
from softhand.scenario.agreement import check_counts, check_opening, check_times, check_tips
from softhand.scenario.bodies import CollisionSection, HandSection, ObjectSection, PalmSection, TableSection
from softhand.scenario.file import find_scenario, overridden, read_toml, with_absolute_paths
from softhand.scenario.fingertip import FingertipSection, TipSection
from softhand.scenario.instruments import ActuationSection, SensingSection, check_loop, check_variables
from softhand.scenario.keywords import all_keys, check_plugin_keys, full_keys
from softhand.scenario.obstacles import ObstacleSection
from softhand.scenario.tactile import TactileSection
from softhand.scenario.task import (
    ControllerSection,
    GraspSection,
    PushSection,
    RecordSection,
    ReferenceSection,
    StepperSection,
)
from softhand.settings.settings import Positive, Settings, Vector3, read_settings

_VALUES = "softhand.scenario.values"  # by name, since it knows scenarios


class Scenario(Settings):
    """All that one run needs, in SI units.

    Make one with `load_scenario`, change it with `replace`.
    """

    description: str = ""
    """One line, shown by `softhand list`."""
    duration: Positive = 2.0
    """Simulated time, a whole number of control periods [s]."""
    control_period: Positive = 0.001
    """Time for which a torque is held; one sample is recorded each [s]."""
    gravity: Vector3 = (0.0, 0.0, -9.81)
    """Gravity in the base frame [m/s^2]."""
    hand: HandSection
    """The hand and its fingertips."""
    object: ObjectSection
    """The object and its pose at the start."""
    fingertip: FingertipSection
    """Law, friction and damping of the tips."""
    grasp: GraspSection
    """Contacts and internal force at the start."""
    table: TableSection | None = None
    """What the object may stand on, if anything."""
    palm: tuple[PalmSection, ...] = ()
    """What else of the hand the object may lie on."""
    obstacle: tuple[ObstacleSection, ...] = ()
    """What stands in the way of the object."""
    collision: CollisionSection | None = None
    """What becomes of a run in which links collide; they are told after it if not given."""
    controller: ControllerSection
    """What sets the joint torques."""
    reference: ReferenceSection
    """What the controller is asked for."""
    tactile: TactileSection | None = None
    """Taxels on the tips; there are none if not given."""
    sensing: SensingSection | None = None
    """Instruments through which the controller sees the grasp; it sees the truth if not given."""
    actuation: ActuationSection | None = None
    """Drives between the commanded torque and the joints, which have it at once if not given."""
    push: tuple[PushSection, ...] = ()
    """What disturbs the object or the hand."""
    stepper: StepperSection = StepperSection()
    """The time integration."""
    record: RecordSection = RecordSection()
    """What is recorded."""

    @field_validator("obstacle", mode="before")
    @classmethod
    def _obstacles_one_by_one(cls, tables: Any) -> Any:
        """What is wrong with one is told by its number and its key."""
        for k, table in enumerate(tables if isinstance(tables, list | tuple) else (), 1):
            if isinstance(table, Mapping):
                read_settings(ObstacleSection, table, f"obstacle {k}")
        return tables

    @model_validator(mode="after")
    def _sections_agree(self) -> Scenario:
        self._agree()
        return self

    def _agree(self) -> None:
        check_counts(self.hand, self.grasp, self.reference)
        check_opening(self.grasp, self.fingertip)
        check_tips(self.hand, self.fingertip)
        check_times(self.duration, self.control_period, self.stepper.step, self.record.every)
        check_loop(self.sensing, self.actuation, self.tactile, self.control_period)
        check_variables(
            "record.variables",
            self.record.variables or (),
            self.sensing,
            self.actuation,
            self.tactile,
            self.fingertip.has_elements,
        )

    def replace(self, overrides: Mapping[str, Any] | None = None, **values: Any) -> Scenario:
        """Return a checked copy with some values changed.

            slippery = scenario.replace({"fingertip.friction": 0.3}, mass=0.25)

        Args:
            overrides: dotted keys and values, as after `--set`. A section's name as key replaces the whole section.
                None removes a key, so that its default holds. Paths are relative to the current folder.
            values: the same by the last part of the key, where there is only one such key: `mass=0.3` is `object.mass`.

        Raises:
            ScenarioError: a key or value is wrong, or the sections no longer agree.
        """
        return _changed(self.model_dump(exclude_none=True), overrides, values)

    def with_values(self, values: Mapping[str, Any]) -> Scenario:
        """`replace`, by dotted keys alone."""
        return self._with_sections(values) or self.replace(values)

    def _with_sections(self, values: Mapping[str, Any]) -> Scenario | None:
        """The same, reading no section but those that change; None for other keys, and where something is wrong."""
        before = {name: getattr(self, name) for name in {key.split(".")[0] for key in values} & _SECTIONS}
        try:
            tables = overridden({name: own.model_dump(exclude_none=True) for name, own in before.items()}, values)
            if tables.keys() != before.keys():
                return None
            check_plugin_keys(values, tables, Scenario)
            changed = self.model_copy(
                update={name: type(own).model_validate(tables[name]) for name, own in before.items()}
            )
            changed._agree()
            return changed
        except (ScenarioError, ValueError):  # told by whoever reads all
            return None

    def to_toml(self) -> str:
        """Return the scenario as the text of a TOML file; reading it gives an equal scenario."""
        try:
            return tomli_w.dumps(self.model_dump(exclude_none=True))
        except TypeError as error:
            raise ScenarioError(f"The scenario cannot be written as TOML: {error}.", key="", value=self) from error

    def __repr__(self) -> str:
        told = (self.description, *(f"{name} {value}" for name, value in self._chosen()))
        return f"<Scenario: {', '.join(filter(None, told))}>"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """What is chosen, and every value with its unit behind a line to be opened, for a notebook."""
        try:
            rows = import_module(_VALUES).list_values(self, np.array([False, True]))
        except ScenarioError as error:  # a plugin that nobody knows
            return html_table(f"Scenario: {self.description}", (), self._chosen(), [str(error)])
        above = html_table(f"Scenario: {self.description}", (), self._chosen())
        return above + folded(f"{len(rows)} values", html_table("", ("key", "value", "unit"), rows))

    def _chosen(self) -> list[tuple[str, str]]:
        return [
            ("tips", ", ".join(self.hand.names)),
            ("law", self.fingertip.law),
            ("controller", self.controller.name),
            ("reference", self.reference.kind),
            ("stepper", self.stepper.name),
            ("duration", f"{self.duration:g} s"),
        ]

    def _names(self) -> list[str]:
        return [*super()._names(), *all_keys(self.model_dump(exclude_none=True), Scenario)]


_SECTIONS = {"hand", "object", "fingertip", "grasp", "controller", "reference", "stepper", "record"}
"""Those that are always there."""


def load_scenario(source: str | Path, overrides: Mapping[str, Any] | None = None, **values: Any) -> Scenario:
    """Read and check a scenario.

    Args:
        source: name of a shipped scenario, or path of a TOML file. Paths in the file are relative to its folder.
        overrides: dotted keys and values put in before anything is checked, as in `Scenario.with_values`.
        values: the same by the last part of the key, where there is only one such key: `mass=0.3` is `object.mass`.

    Raises:
        ScenarioError: no such scenario or file, no readable TOML, or keys and values that are wrong.
    """
    file = find_scenario(source)
    table = with_absolute_paths(read_toml(file), file.parent)
    try:
        return _changed(table, overrides, values)
    except ScenarioError as error:
        gap = "\n" if "\n" in str(error) else " "
        raise ScenarioError(f"Scenario {source}:{gap}{error}", **error.__dict__) from error


def as_scenario(source: Scenario | str | Path, overrides: Mapping[str, Any] | None = None, **values: Any) -> Scenario:
    """A scenario as it is, or by its name or path, with some values changed as in `load_scenario`."""
    if not isinstance(source, Scenario):
        return load_scenario(source, overrides, **values)
    if not (overrides or values):
        return source
    return source.replace(overrides, **values)


def _changed(table: Mapping[str, Any], overrides: Mapping[str, Any] | None, values: Mapping[str, Any]) -> Scenario:
    changed = overridden(table, overrides or {})
    changed = overridden(changed, full_keys(values, changed, Scenario))
    scenario = read_settings(Scenario, changed, "")
    check_plugin_keys(overrides or {}, changed, Scenario)
    return scenario


def with_law(scenario: Scenario, name: str, parameters: Mapping[str, Any] | None = None) -> Scenario:
    """The scenario with another law at all fingertips; radius, friction and damping stay.

    Args:
        scenario: to be changed.
        name: of the law.
        parameters: of the law; the others have its defaults.
    """
    section = scenario.fingertip
    tips = {
        tip: {key: value for key, value in own.model_dump(exclude_none=True).items() if key in _STAYS}
        for tip, own in (section.tips or {}).items()
    }
    table = {**section.own(), "radius": section.parameters.get("radius"), **(parameters or {}), "law": name}
    table["tips"] = tips or None
    return scenario.with_values({"fingertip": {key: value for key, value in table.items() if value is not None}})


_STAYS = (set(TipSection.model_fields) - {"law"}) | {"radius"}
