"""Sections of a scenario: bodies that stand still."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from softhand.errors import ScenarioError
from softhand.settings.settings import NonNegative, Positive, Settings, Vector3
from softhand.settings.wording import show

SIZES = {"box": ("x", "y", "z"), "cylinder": ("radius", "length"), "sphere": ("radius",)}
"""What the size of each shape is."""


class ObstacleSection(Settings):
    """A convex body that stands still, and that the object may meet."""

    name: str | None = None
    """Label in recordings; "obstacle 1" and so on if not given."""
    shape: Literal["box", "cylinder", "sphere", "polyhedron"]
    """What it is; a cylinder stands along its z axis, a polyhedron is the convex hull of its vertices."""
    size: Annotated[tuple[Positive, ...], Field(min_length=1, max_length=3)] | None = None
    """Edges x, y, z of a box; radius and length of a cylinder; radius of a sphere [m]."""
    vertices: Annotated[tuple[Vector3, ...], Field(min_length=4)] | None = None
    """Of a polyhedron, in its own axes [m]."""
    position: Vector3
    """Its middle, or the origin of its vertices, in the base frame [m]."""
    rpy: Vector3 = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw [rad]."""
    friction: Positive
    """Coefficient mu [1]."""
    stiffness: Positive = 2e4
    """Stiffness of each corner or other place that touches, normal and tangential [N/m]."""
    damping: NonNegative = 10.0
    """Damping there, likewise [N s/m]."""

    @model_validator(mode="after")
    def _size_fits(self) -> ObstacleSection:
        needed, other = ("vertices", "size") if self.shape == "polyhedron" else ("size", "vertices")
        if getattr(self, needed) is None or getattr(self, other) is not None:
            wrong = needed if getattr(self, needed) is None else other
            what = "missing" if wrong == needed else "remove it"
            message = f"obstacle.{wrong}: {what}; {show(self.shape)} has {needed}."
            raise ScenarioError(message, key=f"obstacle.{wrong}", value=getattr(self, wrong))
        numbers = SIZES.get(self.shape, ())
        if self.size is not None and len(self.size) != len(numbers):
            message = (
                f"obstacle.size: got {show(self.size)} of length {len(self.size)}; the size of {show(self.shape)} is "
                f"[{', '.join(numbers)}]."
            )
            raise ScenarioError(message, key="obstacle.size", value=self.size)
        return self


def names_of(obstacles: tuple[ObstacleSection, ...]) -> list[str]:
    """The labels of all."""
    return [obstacle.name or f"obstacle {k}" for k, obstacle in enumerate(obstacles, 1)]
