"""The figures that one looks at first after a run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from softhand.numerics.record import Record
from softhand.numerics.rotations import turns_between
from softhand.numerics.table import html_table
from softhand.recording.events import Event, find_events
from softhand.recording.recorded import scenario_of
from softhand.recording.recording import Recording
from softhand.recording.units import table_of

_ROUNDED = 1e-9  # a tip that slips is on the limit


@dataclass(frozen=True, repr=False)
class Summary(Record):
    """How a run ended and what it used.

    Attributes:
        position_error: distance from the desired position at the end [mm].
        orientation_error: angle between the orientation and the desired one at the end [deg].
        force_error: largest difference of an internal force from the desired one at the end [N].
        friction_use: largest |f_t| / (mu f_z) of the run; above 1 a real tip would have slipped.
        friction_finger: where that was.
        friction_time: when that was [s].
        limit_surface_use: largest share that force and torsion together took of what friction holds; above 1 a real tip
            would have slipped, at 1 one slips; NaN if not recorded.
        limit_surface_finger: where that was; "" if not recorded.
        limit_surface_time: when that was [s]; NaN if not recorded.
        limit: by which it is counted, "exact" or "ellipse".
        slipped: distance that tips slipped, each that did [m].
        events: what happened when.
        torque_limited: share of the samples in which an effort limit cut a torque.
        out_of_range: where the fingertip law was used beyond what it is meant for, a sentence; "" if nowhere.
        regulated: of a hand with coupled joints, what its motors can regulate, by label; see
            `softhand.contact.mobility`.
        lost_contact: tips that held on without pressing, which a tip can under `rolling`, and the first such time [s].
        steps_per_second: simulated time steps per second of wall time, controller and recording included.
        real_time_factor: simulated time over wall time.
    """

    units: ClassVar = {
        "position_error": "mm", "orientation_error": "deg", "force_error": "N", "friction_use": "1",
        "friction_time": "s", "limit_surface_use": "1", "limit_surface_time": "s", "slipped": "m",
        "torque_limited": "1", "lost_contact": "s", "steps_per_second": "1/s", "real_time_factor": "1",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"events"})

    position_error: float
    orientation_error: float
    force_error: float
    friction_use: float
    friction_finger: str
    friction_time: float
    limit_surface_use: float
    limit_surface_finger: str
    limit_surface_time: float
    limit: str
    slipped: dict[str, float]
    events: list[Event]
    torque_limited: float
    out_of_range: str
    regulated: dict[str, str]
    lost_contact: dict[str, float]
    steps_per_second: float
    real_time_factor: float

    def __repr__(self) -> str:
        return f"<Summary: {', '.join(f'{label} {value}' for label, value in self.rows())}>"

    def _repr_html_(self) -> str:
        """The table of the command, for a notebook."""
        return html_table("Summary", (), self.rows(), self.warnings())

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        where = f"{self.friction_finger}, t = {self.friction_time:.3g} s"
        coupled = f"{self.limit_surface_finger}, t = {self.limit_surface_time:.3g} s; > 1 slips"
        rows = [
            ("final position error", f"{self.position_error:.4g} mm"),
            ("final orientation error", f"{self.orientation_error:.4g} deg"),
            ("final internal-force error", f"{self.force_error:.4g} N"),
            ("largest friction use", f"{self.friction_use:.3g}  ({where})"),
            (
                "largest limit-surface use",
                f"{self.limit_surface_use:.3g}" + (f"  ({coupled})" if self.limit_surface_finger else ""),
            ),
            *((f"slip of {finger}", f"{1e3 * travel:.3g} mm") for finger, travel in self.slipped.items()),
            *self.regulated.items(),
            ("steps per second", f"{self.steps_per_second:,.0f}"),
            ("real-time factor", f"{self.real_time_factor:.3g}"),
        ]
        if self.torque_limited:
            rows.append(("torque at its limit", f"{100.0 * self.torque_limited:.3g} % of the samples"))
        return rows

    def warnings(self) -> list[str]:
        """What a reader of the numbers must know."""
        found = []
        if self.friction_use > 1.0 and not self.limit_surface_use <= 1.0 + _ROUNDED:  # else tips slip at the limit
            found.append(
                f"Friction use reached {self.friction_use:.3g} "
                f"({self.friction_finger}, t = {self.friction_time:.3g} s): pure rolling, "
                "as the paper assumes it, asks for more friction than there is."
            )
        elif self.limit_surface_use > 1.0 + _ROUNDED:
            found.append(
                f"Limit-surface use reached {self.limit_surface_use:.3g} ({self.limit_surface_finger}, "
                f"t = {self.limit_surface_time:.3g} s): force and torsion together ask for so many times what friction "
                f"holds, by the {self.limit} limit; above 1 a real tip slips, as one with fingertip.contact = "
                '"coulomb" does.'
            )
        if self.out_of_range:
            found.append(self.out_of_range)
        for finger, time in self.lost_contact.items():
            found.append(f"{finger} does not press on the object from t = {time:.3g} s; its grip there is a fiction.")
        return found


def summarize(recording: Recording) -> Summary:
    """The summary of a run, complete or not.

    Args:
        recording: with at least one sample.
    """
    pose = recording.object_position - recording.object_position_desired
    turn = turns_between(recording.object_rpy_desired[-1:], recording.object_rpy[-1:])[0]
    force = recording.internal_force - recording.internal_force_desired
    use = recording.friction_use
    sample, contact = np.unravel_index(int(np.argmax(use)), use.shape)
    clinging = (recording.deformation[:, :, 0] <= 0.0) & recording.contact_force.any(axis=2)
    fingers = recording.labels["contact"]
    lost = {
        finger: float(recording.time[np.argmax(clinging[:, k])])
        for k, finger in enumerate(fingers)
        if clinging[:, k].any()
    }
    coupled, coupled_finger, coupled_time = _coupled(recording)
    wall = float(recording.attributes.get("wall_time", np.nan))
    return Summary(
        position_error=1e3 * float(np.linalg.norm(pose[-1])),
        orientation_error=float(np.degrees(np.linalg.norm(turn))),
        force_error=float(np.max(np.abs(force[-1]))),
        friction_use=float(use[sample, contact]),
        friction_finger=fingers[contact],
        friction_time=float(recording.time[sample]),
        limit_surface_use=coupled,
        limit_surface_finger=coupled_finger,
        limit_surface_time=coupled_time,
        limit=str(scenario_of(recording).at("fingertip", "limit") or "exact"),
        slipped=_slipped(recording),
        events=find_events(recording),
        torque_limited=float(np.mean(np.any(recording.torque_limited, axis=1))),
        out_of_range=str(recording.attributes.get("out_of_range", "")),
        regulated=_regulated(recording),
        lost_contact=lost,
        steps_per_second=float(recording.attributes.get("steps_per_second", np.nan)),
        real_time_factor=recording.stop_time / wall,
    )


def _coupled(recording: Recording) -> tuple[float, str, float]:
    """Largest use of the limit of force and torsion, finger, time [s]."""
    if "limit_surface_use" not in recording.variables:
        return float("nan"), "", float("nan")
    use = recording.limit_surface_use
    sample, contact = np.unravel_index(int(np.argmax(use)), use.shape)
    return float(use[sample, contact]), recording.labels["contact"][contact], float(recording.time[sample])


def _regulated(recording: Recording) -> dict[str, str]:
    """The rows of `simulation.regulated`."""
    table = table_of(recording.attributes.get("regulated"))
    return {str(label): str(text) for label, text in table.items()} if isinstance(table, dict) else {}


def _slipped(recording: Recording) -> dict[str, float]:
    """Slip travel of the tips that slipped [m]."""
    if "slip_travel" not in recording.variables:
        return {}
    travel = zip(recording.labels["contact"], recording.slip_travel[-1], strict=True)
    return {finger: float(way) for finger, way in travel if way > 0.0}
