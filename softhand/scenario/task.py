"""Sections of a scenario: grasp, controller, reference, stepper."""

from __future__ import annotations

from pydantic import model_validator

from softhand.errors import ScenarioError
from softhand.plugins import SHIPPED
from softhand.references.waypoint import Waypoint
from softhand.settings.problems import unknown_key
from softhand.settings.settings import NonNegative, OpenSettings, Positive, Settings, Vector, Vector3
from softhand.settings.wording import describe, nearest, show


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


class ReferenceSection(OpenSettings):
    """What the controller is asked for, by the name of the reference, and its own parameters.

    Attributes:
        kind: `step` asks for it at once, `minimum-jerk` goes there from the start, `waypoints` passes one by one.
        duration: time to the target, 1 s if not given; of `minimum-jerk` only [s].
        object_position: target position, in the base frame [m]; not with `waypoints`.
        object_rpy: target roll, pitch, yaw [rad]; not with `waypoints`.
        internal_force: target, in the order of grasp.internal_force [N]; not with `waypoints`.
        waypoints: one after the other.
    """

    kind: str
    duration: Positive | None = None
    object_position: Vector3 | None = None
    object_rpy: Vector3 | None = None
    internal_force: Vector | None = None
    waypoints: tuple[Waypoint, ...] = ()

    @model_validator(mode="after")
    def _has_what_its_kind_needs(self) -> ReferenceSection:
        if self.kind not in SHIPPED["references"]:
            return self
        for name, value in self.parameters.items():
            key, near = f"reference.{name}", nearest(name, type(self).model_fields)
            message = unknown_key(key, value, "reference", near and f"reference.{near}", type(self))
            raise ScenarioError(message, key=key, value=value)
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
