"""Sections of a scenario: grasp, controller, reference, stepper."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from softhand.errors import ScenarioError
from softhand.settings.settings import NonNegative, OpenSettings, Positive, Settings, Vector, Vector3
from softhand.settings.wording import describe, show


class GraspSection(Settings):
    """The grasp at the start."""

    contact_points: tuple[Vector3, ...]
    """Contact of each tip at the start, on the surface within 1 um, in the object frame [m]."""
    internal_force: Vector
    """Internal force at the start [N], one number a pair of fingertips; positive squeezes; 0 with open fingers."""
    opening: NonNegative = 0.0
    """How far off its contact point each tip starts, along the outward normal [m]; 0 is in the grasp."""
    joint_guess: Vector | None = None
    """Where the inverse kinematics starts [rad], one number a joint; amid the limits if not given."""


class ControllerSection(OpenSettings):
    """The controller by name, and its own parameters."""

    name: str
    """Name of the controller."""


class WaypointSection(Settings):
    """One waypoint. What is not given stays as it was at the waypoint before, or at the start."""

    phase: str = ""
    """Name of the way there, for figures and events."""
    duration: Positive
    """Duration of the way there [s]."""
    object_position: Vector3 | None = None
    """Position of the object in the base frame [m]."""
    object_rpy: Vector3 | None = None
    """Roll, pitch, yaw of the object [rad]."""
    internal_force: Vector | None = None
    """Internal force, in the order of grasp.internal_force [N]."""
    opening: float | None = None
    """How far the tips stand off their contact points [m]; below 0 they press."""
    carried: Annotated[float, Field(ge=0, le=1)] | None = None
    """Share of the object's weight that the fingers carry [1]; the table has the rest."""


class ReferenceSection(Settings):
    """What the controller is asked for."""

    kind: Literal["step", "minimum-jerk", "waypoints"]
    """`step` asks for it at once, `minimum-jerk` goes there from the start, `waypoints` passes one by one."""
    duration: Positive = 1.0
    """Time to the target [s]; of `minimum-jerk` only."""
    object_position: Vector3 | None = None
    """Target position, in the base frame [m]; not with `waypoints`."""
    object_rpy: Vector3 | None = None
    """Target roll, pitch, yaw [rad]; not with `waypoints`."""
    internal_force: Vector | None = None
    """Target of the internal force, in the order of grasp.internal_force [N]; not with `waypoints`."""
    waypoints: tuple[WaypointSection, ...] = ()
    """Waypoints, one after the other."""

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


class StepperSection(OpenSettings):
    """The stepper by name, and its own parameters."""

    name: str = "midpoint"
    """Name of the stepper."""
    step: Positive = 0.001
    """Time step, a whole number of which makes a control period [s]."""
