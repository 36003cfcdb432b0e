"""What moves in a motion of hand and object: its kinetic energy by fingers, and by shifts and turns of the object."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import Array
from softhand.numerics.spatial import cross_matrix
from softhand.plant.plant import Plant

_NAMED, _MOST = 0.1, 3
"""Share from which something is named, and how many are at most."""
_SOLE = 0.8
"""Share of one joint or axis in its group from which the group is told by it alone."""
SHIFTS, TURNS = "object shifts", "object turns"


class Groups:
    """Joints of each finger, shifts and turns of the object.

    The share of a coordinate in a motion v is its part of v^T M v, which no choice of units changes. The object shifts
    with its centre of mass and turns about it, each along its own axes, so that neither where the scene stands nor how
    it is turned matters.

    Args:
        plant: of which.
        q: the configuration, shape (nq,).
    """

    def __init__(self, plant: Plant, q: Array) -> None:
        world, n = plant.world, plant.world.n_joints
        M = plant.rigid.mass_matrix(q)
        inertia = world.model.inertias[world.object_joint]
        # velocity of the centre of mass in place of that of the origin
        self._centred = np.eye(n + 6)
        self._centred[n : n + 3, n + 3 :] = -cross_matrix(np.asarray(inertia.lever))
        back = np.linalg.inv(self._centred)
        self._M = back.T @ (0.5 * (M + M.T)) @ back
        self._n, self._joints = n, tuple(world.joint_names)
        self._fingers = _fingers(plant)

    def shares(self, motion: NDArray[Any]) -> dict[str, float]:
        """Of the kinetic energy, adding up to 1.

        Args:
            motion: displacement or velocity, real or complex, shape (nv,).
        """
        parts, n = self._parts(motion), self._n
        found = {name: float(parts[columns].sum()) for name, columns in self._fingers.items()}
        ways = [(f"{SHIFTS} along {axis}", parts[n + k]) for k, axis in enumerate("xyz")]
        ways += [(f"{TURNS} about {axis}", parts[n + 3 + k]) for k, axis in enumerate("xyz")]
        return {**found, **{name: float(share) for name, share in ways}}

    def name(self, motion: NDArray[Any], shares: Mapping[str, float]) -> str:
        """What moves most, in words: `object turns about its z axis 71 %, finger_2 12 %`.

        Args:
            motion: as above.
            shares: of it, others among them.
        """
        parts, n, moved = self._parts(motion), self._n, self._centred @ motion
        told: list[tuple[float, str]] = []
        for name, columns in self._fingers.items():
            most = max(columns, key=lambda column: parts[column])
            is_sole = parts[most] >= _SOLE * parts[columns].sum()
            told.append((shares[name], f"{self._joints[most] if is_sole else name} moves"))
        for begin, what, way in ((n, SHIFTS, "along"), (n + 3, TURNS, "about")):
            share = sum(shares[one] for one in shares if one.startswith(what))
            ways = slice(begin, begin + 3)
            told.append((share, f"{what} {way} its {_axis(moved[ways], parts[ways])}"))
        known = {*self._fingers, *(one for one in shares if one.startswith((SHIFTS, TURNS)))}
        told += [(share, name) for name, share in shares.items() if name not in known]
        told.sort(key=lambda one: -round(one[0], 3))  # equal ones in their order, whatever the last digits are
        chosen = [one for one in told[:_MOST] if one[0] >= _NAMED] or told[:1]
        return ", ".join(f"{words} {100.0 * share:.0f} %" for share, words in chosen)

    def _parts(self, motion: NDArray[Any]) -> Array:
        moved = self._centred @ motion
        parts = (moved.conj() * (self._M @ moved)).real
        total = parts.sum()
        return np.asarray(parts / total if total > 0.0 else np.full(len(parts), 1.0 / len(parts)))


def _axis(vector: NDArray[Any], parts: Array) -> str:
    """`z axis`, or the direction in the axes of the object."""
    k = int(np.argmax(parts))
    if parts.sum() <= 0.0 or parts[k] >= _SOLE * parts.sum():
        return f"{'xyz'[k]} axis"
    phase = np.exp(-0.5j * np.angle(np.sum(vector**2)))
    real = (vector * phase).real
    size = np.linalg.norm(real)
    real = real / (size if size > 0.0 else 1.0)
    real = real * np.sign(real[np.argmax(np.abs(real))])
    return f"axis ({', '.join(f'{one + 0.0:.1f}' for one in real.round(1))})"


def _fingers(plant: Plant) -> dict[str, list[int]]:
    """Columns of the joints by the tips that they move."""
    world = plant.world
    names = plant.contact_names[: world.n_tips]
    found: dict[str, list[int]] = {}
    for column in range(world.n_joints):
        moved = [
            name.removesuffix("_tip") for name, tip in zip(names, world.tips, strict=True) if column in tip.columns
        ]
        name = moved[0] if len(moved) == 1 else f"what carries {', '.join(moved)}" if moved else "other joints"
        found.setdefault(name, []).append(column)
    return found
