"""A squeeze as a result: what holds, what limits it, and what would do where nothing holds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError
from softhand.holding.curve import SqueezeCurve, curve_of
from softhand.holding.held import Held
from softhand.holding.loads import Loads
from softhand.holding.program import Terms
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.numerics.table import html_table

_TOLD = 4  # limits in the table


@dataclass(frozen=True, eq=False, repr=False)
class Squeeze(Record):
    """With which internal forces a grasp holds a set of loads.

    Attributes:
        holds: whether some squeeze holds all loads.
        least: f_N of the least total normal force that holds [N], shape (np,); NaN if none does.
        largest: that of the largest, infinite if nothing limits it, shape (np,); NaN if none holds.
        present: f_N of the scenario or of the sample [N], shape (np,).
        loads: names, one for each load.
        wrenches: of each load, which the contacts exert, about the centre of mass [N, N m], shape (loads, 6).
        contacts: names.
        joints: names.
        contact_force: f_x, f_y, f_z [N] and tau [N m] on the object, in the contact frames, of each load under the
            least squeeze, shape (loads, nc, 4); NaN if none holds.
        limit_surface_use: by them, shape (loads, nc).
        joint_torque: with them [N m, N], shape (loads, n).
        active: load, limit and how much of it is used, of each limit that is reached under the least squeeze.
        active_largest: the same under the largest.
        load_factor: the largest factor on all loads, gravity included, with which some squeeze holds.
        least_friction: the smallest mu, the same at all contacts, with which some squeeze holds; infinite if none does.
        least_effort: the smallest factor on the effort limits with which some squeeze holds; infinite if none does.
        margin: share of the limit surface that is left free.
        friction: mu of each contact, shape (nc,).
        levers: tau_max / (mu f_z) that were counted with [m], shape (nc,).
        refusal: what to do if no squeeze holds; None if one does.
        asked: contacts, loads and terms.
    """

    units: ClassVar = {
        "least": "N", "largest": "N", "present": "N", "wrenches": "N, N m", "contact_force": "N, N, N, N m",
        "limit_surface_use": "1", "joint_torque": "N m, N", "load_factor": "1", "least_friction": "1",
        "least_effort": "1", "margin": "1", "friction": "1", "levers": "m", "normal_force": "N",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"asked"})

    holds: bool
    least: Array
    largest: Array
    present: Array
    loads: tuple[str, ...]
    wrenches: Array
    contacts: tuple[str, ...]
    joints: tuple[str, ...]
    contact_force: Array
    limit_surface_use: Array
    joint_torque: Array
    active: tuple[tuple[str, str, float], ...]
    active_largest: tuple[tuple[str, str, float], ...]
    load_factor: float
    least_friction: float
    least_effort: float
    margin: float
    friction: Array
    levers: Array
    refusal: GraspError | None
    asked: tuple[Held, Loads, Terms]

    @property
    def normal_force(self) -> float:
        """Sum of the normal forces under the least squeeze, the mean over the loads [N]."""
        return float(np.mean(np.sum(self.contact_force[:, :, 2], axis=1)))

    def curve(self) -> SqueezeCurve:
        """The same at margins from 0 to 0.9, with the levers of torsion of the present forces."""
        return curve_of(*self.asked)

    def __repr__(self) -> str:
        return f"<Squeeze: {'; '.join(': '.join(row) for row in self.rows())}>"

    def _repr_html_(self) -> str:
        """The table of the command, for a notebook."""
        return html_table("Squeeze", ("", ""), self.rows())

    def rows(self) -> list[tuple[str, str]]:
        """Label and value."""
        pairs = ", ".join(f"{i + 1}-{j + 1}" for i, j in contact_pairs(len(self.contacts)))
        count = len(self.loads)
        rows = [
            ("loads", f"{count}: {self.loads[0]}{', ...' if count > 1 else ''}"),
            ("margin", f"{100.0 * self.margin:.3g} % of the limit surface is left free"),
            ("internal forces now", f"{_newtons(self.present)}  (fingers {pairs})"),
        ]
        if not self.holds:
            rows.append(("least that holds", "none"))
        else:
            rows += [
                ("least that holds", f"{_newtons(self.least)}, {self.normal_force:.3g} N of normal force in all"),
                ("limits reached", _limits(self.active)),
                ("largest that holds", _newtons(self.largest) if np.all(np.isfinite(self.largest)) else "no limit"),
                ("limits reached", _limits(self.active_largest)),
                ("largest torque under the least", self._torque()),
            ]
        return [
            *rows,
            ("largest factor on the loads", _factor(self.load_factor)),
            ("least friction", f"{self.least_friction:.3g}" if np.isfinite(self.least_friction) else "none holds"),
            (
                "least effort limits",
                f"{self.least_effort:.3g} times these" if np.isfinite(self.least_effort) else "none",
            ),
        ]

    def _torque(self) -> str:
        most = np.unravel_index(np.argmax(np.abs(self.joint_torque)), self.joint_torque.shape)
        return f"{abs(self.joint_torque[most]):.3g} N m at {self.joints[int(most[1])]}"


def _newtons(values: Array) -> str:
    return ", ".join(f"{value:.2f}" for value in values + 0.0) + " N"


def _limits(active: tuple[tuple[str, str, float], ...]) -> str:
    """Which, and for how many loads."""
    names = dict.fromkeys(limit for _, limit, _ in active)
    if not names:
        return "none"
    told = []
    for limit in list(names)[:_TOLD]:
        loads = [load for load, name, _ in active if name == limit]
        told.append(f"{limit} ({loads[0]}{f' and {len(loads) - 1} more' if len(loads) > 1 else ''})")
    more = len(names) - _TOLD
    return "; ".join(told) + (f"; {more} more" if more > 0 else "")


def _factor(value: float) -> str:
    return "none of it" if not value > 0.0 else "above 1000" if value > 999.0 else f"{value:.3g}"
