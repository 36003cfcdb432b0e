"""Ways from a state to rest: what holds it is let go, what is asked for is followed, and where that fails it gives way.

Each point of a way but the last part is at rest under what holds it there, so that neither inertia nor damping counts.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from softhand.errors import ControllerError
from softhand.numerics.arrays import Array
from softhand.resting.balance import Balance, Found, Point

_AT_REST = 1e-10
"""What may be left, of the forces."""
_ON_THE_WAY = 1e-6
"""The same between the ends."""
_ITERATIONS, _SLOW = 20, 0.2
_SHORTEST = 1e-4
"""Of a way, before something gives way."""
_MOST_TIMES = 12
"""That something may give way: at an edge that is scraped along, say, balance is lost again and again."""
_DEPENDENT = 1e-9
"""Of the largest squared frequency: what a motion must have to be stiff."""
_MOST_STEPS, _FIRST_TIME, _LEAST_TIME, _FARTHEST = 300, 1e-3, 1e-10, 0.1
"""Of giving way: steps, the time of the first and of the least [s^2], and how far the object goes before it is given
up [m]."""

Held = Callable[[float], Array]
"""What is held from outside at a share of the way, shape (size,)."""


@dataclass
class Travel:
    """A way as far as it went.

    Attributes:
        point: where it ended.
        share: of the way that was gone in balance, 1 for all of it.
        gave_way: how often something gave way, and went on from there by itself.
        stuck: the point at which it first gave way, or None.
        fell: whether there is no rest from there.
        fault: what ended the fingertip model, if that did.
    """

    point: Point
    share: float = 0.0
    gave_way: int = 0
    stuck: Point | None = None
    fell: bool = False
    fault: str = ""


def travel(balance: Balance, start: Point, held: Held, ask: Callable[[float], None], first: float) -> Travel:
    """Along a way.

    Args:
        balance: of hand and object.
        start: in balance at share 0.
        held: what holds joints and object from outside, by the share of the way.
        ask: sets what the controller is asked for, by the same.
        first: length of the first step, as a share.

    Raises:
        ControllerError: the controller fails, however short the step.
    """
    here, step = Travel(start), first
    while here.share < 1.0:
        step = min(step, 1.0 - here.share)
        share = 1.0 if here.share + step > 1.0 - 1e-12 else here.share + step
        ask(share)
        try:
            way, error = _solve(balance, here.point, held(share), is_last=share == 1.0), None
        except ControllerError as raised:  # a law that is asked too far ahead may give up
            way, error = None, raised
        if way is not None:
            here.point, here.share, step = balance.accept(here.point, way), share, 2.0 * step
            here.fault = balance.fault(here.point)
            if here.fault:
                here.fell, here.stuck = True, here.point
                return here
            continue
        step *= 0.5
        if step >= _SHORTEST:
            continue
        if error is not None:
            raise error
        if here.stuck is None:
            here.stuck = here.point
        if here.gave_way == _MOST_TIMES:
            here.fell, here.stuck = True, here.point
            return here
        here.gave_way += 1
        share = 1.0 if np.any(held(here.share)) else min(1.0, here.share + _SHORTEST)
        ask(share)
        here.point, rests, here.fault = _give_way(balance, here.point, held(share))
        if not rests:
            here.fell = True
            return here
        here.share, step = share, first
    return here


def _solve(balance: Balance, point: Point, held: Array, is_last: bool) -> Array | None:
    """The step from a point to where nothing but what is held is left, by Newton's method; None if there is none near.

    Steps are those of least kinetic energy: what needs no force stays.
    """
    way, K, near = np.zeros(balance.size), None, 1.0
    left, found = np.inf, balance.at(point, way)
    scale = balance.scale()
    enough = (_AT_REST if is_last else _ON_THE_WAY) * scale
    best, least = way, np.inf
    for _ in range(_ITERATIONS):
        excess = found.left - held
        now = balance.newtons(excess)
        if not np.isfinite(now):
            return None
        if now < least:
            best, least = way, now
        if now < enough and (not is_last or now > 0.5 * left or now < 1e-3 * enough):
            break
        if K is None or now > _SLOW * left:
            if now >= left and K is not None and now < enough:
                break
            K = balance.slope(point, way, near)
        left, step = now, _least(balance, K, excess)
        way, near = way - step, float(np.max(np.abs(step[: len(balance.mass)])))
        if balance.share_of_step(way) > 1.0:
            return None
        found = balance.at(point, way)
    return best if least < enough else None


def _least(balance: Balance, K: Array, excess: Array) -> Array:
    w = balance.weights
    step: Array = np.linalg.lstsq(K / np.outer(w, w), excess / w, rcond=_DEPENDENT)[0] / w
    return step


def _give_way(balance: Balance, start: Point, held: Array) -> tuple[Point, bool, str]:
    """From a point where nothing holds on: as in a bath that takes the speed, M way / time^2 = what is left.

    Returns:
        Where it ends, whether that is at rest, and what ended the fingertip model.
    """
    point, time = start, _FIRST_TIME
    begin = start.state.q[-7:-4].copy()
    for _ in range(_MOST_STEPS):
        found = balance.at(point, np.zeros(balance.size))
        excess = found.left - held
        if balance.newtons(excess) < 1e-4 * balance.scale():
            way = _solve(balance, point, held, is_last=True)
            if way is not None:
                return balance.accept(point, way), True, ""
        if np.linalg.norm(point.state.q[-7:-4] - begin) > _FARTHEST:
            break
        way, time = _slow_step(balance, point, found, held, time)
        if way is None:
            break
        point, time = balance.accept(point, way), 2.0 * time
        if fault := balance.fault(point):
            return point, False, fault
    return point, False, ""


def _slow_step(balance: Balance, point: Point, found: Found, held: Array, time: float) -> tuple[Array | None, float]:
    """An implicit step of M way / time = what is left, shortened until it exists; and its time [s^2]."""
    nv = len(balance.mass)
    K = balance.slope(point, np.zeros(balance.size))
    while time > _LEAST_TIME:
        drag = np.zeros_like(K)
        drag[:nv, :nv] = balance.mass / time
        both = drag - K
        way: Array = np.asarray(np.linalg.solve(both, found.left - held), dtype=np.float64)
        is_damped = np.linalg.eigvalsh(both[:nv, :nv] + both[:nv, :nv].T)[0] > 0.0
        if is_damped and balance.share_of_step(way) <= 1.0:
            after = balance.at(point, way)
            off = balance.newtons(after.left - held - drag @ way)
            if off < 0.1 * balance.newtons(found.left - held):
                return way, time
        time *= 0.5
    return None, time
