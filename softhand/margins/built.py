"""Instruments and drives between plant and controller: what they keep from one control period to the next, linear.

A control period is written as rows over (x, m, w): x of the plant, m all that controller, instruments and drives keep,
w an error of each measured component in that period.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.sensing.quantities import Channel
from softhand.simulation.actuation import Actuation, lag_shares

LONGEST = 1000
"""Control periods in a cycle."""
_SAME = 1e-6  # of a control period


class Turn(NamedTuple):
    """One control period of controller, instruments and drives."""

    K: Array
    """Torque that the joints have by (x, m), shape (n, s + m)."""
    N: Array
    """Next m by (x, m), shape (m, s + m)."""
    by_error: Mapping[str, Array]
    """Both by an error of each component of a quantity, by its name, shape (n + m, components)."""


@dataclass(frozen=True, eq=False)
class Controls:
    """A controller alone.

    Attributes:
        K: command by (x, m), shape (n, s + m).
        N: next m by (x, m), shape (m, s + m).
        answers: command and m by an error of each component, by quantity, shape (n + m, components).
        along: what is measured by x, by quantity, shape (components, s).
        every: control periods between two calls.
    """

    K: Array
    N: Array
    answers: Mapping[str, Array]
    along: Mapping[str, Array]
    every: int


def has_dynamics(channel: Channel) -> bool:
    """Whether what an instrument tells depends on earlier samples."""
    return channel.delay > 0 or channel.stride > 1 or channel.share < 1.0


def is_dynamic(actuation: Actuation | None) -> bool:
    """Whether the torque of a drive depends on earlier commands."""
    return actuation is not None and (actuation.delay > 0 or bool(np.any(actuation.mean > 0.0)))


def channel_at(channel: Channel, ratio: float) -> Channel:
    """With a control period so many times as long; what comes between two is there at the later one."""
    share = -math.expm1(ratio * math.log1p(-channel.share)) if channel.share < 1.0 else 1.0
    stride = max(1, _whole(channel.stride / ratio)) if channel.stride > 1 else 1  # 1 is every one, however long
    return replace(channel, delay=_whole(channel.delay / ratio), stride=stride, share=share)


def actuation_at(actuation: Actuation, ratio: float) -> Actuation:
    """Likewise."""
    with np.errstate(divide="ignore"):
        lag = np.where(actuation.decay > 0.0, -1.0 / np.log(actuation.decay), actuation.mean)  # in control periods
    decay, mean = lag_shares(lag, ratio)
    return replace(actuation, delay=_whole(actuation.delay / ratio), decay=decay, mean=mean)


def _whole(periods: float) -> int:
    return math.ceil(periods - _SAME)


def turns_of(asked: Controls, channels: Mapping[str, Channel], actuation: Actuation | None) -> tuple[Turn, ...]:
    """The control periods of a cycle, after which all begins anew: as many as samples and calls have in common.

    Of m the numbers of the controller come first, then those that `kept_names` names.

    Args:
        asked: the controller.
        channels: instruments of the quantities of `asked`.
        actuation: the drives, if there are any.

    Raises:
        ScenarioError: that are too many.
    """
    count = math.lcm(asked.every, *(one.stride for one in channels.values()))
    if count > LONGEST:
        strides = {f"sensing.{name}.rate": one.stride for name, one in channels.items() if one.stride > 1}
        raise ScenarioError(
            f"{', '.join(strides)}: samples every {', '.join(map(str, strides.values()))} control periods are together "
            f"only every {count}, but the linear loop takes {LONGEST} at most; give rates that divide one another.",
            key=next(iter(strides)), value=count,
        )  # fmt: skip
    return tuple(_Period(asked, channels, actuation, k).turn() for k in range(count))


def kept_names(
    asked: Controls, channels: Mapping[str, Channel], actuation: Actuation | None, labels: Mapping[str, Sequence[str]]
) -> list[str]:
    """What instruments and drives keep.

    Args:
        asked: as above.
        channels: likewise.
        actuation: likewise.
        labels: of the components of each quantity, and of the joints as "torque".
    """
    slots = _Period(asked, channels, actuation, 0).slots[1:]
    return [f"{label}: {what}" for whose, what in slots for label in labels[whose]]


class _Period:
    """One control period at work."""

    def __init__(
        self, asked: Controls, channels: Mapping[str, Channel], actuation: Actuation | None, number: int
    ) -> None:
        self.asked, self.channels, self.number = asked, channels, number
        self.actuation = actuation if is_dynamic(actuation) else None
        self.n, self.m = len(asked.K), len(asked.N)
        self.s = asked.K.shape[1] - self.m
        self.slots: list[tuple[str, str]] = []
        self._places: dict[tuple[str, str], slice] = {}
        end = self.s
        for slot, size in self._layout():
            self.slots.append(slot)
            self._places[slot], end = slice(end, end + size), end + size
        self.width = end
        self._errors, columns = {}, end
        for name, answer in asked.answers.items():
            self._errors[name] = slice(columns, columns + answer.shape[1])
            columns += answer.shape[1]
        self._columns = columns
        self._next: dict[tuple[str, str], Array] = {}

    def _layout(self) -> list[tuple[tuple[str, str], int]]:
        """Who keeps what, and how many numbers that is."""
        found = [(("controller", ""), self.m)]
        for name, one in self.channels.items():
            size = self.asked.answers[name].shape[1]
            found += [((name, "held"), size)] * (one.stride > 1)
            found += [((name, _ago(k)), size) for k in range(1, one.delay + 1)]
            found += [((name, "filtered"), size)] * (one.share < 1.0)
        found += [(("torque", "held"), self.n)] * (self.asked.every > 1)
        if self.actuation is not None:
            found += [(("torque", _ago(k)), self.n) for k in range(1, self.actuation.delay + 1)]
            found += [(("torque", "behind the lag"), self.n)] * bool(np.any(self.actuation.mean > 0.0))
        return found

    def turn(self) -> Turn:
        """All of it."""
        command = self._command()
        if self.asked.every > 1:
            is_asked = self.number % self.asked.every == 0
            command = self._keep(("torque", "held"), command if is_asked else self._kept(("torque", "held")))
        torque = self._driven(command)
        after = [np.zeros((0, self._columns)), *(self._next[slot] for slot in self.slots)]
        both = np.vstack([torque, *after])
        by_error = {name: both[:, columns] for name, columns in self._errors.items()}
        return Turn(both[: self.n, : self.width], both[self.n :, : self.width], by_error)

    def _command(self) -> Array:
        """u = K (x, m) + G (what is seen - what is), and m likewise."""
        rows = self._rows(self.n + self.m)
        rows[:, : self.s + self.m] = np.vstack([self.asked.K, self.asked.N])
        for name, answer in self.asked.answers.items():
            rows += answer @ self._error(name, answer.shape[1])
        memory, is_asked = ("controller", ""), self.number % self.asked.every == 0
        self._keep(memory, rows[self.n :] if is_asked else self._kept(memory))
        return rows[: self.n]

    def _error(self, name: str, size: int) -> Array:
        """Of what is seen of one quantity, by components."""
        noise = self._rows(size)
        noise[:, self._errors[name]] = np.eye(size)
        channel = self.channels.get(name)
        if channel is None or not has_dynamics(channel):
            return noise
        true = self._rows(size)
        true[:, : self.s] = self.asked.along[name]
        seen = true + noise
        if channel.stride > 1:
            seen = self._keep((name, "held"), seen if self.number % channel.stride == 0 else self._kept((name, "held")))
        seen = self._late(name, seen, channel.delay)
        if channel.share < 1.0:
            before = self._kept((name, "filtered"))
            seen = self._keep((name, "filtered"), before + channel.share * (seen - before))
        return seen - true

    def _driven(self, command: Array) -> Array:
        """The mean torque of the control period."""
        drives = self.actuation
        if drives is None:
            return command
        command = self._late("torque", command, drives.delay)
        lagged = ("torque", "behind the lag")
        if lagged not in self._places:
            return command
        left = self._kept(lagged) - command
        self._keep(lagged, command + drives.decay[:, None] * left)
        return command + drives.mean[:, None] * left

    def _late(self, name: str, rows: Array, delay: int) -> Array:
        """As they were some control periods ago."""
        for k in range(1, delay + 1):
            rows, self._next[name, _ago(k)] = self._kept((name, _ago(k))), rows
        return rows

    def _rows(self, count: int) -> Array:
        return np.zeros((count, self._columns))

    def _kept(self, slot: tuple[str, str]) -> Array:
        return np.eye(self._columns)[self._places[slot]]

    def _keep(self, slot: tuple[str, str], rows: Array) -> Array:
        self._next[slot] = rows
        return rows


def _ago(periods: int) -> str:
    return f"{periods} control period{'s' if periods > 1 else ''} ago"
