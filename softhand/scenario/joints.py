"""Section of a scenario: what the joints of the hand have of their own."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

from pydantic import model_validator

from softhand.settings.settings import NonNegative, Positive, Settings

Each: TypeAlias = NonNegative | dict[str, NonNegative]
Given: TypeAlias = NonNegative | Literal["urdf"] | dict[str, NonNegative]
Speed: TypeAlias = Positive | Literal["urdf"] | dict[str, Positive]


class JointsSection(Settings):
    """What the joints of the hand have of their own; of coupled joints, what their motors have.

    Each is one number for all joints, or a table by their names, where those that are not named have none.
    """

    armature: Each = 0.0
    """Inertia of the rotor as the joint feels it: gear ratio squared times its own [kg m^2 or kg]."""
    damping: Given = 0.0
    """Viscous damping, or "urdf" for that of `<dynamics>` [N m s/rad or N s/m]."""
    friction: Given = 0.0
    """Dry friction: the torque that a joint holds, and that brakes it while it moves; or "urdf" [N m or N]."""
    stop_stiffness: Each = 0.0
    """Stiffness of the stops at the limits of the joints; 0 for none [N m/rad or N/m]."""
    stop_damping: Each = 0.0
    """Damping of the stops, chi of their torque k d (1 + chi d') at a depth d [s/rad or s/m]."""
    velocity_limit: Speed | None = None
    """Speed at which a motor has no torque left, or "urdf" for that of `<limit>`; none if not given [rad/s or m/s]."""

    @model_validator(mode="after")
    def _stops_are_stiff(self) -> JointsSection:
        for joint, damping in _by_joint(self.stop_damping):
            stiffness: Any = self.stop_stiffness
            if damping and not (stiffness.get(joint) if isinstance(stiffness, dict) else stiffness):
                raise ValueError(
                    "stop_damping is that of stops, and there are none without a stiffness; give stop_stiffness, such "
                    "as 10.0."
                )
        return self


def _by_joint(value: Any) -> list[tuple[str, float]]:
    return list(value.items()) if isinstance(value, dict) else [("", value)]
