"""The pieces of a log: which samples, which rows of residuals, which steps compute them anew."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.resolve import Setup
from softhand.calibration.log import Log
from softhand.calibration.parameters import DELAY, Parameter
from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.steppers.midpoint import Midpoint


class Piece(NamedTuple):
    """Some samples of a log that follow one another."""

    first: int
    size: int


class Layout:
    """The pieces of a log.

    Attributes:
        log: of which.
        pieces: of it.
        period: of the log [s].
        late: periods by which a measured sample may be late, and by which pieces overlap.
        names: of the quantities that are compared.
        channels: of each channel its quantity and component.
        rows: for each piece, of each quantity the places of its measured numbers, flat, and their channels.
        channel: for each piece the channel of each row of its residuals, shape (m,).
        stepper: of the scenario.
        steps: in a period.

    Args:
        log: checked against the hand.
        setup: of the scenario.
        parameters: that are fitted.
        length: of a piece [s].

    Raises:
        ScenarioError: the stepper is another than midpoint, or its step does not fit into the period of the log.
    """

    def __init__(self, log: Log, setup: Setup, parameters: Sequence[Parameter], length: float) -> None:
        self.log, self.period = log, log.period
        self.names = [name for name in log.measured if np.isfinite(log.measured[name]).any()]
        self.stepper, self.steps = _stepper_of(setup, self.period)
        self.late = self._latest(setup, parameters)
        count = max(round(length / self.period), 10) + self.late
        self.pieces = [Piece(first, count) for first in range(0, len(log) - count, count - self.late)]
        self.channels = [(name, k) for name in self.names for k in range(self._width(name))]
        self.rows = [self._rows_of(piece) for piece in self.pieces]
        self.channel = [np.concatenate([rows[1] for rows in every]) for every in self.rows]

    @property
    def handed_on(self) -> int:
        """Periods after which the next piece begins."""
        return self.pieces[0].size - self.late

    def time(self, k: int, periods: int = 0) -> float:
        """At which a piece begins, or so many periods later [s]."""
        return float(self.log.time[0] + (self.pieces[k].first + periods) * self.period)

    def times(self, k: int) -> Array:
        """Of each row of the residuals of a piece [s]."""
        found, first = [], self.pieces[k].first
        for name, (places, _) in zip(self.names, self.rows[k], strict=True):
            found.append(self.log.time[first + places // self._width(name)])
        return np.concatenate(found)

    def measured(self, k: int) -> dict[str, Array]:
        """In a piece."""
        piece = self.pieces[k]
        return {name: self.log.measured[name][piece.first : piece.first + piece.size] for name in self.names}

    def torques(self, k: int) -> Array:
        """Likewise."""
        piece = self.pieces[k]
        return self.log.joint_torque[piece.first : piece.first + piece.size]

    def _width(self, name: str) -> int:
        return 3 if name == "object_orientation" else self.log.measured[name].shape[1]

    def _latest(self, setup: Setup, parameters: Sequence[Parameter]) -> int:
        latest, section = 0.0, setup.scenario.sensing
        for name in self.names:
            one = getattr(section, name, None) if section is not None else None
            latest = max(latest, one.delay if one is not None else 0.0)
        latest = max([latest, *(one.upper for one in parameters if one.kind == DELAY)])
        return math.ceil(latest / self.period - 1e-9) + (1 if latest > 0.0 else 0)

    def _rows_of(self, piece: Piece) -> list[tuple[NDArray[np.int64], NDArray[np.int64]]]:
        """Of each quantity the places of its measured numbers in a piece, flat, and their channels."""
        rows, first = [], 0
        for name in self.names:
            values = self.log.measured[name][piece.first : piece.first + piece.size]
            there: NDArray[np.bool_] = np.asarray(np.isfinite(values))
            if name == "object_orientation":
                there = np.repeat(np.all(there, axis=1, keepdims=True), 3, axis=1)
            there = there.copy()
            there[: self.late] = False
            width = there.shape[1]
            places = np.flatnonzero(there)
            rows.append((places, first + places % width))
            first += width
        return rows


def _stepper_of(setup: Setup, period: float) -> tuple[Midpoint, int]:
    stepper = setup.stepper
    if not isinstance(stepper, Midpoint):
        raise ScenarioError(
            f"stepper.name: {setup.scenario.stepper.name!r}; a calibration computes the run anew with midpoint alone; "
            'take stepper.name = "midpoint".',
            key="stepper.name", value=setup.scenario.stepper.name,
        )  # fmt: skip
    steps = period / stepper.step
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-3 * steps:
        raise ScenarioError(
            f"stepper.step: {stepper.step:g} s does not fit into the {period:g} s between two samples of the log; take "
            f"stepper.step = {period / max(round(steps), 1):.6g}.",
            key="stepper.step", value=stepper.step,
        )  # fmt: skip
    return stepper, round(steps)
