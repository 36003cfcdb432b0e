"""A bonded body pressed against a plane without friction, from the state before: large strain, contact by a penalty."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.errors import SofthandError
from softhand.material.neo_hookean import NeoHookean
from softhand.material.section import Section
from softhand.numerics.arrays import Array

PENALTY = 1e4
"""Pressure of the contact over how far the body goes through the plane, over G / r."""

_ROUNDS = 40
_STEP = 0.05  # of the depth, over the radius
_CLOSE = 1e-8  # of the displacement, over the radius


@dataclass(frozen=True)
class Pressed:
    """A body pressed by `depth`; G = 1, lengths as those of the mesh.

    Attributes:
        depth: of the plane below the top of the undeformed body.
        force: of the plane.
        state: rows of F - 1 and p at the points, as `Body.state` gives it.
        touching: which points of the edge touch.
        outward: their distance from the axis, deformed.
        pressure: force on each point of the edge.
    """

    depth: float
    force: float
    state: Array
    touching: NDArray[np.bool_]
    outward: Array
    pressure: Array

    @property
    def radius(self) -> float:
        """Of the contact."""
        return float(self.outward[self.touching].max(initial=0.0))


def press(section: Section, nu: float, depths: Array) -> Iterator[Pressed]:
    """The body at each depth in turn; these grow.

    Raises:
        SofthandError: no balance is found.
    """
    material, body = NeoHookean(nu), section.body("press")
    upward, places, areas = section.edge("press", "Z")
    across = section.edge("press", "R")[0]
    x, before = np.zeros(body.size), 0.0
    for depth in depths:
        steps = max(1, int(np.ceil((depth - before) / _STEP - 1e-9)))
        for middle in np.linspace(before, depth, steps + 1)[1:]:
            _balance(section, material, x, middle)
        before = depth
        through = upward @ x + places[1] - (section.height - depth)
        pressure = PENALTY * areas * np.maximum(through, 0.0)
        yield Pressed(
            float(depth), float(pressure.sum()), body.state(x), through > 0.0, across @ x + places[0], pressure
        )


def _balance(section: Section, material: NeoHookean, x: Array, depth: float) -> None:
    """Newton's method on the unknowns, in place."""
    from scipy.sparse.linalg import spsolve

    body, free = section.body("press"), section.free("press")
    upward, places, areas = section.edge("press", "Z")
    for _ in range(_ROUNDS):
        state = body.state(x)
        through = upward @ x + places[1] - (section.height - depth)
        slope = body.slope(material, state) + upward.T @ (PENALTY * areas * np.maximum(through, 0.0))
        held = upward.multiply((PENALTY * areas * (through > 0.0))[:, None])
        tangent = body.tangent(material, state) + upward.T @ held
        move = spsolve(tangent[free][:, free].tocsc(), -slope[free])
        x[free] += move
        if not np.all(np.isfinite(move)):
            break
        if np.max(np.abs(move)) < _CLOSE:
            return
    raise SofthandError(f"the finite elements find no balance at depth {depth:.3g} r; try a finer mesh or less depth.")
