"""What a damping is: numbers for the one formula of `contact.damping`."""

from __future__ import annotations

import numpy as np

from softhand.errors import ScenarioError
from softhand.settings.failures import blaming
from softhand.settings.settings import Settings

Channels = tuple[float, float, float]
"""Radial, tangential, torsional."""


class Damping(Settings):
    """Damping of a tip, whatever its law. A subclass overrides what it needs.

        F <- F - sum_k c_k w_k,   w_k' = nu_k (F - w_k)             in the coordinates of the law
        f <- f + (c + lambda f_n) velocity                          in the contact frame, each channel by itself

    The total normal force is never tensile; a tip that does not touch is not damped.
    """

    def viscosity(self) -> Channels:
        """c: radial and tangential [N s/m], torsional [N m s/rad]."""
        return 0.0, 0.0, 0.0

    def viscosity_per_force(self) -> Channels:
        """lambda: radial and tangential [s/m], torsional [m s/rad]."""
        return 0.0, 0.0, 0.0

    def relaxation(self) -> tuple[tuple[float, float], ...]:
        """(c_k, nu_k [1/s]) of each relaxation; the c_k are positive and their sum is below 1."""
        return ()

    def relaxed(self) -> float:
        """Share of the law's force that is left at rest, c_0 = 1 - sum c_k."""
        return 1.0 - sum(share for share, _ in self.relaxation())


def check_damping(damping: Damping, key: str) -> None:
    """Refuse a damping whose methods raise, or return other numbers than `Damping` says.

    Args:
        damping: with its settings.
        key: of the scenario that chose it.

    Raises:
        ScenarioError: names the damping and the method.
    """
    name = f"damping '{type(damping).__name__}'"
    for method in (damping.viscosity, damping.viscosity_per_force):
        with blaming(name, key):
            found = np.asarray(method(), dtype=float)
        if found.shape != (3,) or not np.all(np.isfinite(found) & (found >= 0.0)):
            what = f"{method.__name__} must return 3 numbers >= 0, got {found.tolist()}"
            raise ScenarioError(f"{key}: {name}: {what}.", key=key, value=name)
    with blaming(name, key):
        pairs = np.asarray(damping.relaxation() or np.empty((0, 2)), dtype=float)
    if pairs.ndim != 2 or pairs.shape[1] != 2 or not np.all(pairs > 0.0) or not pairs[:, 0].sum() < 1.0:
        what = "relaxation must return pairs (c_k, nu_k) of numbers > 0, the sum of the c_k below 1"
        raise ScenarioError(f"{key}: {name}: {what}, got {pairs.tolist()}.", key=key, value=name)
