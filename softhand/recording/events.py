"""What happened in a run, and when: phases, touch, lift-off, slip, edges, apex, limits of torques and joints."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.errors import RecordingError
from softhand.recording.recording import Recording
from softhand.settings.wording import show

_NOTHING = 1e-9  # [N] a force below this is noise of the solver, and no touch
_UNSEEN = 1e-6  # in the unit shown
_GAP = 0.010  # [s] that does not part two of a kind: a tip that creeps at its limit slips in most steps, not in all
_INCIPIENT, _STUCK = 0.5, 0.4  # share of a contact that slips from which it is told, and below which it may be anew
_TOGETHER = 0.005  # [s] within which places of the object that meet the table, or leave it, are one event
_TABLE = "table "
_PLACE = re.compile(r"(.+?)(?:'s)? (corner|edge|rim|side|end point|ball|ellipsoid)\b")
"""Names of supports at which the object meets a table or an obstacle: whose they are, and what they are."""
_OTHER_FACE = 0.7  # cosine between the normals of two samples below which another face is touched
_APEX_TURN = 1.0  # [rad] of Theta between two samples: the contact went past the apex in between
_AT_APEX = 1e-4  # [rad] a tip that rests on its apex does not pass it; Theta is noise there


@dataclass(frozen=True)
class Event:
    """One event.

    Attributes:
        time: of the first sample that shows it [s].
        kind: one of `KINDS`.
        finger: name of the tip or of the support, for a limit of torque or joint that of the joint; "" for the whole
            run.
        text: the reason in figures.
    """

    time: float
    kind: str
    finger: str
    text: str


KINDS = (
    "phase", "touch", "lift-off", "incipient slip", "slip", "torsional slip", "slip ends", "edge", "vertex", "part",
    "two parts", "apex", "torque limit", "joint limit", "collision", "stopped",
)  # fmt: skip
"""`torsional slip` is slip where torsion takes the larger share of the limit; `edge` and `vertex` are where a tip that
presses rolls off a face; `part` is where it goes on on another part of the object, `two parts` where it would touch two
of them, and feels the deeper one alone; `incipient slip` is where half of a contact that holds begins to slip, in a
recording that `softhand.incipient_slip` went through; `joint limit` is a joint beyond its stop, which a run does not
hold. `collision` needs shapes, so that `softhand.collisions` finds it, and not `find_events`."""


def find_events(recording: Recording) -> list[Event]:
    """The events of a run in the order of time, from its arrays alone; arrays that it lacks have no events."""
    there = recording.variables.keys()
    found = [event for finder, needed in _FINDERS if there >= set(needed) for event in finder(recording)]
    if not recording.complete:
        found.append(Event(recording.stop_time, "stopped", "", recording.reason))
    return sorted(found, key=lambda event: event.time)


def events_as_text(events: list[Event]) -> str:
    """JSON, as the attribute `events` of a recording has it."""
    return json.dumps([asdict(event) for event in events])


def phases_as_text(phases: Sequence[tuple[str, float]]) -> str:
    """JSON, as the attribute `phases` of a recording has it: name and begin of each [s]."""
    return json.dumps(phases)


def phases_of(recording: Recording) -> list[tuple[str, float, float]]:
    """Name, begin and end [s] of the phases of a run, as far as it went."""
    begun = [phase for phase in _begun(recording) if phase[1] <= recording.stop_time]
    ends = [time for _, time in begun[1:]] + [recording.stop_time]
    return [(name, begin, end) for (name, begin), end in zip(begun, ends, strict=False)]


def _begun(recording: Recording) -> list[tuple[str, float]]:
    text = recording.attributes.get("phases", "[]")
    try:
        return [(str(name), float(begin)) for name, begin in json.loads(str(text))]
    except (ValueError, TypeError, RecursionError) as error:
        message = f"The attribute 'phases' of the recording is {show(text)}; it must be JSON, a name and a time each."
        raise RecordingError(message, file=None) from error


def _phases(recording: Recording) -> Iterator[Event]:
    for name, begin, _ in phases_of(recording):
        yield Event(begin, "phase", "", name)


def _touches(recording: Recording) -> Iterator[Event]:
    """Touch and lift-off; a tip that presses from the start does not touch."""
    yield from _pressing_ends(recording, recording.labels["contact"], recording.contact_force[:, :, 2])


def _pressing_ends(recording: Recording, names: Sequence[str], force: NDArray[np.float64]) -> Iterator[Event]:
    """Where each column of normal forces [N] begins and ends to be positive."""
    pressing = force > _NOTHING
    for i, name in enumerate(names):
        for k in np.flatnonzero(np.diff(pressing[:, i])) + 1:
            if pressing[k, i]:
                yield Event(_time(recording, k), "touch", name, f"f_z = {_short(force[k, i])} N")
            else:
                before = _short(force[k - 1, i])
                yield Event(_time(recording, k), "lift-off", name, f"f_z was {before} N the sample before")


def _support_touches(recording: Recording) -> Iterator[Event]:
    """The same of the supports; places that meet a table or an obstacle together, or leave it, are one event of it."""
    places: dict[tuple[str, str], list[Event]] = {}
    names, tips = recording.labels["support"], {_TABLE + tip for tip in recording.labels["contact"]}
    for event in _pressing_ends(recording, names, recording.support_force[:, :, 2]):
        place = None if event.finger in tips else _PLACE.match(event.finger)
        if place:
            places.setdefault((place[1], event.kind), []).append(event)
        else:
            yield event
    for (whose, _), events in places.items():
        events.sort(key=lambda event: event.time)
        while events:
            first = events[0]
            together = [event for event in events if event.time <= first.time + _TOGETHER]
            del events[: len(together)]
            met = {event.finger for event in together}
            corners = all((place := _PLACE.match(name)) and place[2] == "corner" for name in met)
            kind = "corners" if corners else "places"
            yield first if len(met) == 1 else Event(first.time, first.kind, whose, f"{len(met)} {kind}")


def _slips(recording: Recording) -> Iterator[Event]:
    for i, finger in enumerate(recording.labels["contact"]):
        for first, last in _spans(recording.is_slipping[:, i] != 0, recording.time):
            force, share = recording.contact_force[first, i], recording.friction_use[first, i]
            use = recording.limit_surface_use[first, i]  # below 1 where the step that slipped ended within the limit
            kind = "torsional slip" if share * share < 0.5 * use * use else "slip"  # use^2 is the sum of both squares
            shear, normal, torsion = map(_short, (np.hypot(*force[:2]), force[2], 1e3 * force[3]))
            figures = f"f_t = {shear} N, f_z = {normal} N, tau = {torsion} N mm"
            yield Event(_time(recording, first), kind, finger, figures)
            if last + 1 < len(recording):
                travel, twist, loss = (
                    recording[name][last, i] - recording[name][max(first - 1, 0), i]
                    for name in ("slip_travel", "slip_twist", "slip_loss")
                )
                amounts = (1e3 * travel, np.degrees(twist), 1e3 * loss)
                figures = "{} mm, {} deg, {} mJ".format(*map(_short, amounts))
                yield Event(_time(recording, last + 1), "slip ends", finger, figures)


def _incipient_slips(recording: Recording) -> Iterator[Event]:
    """Where half of a contact, which holds as a whole, has begun to slip."""
    for i, finger in enumerate(recording.labels["contact"]):
        shares, is_told = recording.slipped_share[:, i], bool(recording.slipped_share[:1, i] >= _INCIPIENT)
        for k in np.flatnonzero((shares >= _INCIPIENT) | (shares < _STUCK)):
            begins = shares[k] >= _INCIPIENT
            if begins and not is_told and not recording.is_slipping[k, i]:
                use = _short(recording.limit_surface_use[k, i])
                figures = f"{_short(100.0 * shares[k], 2)} % of the contact slips, at {use} of the limit"
                yield Event(_time(recording, k), "incipient slip", finger, figures)
            is_told = begins


def _edges(recording: Recording) -> Iterator[Event]:
    """A tip that presses leaves the face for an edge or a vertex, or gets over it between two samples."""
    pressing = recording.deformation[:, :, 0] > 0.0
    for i, finger in enumerate(recording.labels["contact"]):
        feature = np.where(pressing[:, i], recording.contact_feature[:, i] % 10, 0)
        part = recording.contact_feature[:, i] // 10 % 100
        normal = recording.contact_rotation[:, i, :, 2]
        turned = np.sum(normal[1:] * normal[:-1], axis=1) < _OTHER_FACE
        jumps = np.flatnonzero(turned & (feature[1:] == 1) & (feature[:-1] == 1) & (part[1:] == part[:-1])) + 1
        for first, last in [*_spans(feature > 1, recording.time), *((int(k), int(k) - 1) for k in jumps)]:
            before, after = max(first - 1, 0), min(last + 1, len(recording) - 1)
            cosine = np.clip(_normal(recording, before, i) @ _normal(recording, after, i), -1.0, 1.0)
            kind = "vertex" if np.any(feature[first : last + 1] == 3) else "edge"
            end = {0: "in the air", 1: "on a face"}.get(int(feature[after]), "still there")
            duration = 1e3 * (recording.time[after] - recording.time[before])
            figures = (
                f"f_z = {_short(recording.contact_force[first, i, 2])} N, the normal turns by "
                f"{_short(np.degrees(np.arccos(cosine)))} deg in {_short(duration)} ms, then {end}"
            )
            yield Event(_time(recording, first), kind, finger, figures)


def _parts(recording: Recording) -> Iterator[Event]:
    """A tip that presses goes from one part of the object to another, or reaches two."""
    pressing = recording.deformation[:, :, 0] > 0.0
    for i, finger in enumerate(recording.labels["contact"]):
        feature = recording.contact_feature[:, i]
        part = feature // 10 % 100
        for k in np.flatnonzero((np.diff(part) != 0) & pressing[1:, i] & pressing[:-1, i]) + 1:
            cosine = np.clip(_normal(recording, int(k) - 1, i) @ _normal(recording, int(k), i), -1.0, 1.0)
            turn = _short(np.degrees(np.arccos(cosine)))
            text = f"from part {part[k - 1]} of the object to part {part[k]}, the normal turns by {turn} deg"
            yield Event(_time(recording, k), "part", finger, text)
        for first, last in _spans((feature >= 1000) & pressing[:, i], recording.time):
            duration = 1e3 * (recording.time[last] - recording.time[first])
            text = f"reaches a part beside part {part[first]}, feels the deeper one alone, for {_short(duration)} ms"
            yield Event(_time(recording, first), "two parts", finger, text)


def _normal(recording: Recording, sample: int, contact: int) -> NDArray[np.float64]:
    """Inward normal of the object at a contact, in the object frame, shape (3,)."""
    (sr, sp, sy), (cr, cp, cy) = np.sin(recording.object_rpy[sample]), np.cos(recording.object_rpy[sample])
    axes = np.array([
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ])  # fmt: skip
    normal: NDArray[np.float64] = axes.T @ recording.contact_rotation[sample, contact, :, 2]
    return normal


def _apexes(recording: Recording) -> Iterator[Event]:
    """Theta jumps where the contact rolls over the apex of the tip."""
    turn = np.abs(np.diff(recording.contact_angles[:, :, 0], axis=0))
    off = np.abs(0.5 * np.pi - recording.contact_angles[:, :, 1])
    passed = (np.minimum(turn, 2.0 * np.pi - turn) > _APEX_TURN) & (np.maximum(off[1:], off[:-1]) > _AT_APEX)
    for k, i in np.argwhere(passed & (recording.deformation[1:, :, 0] > 0.0)):
        Phi = np.degrees(recording.contact_angles[k : k + 2, i, 1].max())
        yield Event(_time(recording, k + 1), "apex", recording.labels["contact"][i], f"Phi = {_short(Phi)} deg")


def _torque_limits(recording: Recording) -> Iterator[Event]:
    units = _joint_units(recording, "joint_torque")
    for i, joint in enumerate(recording.labels["joint"]):
        for first, last in _spans(recording.torque_limited[:, i] != 0, recording.time):
            samples = int(np.count_nonzero(recording.torque_limited[first : last + 1, i]))
            effort = f"{_short(recording.joint_torque[first, i])} {units[i]}"
            figures = f"{effort}, {samples} sample{'s' if samples > 1 else ''}"
            yield Event(_time(recording, first), "torque limit", joint, figures)


def _joint_limits(recording: Recording) -> Iterator[Event]:
    units = _joint_units(recording, "joint_position")
    for i, joint in enumerate(recording.labels["joint"]):
        for side, name in ((1, "upper"), (-1, "lower")):
            for first, last in _spans(recording.joint_limited[:, i] == side, recording.time):
                angle = recording.joint_position[first : last + 1, i]
                most = f"{_short(side * np.max(side * angle), 4)} {units[i]}"
                figures = f"at {_short(angle[0], 4)} {units[i]} beyond the {name} limit, at most {most}"
                yield Event(_time(recording, first), "joint limit", joint, figures)


def _joint_units(recording: Recording, name: str) -> tuple[str, ...]:
    """Unit of an array of each joint."""
    units = recording.units(name)
    return units if len(units) > 1 else units * len(recording.labels["joint"])


def _short(value: Any, digits: int = 3) -> str:
    """A number in few digits; what is less than anybody measures is 0, and not 1e-23."""
    return f"{value:.{digits}g}" if abs(value) >= _UNSEEN else "0"


def _time(recording: Recording, sample: int | np.signedinteger) -> float:
    return float(recording.time[sample])


def _spans(holds: NDArray[np.bool_], time: NDArray[np.float64]) -> list[tuple[int, int]]:
    """First and last sample of each stretch where something holds, short gaps bridged."""
    samples = np.flatnonzero(holds)
    if not samples.size:
        return []
    parts = np.flatnonzero(np.diff(time[samples]) > _GAP) + 1
    return [(int(part[0]), int(part[-1])) for part in np.split(samples, parts)]


_FINDERS: tuple[tuple[Callable[[Recording], Iterator[Event]], tuple[str, ...]], ...] = (
    (_phases, ()),
    (_touches, ("contact_force",)),
    (_support_touches, ("support_force",)),
    (_slips, ("is_slipping", "contact_force", "friction_use", "limit_surface_use", "slip_travel", "slip_twist",
              "slip_loss")),
    (_incipient_slips, ("slipped_share", "is_slipping", "limit_surface_use")),
    (_edges, ("contact_feature", "contact_rotation", "object_rpy", "deformation", "contact_force")),
    (_parts, ("contact_feature", "contact_rotation", "object_rpy", "deformation")),
    (_apexes, ("contact_angles", "deformation")),
    (_torque_limits, ("torque_limited", "joint_torque")),
    (_joint_limits, ("joint_limited", "joint_position")),
)  # fmt: skip
"""What finds events, and the arrays that it needs."""
