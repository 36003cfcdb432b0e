"""Masses and inertias: what a rigid body can have, and that everything that moves has some."""

from __future__ import annotations

import math

import numpy as np

from softhand.model.urdf.composite import breaks_triangle, inertia_of, parts_of
from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.tree import Joint, Tree
from softhand.numerics.arrays import Array

_HEAVY = 20.0  # [kg] for a link of a hand
_LIGHTEST = 1e-9  # [kg]
_SMALLEST = 1e-18  # [kg m^2], a millimetre and a microgram
_ROUNDING = 0.01  # of the largest moment: a plate on the edge of the inequality may be rounded so far across
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
        _check_triangles([tree.links[name] for name in members], members, carriers, findings)
        if (leader == tree.root and not has_free_root) or any(weight is None or weight > 0.0 for weight in weights):
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
    _check_inertia(element, kg, np.array(values), findings)
    return kg


def _check_inertia(element: Element, mass: float, values: Array, findings: Findings) -> None:
    xx, xy, xz, yy, yz, zz = values
    matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    shown = ", ".join(f"{name}={value:g}" for name, value in zip(("ixx", "iyy", "izz"), (xx, yy, zz), strict=True))
    principal = np.linalg.eigvalsh(matrix)
    if not principal[0] > max(_SMALLEST, 1e-12 * principal[2]):
        findings.error(
            element,
            f"not positive definite: its principal moments are {_listed(principal)} kg m^2 ({shown}), and each must "
            f"be > 0; {_HINT}.",
            shown,
        )
        return
    if breaks_triangle(matrix, _ROUNDING):
        return  # told of the whole rigid body
    gyration = math.sqrt(principal[2] / mass)
    if not _GYRATION[0] < gyration < _GYRATION[1]:
        findings.warn(
            element,
            f"with the mass of {mass:g} kg the radius of gyration is {1e3 * gyration:.3g} mm; "
            "is the inertia in kg m^2?",
            shown,
        )


def _check_triangles(links: list[Element], names: list[str], carriers: dict[str, Joint], findings: Findings) -> None:
    """Links that no body can be: an error, but a warning where all that is fixed together can be one.

    Only the sum over the links of a rigid body is in the equations of motion.
    """
    parts = parts_of(links, names, carriers)
    broken = [part for part in parts if breaks_triangle(part.inertia, _ROUNDING)]
    is_possible = bool(broken) and not breaks_triangle(inertia_of(parts), _ROUNDING)
    for part in broken:
        xx, yy, zz = (float(part.element.get(name, "nan")) for name in ("ixx", "iyy", "izz"))
        shown = f"ixx={xx:g}, iyy={yy:g}, izz={zz:g}"
        principal = np.asarray(np.linalg.eigvalsh(part.inertia), dtype=float)
        what = (
            f"no body has these principal moments: {principal[2]:.4g} kg m^2 exceeds the sum of "
            f"{_listed(principal[:2])} ({shown}), breaking the triangle inequality"
        )
        if is_possible:
            others = ", ".join(other.name for other in parts if other is not part)
            findings.warn(
                part.element,
                f"{what}; with what is fixed to it ({others}) a body can have them, and that moves.",
                shown,
            )
        else:
            findings.error(part.element, f"{what}; {_HINT}.", shown)


def _listed(values: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
