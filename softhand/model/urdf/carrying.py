"""A hand on an arm: two URDFs as one, with the hand's root link fixed to a link of the arm."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from xml.etree import ElementTree

from softhand.errors import ModelError
from softhand.model.urdf.examination import Role
from softhand.model.urdf.meshes import find_mesh
from softhand.model.urdf.mounting import ZERO
from softhand.model.urdf.urdf import Urdf, Vector3

PLACE = "hand_place"
"""Name of the joint between the two."""

ARM_PREFIX = "arm_"
"""Put before a name of the arm that the hand has too."""

_PARTS = ("link", "joint", "material")


@dataclass(frozen=True)
class ArmPlace:
    """The arm that carries a hand.

    Attributes:
        urdf: of the arm, fixed at its root.
        link: that carries the hand; "" for the end of the arm, if it has one alone.
        position: of the hand's root link in the frame of that link [m].
        rpy: its roll, pitch, yaw there [rad].
    """

    urdf: Urdf
    link: str = ""
    position: Vector3 = ZERO
    rpy: Vector3 = ZERO


def carried(hand: Urdf, arm: ArmPlace) -> Urdf:
    """Both as one URDF, whose root is that of the arm.

    Links, joints and materials are taken over. One of the arm with a name that the hand has too is called `arm_NAME`.
    Meshes are named by where they lie, as two URDFs may lie in two folders.

    Args:
        hand: without a mount.
        arm: with its link.

    Raises:
        ModelError: the arm has no such link, or no end that is the only one.
    """
    link, taken = _link_of(arm), _names(hand)
    others = {name for name in _names(arm.urdf) if name in taken or name == PLACE}
    renamed = {name: f"{ARM_PREFIX}{name}" for name in others}
    clash = set(renamed.values()) & (taken | _names(arm.urdf))
    if clash or PLACE in taken:
        name = min(clash, default=PLACE)
        raise ModelError(f"{hand.file}: '{name}' cannot be a name here; rename it.", file=str(hand.file))
    root = ElementTree.Element(
        "robot", {"name": f"{arm.urdf.root.get('name', 'arm')} with {hand.root.get('name', '')}"}
    )
    root.extend(_copied(arm.urdf, renamed))
    place = ElementTree.SubElement(root, "joint", {"name": PLACE, "type": "fixed"})
    ElementTree.SubElement(place, "parent", {"link": renamed.get(link, link)})
    ElementTree.SubElement(place, "child", {"link": hand.tree.root})
    ElementTree.SubElement(place, "origin", {"xyz": _words(arm.position), "rpy": _words(arm.rpy)})
    root.extend(_copied(hand, {}))
    ElementTree.indent(root)
    text = ElementTree.tostring(root, encoding="unicode")
    found = Urdf.parse(text, hand.file, Role(is_object=False, effort_counts=False))
    return replace(found, folder=hand.folder, warnings=(*arm.urdf.warnings, *hand.warnings))


def _link_of(arm: ArmPlace) -> str:
    links, ends = list(arm.urdf.tree.links), arm.urdf.ends
    if arm.link in links:
        return arm.link
    file = arm.urdf.file
    if arm.link:
        raise ModelError(
            f"{file}: no link is called '{arm.link}', which the hand shall sit on. The arm has the links "
            f"{', '.join(links)}.",
            file=str(file), value=arm.link,
        )  # fmt: skip
    if len(ends) != 1:
        raise ModelError(
            f"{file}: the arm has {len(ends)} ends, {', '.join(ends)}; name the link that carries the hand in "
            "hand.arm.link.",
            file=str(file),
        )
    return ends[0]


def _names(urdf: Urdf) -> set[str]:
    """Of all that is taken over."""
    materials = {material.get("name", "") for material in urdf.root.iterfind("material")}
    joints = {element.get("name", "") for element in urdf.root.iterfind("joint")}
    return {*urdf.tree.links, *joints, *materials}


def _copied(urdf: Urdf, renamed: dict[str, str]) -> Iterable[ElementTree.Element]:
    """Its parts, with other names, and meshes by their place."""
    for part in urdf.root:
        if part.tag not in _PARTS:
            continue
        copy = ElementTree.fromstring(ElementTree.tostring(part))
        copy.tail = None
        for element in copy.iter():
            for key in ("name", "link", "joint"):
                if element.tag in (*_PARTS, "parent", "child", "mimic") and key in element.attrib:
                    element.set(key, renamed.get(element.attrib[key], element.attrib[key]))
            if element.tag == "mesh" and (found := find_mesh(element.get("filename", "").strip(), urdf.folder)):
                element.set("filename", str(found.resolve()))
        yield copy


def _words(numbers: Vector3) -> str:
    return " ".join(map(repr, map(float, numbers)))
