"""Scenarios: everything that one run needs, read from a TOML file and checked."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import tomli_w
from pydantic import model_validator

from softhand.errors import ScenarioError
from softhand.scenario.bodies import HandSection, ObjectSection, PalmSection, TableSection
from softhand.scenario.file import find_scenario, overridden, read_toml, with_absolute_paths
from softhand.scenario.fingertip import FingertipSection, TipSection
from softhand.scenario.task import ControllerSection, GraspSection, ReferenceSection, StepperSection
from softhand.settings.settings import Positive, Settings, Vector3, read_settings
from softhand.settings.wording import choices, show

_MOST_STEPS = 1e9


class Scenario(Settings):
    """All that one run needs, in SI units.

    Make one with `load_scenario`, change it with `with_values`.

    Attributes:
        description: one line, shown by `softhand list`.
        duration: simulated time, a whole number of control periods [s].
        control_period: the torque is held for so long, and one sample is recorded [s].
        gravity: in the base frame [m/s^2].
        hand: the hand and its fingertips.
        object: the object and its pose at the start.
        fingertip: law, friction and damping of the tips.
        grasp: contacts and internal force at the start.
        table: what the object may stand on, if anything.
        palm: what else of the hand the object may lie on.
        controller: what sets the joint torques.
        reference: what the controller is asked for.
        stepper: the time integration.
    """

    description: str = ""
    duration: Positive = 2.0
    control_period: Positive = 0.001
    gravity: Vector3 = (0.0, 0.0, -9.81)
    hand: HandSection
    object: ObjectSection
    fingertip: FingertipSection
    grasp: GraspSection
    table: TableSection | None = None
    palm: tuple[PalmSection, ...] = ()
    controller: ControllerSection
    reference: ReferenceSection
    stepper: StepperSection = StepperSection()

    @model_validator(mode="after")
    def _sections_agree(self) -> Scenario:
        tips = len(self.hand.tips)
        _check_count("grasp.contact_points", self.grasp.contact_points, tips, f"{tips} fingertips")
        pairs = tips * (tips - 1) // 2
        why = f"{tips} fingertips with {pairs} pair{'s' if pairs > 1 else ''}"
        _check_count("grasp.internal_force", self.grasp.internal_force, pairs, why)
        for key, force in self._desired_forces():
            _check_count(key, force, pairs, why)
        self._check_opening()
        for tip in self.fingertip.tips or ():
            if tip not in self.hand.names:
                message = f"fingertip.tips: {show(tip)} is no fingertip. {choices(tip, self.hand.names)}"
                raise ScenarioError(message, key=f"fingertip.tips.{tip}", value=tip)
            self.fingertip.at(tip)
        period, step = self.control_period, self.stepper.step
        rule = f"go a whole number of times into the control period of {period:.12g} s"
        _check_whole("stepper.step", step, period / step, rule, lambda count: period / count)
        rule = f"be a whole number of control periods of {period:.12g} s"
        _check_whole("duration", self.duration, self.duration / period, rule, lambda count: period * count)
        return self

    def _desired_forces(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        asked = self.reference
        if asked.internal_force is not None:
            yield "reference.internal_force", asked.internal_force
        for k, waypoint in enumerate(asked.waypoints, start=1):
            if waypoint.internal_force is not None:
                yield f"reference.waypoints, internal_force of item {k}", waypoint.internal_force

    def _check_opening(self) -> None:
        """Open fingers do not squeeze, and a tip that comes and goes needs the solid box."""
        if not self.grasp.opening:
            return
        if any(self.grasp.internal_force):
            raise ScenarioError(
                f"grasp.internal_force: got {show(self.grasp.internal_force)}, but with grasp.opening the tips do not "
                "touch at the start and it must be 0; the squeeze to come belongs into [reference].",
                key="grasp.internal_force", value=self.grasp.internal_force,
            )  # fmt: skip
        if self.fingertip.contact != "coulomb":
            raise ScenarioError(
                'fingertip.contact: grasp.opening needs "coulomb"; a tip under "rolling" never leaves its face.',
                key="fingertip.contact", value=self.fingertip.contact,
            )  # fmt: skip

    def with_values(self, values: Mapping[str, Any]) -> Scenario:
        """Return a checked copy with some values changed.

        Args:
            values: dotted keys and values. A section's name as key replaces the whole section. None removes a key,
                so that its default holds. Paths are relative to the current folder.

        Raises:
            ScenarioError: a key or value is wrong, or the sections no longer agree.
        """
        return read_settings(Scenario, overridden(self.model_dump(exclude_none=True), values), "")

    def to_toml(self) -> str:
        """Return the scenario as the text of a TOML file; reading it gives an equal scenario."""
        try:
            return tomli_w.dumps(self.model_dump(exclude_none=True))
        except TypeError as error:
            raise ScenarioError(f"The scenario cannot be written as TOML: {error}.", key="", value=self) from error


def load_scenario(source: str | Path, overrides: Mapping[str, Any] | None = None) -> Scenario:
    """Read and check a scenario.

    Args:
        source: name of a shipped scenario, or path of a TOML file. Paths in the file are relative to its folder.
        overrides: dotted keys and values put in before anything is checked, as in `Scenario.with_values`.

    Raises:
        ScenarioError: no such scenario or file, no readable TOML, or keys and values that are wrong.
    """
    file = find_scenario(source)
    table = with_absolute_paths(read_toml(file), file.parent)
    try:
        return read_settings(Scenario, overridden(table, overrides or {}), "")
    except ScenarioError as error:
        gap = "\n" if "\n" in str(error) else " "
        raise ScenarioError(f"Scenario {source}:{gap}{error}", **error.__dict__) from error


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


def _check_count(key: str, values: tuple[Any, ...], count: int, why: str) -> None:
    if len(values) != count:
        message = f"{key}: got {show(values)} of length {len(values)}, but {why} need length {count}."
        raise ScenarioError(message, key=key, value=values)


def _check_whole(key: str, value: float, ratio: float, rule: str, good: Callable[[int], float]) -> None:
    """Refuse a ratio that is no whole number; `good` gives the value of the setting that has a given ratio."""
    if not ratio < _MOST_STEPS:
        message = f"{key}: got {value:.12g} s, but at most {_MOST_STEPS:.0e} steps are allowed; it must {rule}."
        raise ScenarioError(message, key=key, value=value)
    if not round(ratio) or abs(ratio - round(ratio)) > 1e-9 * ratio:
        near = min(
            good(max(1, math.floor(ratio))), good(max(1, math.ceil(ratio))), key=lambda other: abs(other - value)
        )
        message = f"{key}: got {value:.12g} s, but it must {rule}; the nearest good value is {near:.12g}."
        raise ScenarioError(message, key=key, value=value, nearest=near)
