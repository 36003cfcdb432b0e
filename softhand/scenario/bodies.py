"""Sections of a scenario: hand, object, table, palm."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field, field_validator, model_validator

from softhand.scenario.joints import JointsSection
from softhand.settings.settings import NonNegative, Positive, Settings, Vector3
from softhand.settings.wording import choices, show

FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Faces of a box by the outward normal, along the axes of the box."""


class PlacedTip(Settings):
    """A fingertip placed on a link of the hand."""

    frame: str
    """Link that carries it."""
    name: str | None = None
    """Name of the fingertip; FRAME_soft if not given."""
    position: Vector3 = (0.0, 0.0, 0.0)
    """Centre of the hemisphere's flat face in the frame of that link [m]."""
    rpy: Vector3 = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw there of the axes whose x points out of the tip [rad]."""

    @property
    def label(self) -> str:
        """Name of the fingertip."""
        return self.name or f"{self.frame}_soft"


class MotorSection(Settings):
    """Limits of one motor of coupled joints."""

    effort: Positive | None = None
    """Largest torque [N m or N]; hand.effort_limit if not given, or that of the joint of the same name."""
    lower: float | None = None
    """Lower limit of the motor, beside those that the limits of its joints leave it [rad or m]."""
    upper: float | None = None
    """Upper limit, likewise [rad or m]."""


class CouplingSection(Settings):
    """Joints that are moved by motors together: joint = sum of ratio x motor + offset.

    A joint that is neither named here nor follows another one by a `<mimic>` of the URDF is a motor itself.
    """

    joints: dict[str, dict[str, float]]
    """Of each coupled joint its motors by name, with the ratio of each [1, m/rad or rad/m]. A
    motor may be called after a joint that it moves, or by any other name."""
    offsets: dict[str, float] | None = None
    """Where these joints are with all motors at zero [rad or m]; 0 if not given."""
    motors: dict[str, MotorSection] | None = None
    """Limits of motors by name; needed for the effort of those that are not called after a joint."""

    @field_validator("joints")
    @classmethod
    def _are_some(cls, joints: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
        if not joints:
            raise ValueError("no joint is coupled; write { JOINT = { MOTOR = 1.0 } }, or take out hand.coupling.")
        return joints


class ArmSection(Settings):
    """The arm that carries the hand."""

    urdf: str
    """File of the arm, relative to the scenario, or package://NAME/PATH in a package of ROS or Python."""
    link: str = ""
    """Link of the arm that carries the hand; its end if not given."""
    position: Vector3 = (0.0, 0.0, 0.0)
    """Position of the hand's root link in the frame of that link [m]."""
    rpy: Vector3 = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw of the hand's root link there [rad]."""
    repair: Literal["balance"] | None = None
    """As `hand.repair`, of the arm."""
    density: Positive | None = None
    """As `hand.density`, of the arm [kg/m^3]."""


