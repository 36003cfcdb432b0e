"""Sections of a scenario: grasp, controller, reference, stepper."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from softhand.errors import ScenarioError
from softhand.settings.settings import NonNegative, OpenSettings, Positive, Settings, Vector, Vector3
from softhand.settings.wording import describe, show


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
