"""Scenarios: everything that one run needs, read from a TOML file and checked."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import tomli_w
from pydantic import ConfigDict, Field, field_validator, model_validator

from softhand.errors import ScenarioError
from softhand.scenario_file import find_scenario, overridden, read_toml, with_absolute_paths
from softhand.settings import (
    NonNegative,
    Positive,
    Settings,
    Vector,
    Vector3,
    describe,
    frozen,
    nearest,
    read_settings,
    show,
)

_MOST_STEPS = 1e9

FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Faces of a box by the outward normal, along the axes of the box."""


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


class PlacedTip(Settings):
    """A fingertip placed on a link of the hand.

    Attributes:
        frame: link that carries it.
        name: of the fingertip; FRAME_soft if not given.
        position: centre of the hemisphere's flat face in the frame of that link [m].
        rpy: roll, pitch, yaw there of the axes whose x points out of the tip [rad].
    """

    frame: str
    name: str | None = None
    position: Vector3 = (0.0, 0.0, 0.0)
    rpy: Vector3 = (0.0, 0.0, 0.0)

    @property
    def label(self) -> str:
        """Name of the fingertip."""
        return self.name or f"{self.frame}_soft"


class HandSection(Settings):
    """The hand and its fingertips.

    Attributes:
        urdf: file of the hand, relative to the scenario, or package://NAME/PATH in an installed package.
        tips: of each fingertip its link or frame: centre of the hemisphere's flat face, x out of the tip; or a table
            that places it on a link.
        position: of the root link in the base frame [m].
        rpy: roll, pitch, yaw of the root link [rad].
        effort_limit: largest torque of every joint, in place of those of the URDF [N m or N].
    """

    urdf: str
    tips: Annotated[tuple[str | PlacedTip, ...], Field(min_length=2)]
    position: Vector3 = (0.0, 0.0, 0.0)
    rpy: Vector3 = (0.0, 0.0, 0.0)
    effort_limit: Positive | None = None

    @property
    def names(self) -> tuple[str, ...]:
        """Of the fingertips."""
        return _names(self.tips)

    @field_validator("tips")
    @classmethod
    def _tips_are_unique(cls, tips: tuple[str | PlacedTip, ...]) -> tuple[str | PlacedTip, ...]:
        name, count = Counter(_names(tips)).most_common(1)[0]
        if count > 1:
            raise ValueError(f"{show(name)} is there {count} times, but each fingertip must have a frame of its own.")
        return tips


def _names(tips: tuple[str | PlacedTip, ...]) -> tuple[str, ...]:
    return tuple(tip if isinstance(tip, str) else tip.label for tip in tips)


class ObjectSection(Settings):
    """The object and its pose at the start.

    Attributes:
        urdf: file of the object, relative to the scenario, or package://NAME/PATH in an installed package.
        mass: replaces the mass of the URDF and scales its inertia alike [kg].
        position: origin of the object frame at the start, in the base frame [m].
        rpy: roll, pitch, yaw at the start [rad].
        ellipsoid: semi-axes of an ellipsoid that takes the place of the URDF's collision shape [m].
        hull: take the convex hull of a collision mesh that is not convex.
        face_friction: coefficient on faces of the box, by name in `FACES`, in place of that of the tip [1].
    """

    urdf: str
    mass: Positive | None = None
    ellipsoid: tuple[Positive, Positive, Positive] | None = None
    hull: bool = False
    position: Vector3
    rpy: Vector3
    face_friction: dict[str, Positive] | None = None

    @field_validator("face_friction", mode="before")
    @classmethod
    def _faces_are_known(cls, table: Any) -> Any:
        for name, value in table.items() if isinstance(table, Mapping) else ():
            if name not in FACES:
                raise ValueError(f"{show(name)} is no face. {_choices(name, FACES)}")
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0.0:
                raise ValueError(f"{show(name)} must be a number > 0.")
        return table


class DampingSection(OpenSettings):
    """The damping of the tips by name, and its own parameters.

    Attributes:
        name: of the damping.
    """

    name: str


