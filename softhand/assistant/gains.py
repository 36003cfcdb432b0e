"""Gains of `regulation` under which small motions of a grasp die out, for a hand and an object of any weight."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from softhand.controllers.regulation import Regulation
from softhand.design.effective import Effective, effective
from softhand.errors import SofthandError
from softhand.margins.loop import close_loop
from softhand.margins.place import Place, find_place
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario

PERIODS = 1e-3, 5e-4, 2.5e-4
"""Control periods that are tried [s]."""

_BANDWIDTH = 2.0  # [Hz] of the pose
_POSTURE = 1.0  # [Hz] of idle joints
_RATIO = 0.5  # damping ratio
_FORCES = 1.0, 0.5, 0.2, 0.0  # K_N
_DAMPINGS = 1.0, 3.0, 10.0, 0.3  # over the first guess
_GROWS = 0.02  # [1/s] below which a motion counts as one that stays


class Gains(NamedTuple):
    """Gains that were found."""

    period: float
    """[s]"""
    settings: tuple[tuple[str, Any, str], ...]
    """Name, value and reason of each."""
    growth: float
    """Of the fastest growing small motion [1/s]."""


def find_gains(scenario: Scenario, can_move: bool, progress: Callable[[float], None]) -> Gains:
    """The first of a list of gains under which no small motion grows, or those under which the fastest grows least.

    The pose gets a stiffness K = omega^2 M with M the object and the fingers as one mass, the joints a damping in
    proportion to what moves with each, and joints that no contact force needs a weak spring to their start. What is
    tried is less feedback of the internal force, more and less damping, and shorter control periods.

    Args:
        scenario: with its grasp; its gains are not used.
        can_move: whether the motors can move the object at all; else its pose gets no stiffness.
        progress: called with the share done.

    Raises:
        SofthandError: as `find_place`.
    """
    best: Gains | None = None
    total = len(PERIODS) * len(_FORCES) * len(_DAMPINGS)
    tried = 0
    for period in PERIODS:
        place = find_place(scenario.with_values({"control_period": period, "stepper.step": period}))
        for settings in _choices(place, can_move):
            tried += 1
            progress(tried / total)
            controller = Regulation(**{name: value for name, value, _ in settings})
            try:
                growth = close_loop(place.with_controller(controller)).growth
            except SofthandError:
                continue
            if best is None or growth < best.growth - _GROWS:
                best = Gains(period, settings, growth)
            if growth < _GROWS:
                return Gains(period, settings, growth)
    if best is None:
        raise SofthandError("no linear loop about the start.")
    return best


def _choices(place: Place, can_move: bool) -> Iterator[tuple[tuple[str, Any, str], ...]]:
    """Gains to try at a control period, those that are liked best first."""
    felt = effective(place)
    M = np.diag(place.plant.rigid.mass_matrix(place.state.q)).copy()
    n = place.plant.world.n_joints
    omega = 2.0 * math.pi * _BANDWIDTH
    stiffness = omega**2 * np.diag(felt.inertia) if can_move else np.zeros(6)
    posture = (2.0 * math.pi * _POSTURE) ** 2 * M[:n]
    for force in _FORCES:
        for factor in _DAMPINGS:
            damping = factor * _damping(felt, M[:n], omega, can_move)
            yield (
                ("torsion_compensation", True, "the torsion of the tips is compensated"),
                ("K_O_position", _each(stiffness[:3]), f"[N/m], {_BANDWIDTH:g} Hz with all that moves with the object"),
                ("K_O_orientation", _each(stiffness[3:]), "[N m/rad], likewise"),
                ("K_v", _each(damping), "[N m s/rad or N s/m], damping of each joint or motor"),
                ("K_N", force, "[-], feedback of the internal force; with more small motions may grow"),
                (
                    "K_posture",
                    _each(posture),
                    "[N m/rad or N/m], joints that the grasp does not need stay at the start",
                ),
            )


def _damping(felt: Effective, M: Array, omega: float, can_move: bool) -> Array:
    """2 zeta omega of the inertia that each joint moves, and of the object where it goes with the joint."""
    rate = 2.0 * _RATIO * omega
    carried = np.zeros(len(M))
    if can_move:
        sizes = np.sum(felt.follow**2 * (1.0 / np.maximum(np.diag(felt.inertia), 1e-12)), axis=1)
        moved = sizes > 1e-9 * max(float(np.max(sizes)), 1e-12)
        carried[moved] = 1.0 / sizes[moved] / max(int(np.count_nonzero(moved)) / 6.0, 1.0)
    return np.asarray(rate * np.minimum(M + carried, 30.0 * np.maximum(M, 1e-6)) + rate * M)


def _each(values: Array) -> Any:
    """One number where all are about the same, else a list, to three digits."""
    rounded = [float(f"{value:.3g}") for value in values]
    if max(rounded) <= 1.5 * min(rounded):
        return float(f"{np.exp(np.mean(np.log(values))):.3g}") if min(rounded) > 0.0 else 0.0
    return rounded
