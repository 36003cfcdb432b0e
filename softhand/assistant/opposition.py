"""Fingertips on two opposite faces of a box that is yet to be made: postures of the hand that let them oppose.

The box is a slab between two planes with normals u and -u. Tips of side A lie on the plane u . x = a, those of side B
on u . x = b < a, each with its ball pressed in a little. Motors, u, a and b are found together, by the method of
Levenberg and Marquardt on what is missed; so joints that are coupled, and fingers that share a motor, need nothing
else.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softhand.assistant.fingers import Fingers, TipOnBody, Tips
from softhand.numerics.arrays import Array

PRESSED = 1e-3
"""How deep a tip is taken to be pressed in [m]."""
LEANING = np.cos(np.radians(72.0))
"""Least cosine between the way out of a tip and the way into the face: it touches before its rim."""

_PLANE = 1e-4  # [m] off its plane that counts as one
_BESIDE = 1e-3, 5e-3  # [m] of the middles of both sides beside each other: of two tips, of more
_CLOSE = 3e-3  # [m] nearer than two tips of a side may be
_LEAN = 0.1  # cosine
_RANGE = 0.1  # weight of a motor at its limit
_SIZE = 5e-3  # [m] beyond the bounds of the width
_ITERATIONS = 60
_REACHED = 2e-5  # [m]


@dataclass(frozen=True)
class Sides:
    """Which tips press on which side.

    Attributes:
        fingers: indices of the tips, those of side A first.
        count: of side A.
    """

    fingers: tuple[int, ...]
    count: int

    @property
    def signs(self) -> Array:
        """+1 on side A, -1 on side B, shape (tips,)."""
        return np.where(np.arange(len(self.fingers)) < self.count, 1.0, -1.0)


@dataclass(frozen=True, eq=False)
class Opposition:
    """Tips on two faces of a slab, as near to it as they get.

    Attributes:
        sides: which tips.
        motors: of the whole hand [rad or m], shape (n,).
        normal: u, shape (3,).
        planes: a and b [m].
        tips: where they are.
        missed: by how much each is off its plane [m], shape (tips,).
        cost: half the sum of the squares.
    """

    sides: Sides
    motors: Array
    normal: Array
    planes: tuple[float, float]
    tips: Tips
    missed: Array
    cost: float

    @property
    def width(self) -> float:
        """Of the slab [m]."""
        return self.planes[0] - self.planes[1]

    @property
    def leaning(self) -> Array:
        """Cosine between the way out of each tip and the way into its face, shape (tips,)."""
        return np.asarray(-self.sides.signs * (self.tips.out @ self.normal))

    def overhang(self, tips: Sequence[TipOnBody]) -> float:
        """How far some link reaches into the box beside its pressed ball, where the faces go on and on [m].

        Args:
            tips: those that touch.
        """
        into = -self.sides.signs[:, None] * self.normal
        return max(
            tip.overhang(axes.T @ way) + PRESSED for tip, axes, way in zip(tips, self.tips.axes, into, strict=True)
        )

    @property
    def beside(self) -> float:
        """How far the middles of both sides are beside each other [m]."""
        return float(np.linalg.norm(_beside(self.tips.centres, self.sides, self.normal)))

    def is_found(self, widths: tuple[float, float]) -> bool:
        """Whether each tip touches its face well, and both sides oppose each other."""
        return bool(
            np.max(np.abs(self.missed)) < _REACHED
            and np.min(self.leaning) > LEANING
            and widths[0] - 1e-3 < self.width < widths[1] + 1e-3
            and self.beside < self.lever
        )

    @property
    def lever(self) -> float:
        """How far both sides may be beside each other for forces within friction to oppose [m]."""
        return (0.15 if len(self.sides.fingers) == 2 else 0.3) * self.width


class Opposing:
    """Finds oppositions of a hand."""

    def __init__(self, fingers: Fingers, tips: Sequence[TipOnBody], widths: tuple[float, float]) -> None:
        """With all tips of the hand, and the least and greatest width of the object [m]."""
        self._fingers, self._tips, self.widths = fingers, tips, widths

    def find(
        self, sides: Sides, motors: Array, normal: Array, frozen: np.ndarray | None = None, pressed: Array | None = None
    ) -> Opposition:
        """The opposition that is found from a posture.

        Args:
            sides: which tips.
            motors: where the search starts [rad or m], shape (n,).
            normal: u there.
            frozen: motors that stay where they are, shape (n,).
            pressed: how deep each tip is pressed in [m], shape (tips,); `PRESSED` if None.
        """
        used = [self._tips[i] for i in sides.fingers]
        moving = np.any([self._fingers.movers(tip.joint) for tip in used], axis=0)
        if frozen is not None:
            moving &= ~frozen
        free = np.flatnonzero(moving)
        reach = np.array([tip.radius for tip in used]) - (PRESSED if pressed is None else pressed)
        state = _State(motors.copy(), normal / np.linalg.norm(normal), 0.0, 0.0)
        tips = self._fingers.at(state.motors, used)
        heights = tips.centres @ state.normal - sides.signs * reach
        state = state._with(a=float(heights[: sides.count].mean()), b=float(heights[sides.count :].mean()))
        damping = 1e-3
        r, J = self._errors(sides, used, reach, state, free)
        cost = 0.5 * float(r @ r)
        for _ in range(_ITERATIONS):
            H, g = J.T @ J, J.T @ r
            scale = np.diag(H) + 1e-9 * np.trace(H) / len(H)
            step = np.linalg.solve(H + damping * np.diag(scale), -g)
            longest = float(
                np.max(np.abs(step[: len(free)]) / (self._fingers.upper - self._fingers.lower)[free], initial=0.0)
            )
            step *= min(1.0, 0.3 / max(longest, 1e-12))
            ahead = self._stepped(state, step, free)
            r_new, J_new = self._errors(sides, used, reach, ahead, free)
            new = 0.5 * float(r_new @ r_new)
            if new < cost:
                done = cost - new < 1e-7 * cost
                state, r, J, cost, damping = ahead, r_new, J_new, new, max(0.3 * damping, 1e-9)
                if done:
                    break
            else:
                damping *= 8.0
                if damping > 1e8:
                    break
        tips = self._fingers.at(state.motors, used)
        missed = r[: len(used)] * _PLANE
        return Opposition(sides, state.motors, state.normal, (state.a, state.b), tips, missed, cost)

    def _stepped(self, state: _State, step: Array, free: np.ndarray) -> _State:
        motors = state.motors.copy()
        motors[free] = np.clip(motors[free] + step[: len(free)], self._fingers.low[free], self._fingers.high[free])
        turn = step[len(free) : len(free) + 3]
        normal = state.normal + np.cross(turn, state.normal)
        return _State(motors, normal / np.linalg.norm(normal), state.a + step[-2], state.b + step[-1])

    def _errors(
        self, sides: Sides, used: Sequence[TipOnBody], reach: Array, state: _State, free: np.ndarray
    ) -> tuple[Array, Array]:
        """What is missed, each in its own measure, and its slopes by motors, turn of u, a and b."""
        fingers, signs, count = self._fingers, sides.signs, sides.count
        tips = fingers.at(state.motors, used)
        C, X, u, m = tips.centres, tips.out, state.normal, len(free)
        of_C, of_X = tips.centre_slopes[:, :, free], tips.out_slopes[:, :, free]
        n = m + 5
        turn = -np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])  # du by a small rotation
        rows: list[float] = []
        slopes: list[Array] = []

        def add(value: float, slope: Array, unit: float) -> None:
            rows.append(value / unit)
            slopes.append(slope / unit)

        for i in range(len(used)):  # off its plane
            slope = np.zeros(n)
            slope[:m], slope[m : m + 3] = u @ of_C[i], C[i] @ turn
            slope[m + 3 + (i >= count)] = -1.0
            plane = state.a if i < count else state.b
            add(float(u @ C[i] - signs[i] * reach[i] - plane), slope, _PLANE)
        for i in range(len(used)):  # leaning too far, and a little at all
            slope = np.zeros(n)
            slope[:m], slope[m : m + 3] = -signs[i] * (u @ of_X[i]), -signs[i] * (X[i] @ turn)
            lean = float(-signs[i] * (X[i] @ u))
            if lean < LEANING + 0.05:
                add(LEANING + 0.05 - lean, -slope, 0.1 * _LEAN)
            add(1.0 - lean, -slope, 20.0 * _LEAN)
        across = np.eye(3) - np.outer(u, u)  # the middles of both sides, beside each other
        weights = np.where(signs > 0.0, 1.0 / count, -1.0 / (len(used) - count))
        gap = weights @ C
        of_gap = np.zeros((3, n))
        of_gap[:, :m] = across @ np.einsum("i,ijk->jk", weights, of_C)
        of_gap[:, m : m + 3] = -(np.outer(u, gap) + (u @ gap) * np.eye(3)) @ turn
        for value, slope in zip(across @ gap, of_gap, strict=True):
            add(float(value), slope, _BESIDE[len(used) > 2])
        for i in range(len(used)):  # tips of one side too close
            for j in range(i + 1, len(used)):
                if (i < count) != (j < count):
                    continue
                way = C[i] - C[j]
                distance, least = float(np.linalg.norm(way)), reach[i] + reach[j] + 2.0 * _CLOSE + 2.0 * PRESSED
                if 1e-9 < distance < least:
                    slope = np.zeros(n)
                    slope[:m] = -(way / distance) @ (of_C[i] - of_C[j])
                    add(least - distance, slope, _CLOSE)
        width = state.a - state.b
        for off, sign in ((self.widths[0] - width, -1.0), (width - self.widths[1], 1.0)):
            if off > 0.0:
                slope = np.zeros(n)
                slope[m + 3], slope[m + 4] = sign, -sign
                add(off, slope, 0.1 * _SIZE)
        half = 0.5 * (fingers.upper - fingers.lower)[free]
        middle = 0.5 * (fingers.upper + fingers.lower)[free]
        rows.extend(_RANGE * (state.motors[free] - middle) / half)
        slopes.extend(np.hstack([np.diag(_RANGE / half), np.zeros((m, 5))]))
        return np.array(rows), np.array(slopes)


@dataclass(frozen=True, eq=False)
class _State:
    motors: Array
    normal: Array
    a: float
    b: float

    def _with(self, a: float, b: float) -> _State:
        return _State(self.motors, self.normal, a, b)


def _beside(centres: Array, sides: Sides, normal: Array) -> Array:
    gap = centres[: sides.count].mean(axis=0) - centres[sides.count :].mean(axis=0)
    return np.asarray(gap - (gap @ normal) * normal)
