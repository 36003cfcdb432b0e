"""Joints one by one: type, axis, limits."""

from __future__ import annotations

import math
from xml.etree import ElementTree

from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.mimics import check_mimics
from softhand.model.urdf.tree import MOVING, Joint, Tree

NO_EFFORT = "no effort"
"""Kind of the error of a joint on which no torque can act."""
UNUSED = {name: f"unused {name}" for name in ("damping", "friction")}
"""Kinds of the warnings of `<dynamics>`, by the attribute."""

_TYPES = (*MOVING, "fixed")
_ROUNDING = 1e-3  # of an axis of a few digits
_FAR = 1.0  # [m] between two joints of a hand


def check_types(root: Element, findings: Findings) -> None:
    """Whether each joint is of a kind that a hand can have."""
    for element in root.iterfind("joint"):
        kind = element.get("type", "")
        if not isinstance(element, Element) or not kind.strip():
            continue
        if kind in ("planar", "floating"):
            findings.error(
                element,
                f'type="{kind}" has more than one degree of freedom; a hand is made of {", ".join(MOVING)} joints: '
                "write it as several of them.",
                kind,
            )
        elif kind not in _TYPES:
            findings.error(element, f'type="{kind}" is no type of joint; there are: {", ".join(_TYPES)}.', kind)


def check_joints(tree: Tree, effort_counts: bool, findings: Findings) -> None:
    """Axis, limits and place of each joint, and what it follows.

    Args:
        tree: of the joints.
        effort_counts: whether torques are limited by the efforts.
        findings: added to.
    """
    _check_dynamics([joint.element.find("dynamics") for joint in tree.joints if joint.is_moving], findings)
    for joint in tree.joints:
        _check_distance(joint.element.find("origin"), findings)
        if joint.is_moving:
            _check_axis(joint, findings)
            is_led = joint.element.find("mimic") is not None
            _check_limit(joint, effort_counts and not is_led, findings)
    check_mimics(tree, findings)


def check_place(joint: Element, findings: Findings) -> None:
    """Where one more joint is."""
    _check_angles(joint.find("origin"), findings)
    _check_distance(joint.find("origin"), findings)


def _check_distance(origin: ElementTree.Element | None, findings: Findings) -> None:
    xyz = numbers_of(origin, "xyz", "0 0 0")
    if isinstance(origin, Element) and xyz and math.hypot(*xyz) > _FAR:
        findings.warn(
            origin,
            f'xyz="{origin.get("xyz")}" is {math.hypot(*xyz):.3g} m long; is it in millimetres? URDF has metres.',
            origin.get("xyz", ""),
            "far",
        )


def check_angles(root: Element, findings: Findings) -> None:
    """Whether an rpy looks like degrees."""
    for origin in [*root.iterfind("joint/origin"), *root.iterfind("link/*/origin")]:
        _check_angles(origin, findings)


def _check_angles(origin: ElementTree.Element | None, findings: Findings) -> None:
    rpy = numbers_of(origin, "rpy", "0 0 0")
    if isinstance(origin, Element) and rpy and max(map(abs, rpy)) > 2.0 * math.pi + 1e-3:
        findings.warn(
            origin, f'rpy="{origin.get("rpy")}" is more than a turn; is it in degrees? URDF has radians.', "", "degrees"
        )


def _check_axis(joint: Joint, findings: Findings) -> None:
    axis = joint.element.find("axis")
    xyz = numbers_of(axis, "xyz", "1 0 0")
    if not isinstance(axis, Element) or xyz is None:
        return
    length, text = math.hypot(*xyz), axis.get("xyz", "")
    if length == 0.0:
        findings.error(axis, f'xyz="{text}" is zero and points nowhere; write a unit vector, such as "0 0 1".', text)
    elif abs(length - 1.0) > _ROUNDING:
        unit = " ".join(f"{value / length:.10g}" for value in xyz)
        findings.error(axis, f'xyz="{text}" has the length {length:.6g}, not 1; write xyz="{unit}".', text)


def _check_limit(joint: Joint, effort_counts: bool, findings: Findings) -> None:
    limit = joint.element.find("limit")
    if not isinstance(limit, Element):
        if joint.kind != "continuous":
            findings.error(
                joint.element,
                f"a {joint.kind} joint needs its limits; write "
                '<limit lower="-1.57" upper="1.57" effort="2.0" velocity="20.0"/>.',
            )
        return
    effort, velocity = numbers_of(limit, "effort", "nan"), numbers_of(limit, "velocity", "nan")
    if effort == [0.0] and effort_counts:
        what = "force" if joint.kind == "prismatic" else "torque"
        unit = "N" if joint.kind == "prismatic" else "N m"
        findings.error(
            limit,
            f'effort="{limit.get("effort")}": no {what} can act on the joint; write the largest {what} [{unit}], '
            'such as effort="2.0", or set hand.effort_limit.',
            "0",
            NO_EFFORT,
        )
    if velocity == [0.0]:
        findings.warn(limit, 'velocity="0": the joint could not move; softhand does not use it.', "0", "no velocity")
    if joint.kind == "continuous":
        return
    for name in ("lower", "upper"):
        if limit.get(name) is None:
            findings.error(limit, f"the attribute {name} of a {joint.kind} joint is missing; without it it is 0.")
    lower, upper = numbers_of(limit, "lower", "0"), numbers_of(limit, "upper", "0")
    if lower is None or upper is None or limit.get("lower") is None or limit.get("upper") is None:
        return
    shown = f'lower="{limit.get("lower")}" upper="{limit.get("upper")}"'
    if lower[0] > upper[0]:
        findings.error(limit, f"{shown}: the limits are the wrong way round; exchange them.", shown)
    elif lower[0] == upper[0]:
        findings.error(limit, f'{shown}: the joint cannot move; write its range or type="fixed".', shown)
    elif joint.kind == "revolute" and max(abs(lower[0]), abs(upper[0])) > 4.0 * math.pi:
        findings.warn(limit, f"{shown} is more than two turns; is it in degrees? URDF has radians.", shown, "degrees")
    elif joint.kind == "prismatic" and max(abs(lower[0]), abs(upper[0])) > _FAR:
        findings.warn(limit, f"{shown} is more than {_FAR:g} m; is it in millimetres? URDF has metres.", shown, "far")


def _check_dynamics(elements: list[ElementTree.Element | None], findings: Findings) -> None:
    """One warning for all damping of the file, and one for all friction."""
    for name, kind in UNUSED.items():
        found = []
        for element in elements:
            value = numbers_of(element, name, "0")
            if isinstance(element, Element) and value and value[0] > 0.0:
                found.append(element)
        if found:
            shown = f'{name}="{found[0].get(name)}"'
            more = f", nor that of {len(found) - 1} more in this file" if len(found) > 1 else ""
            findings.warn(
                found[0],
                f"{shown} is not used{more}: the joints run free of it unless the scenario has "
                f'hand.joints.{name} = "urdf".',
                shown,
                kind,
            )
