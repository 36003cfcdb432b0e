"""Sections of a scenario: hand, object, table, palm."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, field_validator

from softhand.settings.settings import NonNegative, Positive, Settings, Vector3
from softhand.settings.wording import choices, show

FACES = ("+x", "-x", "+y", "-y", "+z", "-z")
"""Faces of a box by the outward normal, along the axes of the box."""


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
                raise ValueError(f"{show(name)} is no face. {choices(name, FACES)}")
            if isinstance(value, bool) or not isinstance(value, int | float) or not value > 0.0:
                raise ValueError(f"{show(name)} must be a number > 0.")
        return table


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
