"""The shear modulus of a material from what is known of it: a modulus with its unit, or a hardness."""

from __future__ import annotations

import re
from dataclasses import dataclass

from softhand.errors import SofthandError
from softhand.material.hardness import SCALES, young_of_hardness

UNITS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/m^2": 1.0, "N/mm^2": 1e6}
_LEAST, _MOST = 1e2, 1e9  # [N/m^2] of a fingertip: foam to hard plastic


@dataclass(frozen=True)
class Material:
    """A linear elastic material, neo-Hookean at large strain.

    Attributes:
        G: shear modulus [N/m^2].
        nu: Poisson's ratio.
        spread: share by which G may be off; 0 if it is not known.
        source: where G is from.
    """

    G: float
    nu: float
    spread: float
    source: str


def material_of(nu: float, **known: str | float | None) -> Material:
    """The material of exactly one thing that is known.

    Args:
        nu: Poisson's ratio.
        known: one of `shear` and `young`, texts with units, `shore_a` and `shore_00`, readings; the others None.

    Raises:
        SofthandError: none or several are given, a value is out of range, or nu is that of no material.
    """
    if not 0.0 <= nu <= 0.5:
        raise SofthandError(f"--nu: got {nu:g}; Poisson's ratio is from 0 to 0.5, 0.5 for an incompressible material.")
    given = {name.replace("_", "-"): value for name, value in known.items() if value is not None}
    if len(given) != 1:
        options = ", ".join(f"--{name.replace('_', '-')}" for name in known)
        got = f"got {' and '.join(f'--{name}' for name in given)}" if given else "nothing is given"
        raise SofthandError(f"The modulus: {got}; give exactly one of {options}.")
    ((name, value),) = given.items()
    if name in SCALES:
        young, spread = young_of_hardness(name, float(value), nu)
        return Material(young / (2.0 * (1.0 + nu)), nu, spread, f"{SCALES[name].name} {float(value):g}")
    modulus = read_modulus(str(value), f"--{name}")
    return Material(modulus if name == "shear" else modulus / (2.0 * (1.0 + nu)), nu, 0.0, f"--{name} {value}")


def read_modulus(text: str, where: str) -> float:
    """A modulus [N/m^2] from a text such as "0.18 MPa".

    Raises:
        SofthandError: no number, no unit or another one, or no modulus of a fingertip.
    """
    found = re.fullmatch(r"\s*([-+.\deE]*\d\.?)\s*(\D[\w/^]*)\s*", text[:60])
    try:
        value = float(found[1]) * UNITS[found[2]] if found else float("nan")
    except (ValueError, KeyError):
        value = float("nan")
    if value != value:
        raise SofthandError(f"{where}: got {text[:60]!r}; give a number with its unit, such as 0.18MPa; "
                            f"units are {', '.join(UNITS)}.")  # fmt: skip
    if not _LEAST <= value <= _MOST:
        raise SofthandError(f"{where}: {text} is {value:g} N/m^2; a fingertip has from {_LEAST:g} to {_MOST:g}.")
    return value
