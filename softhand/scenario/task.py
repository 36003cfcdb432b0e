"""Sections of a scenario: grasp, controller, reference, stepper."""

from __future__ import annotations

from typing import Literal

from pydantic import field_validator, model_validator

from softhand.errors import ScenarioError
from softhand.recording.variables import VARIABLES
from softhand.references.legs import OrientationPath
from softhand.references.waypoint import Waypoint
from softhand.settings.problems import unknown_key
from softhand.settings.settings import NonNegative, OpenSettings, Positive, Settings, Vector, Vector3
from softhand.settings.wording import choices, describe, nearest, show


class GraspSection(Settings):
    """The grasp at the start."""

    contact_points: tuple[Vector3, ...]
    """Contact of each tip at the start, on the surface within 1 um, in the object frame [m]."""
    internal_force: Vector
    """Internal force at the start [N], one number a pair of fingertips; positive squeezes; 0 with open fingers."""
    opening: NonNegative = 0.0
    """How far off its contact point each tip starts, along the outward normal [m]; 0 is in the grasp."""
    standoff: Vector3 = (0.0, 0.0, 0.0)
    """Where the open hand starts, from its place at the object, in the base frame [m]; of a hand on an arm."""
    joint_guess: Vector | None = None
    """Where the inverse kinematics starts [rad or m], one number a joint; amid the limits if not given."""
    reach: Literal["fingers", "all"] = "fingers"
    """`fingers`: joints that move several tips, of a wrist or an arm, stay at `joint_guess`; `all`: they bring the palm
    to where the fingers are as near to it as they can."""


class ControllerSection(OpenSettings):
    """The controller by name, and its own parameters."""

    name: str
    """Name of the controller."""


class ReferenceSection(OpenSettings):
    """What the controller is asked for, by the name of the reference, and its own parameters."""

    kind: str
    """`hold` stays, `step` asks for it at once, `minimum-jerk` goes there, `waypoints` passes one by one."""
    duration: Positive | None = None
    """Time to the target, 1 s if not given; of `minimum-jerk` only [s]."""
    object_position: Vector3 | None = None
    """Target position, in the base frame [m]; not with `waypoints` and `hold`."""
    object_rpy: Vector3 | None = None
    """Target roll, pitch, yaw [rad]; not with `waypoints` and `hold`."""
    internal_force: Vector | None = None
    """Target of the internal force, in the order of grasp.internal_force [N]; not with `waypoints` and `hold`."""
    waypoints: tuple[Waypoint, ...] = ()
    """Waypoints, one after the other."""
    orientation_path: OrientationPath | None = None
    """Way of the orientation: `geodesic`, about one axis, if not given; `euler`, roll, pitch and yaw one by one."""

    @model_validator(mode="after")
    def _has_what_its_kind_needs(self) -> ReferenceSection:
        if self.kind not in _WITH_THESE_KEYS:  # checks its keys itself
            return self
        for name, value in self.parameters.items():
            key, near = f"reference.{name}", nearest(name, type(self).model_fields)
            message = unknown_key(key, value, "reference", near and f"reference.{near}", type(self))
            raise ScenarioError(message, key=key, value=value)
        if self.kind == "hold":
            self._has_nothing_else()
            return self
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

    def _has_nothing_else(self) -> None:
        """A start that is kept is described by [object] and [grasp]."""
        for key, value in self.model_dump(exclude={"kind"}).items():
            if value:
                raise ScenarioError(
                    f'reference.{key}: "hold" keeps the start and has no {key}; remove it. From the command line: '
                    "--set 'reference={kind=\"hold\"}'.",
                    key=f"reference.{key}", value=value,
                )  # fmt: skip


_WITH_THESE_KEYS = ("hold", "step", "minimum-jerk", "waypoints")


class PushSection(Settings):
    """A push from outside: a force and a moment on one body while a time lasts, world axes."""

    on: str = "object"
    """What is pushed: "object", or a link or frame of the hand."""
    force: Vector3 = (0.0, 0.0, 0.0)
    """Force in the base frame [N]."""
    moment: Vector3 = (0.0, 0.0, 0.0)
    """Moment in the base frame [N m]."""
    point: Vector3 = (0.0, 0.0, 0.0)
    """Where the force acts, in the frame of the body [m]."""
    start: NonNegative = 0.0
    """When it begins [s]."""
    duration: Positive
    """How long it lasts [s]."""


class RecordSection(Settings):
    """What is recorded of a run."""

    every: Positive | None = None
    """Time between two samples, a whole number of control periods [s]; each control period if not given. The last
    sample of a run is always recorded."""
    variables: tuple[str, ...] | None = None
    """Names of the variables; all if not given."""

    @field_validator("variables")
    @classmethod
    def _are_variables(cls, names: tuple[str, ...] | None) -> tuple[str, ...] | None:
        for name in names or ():
            if name not in VARIABLES:
                raise ValueError(f"{show(name)} is no variable of a recording. {choices(name, list(VARIABLES))}")
        return names


class StepperSection(OpenSettings):
    """The stepper by name, and its own parameters."""

    name: str = "midpoint"
    """Name of the stepper."""
    step: Positive = 0.001
    """Time step, a whole number of which makes a control period [s]."""
    terms: Literal["pinocchio", "compiled"] = "pinocchio"
    """What gives mass matrix, velocity terms and poses: Pinocchio, or a kernel of softhand, which is faster."""
