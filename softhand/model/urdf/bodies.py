"""Masses: that everything that moves has some, and none that a link of a hand cannot have."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from softhand.model.urdf.composite import parts_of
from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.inertias import check_inertias, check_mirrored
from softhand.model.urdf.tree import Tree

NO_MASS = "no mass"
"""Kind of the error of a body that moves without one."""

_HEAVY = 20.0  # [kg] for a link of a hand
_LIGHTEST = 1e-9  # [kg]


def check_bodies(tree: Tree, has_free_root: bool, findings: Findings) -> None:
    """Each <inertial>, and whether each body that moves has a mass.

    Args:
        tree: of the links.
        has_free_root: whether the root moves, as that of an object.
        findings: added to.
    """
    section = "object" if has_free_root else "hand"
    masses = {name: _check_inertial(link, findings) for name, link in tree.links.items()}
    carriers = {joint.child: joint for joint in tree.joints}
    for leader, members in tree.bodies().items():
        moves = leader != tree.root or has_free_root
        check_inertias(parts_of([tree.links[name] for name in members], members, carriers), moves, section, findings)
    for leader in weightless(tree, has_free_root, masses):
        moved = f"joint '{carriers[leader].name}' moves it" if leader in carriers else "an object moves freely"
        kind = "no <inertial>" if tree.links[leader].find("inertial") is None else "no mass"
        findings.error(
            tree.links[leader],
            f"{kind} in it, nor in what is fixed to it, but {moved}; "
            "give it an <inertial> with a mass > 0 and an inertia, or set "
            f"{section}.density, such as 1200 kg/m^3, to take both from its shapes.",
            kind=NO_MASS,
        )


def weightless(tree: Tree, has_free_root: bool, masses: Mapping[str, float | None]) -> dict[str, list[str]]:
    """The bodies that move without any mass: the links of each, by the one that leads them.

    Args:
        tree: of the links.
        has_free_root: whether the root moves.
        masses: of the links [kg], None where it cannot be told.
    """
    return {
        leader: members
        for leader, members in tree.bodies().items()
        if (leader != tree.root or has_free_root) and all(masses[name] == 0.0 for name in members)
    }


def masses_of(tree: Tree) -> dict[str, float | None]:
    """Mass of each link [kg], 0 without one; None if it cannot be told."""
    nowhere = Findings(Path())
    return {name: _check_inertial(link, nowhere) for name, link in tree.links.items()}


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
        findings.warn(mass_element, f"{shown} weighs nothing; leave the <inertial> out.", "0", "no weight")
        return 0.0
    if kg <= 0.0:
        what = "is negative" if kg < 0.0 else "is zero"
        findings.error(mass_element, f"{shown} {what}; a body has a mass > 0, in kg.", shown)
        return None
    if kg < _LIGHTEST:
        findings.error(mass_element, f"{shown} is below {_LIGHTEST:g} kg; write the mass in kg.", shown)
        return None
    if kg > _HEAVY:
        findings.warn(mass_element, f"{shown} is heavy for a hand; is it in grams? A mass is in kg.", shown, "heavy")
    check_mirrored(element, max(map(abs, values)), findings)
    return kg
