"""Links and joints as a tree: one root, one parent each, no loop, no name twice."""

from __future__ import annotations

from dataclasses import dataclass, field

from softhand.model.urdf.document import Element
from softhand.model.urdf.findings import Findings

MOST_LINKS = 1000
MOVING = ("revolute", "continuous", "prismatic")
_RESERVED = ("universe",)


@dataclass(frozen=True)
class Joint:
    """A joint between two links that exist."""

    element: Element
    name: str
    kind: str
    parent: str
    child: str

    @property
    def is_moving(self) -> bool:
        """Whether it has a degree of freedom."""
        return self.kind in MOVING


@dataclass
class Tree:
    """The links by name, the joints from the root outward, and the root."""

    links: dict[str, Element] = field(default_factory=dict)
    joints: list[Joint] = field(default_factory=list)
    root: str = ""

    def bodies(self) -> dict[str, list[str]]:
        """Links that move as one, by the link that leads them: the root, or the child of a moving joint."""
        leader = {self.root: self.root}
        for joint in self.joints:
            leader[joint.child] = joint.child if joint.is_moving else leader[joint.parent]
        groups: dict[str, list[str]] = {}
        for link, head in leader.items():
            groups.setdefault(head, []).append(link)
        return groups


def read_tree(root: Element, findings: Findings) -> Tree | None:
    """The tree of a URDF; None, with the reasons among the findings, if it has none."""
    before = len(findings.errors)
    links = _by_name(root, "link", findings)
    elements = _by_name(root, "joint", findings)
    if not links:
        findings.error(root, "there is no <link> in it; a URDF has at least one.")
        return None
    if len(links) > MOST_LINKS:
        findings.error(root, f"{len(links)} links; at most {MOST_LINKS} are read.", str(len(links)))
        return None
    joints, parents = [], dict[str, Joint]()
    for name, element in elements.items():
        joint = _read_joint(name, element, links, findings)
        if joint is None:
            continue
        first = parents.setdefault(joint.child, joint)
        if first is not joint:
            findings.error(
                element,
                f"the link '{joint.child}' has two parents: joint '{first.name}' in line {first.element.line} carries "
                "it already; a hand is a tree, cut the loop.",
                joint.child,
            )
        joints.append(joint)
    if len(findings.errors) > before or len(joints) < len(root.findall("joint")):
        return None  # a joint without ends or name is told already
    return _ordered(root, links, joints, parents, findings)


def _by_name(root: Element, tag: str, findings: Findings) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in root:
        if element.tag != tag or not element.get("name"):
            continue
        assert isinstance(element, Element)
        name = element.attrib["name"]
        if name in found:
            findings.error(element, f"this name is there twice, first in line {found[name].line}; rename one.", name)
        elif name in _RESERVED:
            findings.error(element, f"the name '{name}' is taken by Pinocchio; choose another.", name)
        found.setdefault(name, element)
    return found


def _read_joint(name: str, element: Element, links: dict[str, Element], findings: Findings) -> Joint | None:
    ends = []
    for tag in ("parent", "child"):
        end = element.find(tag)
        link = "" if end is None else end.get("link", "")
        if isinstance(end, Element) and link and link not in links:
            listed = ", ".join(list(links)[:12]) + (", ..." if len(links) > 12 else "")
            findings.error(end, f'link="{link}": no link is called so; there are: {listed}.', link)
        ends.append(link if link in links else "")
    parent, child = ends
    if parent and parent == child:
        findings.error(element, f"it joins the link '{child}' to itself; name another parent.", child)
        return None
    return Joint(element, name, element.get("type", ""), parent, child) if parent and child else None


def _ordered(
    root: Element, links: dict[str, Element], joints: list[Joint], parents: dict[str, Joint], findings: Findings
) -> Tree | None:
    """Walk from the root; what is not met hangs on a loop."""
    roots = [name for name in links if name not in parents]
    if len(roots) > 1:
        for name in roots[1:]:
            findings.error(
                links[name],
                f"no joint carries it, nor the link '{roots[0]}': there are {len(roots)} roots; "
                "join it with a <joint>, type fixed if it does not move.",
                name,
            )
        return None
    below: dict[str, list[Joint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    ordered: list[Joint] = []
    waiting = list(reversed(below.get(roots[0], []))) if roots else []
    while waiting:
        joint = waiting.pop()
        ordered.append(joint)
        waiting += reversed(below.get(joint.child, []))
    if len(ordered) < len(joints):
        met = {joint.name for joint in ordered}
        loop = next(joint for joint in joints if joint.name not in met)
        findings.error(
            loop.element, f"it closes a loop of links through '{loop.child}'; a hand is a tree, cut it.", loop.child
        )
        return None
    return Tree(links, ordered, roots[0])
