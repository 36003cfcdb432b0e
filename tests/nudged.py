"""Runs beside rest: how fast a small motion grows in them."""

from __future__ import annotations

import numpy as np

import softhand
from softhand.margins.loop import close_loop
from softhand.margins.place import find_place
from softhand.scenario.scenario import Scenario
from softhand.simulation.simulation import Simulation


def grown(scenario: Scenario, seconds: float) -> np.ndarray:
    """Velocities of a run that begins beside rest, nudged along the fastest growing mode, shape (periods, nv)."""
    loop = close_loop(find_place(scenario))
    values, vectors = np.linalg.eig(loop.step)
    shape = vectors[loop.moving : 2 * loop.moving, np.argmax(np.abs(values))].real
    simulation: Simulation = softhand.build(scenario)
    start = simulation.save()
    simulation.reset(softhand.State(start.q, start.v + 1e-7 * shape / np.linalg.norm(shape), start.z))
    found = np.empty((round(seconds / scenario.control_period), loop.moving))
    for k in range(len(found)):
        simulation.sample()
        simulation.step()
        found[k] = simulation.state.v
    return found


def rate_of(velocities: np.ndarray, period: float, begin: float) -> float:
    """Growth rate of the largest in windows of 50 ms, from a time [s] on."""
    count = round(0.05 / period)
    peaks = np.max(np.abs(velocities), axis=1)[round(begin / period) :]
    peaks = peaks[: len(peaks) // count * count].reshape(-1, count).max(axis=1)
    return float(np.polyfit(np.arange(len(peaks)) * count * period, np.log(peaks), 1)[0])
