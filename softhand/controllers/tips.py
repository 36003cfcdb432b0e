"""What the laws without contact sensing have in common: forces at the tip centres x_i."""

from __future__ import annotations

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.errors import ScenarioError
from softhand.numerics.arrays import Array
from softhand.sensing.observation import Observation


def radii(observation: Observation) -> Array:
    """r of each tip [m], shape (nc,)."""
    return np.array([tip.law.radius for tip in observation.fingertips])


def need_fingers(name: str, observation: Observation, least: int, most: int | None = None) -> None:
    """Refuse a hand with another number of fingers.

    Raises:
        ScenarioError: too few or too many.
    """
    count = len(observation.fingertips)
    if count < least or (most is not None and count > most):
        wanted = f"{least}" if most == least else f"at least {least}"
        raise ScenarioError(
            f'controller.name: "{name}" needs {wanted} fingers, but hand.tips has {count}.',
            key="controller.name",
            value=name,
        )


def last_axis(spin: Array) -> Array:
    """Axis of the last joint that turns a tip, world axes, shape (3,).

    Args:
        spin: angular Jacobian of the tip, shape (3, n).

    Raises:
        ScenarioError: all its joints are slides.
    """
    turning = np.flatnonzero(np.any(spin != 0.0, axis=0))
    if not turning.size:
        raise ScenarioError(
            "controller.name: this controller needs fingers with a joint that turns the tip, and this hand has slides "
            "alone; choose regulation.",
            key="controller.name",
            value=None,
        )
    return np.array(spin[:, turning[-1]])


def attraction(x: Array) -> Array:
    """Sum over j != i of x_j - x_i [m], shape (nc, 3): from each tip towards all others."""
    return x.sum(axis=0) - len(x) * x


def strength(observation: Observation, squeeze: Array) -> float:
    """f_d [N] with which f_d / sum(r) (x_j - x_i) has, at these tip centres, the mean of the squeezes asked for.

    Args:
        observation: the grasp at the start.
        squeeze: f_Nd [N], one a pair of contacts, shape (np,).
    """
    x = observation.tip_position
    distances = np.array([np.linalg.norm(x[j] - x[i]) for i, j in contact_pairs(len(x))])
    return float(radii(observation).sum() * np.mean(squeeze / distances))


def pushed(J: Array, forces: Array) -> Array:
    """Joint torques [N m], shape (n,), that push with these forces [N], shape (nc, 3), by Jacobians (nc, 3, n)."""
    return np.einsum("ibk,ib->k", J, forces)
