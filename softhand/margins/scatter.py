"""Noise in, scatter out: what the instruments and drives of a scenario do to the pose of the object and to forces."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.linalg import solve_discrete_lyapunov

from softhand.assembly.instruments import not_linear
from softhand.margins.loop import Loop
from softhand.margins.place import Place
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record

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
        left_out: keys of what the loop has not: rounding, and rates of drives that are cut.
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

    P = A P A^T + Q with Q of the noise of one control period, through the derivative of torque and memory by an error
    of each component that is measured; where no two periods of a cycle are alike, the mean over the cycle.

    Args:
        loop: at the place, with outputs.
        place: where.
    """
    n = len(loop.inputs)
    inflow: dict[str, list[Array]] = {}  # torque and memory by unit noises, in each period
    channels = place.setup.sensing.channels if place.setup.sensing is not None else {}
    for name in loop.by_error:
        if np.any(channels[name].noise):
            inflow[name] = [turn.by_error[name] * channels[name].noise for turn in loop.turns]
    actuation = place.setup.actuation
    if actuation is not None and np.any(actuation.noise):
        inflow[DRIVES] = [np.vstack([np.diag(actuation.noise), np.zeros((len(loop.N), n))])] * len(loop.turns)
    if not inflow:
        return None
    pairs = len(loop.outputs) - n - 6
    missing = tuple(not_linear(place.setup.scenario))
    if np.max(np.abs(np.linalg.eigvals(loop.step))) >= 1.0 - 1e-9:
        position, turn, force, torque = (np.full(count, math.nan) for count in (3, 3, pairs, n))
        return Scatter(position, turn, force, torque, dict.fromkeys(inflow, (math.nan, math.nan, math.nan)), missing)
    parts = {}
    for name, by_noise in inflow.items():
        parts[name] = _variances(loop, by_noise)
    whole = np.sum(list(parts.values()), axis=0)
    sources = {name: _shares(part, whole, pairs) for name, part in parts.items()}
    position, turn, force, torque = np.split(np.sqrt(np.maximum(whole, 0.0)), [3, 6, 6 + pairs])
    return Scatter(position, turn, force, torque, sources, missing)


def _variances(loop: Loop, by_noise: list[Array]) -> Array:
    """Of position, turn, internal force and torque, the mean over a cycle.

    Args:
        loop: which is stable.
        by_noise: torque and memory by unit noises, in each period.
    """
    n = len(loop.inputs)
    ways = [np.vstack([loop.B @ one[:n], one[n:]]) for one in by_noise]
    Q = np.zeros_like(loop.step)
    for step, way in zip(loop.steps, ways, strict=True):
        Q = step @ Q @ step.T + way @ way.T
    P, found = solve_discrete_lyapunov(loop.step, Q), []
    for turn, step, way, one in zip(loop.turns, loop.steps, ways, by_noise, strict=True):
        torque = turn.K @ P @ turn.K.T + one[:n] @ one[:n].T
        found.append(np.concatenate([np.diag(loop.C @ P @ loop.C.T)[n:], np.diag(torque)]))
        P = step @ P @ step.T + way @ way.T
    return np.asarray(np.mean(found, axis=0))


def _shares(part: Array, whole: Array, pairs: int) -> tuple[float, float, float]:
    """Of a part in position, turn and internal force."""
    position, turn, force = (
        float(part[one].sum() / whole[one].sum()) if np.any(whole[one]) else 0.0
        for one in (slice(0, 3), slice(3, 6), slice(6, 6 + pairs))
    )
    return position, turn, force


def _listed(values: Array) -> str:
    return ", ".join(f"{value:.3g}" for value in values)
