"""A rest as a result: where everything is, what carries it, and which limits it is at."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, NamedTuple

import numpy as np

from softhand.errors import GraspError
from softhand.margins.loop import NEUTRAL
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.numerics.table import html_table
from softhand.plant.state import State


class Limit(NamedTuple):
    """A limit that a rest is at."""

    what: str
    """`slip`: the tip is at its limit of friction; `effort limit`: of a joint; `joint limit`: a joint is beyond it,
    which runs do not hold; `lift-off`: a contact that touched in the given state does not."""
    where: str
    """Name of the contact or the joint."""


@dataclass(frozen=True, eq=False, repr=False)
class Equilibrium(Record):
    """Where hand and object rest; or, with `refusal`, the last place at which they are held with the least.

    Attributes:
        refusal: why there is no rest; None if there is one.
        time: of the rest: up to there the reference was followed [s].
        joints: names.
        tips: names.
        supports: names.
        joint_position: [rad or m], shape (n,).
        object_position: origin of the object in the world [m].
        object_rpy: roll, pitch, yaw [rad].
        moved: translation [m] and rotation vector [rad] of the object from the given state, world axes, shape (6,).
        torque: of the joints [N m, N], shape (n,).
        torque_use: of its effort limit, shape (n,).
        force: of each tip on the object, world axes [N], shape (nc, 3).
        normal_force: of each tip [N], shape (nc,).
        torsion: of each tip [N m], shape (nc,).
        limit_surface_use: of each tip, 1 where it slips; more where contacts only roll, shape (nc,).
        slipped: length of the way that each tip slipped [m], shape (nc,).
        support_force: of each support on what it carries, world axes [N], shape (ns, 3).
        limits: that are active.
        share: of the way that was gone in balance, 1 for all: of what held the given state and was let go, or, if that
            went well, of the time of the reference.
        gave_way: whether balance was lost on the way and found again.
        unbalanced: force [N] and moment [N m] about its origin left on the object, world axes, shape (6,).
        torque_left: left at each joint [N m, N], shape (n,).
        growth: rate of the fastest growing small motion beside the rest [1/s], below 0 if all die out, contacts
            sticking; NaN without a rest.
        growing: name of what moves most in it.
    """

    units: ClassVar = {
        "time": "s", "joint_position": "rad, m", "object_position": "m", "object_rpy": "rad", "moved": "m, rad",
        "torque": "N m, N", "torque_use": "1", "force": "N", "normal_force": "N", "torsion": "N m",
        "limit_surface_use": "1", "slipped": "m", "support_force": "N", "share": "1", "unbalanced": "N, N m",
        "torque_left": "N m, N", "growth": "1/s",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"nearest"})

    refusal: GraspError | None
    time: float
    joints: tuple[str, ...]
    tips: tuple[str, ...]
    supports: tuple[str, ...]
    joint_position: Array
    object_position: Array
    object_rpy: Array
    moved: Array
    torque: Array
    torque_use: Array
    force: Array
    normal_force: Array
    torsion: Array
    limit_surface_use: Array
    slipped: Array
    support_force: Array
    limits: tuple[Limit, ...]
    share: float
    gave_way: bool
    unbalanced: Array
    torque_left: Array
    growth: float
    growing: str
    nearest: State
    """The state of all this, at rest or not."""

    @property
    def state(self) -> State:
        """The rest, for `Simulation.reset` and `linearize`; what the controller remembers is in it.

        Raises:
            GraspError: there is none; `nearest` is what comes nearest to it.
        """
        if self.refusal is not None:
            raise self.refusal
        return self.nearest

    def __repr__(self) -> str:
        return f"<Equilibrium: {', '.join(': '.join(row) for row in self.rows())}>"

    def _repr_html_(self) -> str:
        """The tables of the command, for a notebook."""
        tips = html_table("", ("tip", *self.header), self.tip_rows())
        return html_table("Rest", (), self.rows(), self.notes()) + tips

    header: ClassVar = ("normal force", "use of the limit", "torsion", "slipped")

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        shift, turn = 1e3 * np.linalg.norm(self.moved[:3]), math.degrees(np.linalg.norm(self.moved[3:]))
        rows = [
            ("at rest", "yes" if self.refusal is None else "no"),
            ("reference followed to", f"{self.time:g} s"),
            ("object at", f"({_three(1e3 * self.object_position)}) mm"),
            ("roll, pitch, yaw", f"({_three(np.degrees(self.object_rpy))}) deg"),
            ("moved from the given state", f"{shift:.3g} mm, {turn:.3g} deg"),
        ]
        if len(self.torque):
            j = int(np.argmax(self.torque_use))
            rows.append(("largest torque", f"{100.0 * self.torque_use[j]:.3g} % of its limit, {self.joints[j]}"))
        for name, force in zip(self.supports, self.support_force, strict=True):
            if np.any(force):
                rows.append((f"{name} carries", f"{np.linalg.norm(force):.3g} N"))
        rows.append(("limits", "; ".join(f"{one.what}: {one.where}" for one in self.limits) or "none"))
        if self.refusal is not None:
            force, moment = (np.linalg.norm(part) for part in (self.unbalanced[:3], self.unbalanced[3:]))
            rows.append(
                ("left on the object", f"{force:.3g} N along {direction(self.unbalanced[:3])}, {moment:.3g} N m")
            )
            rows.append(("left at the joints", f"{np.max(np.abs(self.torque_left), initial=0.0):.3g} N m or N"))
        elif not math.isnan(self.growth):
            rows.append(("small motions beside it", self._growth()))
        return rows

    def tip_rows(self) -> list[tuple[str, ...]]:
        """Name, normal force, use of the limit, torsion and slip of each tip."""
        return [
            (name, f"{f:.3g} N", f"{use:.3g}", f"{1e3 * tau:.3g} mN m", f"{1e3 * way:.3g} mm")
            for name, f, use, tau, way in zip(
                self.tips, self.normal_force, self.limit_surface_use, self.torsion, self.slipped, strict=True
            )
        ]

    def notes(self) -> list[str]:
        """What a reader of the numbers must know."""
        found = []
        if self.gave_way and self.refusal is None:
            found.append(
                "Balance was lost on the way and found again; a run swings through there and may come to rest "
                "elsewhere."
            )
        slips = {one.where for one in self.limits if one.what == "slip"}
        beyond = [
            name
            for name, use in zip(self.tips, self.limit_surface_use, strict=True)
            if use > 1.001 and name not in slips
        ]
        if beyond:
            found.append(
                f"{', '.join(beyond)}: beyond the limit of friction, which contacts that only roll do not have."
            )
        if self.refusal is None and self.growth > NEUTRAL:
            found.append("No run comes to rest there by itself: small motions beside it grow.")
        return found

    def _growth(self) -> str:
        if abs(self.growth) <= NEUTRAL:
            return "stay  (some motion neither grows nor dies out)"
        return f"{self.growth:+.3g} 1/s  ({'all die out' if self.growth < 0.0 else f'grow, {self.growing}'})"


def direction(vector: Array) -> str:
    """Of a vector, as words."""
    size = float(np.linalg.norm(vector))
    return f"({', '.join(f'{x + 0.0:.2f}' for x in np.round(vector / size if size else vector, 2))})"


def _three(values: Array) -> str:
    """Numbers of which less than a millionth is nothing."""
    return ", ".join(f"{x if abs(x) > 1e-6 else 0.0:.4g}" for x in values)
