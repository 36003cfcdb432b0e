"""Colours of the picture.

The ramp goes from bluish green over yellow to vermillion, which the colour-blind tell apart [Okabe, Ito]; above 1 it is
dark.
"""

from __future__ import annotations

import numpy as np

Colour = tuple[float, float, float]


def rgb(code: str) -> Colour:
    """#rrggbb as numbers from 0 to 1."""
    red, green, blue = (int(code[k : k + 2], 16) / 255.0 for k in (1, 3, 5))
    return red, green, blue


TABLE = rgb("#c9bfae")
LINK, PALM, JOINT = rgb("#b3bac7"), rgb("#545c69"), rgb("#3d454f")
OBJECT, TIP, NET = rgb("#5c8ccc"), rgb("#f2b899"), rgb("#8a4a2a")
DISC, TRAIL = rgb("#e6eef8"), rgb("#10151c")
TORSION, INTERNAL, DESIRED = rgb("#a3308f"), rgb("#2f6fb0"), rgb("#007c89")
RAMP = (rgb("#009E73"), rgb("#F0E442"), rgb("#D55E00"))
SLIPPING = rgb("#7a0026")
GIVES, TURNS = rgb("#7b3fa0"), rgb("#a8155f")
SLIP, SUPPORT = rgb("#e4002b"), rgb("#5b4a8a")
UNFELT = rgb("#6b4632")
PRESSURE = (rgb("#bcd7f0"), rgb("#3f87c6"), rgb("#0b2a5b"))
_ROUNDED = 1e-9  # a tip that slips is on the limit


def use_colour(use: float) -> Colour:
    """Colour of a friction use: green at 0, red at 1, dark above."""
    if not use <= 1.0 + _ROUNDED:
        return SLIPPING
    red, green, blue = (np.interp(max(use, 0.0), (0.0, 0.5, 1.0), [c[k] for c in RAMP]) for k in range(3))
    return float(red), float(green), float(blue)


def pressure_colours(count: int) -> list[Colour]:
    """From a light to a dark blue, for what taxels feel."""
    red, green, blue = (
        np.interp(np.linspace(0.0, 1.0, count), (0.0, 0.5, 1.0), [c[k] for c in PRESSURE]) for k in range(3)
    )
    return [(float(r), float(g), float(b)) for r, g, b in zip(red, green, blue, strict=True)]


def paler(colour: Colour, share: float) -> Colour:
    """The same hue with a share of white, 0 to 1."""
    red, green, blue = (part + share * (1.0 - part) for part in colour)
    return red, green, blue


def darker(colour: Colour, factor: float = 0.6) -> Colour:
    """The same hue with less light."""
    red, green, blue = colour
    return red * factor, green * factor, blue * factor
