"""What the laws without contact sensing have in common: forces at the tip centres x_i."""

from __future__ import annotations

import math

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.compiled import compiled
from softhand.sensing.observation import Observation


def radii(observation: Observation) -> Array:
    """r of each tip [m], shape (nc,)."""
    return np.array([tip.law.radius for tip in observation.fingertips])


def pairs_of(observation: Observation) -> AnyArray:
    """Contacts that an internal force acts between, as `contact_pairs`, shape (np, 2)."""
    return np.array(contact_pairs(len(observation.fingertips)), dtype=np.int64).reshape(-1, 2)


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


@compiled
def cross(a, b):
    """a x b"""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def moved(position, start, is_continuous):
    """q - q(0) of a joint [rad, m], of one that turns without end the shorter way."""
    way = position - start
    if is_continuous:
        way -= 2.0 * math.pi * math.ceil(way / (2.0 * math.pi) - 0.5)
    return way


@compiled
def attract(x, share, forces):
    """forces += share times the sum over j != i of x_j - x_i: from each tip towards all others.

    Args:
        x: tip centres [m], shape (nc, 3).
        share: [N/m]
        forces: changed [N], shape (nc, 3).
    """
    for i in range(x.shape[0]):
        for j in range(x.shape[0]):
            for k in range(3):
                forces[i, k] += share * (x[j, k] - x[i, k])


def strength(observation: Observation, squeeze: Array) -> float:
    """f_d [N] with which f_d / sum(r) (x_j - x_i) has, at these tip centres, the mean of the squeezes asked for.

    Args:
        observation: the grasp at the start.
        squeeze: f_Nd [N], one a pair of contacts, shape (np,).
    """
    x = observation.tip_position
    distances = np.array([np.linalg.norm(x[j] - x[i]) for i, j in contact_pairs(len(x))])
    return float(radii(observation).sum() * np.mean(squeeze / distances))
