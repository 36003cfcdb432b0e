"""What a grasp shall hold: gravity in any attitudes, wrenches, and balls of forces, moments and accelerations."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull

from softhand.errors import ScenarioError
from softhand.holding.held import Held
from softhand.numerics.arrays import Array, as_numbers
from softhand.numerics.spatial import rotation_of
from softhand.settings.guesses import did_you_mean

ANY = "any"
_FINE, _COARSE = 2, 1  # times that an icosahedron is divided: 162 and 42 corners
_MOST = 4000


class Loads(NamedTuple):
    """Loads, each a gravity of the hand and a wrench that the contacts must exert."""

    names: tuple[str, ...]
    wrenches: Array
    """On the object, about its centre of mass, in base axes [N, N m], shape (loads, 6)."""
    gravity: Array
    """That the hand feels, in base axes [m/s^2], shape (loads, 3)."""

    def some(self, which: Sequence[int]) -> Loads:
        """Those of these numbers."""
        return Loads(tuple(self.names[k] for k in which), self.wrenches[list(which)], self.gravity[list(which)])


def loads_of(
    held: Held,
    attitudes: str | Sequence[ArrayLike] | None = None,
    wrenches: Sequence[ArrayLike] = (),
    force: float = 0.0,
    moment: float = 0.0,
    acceleration: float = 0.0,
) -> Loads:
    """All combinations of what is asked for.

    A ball is stood for by a polytope around it: what holds these loads holds all of the ball, as the limits are convex.

    Args:
        held: the contacts.
        attitudes: roll, pitch, yaw of the hand [rad], one for each; "any"; None for gravity as it is.
        wrenches: from outside on the object, about its centre of mass, in base axes [N, N m].
        force: through the centre of mass, up to so large in any direction [N].
        moment: up to so large about any axis [N m].
        acceleration: of the hand, up to so large in any direction [m/s^2].

    Raises:
        ScenarioError: a load is none.
    """
    for name, value in (("force", force), ("moment", moment), ("acceleration", acceleration)):
        if not (isinstance(value, int | float) and np.isfinite(value) and value >= 0.0):
            raise ScenarioError(f"{name}: got {value!r}; give the radius of a ball, at least 0.", key=name, value=value)
    size = float(np.linalg.norm(held.gravity))
    is_any = _is_any(attitudes)
    balls = [acceleration + (size if is_any else 0.0), float(force), float(moment)]
    level = _FINE if sum(radius > 0.0 for radius in balls) == 1 and len(wrenches) <= 1 else _COARSE
    felt, pushes, turns = (radius * ball(level) if radius > 0.0 else np.zeros((1, 3)) for radius in balls)
    turned = [("any attitude", np.zeros(3))] if is_any else _turned(held.gravity, attitudes)
    outside = [("", np.zeros(6)), *_outside(wrenches)] if not len(wrenches) else _outside(wrenches)
    count = len(turned) * len(outside) * len(felt) * len(pushes) * len(turns)
    if count > _MOST:
        raise ScenarioError(
            f"loads: {count} of them, above {_MOST}; give fewer attitudes or wrenches, or fewer kinds of balls.",
            key="loads", value=count,
        )  # fmt: skip
    names, rows, gravities = [], [], []
    for (name, gravity), (push_name, push), a, f, m in product(turned, outside, felt, pushes, turns):
        parts = [name, push_name, *(_along(what, ways) for what, ways in (("force", f), ("moment", m)) if ways.any())]
        if a.any():
            parts.append(_along("gravity" if is_any else "acceleration", a))
        feels = gravity - a
        names.append(", ".join(part for part in parts if part))
        rows.append(-(push + np.concatenate([held.mass * feels + f, m])))
        gravities.append(feels)
    return Loads(tuple(names), np.array(rows), np.array(gravities))


@cache
def ball(level: int) -> Array:
    """Corners of a polytope that the unit ball just fits into: an icosahedron divided so often, shape (corners, 3)."""
    corners = directions(level)
    hull = ConvexHull(corners)
    found: Array = corners / np.min(-hull.equations[:, 3])
    found.flags.writeable = False
    return found


@cache
def directions(level: int) -> Array:
    """Unit vectors spread over a sphere, the corners of an icosahedron divided so often: 12, 42, 162."""
    g = (1.0 + 5.0**0.5) / 2.0
    points = np.array([[0.0, a, b * g] for a in (1.0, -1.0) for b in (1.0, -1.0)])
    points = np.vstack([points, points[:, [1, 2, 0]], points[:, [2, 0, 1]]])
    for _ in range(level):
        edges = {
            tuple(sorted(pair)) for s in ConvexHull(points).simplices for pair in zip(s, np.roll(s, 1), strict=True)
        }
        points = np.vstack([points, [points[i] + points[j] for i, j in sorted(edges)]])
        points /= np.linalg.norm(points, axis=1)[:, None]
    found: Array = points / np.linalg.norm(points, axis=1)[:, None]
    found.flags.writeable = False
    return found


def _is_any(attitudes: object) -> bool:
    if isinstance(attitudes, str) and attitudes != ANY:
        raise ScenarioError(
            f"attitudes: got {attitudes!r}; allowed are 'any' and lists of roll, pitch, yaw in rad"
            f"{did_you_mean(attitudes, [ANY])}",
            key="attitudes", value=attitudes,
        )  # fmt: skip
    return isinstance(attitudes, str)


def _turned(gravity: Array, attitudes: object) -> list[tuple[str, Array]]:
    """Gravity in the base of a hand that is turned so."""
    if attitudes is None:
        return [("gravity", gravity)]
    rows = as_numbers(attitudes)
    if rows is None or rows.ndim != 2 or rows.shape[1] != 3 or not len(rows) or not np.all(np.isfinite(rows)):
        raise ScenarioError(
            f"attitudes: got {attitudes!r}; give [roll, pitch, yaw] of the hand for each [rad], or 'any'.",
            key="attitudes", value=attitudes,
        )  # fmt: skip
    return [(f"attitude {_numbers(np.degrees(row))} deg", rotation_of(row).T @ gravity) for row in rows]


def _outside(wrenches: Sequence[ArrayLike]) -> list[tuple[str, Array]]:
    rows = as_numbers(wrenches) if len(wrenches) else np.zeros((0, 6))
    if rows is None or rows.ndim != 2 or rows.shape[1] != 6 or not np.all(np.isfinite(rows)):
        raise ScenarioError(
            f"wrenches: got {wrenches!r}; give six finite numbers for each, a force [N] and a moment [N m].",
            key="wrenches", value=wrenches,
        )  # fmt: skip
    return [(f"wrench {_numbers(row[:3])} N, {_numbers(row[3:])} N m", row) for row in rows]


def _along(what: str, vector: Array) -> str:
    return f"{what} along {_numbers(vector / np.linalg.norm(vector))}"


def _numbers(row: Array) -> str:
    return "(" + ", ".join(f"{value + 0.0:.3g}" for value in np.round(row, 3)) + ")"
