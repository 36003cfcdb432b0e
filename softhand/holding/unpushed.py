"""A grasp before anybody pushes: where it rests under its controller, and that it holds there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.assembly.build import simulate
from softhand.batch.rollout import rollout
from softhand.batch.run import FINISHED
from softhand.closed_loop.start import HeldStart
from softhand.errors import GraspError
from softhand.holding.held import Held, held_there, look
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario

_PILOT = 2.0  # [s] without a push, after which the grasp is taken as at rest
_QUIET = 0.05  # [s] before a push
_RESTING = 0.01  # of the contact forces, within which the start is at rest
_SLIPS = 0.999


class Unpushed(NamedTuple):
    """A grasp at rest."""

    scenario: Scenario
    """Which stays there, without pushes of its own."""
    start: HeldStart
    held: Held
    quiet: float
    """When it rests [s]."""


def unpushed(scenario: Scenario) -> Unpushed:
    """A grasp where it rests: at its start, or where its controller has taken it within two seconds.

    Raises:
        GraspError: a fingertip does not press, or it slips or lifts off without any push.
    """
    stays = scenario.replace({"reference": {"kind": "hold"}, "push": [], "record": {}, "duration": _PILOT})
    start = look(scenario)
    _must_press(start)
    held = held_there(start)
    _must_hold(held)
    names = ("contact_force", "limit_surface_use", "is_slipping")
    runs = rollout(stays, [{}], variables=names, every=stays.control_period)
    if runs.outcomes[0].reason != FINISHED:
        raise GraspError(
            f"the start does not hold without any push: {runs.outcomes[0].message}", quantity="run",
            value=runs.outcomes[0].time,
        )  # fmt: skip
    force, last = runs.contact_force[0, :, :, :3], runs.contact_force[0, -1, :, :3]
    _must_stay(held, runs.time, force[:, :, 2], runs.limit_surface_use[0], runs.is_slipping[0])
    away = np.max(np.linalg.norm(force - last, axis=2), axis=1) > _RESTING * np.max(np.abs(last))
    if not away[0]:
        return Unpushed(stays, start, held, _QUIET)
    run = simulate(stays)
    start = look(run, float(run.time[-1]))
    return Unpushed(stays, start, held_there(start), max(float(run.time[np.flatnonzero(away)[-1]]), _QUIET))


def _must_press(start: HeldStart) -> None:
    observed = start.probe.at(start.state, start.time)
    apart = [name for name, row in zip(observed.tip_names, observed.contact_force, strict=True) if not row[2] > 0.0]
    if apart:
        raise GraspError(
            f"{', '.join(apart)}: not pressing on the object at the start, so that there is no grasp to push; set "
            "grasp.opening = 0 for a start that holds.",
            finger=apart[0], quantity="normal force", value=0.0,
        )  # fmt: skip


def _must_hold(held: Held) -> None:
    use = held.limit_use
    k = int(np.argmax(use))
    if use[k] >= 1.0:
        raise GraspError(
            f"{held.tips[k]} slips at the start without any push: it needs {use[k]:.3g} times its limit surface at "
            f"mu = {held.friction[k]:g}; mu = {np.ceil(1e3 * use[k] * held.friction[k]) / 1e3:g} would do, or a larger "
            "grasp.internal_force (softhand squeeze tells which).",
            finger=held.tips[k], quantity="limit surface", value=float(use[k]),
        )  # fmt: skip


def _must_stay(held: Held, time: Array, pressing: Array, use: Array, slipping: Array) -> None:
    lifts, slips = pressing <= 0.0, (use >= _SLIPS) | (slipping > 0)
    gone = np.flatnonzero(np.any(lifts | slips, axis=1))
    if len(gone):
        row = int(gone[0])
        tip = int(np.argmax((lifts | slips)[row]))
        how = "lifts off" if lifts[row, tip] else "slips"
        raise GraspError(
            f"{held.tips[tip]} {how} at t = {time[row]:g} s without any push, as the controller takes the grasp from "
            "its start; give it more friction or a larger grasp.internal_force, or another controller.",
            finger=held.tips[tip], quantity="limit surface", value=float(use[row, tip]),
        )  # fmt: skip
