"""Masses and inertias: what a rigid body can have, and that everything that moves has some."""

from __future__ import annotations

import math

from softhand.model.urdf.composite import (
    Part,
    breaks_triangle,
    has_negative,
    inertia_of,
    is_positive,
    moments_of,
    parts_of,
    tensor_of,
)
from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import MIRRORED, numbers_of
from softhand.model.urdf.tree import Tree
from softhand.numerics.arrays import Array

_HEAVY = 20.0  # [kg] for a link of a hand
_LIGHTEST = 1e-9  # [kg]
_ROUNDING = 0.01  # of the largest moment: a plate on the edge of the inequality may be rounded so far across
_MIRROR = 1e-6  # of the largest moment, by which products that are there twice may be rounded apart
_GYRATION = (1e-4, 1.0)  # [m] radius of gyration of a link of a hand
_HINT = "a solid box of mass m has ixx = m (y^2 + z^2) / 12"


def check_bodies(tree: Tree, has_free_root: bool, findings: Findings) -> None:
    """Each <inertial>, and whether each body that moves has a mass.

    Args:
        tree: of the links.
        has_free_root: whether the root moves, as that of an object.
        findings: added to.
    """
    masses = {name: _check_inertial(link, findings) for name, link in tree.links.items()}
    carriers = {joint.child: joint for joint in tree.joints}
    for leader, members in tree.bodies().items():
        weights = [masses[name] for name in members]
        moves = leader != tree.root or has_free_root
        _check_body(parts_of([tree.links[name] for name in members], members, carriers), moves, findings)
        if not moves or any(weight is None or weight > 0.0 for weight in weights):
            continue
        moved = f"joint '{carriers[leader].name}' moves it" if leader in carriers else "an object moves freely"
        kind = "no <inertial>" if tree.links[leader].find("inertial") is None else "no mass"
        findings.error(
            tree.links[leader],
            f"{kind} in it, nor in what is fixed to it, but {moved}; "
            "give it an <inertial> with a mass > 0 and an inertia.",
        )


def _check_inertial(link: Element, findings: Findings) -> float | None:
    """The mass of a link [kg], 0 without one; None if it cannot be told."""
    inertial = link.find("inertial")
    if inertial is None:
        return 0.0
    mass_element, element = inertial.find("mass"), inertial.find("inertia")
    if not (isinstance(mass_element, Element) and isinstance(element, Element)):
        return None
    mass = numbers_of(mass_element, "value", "nan")
    moments = [numbers_of(element, name, "nan") for name in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")]
    if mass is None or any(moment is None for moment in moments):
        return None
    kg, values = mass[0], [moment[0] for moment in moments if moment is not None]
    shown = f'value="{mass_element.get("value")}"'
    if kg == 0.0 and not any(values):
        findings.warn(mass_element, f"{shown} weighs nothing; leave the <inertial> out.", "0")
        return 0.0
    if kg <= 0.0:
        what = "is negative" if kg < 0.0 else "is zero"
        findings.error(mass_element, f"{shown} {what}; a body has a mass > 0, in kg.", shown)
        return None
    if kg < _LIGHTEST:
        findings.error(mass_element, f"{shown} is below {_LIGHTEST:g} kg; write the mass in kg.", shown)
        return None
    if kg > _HEAVY:
        findings.warn(mass_element, f"{shown} is heavy for a hand; is it in grams? A mass is in kg.", shown)
    _check_mirrored(element, max(map(abs, values)), findings)
    _check_inertia(element, kg, values, findings)
    return kg


def _check_mirrored(element: Element, largest: float, findings: Findings) -> None:
    """Products of inertia that are there twice are the same."""
    for name, twin in MIRRORED.items():
        mirrored, product = (numbers_of(element, word, "nan") for word in (name, twin))
        if mirrored and product and abs(mirrored[0] - product[0]) > _MIRROR * largest:
            told = f'{name}="{element.get(name)}" is not {twin}="{element.get(twin)}"'
            findings.error(element, f"{told}, but an inertia is symmetric; remove {name}.", element.get(name, ""))


def _check_inertia(element: Element, mass: float, values: list[float], findings: Findings) -> None:
    """What can be told of a link alone."""
    matrix, shown = tensor_of(values), _shown(element)
    principal = moments_of(matrix)
    if has_negative(principal):
        findings.error(element, f"{_flatness(principal, shown)}; {_HINT}.", shown)
        return
    if not is_positive(principal) or breaks_triangle(principal, _ROUNDING):
        return  # told of the whole rigid body
    gyration = math.sqrt(principal[2] / mass)
    if not _GYRATION[0] < gyration < _GYRATION[1]:
        findings.warn(
            element,
            f"with the mass of {mass:g} kg the radius of gyration is {1e3 * gyration:.3g} mm; "
            "is the inertia in kg m^2?",
            shown,
        )


def _check_body(parts: list[Part], moves: bool, findings: Findings) -> None:
    """Links that no body can be: an error, but a warning where all that is fixed together can be one, or rests.

    Only the sum over the links of a rigid body is in the equations of motion.
    """
    wrong = [part for part in parts if not _is_possible(part.inertia)]
    is_excused = bool(wrong) and (not moves or _is_possible(inertia_of(parts)))
    for part in wrong:
        shown, principal = _shown(part.element), moments_of(part.inertia)
        what = _imbalance(principal, shown) if is_positive(principal) else _flatness(principal, shown, is_excused)
        if not is_excused:
            findings.error(part.element, f"{what}; {_HINT}.", shown)
        elif moves:
            others = ", ".join(other.name for other in parts if other is not part)
            why = f"with what is fixed to it ({others}) a body can have them, and that moves."
            findings.warn(part.element, f"{what}; {why}", shown)
        else:
            findings.warn(part.element, f"{what}; the link does not move, and they do not count.", shown)


def _is_possible(inertia: Array) -> bool:
    principal = moments_of(inertia)
    return is_positive(principal) and not breaks_triangle(principal, _ROUNDING)


def _imbalance(principal: Array, shown: str) -> str:
    return (
        f"no body has these principal moments: {principal[2]:.4g} kg m^2 exceeds the sum of "
        f"{_listed(principal[:2])} ({shown}), breaking the triangle inequality"
    )


def _flatness(principal: Array, shown: str, is_excused: bool = False) -> str:
    """Words for moments that are zero or below; where they are excused, those of a point or a rod."""
    moments = f"{_listed(principal + 0.0)} kg m^2 ({shown})"  # no -0
    if is_excused:
        return f"its principal moments are those of a point or a rod, {moments}"
    return f"not positive definite: its principal moments are {moments}, and each must be > 0"


def _shown(element: Element) -> str:
    return ", ".join(f"{name}={float(element.get(name, 'nan')):g}" for name in ("ixx", "iyy", "izz"))


def _listed(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
