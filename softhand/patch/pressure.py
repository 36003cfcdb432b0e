"""How the normal force of a tip is spread over its contact: the share of it that each ring bears."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq
from scipy.special import beta, betainc

from softhand.numerics.arrays import Array

_FLATTEST, _STEEPEST = 60.0, 1.05  # exponents k between which kappa is sought


def power_shares(edges: ArrayLike, k: float) -> Array:
    """Shares of the pressure (1 - x^k)^(1/k), x = rho / a; Hertz's is k = 2.

    Args:
        edges: of the rings over the contact radius, growing from 0; beyond 1 nothing presses, shape (n + 1,).
        k: exponent.

    Returns:
        Share of each ring, shape (n,).
    """
    inside: Array = betainc(2.0 / k, 1.0 / k + 1.0, np.minimum(np.asarray(edges, dtype=float), 1.0) ** k)
    return np.diff(inside)


def column_shares(edges: ArrayLike, depth: float, radius: float) -> Array:
    """Shares of columns that are compressed one by one, the paper's Fig. 4.

    The column at the angle b from the middle gives dN = (cos b - c) sin b db dg and presses at R tan b, c = R / r; so
    beyond b there is ((cos b - c) / (1 - c))^2 of the whole.

    Args:
        edges: of the rings over the contact radius sqrt(r^2 - R^2), shape (n + 1,).
        depth: dr [m].
        radius: r [m].
    """
    c = 1.0 - depth / radius
    slope = math.sqrt(1.0 - c * c) / c
    cosine = 1.0 / np.sqrt(1.0 + (slope * np.minimum(np.asarray(edges, dtype=float), 1.0)) ** 2)
    return -np.diff((np.maximum(cosine - c, 0.0) / (1.0 - c)) ** 2)


def exponent_of(kappa: float) -> float:
    """k of the pressure (1 - x^k)^(1/k) that holds the torsion kappa mu f_z a; kappa is from 0.5 to 2/3."""
    low, high = _share(_STEEPEST), _share(_FLATTEST)
    return float(brentq(lambda k: _share(k) - min(max(kappa, low), high), _STEEPEST, _FLATTEST))


def _share(k: float) -> float:
    """Mean of x over the pressure."""
    return float(beta(3.0 / k, 1.0 / k + 1.0) / beta(2.0 / k, 1.0 / k + 1.0))
