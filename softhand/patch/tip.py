"""What a patch needs of a fingertip law: contact radius, pressure, shear modulus."""

from __future__ import annotations

import math

from softhand.laws.hemisphere import Hemisphere
from softhand.laws.hertz import Hertz
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.patch.pressure import column_shares, exponent_of, power_shares

_COMPARED = 0.2  # dr / r at which a law is compared with the one of a material
_LEANING = math.pi / 3.0  # Phi there [rad]


def contact_radius(law: Law, depth: float) -> float:
    """a [m] at a depth dr [m], that of `contact.limit.spin_length`; 0 without touch."""
    r = law.radius
    d = min(max(depth, 0.0), r)
    return math.sqrt(d * (2.0 * r - d)) if law.torsion_share is None else math.sqrt(r * d)


def ring_shares(law: Law, depth: float, edges: Array) -> Array:
    """Share of the normal force on each ring, the pressure that the limit surface of the law comes from.

    Args:
        law: of the tip.
        depth: dr [m], above 0.
        edges: radii of the rings [m], shape (n + 1,).
    """
    relative = edges / contact_radius(law, depth)
    if law.torsion_share is None:
        return column_shares(relative, depth, law.radius)
    return power_shares(relative, exponent_of(law.torsion_share))


def material_of_law(law: Law) -> tuple[float, float]:
    """G [N/m^2] and nu of the tip.

    A law that names no material has that of an incompressible `hemisphere` which, upright, presses back as hard at
    dr = 0.2 r.
    """
    if isinstance(law, Hemisphere):
        return law.G, law.nu
    if isinstance(law, Hertz):
        return law.E / (2.0 * (1.0 + law.nu)), law.nu
    pressed = [_COMPARED * law.radius, 0.0, 0.0, 0.0]
    alike = Hemisphere(radius=law.radius, G=1.0)
    return float(law(pressed, _LEANING)[0] / alike(pressed, 0.5 * math.pi)[0]), alike.nu
