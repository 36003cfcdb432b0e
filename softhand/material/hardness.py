"""The modulus of a rubber from its hardness, with how sure that is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt

from softhand.errors import SofthandError


@dataclass(frozen=True)
class Scale:
    """A scale of hardness.

    Attributes:
        name: as people say it.
        least: reading from which the relation is used.
        most: up to which.
        modulus: Young's modulus [N/m^2] of an incompressible rubber by the reading.
        spread: share by which a rubber of that hardness may be off.
        source: of the relation, with its certainty.
    """

    name: str
    least: float
    most: float
    modulus: Callable[[float], float]
    spread: float
    source: str


def _shore_a(S: float) -> float:
    return 1e6 * 0.0981 * (56.0 + 7.62336 * S) / (0.137505 * (254.0 - 2.54 * S))


def _shore_00(S: float) -> float:
    force, depth, ball = 0.203 + 0.00908 * S, 2.54e-3 * (1.0 - S / 100.0), 1.19e-3
    return 0.75 * (1.0 - 0.5**2) * force / (sqrt(ball) * depth**1.5)


SCALES = {
    "shore-a": Scale(
        "Shore A", 20.0, 80.0, _shore_a, 0.25,
        "Gent 1958: a flat punch in a half-space; soft rubbers are up to a quarter softer than it says [F]",
    ),
    "shore-00": Scale(
        "Shore 00", 20.0, 80.0, _shore_00, 0.4,
        "Hertz for ball, spring and travel of ASTM D2240 type 00; below 50 deeper than Hertz means [U]",
    ),
}  # fmt: skip
"""Scales by the name of their option."""


def young_of_hardness(scale: str, reading: float, nu: float = 0.5) -> tuple[float, float]:
    """Young's modulus of a rubber of this hardness.

        Shore A:  E [MPa] = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S))
        Shore 00: E = (3/4) (1 - nu^2) F / (sqrt(b) h^1.5)
                  F = 0.203 + 0.00908 S [N],   h = 2.54 (1 - S / 100) [mm],   b = 1.19 mm

    Args:
        scale: a key of `SCALES`.
        reading: on it.
        nu: Poisson's ratio, which has to be that of rubber.

    Returns:
        E [N/m^2] and the share by which it may be off.

    Raises:
        SofthandError: no reading of that scale, or no rubber.
    """
    own = SCALES[scale]
    if not own.least <= reading <= own.most:
        near = "; below 20 of Shore A give --shore-00" if scale == "shore-a" and reading < own.least else ""
        raise SofthandError(
            f"{own.name} {reading:g} is outside of {own.least:g} to {own.most:g}, where its relation to a modulus is "
            f"of use{near}; or give a measured modulus by --young or --shear."
        )
    if not 0.45 <= nu <= 0.5:
        raise SofthandError(
            f"nu = {nu:g}: {own.name} tells the modulus of rubber, nu from 0.45 to 0.5, alone; give a measured modulus "
            "by --young or --shear."
        )
    return own.modulus(reading), own.spread
