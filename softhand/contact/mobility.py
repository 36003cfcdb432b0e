"""What the joints or motors of a hand can regulate of an object that it holds, by rank."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from softhand.numerics.arrays import Array

_SAME = 1e-6
"""One less the cosine of the angle below which two directions are one."""
_ZERO = 1e-9

WAYS = ("x", "y", "z", "rx", "ry", "rz")
"""Of an object: along the axes of the base frame, and about them."""


@dataclass(frozen=True)
class Mobility:
    """Directions in which an object and its internal forces can be regulated.

        J q_F' = G^T v,   f_N in K^+ P J,   P the projector along G^T onto what G takes to no wrench

    J are the velocities of the contact points by the joints or motors, G the grasp map. Motions v for which some q_F'
    moves all contact points with the object are the ones that are regulated; all other motions of the motors squeeze.
    [Prattichizzo, Bicchi, Dynamic analysis of mobility and graspability of general manipulation systems, IEEE Trans.
    Robotics and Automation 14 (1998)], with tips of equal stiffness in all directions. All else is held by friction, by
    the stiffness of the tips and, where joints are coupled, by their mechanism.

    Attributes:
        motions: a row each: velocity of the origin of the object frame, angular velocity times the length, base frame,
            the largest number 1; shape (k, 6).
        length: by which angles count as ways [m].
        forces: a row each: internal forces between pairs of contacts, the largest number 1; shape (m, np).
        n_forces: how many independent internal forces there are.
    """

    motions: Array
    length: float
    forces: Array
    n_forces: int

    @property
    def is_full(self) -> bool:
        """Whether all that there is can be regulated."""
        return len(self.motions) == 6 and len(self.forces) == self.n_forces

    def motions_text(self) -> str:
        """Such as `1 of 6: x`."""
        ways = [_named(row, self.length) for row in self.motions] if 0 < len(self.motions) < 6 else []
        return f"{len(self.motions)} of 6" + (f": {'; '.join(ways)}" if ways else "")

    def forces_text(self, pairs: Sequence[str]) -> str:
        """Such as `1 of 3: f 12 with 0.5 f 23`."""
        some = 0 < len(self.forces) < self.n_forces
        ways = [_together([f"f {pair}" for pair in pairs], row, "") for row in self.forces] if some else []
        return f"{len(self.forces)} of {self.n_forces}" + (f": {'; '.join(ways)}" if ways else "")


def _named(row: Array, length: float) -> str:
    """A motion in words: per mm, or per degree of a pure turn."""
    turns = row[3:] / length
    if np.abs(row[:3]).max() <= _ZERO:
        return _together(list(WAYS[3:]), turns / np.abs(turns).max(), "")
    parts = _together(list(WAYS[:3]), row[:3], "")
    spun = [
        f"{_short(math.degrees(1e-3 * turn))} deg/mm of {way}"
        for way, turn in zip(WAYS[3:], turns, strict=True)
        if abs(turn * length) > _ZERO
    ]
    return " with ".join([parts, *spun])


def _together(names: Sequence[str], row: Array, _unit: str) -> str:
    parts = [
        name if abs(share - 1.0) < 1e-6 else f"{_short(share)} {name}"
        for name, share in zip(names, row, strict=True)
        if abs(share) > 1e-6
    ]
    return " with ".join(parts)


def _short(number: float) -> str:
    return f"{number:.3g}"


def mobility(J: Array, G: Array, K: Array, length: float) -> Mobility:
    """The mobility of a grasp.

    Args:
        J: velocities of the contact points by the velocities of joints or motors, shape (3 nc, n).
        G: wrench on the object about the origin of its frame, in the base frame, from contact forces in the axes of J,
            shape (6, 3 nc).
        K: contact forces of one internal force each, in the axes of J, shape (3 nc, np).
        length: by which moments count as forces [m].
    """
    scaled = G / np.repeat([1.0, length], 3)[:, None]
    moves, held = _range(J), _range(scaled.T)
    left, cosines, _ = np.linalg.svd(held.T @ moves) if moves.shape[1] else (np.zeros((0, 0)), np.zeros(0), None)
    shared = held @ left[:, : int(np.count_nonzero(cosines > 1.0 - _SAME))]
    motions = np.linalg.lstsq(scaled.T, shared, rcond=_ZERO)[0].T
    squeezing = _range((moves - held @ (held.T @ moves)), math.sqrt(2.0 * _SAME))
    forces = np.linalg.lstsq(K, squeezing, rcond=_ZERO)[0].T
    n_forces = G.shape[1] - held.shape[1]
    return Mobility(_reduced(motions), length, _reduced(forces), n_forces)


def _range(A: Array, least: float = _ZERO) -> Array:
    """An orthonormal basis of the range, columns of like size counted alike."""
    sizes = np.linalg.norm(A, axis=0)
    kept = A[:, sizes > least * max(float(sizes.max(initial=0.0)), least)]
    if not kept.shape[1]:
        return np.zeros((len(A), 0))
    U, s, _ = np.linalg.svd(kept, full_matrices=False)
    return np.asarray(U[:, s > least * s[0]])


def _reduced(rows: Array) -> Array:
    """The same span with as many zeros as there are rows less one in each: reduced, its largest numbers 1."""
    A, done = np.array(rows), list[int]()
    for k in range(len(A) if A.size else 0):
        free = np.abs(A[k:])
        free[:, done] = 0.0
        best = free.max(axis=0)
        column = int(np.flatnonzero(best > 0.5 * best.max())[0])
        pivot = k + int(np.argmax(free[:, column]))
        A[[k, pivot]] = A[[pivot, k]]
        A[k] /= A[k, column]
        for other in range(len(A)):
            if other != k:
                A[other] -= A[other, column] * A[k]
        done.append(column)
    A[np.abs(A) < 1e-9] = 0.0
    return np.asarray(A[np.argsort(done)]) if done else A