class TipSection(OpenSettings):
    """What is different at one fingertip, and parameters of its law.

    Attributes:
        law: name of the law; another one than that of all tips begins from its own defaults.
        friction: as in `fingertip` [1].
        static_friction: as in `fingertip` [1].
        torsion_length: as in `fingertip` [m].
        damping: as in `fingertip`; the whole table.
    """

    law: str | None = None
    friction: Positive | None = None
    static_friction: Positive | None = None
    torsion_length: Positive | None = None
    damping: DampingSection | None = None


class FingertipSection(OpenSettings):
    """The fingertip law by name, and its own parameters.

    Attributes:
        law: name of the law.
        friction: coefficient mu [1]; with `coulomb` that of a tip which slips.
        contact: `rolling`, the paper's, where a tip never slips, or `coulomb`.
        static_friction: coefficient at which slip begins [1]; that of `friction` if not given.
        torsion_length: largest torsion over friction times normal force [m]; from the pressure of the law if not given.
        tips_touch: whether tips meet each other; otherwise they pass through each other.
        damping: of the tips, if any.
        tips: tables by the name of a fingertip, whose keys hold there in place of these.
    """

    law: str
    friction: Positive
    contact: Literal["rolling", "coulomb"] = "rolling"
    static_friction: Positive | None = None
    torsion_length: Positive | None = None
    tips_touch: bool = False
    damping: DampingSection | None = None
    tips: dict[str, TipSection] | None = None

    @field_validator("tips", mode="before")
    @classmethod
    def _each_tip_is_a_table(cls, tips: Any) -> Any:
        if not isinstance(tips, Mapping):
            return tips
        return {name: read_settings(TipSection, table, f"fingertip.tips.{name}") for name, table in tips.items()}

    def own(self) -> dict[str, Any]:
        """All keys but those of the law."""
        return self.model_dump(include=set(type(self).model_fields), exclude_none=True)

    def at(self, tip: str) -> FingertipSection:
        """What holds at one fingertip, without `tips`.

        Raises:
            ScenarioError: the keys of the tip and those of all tips do not agree.
        """
        table = self.model_dump(exclude={"tips"}, exclude_none=True)
        own = self.tips[tip].model_dump(exclude_none=True) if self.tips and tip in self.tips else {}
        if own.get("law", self.law) != self.law:
            table = {key: value for key, value in table.items() if key in type(self).model_fields or key == "radius"}
        return read_settings(FingertipSection, {**table, **own}, f"fingertip.tips.{tip}" if own else "fingertip")

    @model_validator(mode="after")
    def _friction_falls_with_slip(self) -> FingertipSection:
        if self.static_friction is not None and self.static_friction < self.friction:
            raise ValueError(
                f"static_friction {self.static_friction:g} is below friction {self.friction:g}, that of a tip which "
                "slips; raise it or leave it out."
            )
        return self


class TableSection(Settings):
    """An endless plane that the corners of the object and the fingertips may meet; it bears on one side.

    Attributes:
        height: of the plane along its normal, from the origin of the base frame [m].
        friction: coefficient mu, of the object and of the tips [1].
        normal: out of the table, of any length, in the base frame.
        stiffness: of each corner of the object, normal and tangential [N/m].
        damping: of each corner, likewise [N s/m].
    """

    height: float
    friction: Positive
    normal: Vector3 = (0.0, 0.0, 1.0)
    stiffness: Positive = 2e4
    damping: NonNegative = 10.0

    @field_validator("normal")
    @classmethod
    def _normal_has_a_direction(cls, normal: Vector3) -> Vector3:
        if not math.hypot(*normal) > 1e-100:
            raise ValueError("a normal needs a direction, such as [0, 0, 1].")
        return normal


