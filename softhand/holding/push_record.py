"""The pushes that a grasp survives, as a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Literal

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.numerics.table import html_table

Kind = Literal["force", "moment"]
Profile = Literal["ramp", "step"]


@dataclass(frozen=True, eq=False, repr=False)
class WorstPush(Record):
    """What pushes a grasp survives: no tip slips or lifts, and the run goes on.

    Attributes:
        kind: "force", through the centre of mass, or "moment".
        profile: "ramp", grown without a jerk in 0.6 s and held for 0.3 s; or "step", all at once and held for 0.5 s,
            where the overshoot counts.
        directions: unit vectors in base axes, shape (directions, 3).
        sizes: largest push of each direction that was survived in simulation [N or N m], shape (directions,).
        ends: what ended each, in words.
        linear: the same by the contact forces' linear answer at rest [N or N m], shape (directions,); NaN where the
            torque depends on a sum over time, which has no value at rest.
        along: how many of the directions, the first, were asked for beside the usual ones.
        worst: the smallest of `sizes` [N or N m], whose neighbours are survived as well.
        worst_direction: shape (3,).
        worst_end: what ends it.
        friction: the least mu of each contact with which the start holds, all lowered alike, and the mu there is, shape
            (nc, 2).
        mass: least and largest mass of the object of which the controller does not know, it counting with `mass_known`
            [kg], shape (2,); NaN for moments and steps.
        mass_known: [kg].
        contacts: names.
        controller: name.
        runs: that were simulated.
    """

    units: ClassVar = {
        "directions": "1", "along": "1", "sizes": "N or N m", "linear": "N or N m", "worst": "N or N m",
        "worst_direction": "1", "friction": "1", "mass": "kg", "mass_known": "kg", "runs": "1",
    }  # fmt: skip

    kind: str
    profile: str
    directions: Array
    sizes: Array
    ends: tuple[str, ...]
    linear: Array
    along: int
    worst: float
    worst_direction: Array
    worst_end: str
    friction: Array
    mass: Array
    mass_known: float
    contacts: tuple[str, ...]
    controller: str
    runs: int

    def __repr__(self) -> str:
        return f"<WorstPush: {'; '.join(': '.join(row) for row in self.rows())}>"

    def _repr_html_(self) -> str:
        """The table of the command, for a notebook."""
        return html_table("Worst push", ("", ""), self.rows())

    @property
    def unit(self) -> str:
        """Of the sizes."""
        return "N" if self.kind == "force" else "N m"

    def rows(self) -> list[tuple[str, str]]:
        """Label and value."""
        what = "force through the centre of mass" if self.kind == "force" else "moment"
        how = "grown slowly, in 0.6 s" if self.profile == "ramp" else "all at once, held for 0.5 s"
        k = int(np.argmax(self.sizes))
        mu = ", ".join(f"{least:.3g} of {now:g}" for least, now in self.friction)
        rows = [("push", f"{what}, {how}, under {self.controller}")]
        for way, size, end in zip(self.directions[: self.along], self.sizes, self.ends, strict=False):
            rows.append((f"along {_way(way)}", f"{size:.3g} {self.unit}; then {end}"))
        rows += [
            ("worst", f"{self.worst:.3g} {self.unit} along {_way(self.worst_direction)}; then {self.worst_end}"),
            ("best", f"{self.sizes[k]:.3g} {self.unit} along {_way(self.directions[k])}; then {self.ends[k]}"),
            ("worst by the linear answer", self._linear()),
            ("least friction without push", mu),
        ]
        if np.all(np.isfinite(self.mass)):
            rows.append(
                (
                    "mass that it survives",
                    f"{self.mass[0]:.3g} to {self.mass[1]:.3g} kg, counting with {self.mass_known:g}",
                )
            )
        return [*rows, ("directions, runs", f"{len(self.directions)}, {self.runs}")]

    def _linear(self) -> str:
        k = int(np.argmin(self.linear))
        if np.isnan(self.linear[k]):
            return f"none: the torque of {self.controller} depends on a sum over time"
        return f"{self.linear[k]:.3g} {self.unit} along {_way(self.directions[k])}"


def _way(direction: Sequence[float] | Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.2f}" for value in np.round(direction, 2)) + ")"
