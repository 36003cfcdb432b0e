"""The exact limit of force and torsion of a contact pressure, by plain quadrature: nothing of softhand's is in it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from softhand.numerics.arrays import Array

Pressure = Callable[[Array], Array]
"""p(x) of any scale at x = rho / a, 0 to 1."""


def columns(depth: float, radius: float) -> Pressure:
    """Of columns that are compressed one by one, `depth` [m] deep at the middle of a sphere of `radius` [m].

    The column at the angle b from the middle gives dN = (cos b - c) sin b db dg at rho = c r tan b, c = 1 - depth / r.
    """
    c = 1.0 - depth / radius
    slope = math.sqrt(1.0 - c * c) / c

    def pressure(x: Array) -> Array:
        cosine = 1.0 / np.sqrt(1.0 + (slope * x) ** 2)
        return (cosine - c) * cosine**3

    return pressure


def power(k: float) -> Pressure:
    """(1 - x^k)^(1/k): 2 is Hertz, larger is flatter."""
    return lambda x: np.clip(1.0 - x**k, 0.0, None) ** (1.0 / k)


def lever(pressure: Pressure) -> float:
    """Largest torsion over mu f_z a: the mean of x."""
    x, weights = _rings(160)
    dN = pressure(x) * x * weights
    return float(np.sum(dN * x) / np.sum(dN))


def limit_curve(pressure: Pressure, centres: Sequence[float] | Array) -> Array:
    """Limit (f_t / (mu f_z), tau / (mu f_z a)) of contacts that slip as a whole about centres of rotation.

        f_t = int (d - x cos g) / s dN,   tau = int x (x - d cos g) / s dN,   s = |(d - x cos g, x sin g)|

    Args:
        pressure: of the contact.
        centres: d, distances from the middle over a; 0 is pure spin, far out pure sliding, shape (count,).

    Returns:
        Shape (count, 2).
    """
    x, weights = _rings(160)
    g = 2.0 * math.pi * (np.arange(320) + 0.5) / 320
    dN = (pressure(x) * x * weights)[:, None] * np.ones_like(g)
    dN /= np.sum(dN)
    along, across = x[:, None] * np.cos(g), x[:, None] * np.sin(g)
    curve = []
    for d in np.asarray(centres, dtype=float):
        s = np.hypot(d - along, across)
        curve.append((np.sum((d - along) / s * dN), np.sum((x[:, None] ** 2 - d * along) / s * dN)))
    return np.array(curve)


def _rings(count: int) -> tuple[Array, Array]:
    """Nodes and weights on 0 to 1, closer together at the edge, where a pressure may be steep."""
    nodes, weights = np.polynomial.legendre.leggauss(count)
    t = 0.25 * math.pi * (nodes + 1.0)
    return np.sin(t), 0.25 * math.pi * weights * np.cos(t)
