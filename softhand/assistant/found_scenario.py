"""A scenario that was found for a hand: how it was found, and its rows as a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from softhand.grasping.quality import GraspQuality
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario


@dataclass(frozen=True)
class Tip(Record):
    """A fingertip of the scenario.

    Attributes:
        name: of the tip.
        link: that carries it.
        position: of the centre of its ball in the frame of the link [m].
        rpy: roll, pitch, yaw of its axes there, x out of the tip [rad].
        radius: of the ball [m].
        why: how it was found.
    """

    units: ClassVar = {"position": "m", "rpy": "rad", "radius": "m"}

    name: str
    link: str
    position: tuple[float, ...]
    rpy: tuple[float, ...]
    radius: float
    why: str


@dataclass(frozen=True, eq=False)
class NewScenario(Record):
    """A scenario for a hand, and how it was found.

    Attributes:
        scenario: ready to be run.
        text: of its file, with the reason of each line.
        object_text: URDF of its object.
        files: of the scenario and of the object, if they were written.
        remedies: lines that the URDF of the hand needs.
        tips: that touch.
        unused: why other fingers do not, by the name of their tips.
        object_size: of the box [m].
        object_mass: [kg].
        object_position: [m].
        object_rpy: [rad].
        internal_force: at the start [N].
        margin: of force closure.
        friction_use: the largest share at the start.
        torque_use: the largest share of an effort limit at the start.
        period: control period [s].
        gains: of the controller by name.
        growth: of the fastest growing small motion [1/s].
        collisions: links that are in the object or in each other at the start, in words.
        position_error: of the object after 2 s, in which it was pushed by a fifth of its weight [mm].
        orientation_error: likewise [deg].
        tried: oppositions of fingertips that were tried, and grasps.
        quality: of its grasp.
    """

    units: ClassVar = {
        "object_size": "m", "object_mass": "kg", "object_position": "m", "object_rpy": "rad", "internal_force": "N",
        "margin": "N/N", "friction_use": "1", "torque_use": "1", "period": "s", "growth": "1/s",
        "position_error": "mm", "orientation_error": "deg",
        "gains": "as of the controller", "tried": "1",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"scenario", "text", "object_text", "quality"})

    scenario: Scenario
    text: str
    object_text: str
    files: tuple[str, ...]
    remedies: tuple[str, ...]
    tips: tuple[Tip, ...]
    unused: dict[str, str]
    object_size: tuple[float, ...]
    object_mass: float
    object_position: tuple[float, ...]
    object_rpy: tuple[float, ...]
    internal_force: tuple[float, ...]
    margin: float
    friction_use: float
    torque_use: float
    period: float
    gains: dict[str, Any]
    growth: float
    collisions: tuple[str, ...]
    position_error: float
    orientation_error: float
    tried: tuple[int, int]
    quality: GraspQuality

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        size = " x ".join(f"{1e3 * value:.3g}" for value in self.object_size)
        place = ", ".join(f"{1e3 * value:.4g}" for value in self.object_position)
        rows = [(f"tip {tip.name}", f"on {tip.link}, r {1e3 * tip.radius:.3g} mm: {tip.why}") for tip in self.tips]
        rows += [(f"left out {name}", why) for name, why in self.unused.items()]
        rows += [
            ("object", f"a box of {size} mm, {1e3 * self.object_mass:.3g} g, at ({place}) mm"),
            ("searched", f"{self.tried[0]} ways to oppose the tips, {self.tried[1]} of them as grasps"),
            ("grasp", f"margin {self.margin:.3f} N per newton, friction use {self.friction_use:.2f}, "
             f"torque use {100.0 * self.torque_use:.0f} %"),
            ("control period", f"{1e3 * self.period:g} ms"),
            ("small motions", "none grows" if self.growth < 0.1 else f"grow at {self.growth:+.2g} 1/s"),
            ("after 2 s with a push of a fifth of the weight",
             f"{self.position_error:.2g} mm and {self.orientation_error:.2g} deg from the start"),
        ]  # fmt: skip
        return rows

    def __repr__(self) -> str:
        return f"<NewScenario: {len(self.tips)} tips, margin {self.margin:.3f} N per newton>"
