"""Joints that follow another one: `<mimic>`, followed to the joint that leads them all."""

from __future__ import annotations

from typing import NamedTuple

from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.tree import Joint, Tree


class Mimic(NamedTuple):
    """joint = multiplier leader + offset."""

    leader: str
    multiplier: float
    offset: float
    """[rad or m]"""


def check_mimics(tree: Tree, findings: Findings) -> None:
    """Whether each moving joint that follows another one can do so."""
    joints = {joint.name: joint for joint in tree.joints}
    for joint in tree.joints:
        element = joint.element.find("mimic")
        leader = "" if element is None else element.get("joint", "")
        if not isinstance(element, Element) or not leader:
            continue
        if leader not in joints:
            findings.error(
                element, f'joint="{leader}": no joint is called so; there are: {", ".join(sorted(joints))}.', leader
            )
        elif joint.is_moving:
            _check_leader(joint, joints, element, findings)


def _check_leader(joint: Joint, joints: dict[str, Joint], element: Element, findings: Findings) -> None:
    leader = element.get("joint", "")
    if not joints[leader].is_moving:
        findings.error(
            element,
            f'joint="{leader}" is fixed, so that nothing leads the joint; name one that moves, or make '
            f"'{joint.name}' type=\"fixed\".",
            leader,
        )
    elif numbers_of(element, "multiplier", "1") == [0.0]:
        findings.error(element, 'multiplier="0": nothing moves the joint; make it type="fixed".', "0")
    elif len(way := _way(joint, joints)) != len(set(way)):
        findings.error(
            element,
            f'joint="{leader}" leads round in a ring, {" follows ".join(way)}; let one of them lead.',
            leader,
        )


def _way(joint: Joint, joints: dict[str, Joint]) -> list[str]:
    """Names from a joint to what leads it, or until one comes twice."""
    way = [joint.name]
    while (leader := _leader(joint)) in joints and joints[leader].is_moving:
        way.append(leader)
        joint = joints[leader]
        if way.count(leader) > 1:
            break
    return way


def _leader(joint: Joint) -> str:
    element = joint.element.find("mimic")
    return "" if element is None else element.get("joint", "")


def read_mimics(tree: Tree) -> dict[str, Mimic]:
    """Of each joint that follows another one the one that follows none, through all between, in the order of the tree.

    Args:
        tree: without errors.
    """
    joints = {joint.name: joint for joint in tree.joints if joint.is_moving}
    found = {}
    for name in joints:
        leader, multiplier, offset = name, 1.0, 0.0
        while (element := _mimic_of(joints[leader])) is not None:
            ratio, shift = numbers_of(element, "multiplier", "1"), numbers_of(element, "offset", "0")
            assert ratio is not None and shift is not None
            offset += multiplier * shift[0]
            multiplier *= ratio[0]
            leader = element.get("joint", "")
        if leader != name:
            found[name] = Mimic(leader, multiplier, offset)
    return found


def _mimic_of(joint: Joint) -> Element | None:
    element = joint.element.find("mimic")
    return element if isinstance(element, Element) and element.get("joint") else None
