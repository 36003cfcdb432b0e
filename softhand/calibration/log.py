"""A log: what was commanded to the joints of a hand and what was measured, at even times."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from softhand.errors import MeasurementError
from softhand.numerics.arrays import Array

MEASURED = (
    "joint_position", "joint_velocity", "object_position", "object_orientation", "contact_force", "contact_torsion",
)  # fmt: skip
"""What a log may hold beside torques, by the names of the section `sensing` of a scenario."""

PLAIN_UNITS = {
    "joint_position": "rad", "joint_velocity": "rad/s", "object_position": "m", "object_orientation": "rad",
    "contact_force": "N", "contact_torsion": "N m",
}  # fmt: skip
"""Of the residuals of each; of a joint that slides m, m/s in place of rad, rad/s."""

ENDLESS = {"object_orientation": 4}
_JITTER = 0.2  # of a period, by which a time may be off
_BAD_UNIT = 2.0 * np.pi * 1.5  # [rad], a joint that is not endless goes nowhere near


@dataclass(frozen=True, eq=False)
class Log:
    """What was commanded and measured in a run.

    Attributes:
        time: of each sample [s], evenly apart, shape (T,).
        joint_torque: that the joints had from each sample to the next [N m, N], shape (T, n).
        measured: arrays by the names of `MEASURED`, NaN where there was no sample, shape (T, components): joints in the
            order of the hand; position of the object in the world [m]; its orientation as a quaternion x, y, z, w;
            force of each tip on the object in axes of the tip [N], three a tip; torsion about its contact normal [N m].
        joints: names of the joints; empty where the log has none.
        source: where it is from, for messages.
        lines: number of the line of each sample in its file; empty where it has none.

    Raises:
        MeasurementError: times that go back, repeat, leave a gap or are uneven; numbers that are none; names the
            sample, the line where there is one, and a remedy.
    """

    time: Array
    joint_torque: Array
    measured: dict[str, Array]
    joints: tuple[str, ...] = ()
    source: str = "log"
    lines: tuple[int, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        if len(self.time) < _LEAST:
            raise self.refused(f"has {len(self.time)} samples; a fit takes {_LEAST} at least.")
        if "joint_position" not in self.measured:
            raise self.refused("has no joint positions; a log needs positions and torques of the joints.")
        _check_times(self)
        _check_numbers(self)

    def __len__(self) -> int:
        return len(self.time)

    @property
    def period(self) -> float:
        """Between two samples [s]."""
        return float(round((self.time[-1] - self.time[0]) / (len(self.time) - 1), 12))

    def refused(self, what: str, sample: int | None = None, column: str = "") -> MeasurementError:
        """An error that names the log and, of a sample, its number, time and line."""
        where = ""
        if sample is not None:
            line = f"line {self.lines[sample]}" if self.lines else f"sample {sample}"
            where = f", {line} (t = {self.time[sample]:.6g} s):"
        return MeasurementError(f"{self.source}{where} {what}", column=column, value=sample)

    def part(self, first: int, end: int) -> Log:
        """The samples from `first` until before `end`."""
        return Log(
            self.time[first:end], self.joint_torque[first:end],
            {name: values[first:end] for name, values in self.measured.items()},
            self.joints, self.source, self.lines[first:end],
        )  # fmt: skip


_LEAST = 40


def _check_times(log: Log) -> None:
    time = log.time
    if not np.all(np.isfinite(time)):
        raise log.refused("the time is no number; cut the log before it.", int(np.argmin(np.isfinite(time))), "time")
    steps = np.diff(time)
    usual = float(np.median(steps))
    for k in np.flatnonzero(steps <= 0.0)[:1]:
        if steps[k] == 0.0:
            raise log.refused("has the time of the sample before it; remove what is there twice.", int(k) + 1, "time")
        raise log.refused(
            f"the clock goes back by {-steps[k]:.4g} s; cut the log there, and give what comes behind as a log of its "
            "own.", int(k) + 1, "time",
        )  # fmt: skip
    for k in np.flatnonzero(steps > 1.5 * usual)[:1]:
        lost = round(steps[k] / usual) - 1
        raise log.refused(
            f"comes {1e3 * steps[k]:.4g} ms after the sample before it, others {1e3 * usual:.4g} ms: a gap of {lost} "
            "samples; cut the log there, and give one of the two parts.", int(k) + 1, "time",
        )  # fmt: skip
    even = time[0] + np.linspace(0.0, 1.0, len(time)) * (time[-1] - time[0])
    off = np.abs(time - even)
    k = int(np.argmax(off))
    if off[k] > _JITTER * usual:
        raise log.refused(
            f"is off the even beat of {1e3 * usual:.6g} ms by {1e3 * off[k]:.4g} ms; a torque is held from one sample "
            "to the next, so bring the log to even times first.", k, "time",
        )  # fmt: skip


def _check_numbers(log: Log) -> None:
    for name, values in (("joint_torque", log.joint_torque), ("joint_position", log.measured["joint_position"])):
        bad = ~np.all(np.isfinite(values), axis=1)
        if bad.any():
            k = int(np.argmax(bad))
            which = _component(log, name, int(np.argmin(np.isfinite(values[k]))))
            raise log.refused(f"{which} is no number; fill it in, or cut the log there.", k, name)
    for name, values in log.measured.items():
        if len(values) != len(log.time) or np.any(np.isinf(values)):
            raise log.refused(f"{name} has other samples than time, or infinite ones.", column=name)


def _component(log: Log, name: str, k: int) -> str:
    return f"{name} of {log.joints[k]}" if log.joints else f"{name}, component {k + 1},"


def check_hand(
    log: Log, names: tuple[str, ...], tips: int, lower: Array, upper: Array, slides: NDArray[np.bool_]
) -> None:
    """Refuse a log of another hand, or of other units.

    Args:
        log: to be checked.
        names: joints of the hand, in its order.
        tips: how many fingertips it has.
        lower: limits of the joints [rad, m], shape (n,).
        upper: likewise.
        slides: which joints slide, shape (n,).

    Raises:
        MeasurementError: it has other joints or tips, or angles that no joint of the hand reaches.
    """
    n, given = len(names), log.measured["joint_position"].shape[1]
    if given != n or log.joint_torque.shape[1] != n:
        raise log.refused(
            f"has {given} joint positions and {log.joint_torque.shape[1]} torques, but the hand of the scenario has "
            f"{n} joints, {names[0]} to {names[-1]}; give the scenario of the hand that was logged.", column="joints",
        )  # fmt: skip
    if log.joints and tuple(log.joints) != tuple(names):
        other = next(one for one, mine in zip(log.joints, names, strict=True) if one != mine)
        raise log.refused(
            f"has a joint {other!r}, the hand of the scenario {', '.join(names)}, in this order; give the scenario of "
            "the hand that was logged.", column=other,
        )  # fmt: skip
    sizes = {"joint_velocity": n, "contact_force": 3 * tips, "contact_torsion": tips}
    for name, size in sizes.items():
        if name in log.measured and log.measured[name].shape[1] != size:
            raise log.refused(
                f"has {log.measured[name].shape[1]} components of {name}, but the hand needs {size}.", column=name
            )
    q = log.measured["joint_position"]
    room = np.where(slides, 0.05, 0.35)
    beyond = (q > upper + room) | (q < lower - room)
    if beyond.any():
        k, j = (int(one) for one in np.argwhere(beyond)[0])
        limits = f"{lower[j]:.4g} to {upper[j]:.4g} {'m' if slides[j] else 'rad'}"
        in_degrees = np.radians(q[:, j])
        fits = not slides[j] and np.all((in_degrees > lower[j] - room[j]) & (in_degrees < upper[j] + room[j]))
        hint = "as degrees they would: write [deg] in the header, or convert them" if fits else (
            "the unit, the sign or the hand is another one")  # fmt: skip
        raise log.refused(f"{names[j]} is at {q[k, j]:.4g}, but its limits are {limits}; {hint}.", k, names[j])
