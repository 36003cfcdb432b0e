"""Noise in, scatter out: what the instruments and drives of a scenario do to the pose of the object and to forces."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from softhand.assembly.instruments import left_out
from softhand.assembly.parts import read_start
from softhand.assembly.probe import Probe
from softhand.closed_loop.feedback import numbers_of
from softhand.margins.loop import Loop
from softhand.margins.place import Place
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.references.reference import resting
from softhand.sensing.quantities import Channel, Sensing

_STEP = 1e-6  # of an error of any component, in SI units
DRIVES = "actuation"


@dataclass(frozen=True, eq=False)
class Scatter(Record):
    """Standard deviations that noise leaves in a loop which has run for long, to first order.

    Attributes:
        position: of the object along x, y, z of the world [m], shape (3,).
        turn: of the object about x, y, z of the world [rad], shape (3,).
        internal_force: between each pair of contacts [N], shape (np,).
        torque: of each joint, that of the drives in it [N m, N], shape (n,).
        sources: share of the variance of position, turn and internal force, each summed, by the quantity that is
            measured with noise, or `actuation`; they add up to 1.
        left_out: keys of what the loop has not: delays, holds, filters, rounding and lags of instruments and drives.
    """

    units: ClassVar = {"position": "m", "turn": "rad", "internal_force": "N", "torque": "N m, N", "sources": "1"}

    position: Array
    turn: Array
    internal_force: Array
    torque: Array
    sources: dict[str, tuple[float, float, float]]
    left_out: tuple[str, ...]

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of each line of the table."""
        if np.isnan(self.position).any():
            return [("scatter by noise", "without bound: some motion does not die out")]
        force = np.max(self.internal_force, initial=0.0)
        rows = [
            ("scatter of the object", f"{_listed(1e6 * self.position)} um along x, y, z"),
            ("scatter of its attitude", f"{_listed(np.degrees(self.turn))} deg about x, y, z"),
            ("scatter of the internal force, of the torques", f"{force:.2g} N, {np.max(self.torque):.2g} N m at most"),
        ]
        for name, shares in self.sources.items():
            words = zip(shares, ("position", "attitude", "internal force"), strict=True)
            rows.append((f"share of {name}", ", ".join(f"{100.0 * one:.0f} % of the {what}" for one, what in words)))
        return rows


def find_scatter(loop: Loop, place: Place) -> Scatter | None:
    """What the noise of a scenario does; None where it has none.

    P = A P A^T + Q with Q of the noise of one control period, through the derivative of command and memory by an error
    of each component that is measured. The noise is taken as white from one control period to the next.

    Args:
        loop: at the place, with outputs.
        place: where.
    """
    n, size = len(loop.inputs), len(loop.step)
    drive = np.vstack([loop.B, np.zeros((size - len(loop.A), n))])
    inflow: dict[str, tuple[Array, Array]] = {}  # state a period on and command by unit noises
    for name, noise, answer in _answers(loop, place):
        command, memory = answer[:n] * noise, answer[n:] * noise
        inflow[name] = np.vstack([loop.B @ command, memory]), command
    actuation = place.setup.actuation
    if actuation is not None and np.any(actuation.noise):
        inflow[DRIVES] = drive * actuation.noise, np.diag(actuation.noise)
    if not inflow:
        return None
    pairs = len(loop.outputs) - n - 6
    missing = tuple(left_out(place.setup.scenario))
    if np.max(np.abs(np.linalg.eigvals(loop.step))) >= 1.0 - 1e-9:
        position, turn, force, torque = (np.full(count, math.nan) for count in (3, 3, pairs, n))
        return Scatter(position, turn, force, torque, dict.fromkeys(inflow, (math.nan, math.nan, math.nan)), missing)
    parts = {}
    for name, (by_noise, command) in inflow.items():
        P = solve_discrete_lyapunov(loop.step, by_noise @ by_noise.T)
        seen, torque = loop.C @ P @ loop.C.T, loop.K @ P @ loop.K.T + command @ command.T
        parts[name] = np.concatenate([np.diag(seen)[n:], np.diag(torque)])
    whole = np.sum(list(parts.values()), axis=0)
    sources = {name: _shares(part, whole, pairs) for name, part in parts.items()}
    position, turn, force, torque = np.split(np.sqrt(np.maximum(whole, 0.0)), [3, 6, 6 + pairs])
    return Scatter(position, turn, force, torque, sources, missing)


def _shares(part: Array, whole: Array, pairs: int) -> tuple[float, float, float]:
    """Of a part in position, turn and internal force."""
    position, turn, force = (
        float(part[one].sum() / whole[one].sum()) if np.any(whole[one]) else 0.0
        for one in (slice(0, 3), slice(3, 6), slice(6, 6 + pairs))
    )
    return position, turn, force


def _answers(loop: Loop, place: Place) -> Iterator[tuple[str, Array, Array]]:
    """Name, standard deviations, and command and memory by an error of each component, of each quantity with noise."""
    sensing = place.setup.sensing
    if sensing is None or not any(np.any(one.noise) for one in sensing.channels.values()):
        return
    situation = place.situation()
    state, n = situation.state, len(loop.inputs)
    kept = [int(name.rpartition(" ")[2]) - 1 for name in loop.states[len(loop.A) :]]  # as `linearize` names them
    setup = situation.setup
    motion = resting(place.goal) if place.goal else setup.reference.start(read_start(setup.asked))

    def answer(name: str, bias: Array) -> Array:
        channels = {key: Channel(0.0 * one.noise, one.bias) for key, one in sensing.channels.items()}
        channels[name] = Channel(0.0 * bias, bias)
        seen = Probe(situation.plant, motion, Sensing(channels)).seen(state, state.time)
        torque, memory = setup.controller.torque(seen, situation.memory)
        numbers: Any = np.concatenate([[], *numbers_of(memory)])
        return np.concatenate([np.asarray(torque, dtype=float), numbers[kept]])

    free = np.any(loop.K != 0.0, axis=1)  # of effort limits
    for name, channel in sensing.channels.items():
        if not np.any(channel.noise):
            continue
        steps = _STEP * np.eye(len(channel.bias))
        columns = [(answer(name, channel.bias + one) - answer(name, channel.bias - one)) / (2 * _STEP) for one in steps]
        found = np.column_stack(columns)
        found[:n] *= free[:, None]
        yield name, channel.noise, found


def _listed(values: Array) -> str:
    return ", ".join(f"{value:.3g}" for value in values)
