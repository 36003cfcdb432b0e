"""Joints that follow another one by `<mimic>` to where their own limits do not let them, as one sign is wrong.

A hand that is the mirror image of another one, or whose joint axes were turned, often has the limits of a follower with
the old sign, or its multiplier. Which of the two it is, the file does not tell: with the limits turned the joint goes
where its multiplier says, with the multiplier turned it goes the other way. So a scenario says it, joint by joint.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from softhand.errors import ScenarioError
from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.mimics import Mimic, read_mimics
from softhand.model.urdf.repair import Edit, replaced
from softhand.model.urdf.tree import Joint, Tree

KEY = "hand.mimic_signs"
LIMITS, MULTIPLIER = "limits", "multiplier"


class Clash(NamedTuple):
    """A follower whose limits have nothing in common with those of its leader but an end."""

    joint: str
    mimic: Mimic
    limits: tuple[float, float]
    """Its own [rad or m]."""
    reached: tuple[float, float]
    """Where its leader would bring it [rad or m]."""

    def __str__(self) -> str:
        (low, high), (first, last) = self.limits, self.reached
        return (
            f"'{self.joint}' follows '{self.mimic.leader}' by the multiplier {self.mimic.multiplier:g}, which brings "
            f"it from {first:.4g} to {last:.4g}, and its limits are {low:.4g} and {high:.4g}"
        )


def clashes(tree: Tree) -> list[Clash]:
    """All of a hand; none if either has no limits.

    Args:
        tree: without errors.
    """
    joints, found = {joint.name: joint for joint in tree.joints}, []
    for name, mimic in read_mimics(tree).items():
        own, leading = _limits(joints[name]), _limits(joints[mimic.leader])
        if own is None or leading is None:
            continue
        first, last = sorted(mimic.multiplier * end + mimic.offset for end in leading)
        if max(own[0], first) >= min(own[1], last):
            found.append(Clash(name, mimic, own, (first + 0.0, last + 0.0)))
    return found


def remedy(found: Sequence[Clash]) -> str:
    """What a scenario can say of some clashes."""
    names = ", ".join(f'{clash.joint} = "{LIMITS}"' for clash in found)
    which = f'"{MULTIPLIER}" in place of "{LIMITS}" where that is what is wrong'
    bends = f"one of two signs is wrong; see which way the joint bends, and write {KEY} = {{ {names} }}, {which}"
    return f"{bends} (softhand new has --wrong-sign for it)"


def turned(text: str, tree: Tree, asked: Sequence[tuple[str, str]], findings: Findings) -> list[Edit]:
    """The sign of the limits, or of the multiplier, of some followers turned.

    Limits are mirrored at the offset of the `<mimic>`, where the joint is with its leader at zero.

    Args:
        text: of the URDF.
        tree: its joints.
        asked: names of joints, and `LIMITS` or `MULTIPLIER` of each.
        findings: a warning for each, with what was and what is.

    Raises:
        ScenarioError: a joint is none that follows, or has no limits.
    """
    return list(_turned(text, tree, asked, findings))


def _turned(text: str, tree: Tree, asked: Sequence[tuple[str, str]], findings: Findings) -> Iterator[Edit]:
    followers = {joint.name: joint for joint in tree.joints if _element(joint, "mimic") is not None}
    for name, what in asked:
        joint = followers.get(name)
        mimic = None if joint is None else _element(joint, "mimic")
        if joint is None or mimic is None:
            raise ScenarioError(
                f"{KEY}: '{name}' follows no other joint by <mimic>; there are: {', '.join(followers) or 'none'}.",
                key=f"{KEY}.{name}", value=name,
            )  # fmt: skip
        multiplier, offset = (_number(mimic, key, default) for key, default in (("multiplier", "1"), ("offset", "0")))
        if what == MULTIPLIER:
            element, values = mimic, {"multiplier": repr(-multiplier)}
            told = f"its multiplier was {multiplier:g}, and is {-multiplier:g} now"
        else:
            limit, limits = _element(joint, "limit"), _limits(joint)
            if limit is None or limits is None:
                raise ScenarioError(
                    f"{KEY}: '{name}' has no limits that could have the wrong sign; leave it out.", key=f"{KEY}.{name}",
                    value=what,
                )  # fmt: skip
            low, high = 2.0 * offset - limits[1] + 0.0, 2.0 * offset - limits[0] + 0.0
            element, values = limit, {"lower": repr(low), "upper": repr(high)}
            told = f"its limits were {limits[0]:.4g} and {limits[1]:.4g}, and are {low:.4g} and {high:.4g} now"
        findings.warn(element, f'mimic_signs = "{what}": {told}.', kind="turned")
        inside = " ".join(f'{key}="{value}"' for key, value in {**element.attrib, **values}.items())
        yield replaced(text, element, f"<{element.tag} {inside}/>")


def _element(joint: Joint, tag: str) -> Element | None:
    element = joint.element.find(tag)
    return element if isinstance(element, Element) else None


def _limits(joint: Joint) -> tuple[float, float] | None:
    """Lower and upper limit; None if the joint has none."""
    element = _element(joint, "limit")
    if element is None or joint.kind not in ("revolute", "prismatic"):
        return None
    low, high = _number(element, "lower", "0"), _number(element, "upper", "0")
    return (low, high) if math.isfinite(low) and math.isfinite(high) else None


def _number(element: Element, name: str, default: str) -> float:
    values = numbers_of(element, name, default)
    assert values is not None
    return values[0]
