"""The least and the largest squeeze with which a grasp holds a set of loads, and what limits it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from softhand.errors import GraspError, ScenarioError
from softhand.holding.held import Held, held_there, limit_use, look
from softhand.holding.loads import Loads, loads_of
from softhand.holding.program import Found, Program, Terms
from softhand.holding.record import Squeeze
from softhand.numerics.arrays import Array
from softhand.recording.recording import Recording
from softhand.scenario.scenario import Scenario

_ACTIVE = 1e-3  # of a limit, below which it counts as reached
_SETTLED = 1e-4  # of a lever
_ROUNDS = 8
_MOST_FRICTION = 10.0
_HALVINGS = 18
_ROUNDING = 1e-3
_FEW = 12  # loads


def squeeze(
    source: Scenario | Recording | str | Path,
    at: float | None = None,
    *,
    attitudes: str | Sequence[ArrayLike] | None = None,
    wrenches: Sequence[ArrayLike] = (),
    force: float = 0.0,
    moment: float = 0.0,
    acceleration: float = 0.0,
    margin: float = 0.2,
    friction: float | None = None,
    effort: float = 1.0,
    touch: float = 0.1,
    torsion: bool = True,
) -> Squeeze:
    """The least and the largest internal forces that hold a set of loads in the grasp of a scenario or a recording.

    The same internal forces hold all loads; of each load the contact forces are shared as (59) shares them, beside
    torsions that may be whatever the limits allow. See `holding.program` for the cone program. Combinations of all
    loads are held; balls are stood for by a polytope around them, at most 2 % larger for one ball, 7 % for several.
    The hand stays as it stands: contact points and normals are those of now, and the lever of torsion of each contact
    is that which goes with its least normal force.

    Args:
        source: a scenario whose start is held, its name or path, or a recording.
        at: time in the recording [s]; without it its quietest sample since the reference rests.
        attitudes: roll, pitch, yaw of hand and object together [rad], a row each; "any" for all; None for that of now.
        wrenches: from outside on the object, about its centre of mass, in base axes [N, N m], a row each.
        force: through the centre of mass, up to so large in any direction [N].
        moment: up to so large about any axis [N m].
        acceleration: of the hand, up to so large in any direction [m/s^2].
        margin: share of the limit surface that is left free, from 0 to below 1.
        friction: mu at all contacts in place of the scenario's.
        effort: share of the effort limits that may be used.
        touch: with which each tip presses at least [N].
        torsion: whether torsion may hold anything.

    Returns:
        The record; also where no squeeze holds, with `refusal` and how near a holding one is.

    Raises:
        GraspError: a fingertip does not press on the object.
        ScenarioError: a load or a number cannot be used.
        RecordingError: the recording is empty or does not reach to `at`, or its scenario cannot be read.
    """
    return squeeze_of(*_read(source, at, attitudes, wrenches, force, moment, acceleration, margin, friction, effort,
                             touch, torsion))  # fmt: skip


def _read(
    source: Scenario | Recording | str | Path, at: float | None, attitudes: str | Sequence[ArrayLike] | None,
    wrenches: Sequence[ArrayLike], force: float, moment: float, acceleration: float, margin: float,
    friction: float | None, effort: float, touch: float, torsion: bool,
) -> tuple[Held, Loads, Terms]:  # fmt: skip
    """Arguments of `squeeze`, checked."""
    for name, value, below in (("margin", margin, 1.0), ("friction", friction, 1e3), ("touch", touch, 1e3)):
        if value is not None and not 0.0 <= value < below:
            raise ScenarioError(
                f"{name}: got {value!r}; give a number from 0 to below {below:g}.", key=name, value=value
            )
    if not effort > 0.0:
        raise ScenarioError(f"effort: got {effort!r}; give a share above 0.", key="effort", value=effort)
    held = held_there(look(source, at))
    loads = loads_of(held, attitudes, wrenches, force, moment, acceleration)
    terms = Terms(use=1.0 - margin, effort=effort, touch=touch, torsion=torsion)
    return held if friction is None else held.with_friction(friction), loads, terms


def squeeze_of(held: Held, loads: Loads, terms: Terms) -> Squeeze:
    """The same of contacts and loads that are known."""
    asked = held, loads, terms
    held, program, least = _settled(held, loads, terms)
    largest = None if least is None else program.largest()
    count, pairs, nc = len(loads.names), held.basis.shape[1], len(held.friction)
    forces = np.full((count, nc, 4), np.nan)
    torque = np.full((count, len(held.joints)), np.nan)
    if least is not None:
        forces[:, :, :3], forces[:, :, 3] = least.force.reshape(count, nc, 3), least.torsion
        torque = least.joint_torque
    (load_factor, binding), least_effort = program.load_factor(), program.effort_factor() * terms.effort
    if least is not None:
        load_factor, least_effort = max(load_factor, 1.0), min(least_effort, terms.effort)
    least_friction = _least_friction(held, loads, terms, binding)
    worst = loads.names[binding[0] if binding else 0]
    refusal = None if least is not None else _refusal(held, worst, terms, load_factor, least_friction, least_effort)
    none = np.full(pairs, np.nan)
    return Squeeze(
        holds=least is not None,
        least=none if least is None else least.internal_force,
        largest=none if least is None else np.full(pairs, np.inf) if largest is None else largest.internal_force,
        present=held.internal_force,
        loads=loads.names,
        wrenches=loads.wrenches,
        contacts=held.tips,
        joints=held.joints,
        contact_force=forces,
        limit_surface_use=np.full((count, nc), np.nan)
        if least is None
        else limit_use(held, least.force, least.torsion),
        joint_torque=torque,
        active=_active(held, loads, terms, least),
        active_largest=_active(held, loads, terms, largest),
        load_factor=load_factor,
        least_friction=least_friction,
        least_effort=least_effort,
        margin=1.0 - terms.use,
        friction=held.friction,
        levers=held.lever,
        refusal=refusal,
        asked=asked,
    )


def _settled(held: Held, loads: Loads, terms: Terms) -> tuple[Held, Program, Found | None]:
    """Levers that go with the least normal force of each contact under the squeeze that is found with them."""
    program = Program(held, loads, terms)
    least = program.least()
    for _ in range(_ROUNDS if terms.torsion else 0):
        if least is None:
            break
        now = held.pressed(least.force[:, 2::3].min(axis=0))
        if np.all(np.abs(now.lever - held.lever) <= _SETTLED * held.lever):
            break
        held, program = now, Program(now, loads, terms)
        least = program.least()
    return held, program, least


def _least_friction(held: Held, loads: Loads, terms: Terms, binding: list[int]) -> float:
    """By halving, with the loads that limit most, until those that they leave out are held as well.

    What holds with some mu holds with more.
    """
    few = len(loads.names) <= _FEW
    chosen = set(range(len(loads.names)) if few else binding[:_FEW] or [0])
    while True:
        some, low, high = loads.some(sorted(chosen)), 0.0, _MOST_FRICTION

        def holds(mu: float, some: Loads = some) -> bool:
            return Program(held.with_friction(mu), some, terms).least() is not None

        if not holds(high):
            return float("inf")
        high = 1.0 if holds(1.0) else high
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            low, high = (low, middle) if holds(middle) else (middle, high)
        if len(chosen) == len(loads.names) or holds(high, loads):
            return high
        more = Program(held.with_friction(high), loads, terms).load_factor()[1]
        before = len(chosen)
        chosen |= set(more)
        if len(chosen) == before:  # at the limit, where the halving ends
            high *= 1.0 + _ROUNDING
            return high if holds(high, loads) else float("nan")


def _refusal(held: Held, load: str, terms: Terms, factor: float, friction: float, effort: float) -> GraspError:
    """What is too much, and what would do."""
    mu = f"{held.friction[0]:g}" if np.ptp(held.friction) == 0.0 else ", ".join(f"{one:g}" for one in held.friction)
    found = f"no squeeze of {', '.join(held.tips)} holds: {load}"
    if terms.use < 1.0:
        found += f", with a margin of {1.0 - terms.use:.3g}"
    near = []
    if factor > 1e-6:
        near.append(f"{_floor(factor)} times the load is held")
    if np.isfinite(friction):
        near.append(f"friction {_ceiling(friction)} at all contacts would do (it is {mu})")
    if np.isfinite(effort) and effort > terms.effort:
        near.append(f"effort limits {_ceiling(effort)} times these would do")
    if not near:
        near.append("no friction, no effort and no part of the load would do: the contacts do not oppose each other "
                    "about it; move the contact points or add a finger")  # fmt: skip
    return GraspError(f"{found}; {'; '.join(near)}.", finger="", quantity="squeeze", value=factor)


def _active(held: Held, loads: Loads, terms: Terms, found: Found | None) -> tuple[tuple[str, str, float], ...]:
    """Limits that are reached."""
    if found is None:
        return ()
    use = limit_use(held, found.force, found.torsion) if terms.torsion else _friction_use(held, found.force)
    normal, share = found.force[:, 2::3], np.abs(found.joint_torque) / held.effort
    reached = []
    for k, load in enumerate(loads.names):
        for i, tip in enumerate(held.tips):
            if use[k, i] >= terms.use * (1.0 - _ACTIVE) - 1e-6 and held.friction[i] > 0.0:
                reached.append((load, f"limit surface of {tip}", float(use[k, i])))
            if terms.touch > 0.0 and normal[k, i] <= terms.touch * (1.0 + _ACTIVE):
                reached.append((load, f"touch of {tip}", float(normal[k, i] / terms.touch)))
        for j, joint in enumerate(held.joints):
            if share[k, j] >= terms.effort * (1.0 - _ACTIVE):
                reached.append((load, f"effort of {joint}", float(share[k, j])))
    return tuple(reached)


def _friction_use(held: Held, force: Array) -> Array:
    return limit_use(held, force, np.zeros((len(force), len(held.friction))))


def _floor(value: float) -> str:
    return f"{np.floor(1e3 * value) / 1e3:g}"


def _ceiling(value: float) -> str:
    return f"{np.ceil(1e3 * value) / 1e3:g}"
