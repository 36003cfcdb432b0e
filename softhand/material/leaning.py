"""A tip pressed at an angle from its apex, without friction or sticking, and then rolled: in three dimensions."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.errors import SofthandError
from softhand.material.half_ball import half_ball
from softhand.material.neo_hookean import NeoHookean
from softhand.material.solid import Solid
from softhand.numerics.arrays import Array

PENALTY = 3e3
"""Traction of the contact over how far the body goes through the plane, or is dragged along it, over G / r."""

_ROUNDS, _LET_GO = 40, 15  # from the second on, what comes off loses its anchor: it would touch in every other round
_CLOSE = 1e-6  # of the displacement, over the radius
_FARTHEST = 0.3  # likewise, what one round may move
_STICKING, _SMOOTH = 0.025, 0.05  # step of the depth, over the radius
_TURN = np.radians(2.5)


@dataclass(frozen=True)
class Leaning:
    """What a plane feels of a tip that leans on it; G = 1, r = 1.

    Attributes:
        lean: angle of the axis of the tip from the normal of the plane [rad].
        depth: R = 1 - depth is how far the plane is from the middle of the tip.
        normal: force on the plane, away from the tip.
        along: force on it towards the apex, in the direction of the lean.
        moment: about the foot of the perpendicular from its middle, that must act for it to lean so: above 0 it would
            rather stand upright.
    """

    lean: float
    depth: float
    normal: float
    along: float
    moment: float


class LeaningTip:
    """A bonded neo-Hookean hemisphere that touches nothing yet, in the frame of its flat face.

    Args:
        nu: Poisson's ratio, above 0.
        lean: at which it is going to be pressed [rad]; the apex leans towards -x of the plane.
        sticks: whether a point of it stays where it first touches; else the plane is smooth.
        level: of the mesh.
    """

    def __init__(self, nu: float, lean: float, sticks: bool, level: int = 0) -> None:
        self.solid, self.material, self.sticks = Solid(half_ball(level, _normal(lean))), NeoHookean(nu), sticks
        self.lean, self.depth, self.x = lean, 0.0, np.zeros(self.solid.body.size)
        self.origin = _normal(lean)  # of the plane
        self.anchors = np.full((2, self.solid.areas.size), np.nan)  # in the plane, of what touches
        self.through = np.full(self.solid.areas.size, -1.0)

    def press(self, depth: float) -> Leaning:
        """Along the normal, to a depth not below that of now."""
        steps = max(1, int(np.ceil((depth - self.depth) / (_STICKING if self.sticks else _SMOOTH) - 1e-9)))
        for now in np.linspace(self.depth, depth, steps + 1)[1:]:
            self.origin = self.origin - (now - self.depth) * _normal(self.lean)
            self.depth = float(now)
            found = self._balance()
        return found

    def roll(self, lean: float) -> Iterator[Leaning]:
        """The plane turns about the foot of the perpendicular, which moves on, to another lean at the same depth."""
        steps = max(1, int(np.ceil(abs(lean - self.lean) / _TURN - 1e-9)))
        turn, R = (lean - self.lean) / steps, 1.0 - self.depth
        c, s = np.cos(turn), np.sin(turn)
        turning = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
        for _ in range(steps):
            foot = R * _normal(self.lean + 0.5 * turn)
            self.lean += turn
            n = _normal(self.lean)
            origin = foot + turning @ (self.origin - foot)
            self.origin = origin + n * (R - n @ origin)
            yield self._balance()

    def _balance(self) -> Leaning:
        """Newton's method on the unknowns; then what newly touches sticks where it has met the plane on the way."""
        from scipy.sparse.linalg import splu

        solid, x, n = self.solid, self.x, _normal(self.lean)
        axes = (np.array([-n[2], 0.0, n[0]]), np.array([0.0, 1.0, 0.0]))
        before, weights = solid.positions(x), PENALTY * solid.areas
        down, across = _along(solid, n), [_along(solid, axis) for axis in axes]
        is_held = ~np.isnan(self.anchors[0])
        anchors = np.where(is_held, self.anchors, 0.0)
        for k in range(_ROUNDS):
            arm, state = solid.positions(x) - self.origin[:, None], solid.body.state(x)
            through = n @ arm
            slope = solid.body.slope(self.material, state) + down.T @ (weights * np.maximum(through, 0.0))
            tangent = solid.body.tangent(self.material, state) + _squared(down, weights * (through > 0.0))
            if k >= _LET_GO:
                is_held &= through > 0.0
            held = weights * (is_held & (through > 0.0))
            for axis, way, anchor in zip(axes, across, anchors, strict=True):
                slope += way.T @ (held * (axis @ arm - anchor))
                tangent = tangent + _squared(way, held)
            free = solid.free
            factors = splu(tangent[free][:, free].tocsc(), "MMD_AT_PLUS_A", 1e-3, options={"SymmetricMode": True})
            move = factors.solve(-slope[free])
            largest = float(np.max(np.abs(move)))
            if not np.isfinite(largest):
                break
            x[free] += move * min(1.0, _FARTHEST / max(largest, _FARTHEST))
            if largest < _CLOSE:
                return self._settle(before, is_held, axes)
        raise SofthandError(
            f"the finite elements find no balance at depth {self.depth:.3g} r, lean {np.degrees(self.lean):.3g} deg; "
            "try less depth."
        )

    def _settle(self, before: Array, is_held: NDArray[np.bool_], axes: tuple[Array, Array]) -> Leaning:
        """Forces on the plane, and the anchors of the next step."""
        solid, n = self.solid, _normal(self.lean)
        places = solid.positions(self.x)
        arm, weights = places - self.origin[:, None], PENALTY * solid.areas
        through = n @ arm
        touches = through > 0.0
        force = n[:, None] * (weights * np.maximum(through, 0.0))
        for axis, anchor in zip(axes, self.anchors, strict=True):
            force += axis[:, None] * np.where(is_held & touches, weights * (axis @ arm - anchor), 0.0)
        if self.sticks:
            share = np.where(self.through < 0.0, self.through / np.minimum(self.through - through, -1e-300), 1.0)
            met = before + (places - before) * np.clip(share, 0.0, 1.0) - self.origin[:, None]
            new = touches & ~is_held
            for axis, anchor in zip(axes, self.anchors, strict=True):
                anchor[new] = (axis @ met)[new]
            self.anchors[:, ~touches] = np.nan
        self.through = through
        turned = np.cross((places - (1.0 - self.depth) * n[:, None]).T, force.T).sum(axis=0)
        total = force.sum(axis=1)
        return Leaning(self.lean, self.depth, float(n @ total), float(axes[0] @ total), -float(turned[1]))


def _normal(lean: float) -> Array:
    """Of the plane, away from the tip."""
    return np.array([np.sin(lean), 0.0, np.cos(lean)])


def _along(solid: Solid, axis: Array) -> Any:
    """Displacement of the points along an axis, by the unknowns."""
    x, y, z = (part * way for part, way in zip(axis, solid.displacements, strict=True))
    return (x + y + z).tocsr()


def _squared(way: Any, weights: Array) -> Any:
    return way.T @ way.multiply(weights[:, None]).tocsr()