class PalmSection(Settings):
    """A compliant ball on a link of the hand that the object may meet.

    Attributes:
        frame: link or frame of the hand that carries it; its base too.
        position: of its centre in that frame [m].
        radius: of the ball [m].
        friction: coefficient mu [1].
        stiffness: normal and tangential [N/m].
        damping: likewise [N s/m].
    """

    frame: str
    position: Vector3
    radius: Positive
    friction: Positive
    stiffness: Positive = 1e4
    damping: NonNegative = 5.0


class GraspSection(Settings):
    """The grasp at the start.

    Attributes:
        contact_points: one a fingertip, on the surface, in the object frame [m].
        internal_force: at the start, one number a pair of fingertips; positive squeezes [N]. 0 with open fingers.
        opening: how far off its contact point each tip starts, along the outward normal [m]; 0: in the grasp.
        joint_guess: where the inverse kinematics starts, one number a joint [rad].
    """

    contact_points: tuple[Vector3, ...]
    internal_force: Vector
    opening: NonNegative = 0.0
    joint_guess: Vector | None = None


class ControllerSection(OpenSettings):
    """The controller by name, and its own parameters.

    Attributes:
        name: of the controller.
    """

    name: str


class WaypointSection(Settings):
    """One waypoint. What is not given stays as it was at the waypoint before, or at the start.

    Attributes:
        phase: name of the way there, for figures and events.
        duration: of the way there [s].
        object_position: in the base frame [m].
        object_rpy: roll, pitch, yaw [rad].
        internal_force: in the order of grasp.internal_force [N].
        opening: how far the tips stand off their contact points [m]; below 0 they press.
        carried: share of the object's weight that the fingers carry; the table has the rest.
    """

    phase: str = ""
    duration: Positive
    object_position: Vector3 | None = None
    object_rpy: Vector3 | None = None
    internal_force: Vector | None = None
    opening: float | None = None
    carried: Annotated[float, Field(ge=0, le=1)] | None = None


class ReferenceSection(Settings):
    """What the controller is asked for.

    Attributes:
        kind: `step` asks for it at once, `minimum-jerk` goes there from the start, `waypoints` passes one by one.
        duration: time to the target; of `minimum-jerk` only [s].
        object_position: target position, in the base frame [m]; not with `waypoints`.
        object_rpy: target roll, pitch, yaw [rad]; not with `waypoints`.
        internal_force: target, in the order of grasp.internal_force [N]; not with `waypoints`.
        waypoints: one after the other.
    """

    kind: Literal["step", "minimum-jerk", "waypoints"]
    duration: Positive = 1.0
    object_position: Vector3 | None = None
    object_rpy: Vector3 | None = None
    internal_force: Vector | None = None
    waypoints: tuple[WaypointSection, ...] = ()

    @model_validator(mode="after")
    def _has_what_its_kind_needs(self) -> ReferenceSection:
        target = ("object_position", "object_rpy", "internal_force")
        needed, other = (("waypoints",), target) if self.kind == "waypoints" else (target, ("waypoints",))
        for key in needed:
            if not getattr(self, key):
                allowed = describe(type(self).model_fields[key].annotation)
                raise ScenarioError(
                    f"reference.{key}: missing; {show(self.kind)} needs it, {allowed}.",
                    key=f"reference.{key}",
                    value=None,
                )
        for key in other:
            if getattr(self, key):
                value = getattr(self, key)
                raise ScenarioError(
                    f"reference.{key}: {show(self.kind)} has no {key}; remove it"
                    + (", and put it into a waypoint." if other is target else '. It belongs to "waypoints".'),
                    key=f"reference.{key}", value=value,
                )  # fmt: skip
        return self


class StepperSection(OpenSettings):
    """The stepper by name, and its own parameters.

    Attributes:
        name: of the stepper.
        step: time step, a whole number of which makes a control period [s].
    """

    name: str = "midpoint"
    step: Positive = 0.001


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
                message = f"fingertip.tips: {show(tip)} is no fingertip. {_choices(tip, self.hand.names)}"
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


def _choices(word: str, words: Iterable[str]) -> str:
    near = nearest(word, words)
    return f"{f'Did you mean {show(near)}? ' if near else ''}There are: {', '.join(words)}."


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
