"""Inertias: what a rigid body can have."""

from __future__ import annotations

import math

from softhand.model.urdf.composite import (
    Part,
    breaks_triangle,
    has_negative,
    inertia_of,
    is_positive,
    moments_of,
)
from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import MIRRORED, numbers_of
from softhand.numerics.arrays import Array

IMPOSSIBLE = "impossible inertia"
"""Kind of the error of an inertia that no body has."""

_ROUNDING = 0.01  # of the largest moment: a plate on the edge of the inequality may be rounded so far across
_MIRROR = 1e-6  # of the largest moment, by which products that are there twice may be rounded apart
_GYRATION = (1e-4, 1.0)  # [m] radius of gyration of a link of a hand
_HINT = "a solid box of mass m has ixx = m (y^2 + z^2) / 12"


def check_mirrored(element: Element, largest: float, findings: Findings) -> None:
    """Products of inertia that are there twice are the same.

    Args:
        element: <inertia> of a link.
        largest: of its numbers [kg m^2].
        findings: added to.
    """
    for name, twin in MIRRORED.items():
        mirrored, product = (numbers_of(element, word, "nan") for word in (name, twin))
        if mirrored and product and abs(mirrored[0] - product[0]) > _MIRROR * largest:
            told = f'{name}="{element.get(name)}" is not {twin}="{element.get(twin)}"'
            findings.error(element, f"{told}, but an inertia is symmetric; remove {name}.", element.get(name, ""))


def check_inertias(parts: list[Part], moves: bool, section: str, findings: Findings) -> None:
    """Links that no body can be: an error, but a warning where all that is fixed together can be one, or rests.

    Only the sum over the links of a rigid body is in the equations of motion.

    Args:
        parts: the links of a rigid body that have a mass.
        moves: whether the body does.
        section: of a scenario that has the remedy.
        findings: added to.
    """
    wrong = {part.name for part in impossible(parts)} if moves else set()
    for part in parts:
        principal, shown = moments_of(part.inertia), _shown(part.element)
        others = ", ".join(other.name for other in parts if other is not part)
        if _is_possible(principal):
            _check_gyration(part, principal, shown, findings)
        elif not moves:
            rests = "the link does not move, and they do not count."
            findings.warn(part.element, f"{_fault(principal, shown)}; {rests}", shown, "rests")
        elif part.name not in wrong:
            what = _fault(principal, shown) if is_positive(principal) else _point(principal, shown)
            why = f"with what is fixed to it ({others}) a body can have them, and that moves."
            findings.warn(part.element, f"{what}; {why}", shown, "with others")
        else:
            remedy = f'{_HINT}, or set {section}.repair = "balance" to take the nearest inertia that a body can have'
            findings.error(part.element, f"{_fault(principal, shown)}; {remedy}.", shown, IMPOSSIBLE)


def impossible(parts: list[Part]) -> list[Part]:
    """The links of a rigid body for which it can be none: not those that with all others make a possible one."""
    whole = [part for part in parts if not has_negative(moments_of(part.inertia))]
    is_sound = bool(whole) and _is_possible(moments_of(inertia_of(whole)))
    principals = [(part, moments_of(part.inertia)) for part in parts]
    return [part for part, p in principals if not _is_possible(p) and (has_negative(p) or not is_sound)]


def _is_possible(principal: Array) -> bool:
    return is_positive(principal) and not breaks_triangle(principal, _ROUNDING)


def _check_gyration(part: Part, principal: Array, shown: str, findings: Findings) -> None:
    gyration = math.sqrt(principal[2] / part.mass)
    if not _GYRATION[0] < gyration < _GYRATION[1]:
        findings.warn(
            part.element,
            f"with the mass of {part.mass:g} kg the radius of gyration is {1e3 * gyration:.3g} mm; "
            "is the inertia in kg m^2?",
            shown,
            "gyration",
        )


def _fault(principal: Array, shown: str) -> str:
    if not is_positive(principal):
        return f"not positive definite: its principal moments are {_listed(principal, shown)}, and each must be > 0"
    return (
        f"no body has these principal moments: {principal[2]:.4g} kg m^2 exceeds the sum of "
        f"{_listed(principal[:2], shown, '')}, breaking the triangle inequality"
    )


def _point(principal: Array, shown: str) -> str:
    return f"its principal moments are those of a point or a rod, {_listed(principal, shown)}"


def _listed(values: Array, shown: str, unit: str = " kg m^2") -> str:
    moments = ", ".join(f"{value:.4g}" for value in values + 0.0)  # no -0
    return f"{moments}{unit} ({shown})"


def _shown(element: Element) -> str:
    return ", ".join(f"{name}={float(element.get(name, 'nan')):g}" for name in ("ixx", "iyy", "izz"))