class HandSection(Settings):
    """The hand and its fingertips."""

    urdf: str
    """File of the hand, relative to the scenario, or package://NAME/PATH in a package of ROS or Python."""
    tips: Annotated[tuple[str | PlacedTip, ...], Field(min_length=2)]
    """Of each fingertip its link or frame at the centre of the hemisphere's flat face, x out of the tip; or a table."""
    position: Vector3 = (0.0, 0.0, 0.0)
    """Position of the root link in the base frame, on an arm that of the arm [m]."""
    rpy: Vector3 = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw of that link [rad]."""
    arm: ArmSection | None = None
    """The arm that carries it; a hand without one is fixed."""
    effort_limit: Positive | None = None
    """Largest torque of every joint of the hand [N m or N]; those of the URDF if not given."""
    coupling: CouplingSection | None = None
    """Motors of joints that move together, beside the `<mimic>` of the URDF."""
    joints: JointsSection | None = None
    """What the joints have of their own: rotors, damping, friction, stops; they run free if not given."""
    repair: Literal["balance"] | None = None
    """What is done to an inertia that no body has: the nearest possible one is taken; refused if not given."""
    density: Positive | None = None
    """Density by which links that move without a mass get one from their shapes; refused if not given [kg/m^3]."""
    mimic_signs: dict[str, Literal["limits", "multiplier"]] | None = None
    """Of joints that follow by `<mimic>` to where their limits do not let them, which of the two has the wrong sign."""

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
    """The object and its pose at the start."""

    urdf: str
    """File of the object, relative to the scenario, or package://NAME/PATH in a package of ROS or Python."""
    mass: Positive | None = None
    """Mass in place of that of the URDF, whose inertia is scaled alike [kg]."""
    inertia: tuple[Positive, Positive, Positive] | None = None
    """Moments of inertia about the axes of the object frame through the centre of mass, then its principal ones, in
    place of those of the URDF [kg m^2]."""
    ellipsoid: tuple[Positive, Positive, Positive] | None = None
    """Semi-axes of an ellipsoid in the place of the URDF's collision shape [m]."""
    hull: bool = False
    """Whether the convex hull of a collision mesh is taken that is not convex."""
    decompose: bool = False
    """Whether a collision mesh that is not convex is cut into convex parts by coacd, an extra."""
    decompose_threshold: Annotated[float, Field(ge=0.01, le=1.0)] = 0.05
    """Concavity at which it stops to cut, 0.01 to 1: less gives more parts, that fit better [1]."""
    repair: Literal["balance"] | None = None
    """What is done to an inertia that no body has: the nearest possible one is taken; refused if not given."""
    density: Positive | None = None
    """Density by which an object without a mass gets one from its shapes; refused if not given [kg/m^3]."""
    position: Vector3
    """Origin of the object frame at the start, in the base frame [m]."""
    rpy: Vector3
    """Roll, pitch, yaw at the start [rad], R = R_z(yaw) R_y(pitch) R_x(roll)."""
    face_friction: dict[str, Positive] | None = None
    """Coefficient mu on faces of a box, "+x" to "-z" along its axes, in place of that of the tip [1]."""

    @model_validator(mode="after")
    def _one_way_with_a_hollow(self) -> ObjectSection:
        if self.decompose and self.hull:
            raise ValueError("decompose and hull are both true; choose whether a hollow is kept or filled.")
        if self.decompose and self.ellipsoid is not None:
            raise ValueError("decompose is true, but the ellipsoid is in the place of the mesh; remove one of them.")
        return self

    @property
    def cut(self) -> float | None:
        """The threshold by which meshes are cut; None if they are not."""
        return self.decompose_threshold if self.decompose else None

    @field_validator("inertia")
    @classmethod
    def _has_a_body(cls, inertia: tuple[float, float, float] | None) -> tuple[float, float, float] | None:
        if inertia is not None and 2.0 * max(inertia) > sum(inertia) * (1.0 + 1e-9):
            raise ValueError(
                f"no body has the moments {show(inertia)}: none of them is larger than the sum of the two others."
            )
        return inertia

    @field_validator("face_friction", mode="before")
    @classmethod
    def _faces_are_known(cls, table: Any) -> Any:
        for name, value in table.items() if isinstance(table, Mapping) else ():
            if name not in FACES:
                raise ValueError(f"{show(name)} is no face. {choices(name, FACES)}")
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0.0:
                raise ValueError(f"{show(name)} must be a number > 0.")
        return table


class TableSection(Settings):
    """An endless plane that the object and the fingertips may meet; it bears on one side."""

    height: float
    """Height of the plane along its normal, from the origin of the base frame [m]."""
    friction: Positive
    """Coefficient mu, of the object and of the tips [1]."""
    normal: Vector3 = (0.0, 0.0, 1.0)
    """Normal out of the table, of any length, in the base frame [1]."""
    stiffness: Positive = 2e4
    """Stiffness of each corner of the object, or place that it rolls on, normal and tangential [N/m]."""
    damping: NonNegative = 10.0
    """Damping there, likewise [N s/m]."""

    @field_validator("normal")
    @classmethod
    def _normal_has_a_direction(cls, normal: Vector3) -> Vector3:
        if not math.hypot(*normal) > 1e-100:
            raise ValueError("a normal needs a direction, such as [0, 0, 1].")
        return normal


class PalmSection(Settings):
    """A compliant ball on a link of the hand that the object may meet."""

    frame: str
    """Link or frame of the hand that carries the ball; its base too."""
    position: Vector3
    """Centre of the ball in that frame [m]."""
    radius: Positive
    """Radius of the ball [m]."""
    friction: Positive
    """Coefficient mu [1]."""
    stiffness: Positive = 1e4
    """Stiffness, normal and tangential [N/m]."""
    damping: NonNegative = 5.0
    """Damping, likewise [N s/m]."""


class CollisionSection(Settings):
    """What becomes of a run in which links collide; see `softhand check` for which pairs count."""

    ends_run: bool = True
    """Whether the first collision ends the run; if not, all are told after it."""
    depth: NonNegative = 1e-5
    """Depth up to which two shapes may be in each other, at least 0.01 mm [m]."""
    every: Positive = 0.01
    """Time between two looks, in whole control periods and at least one [s]."""
    shapes: Literal["collision", "visual"] = "collision"
    """Shapes of the hand's URDF that count."""
