"""Inertias that a URDF lacks, or that no body has, put into its text where a scenario asks for it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

from softhand.errors import ModelError
from softhand.model.shapes.mass import Solid, ball, joined, solid_of
from softhand.model.urdf.bodies import masses_of, weightless
from softhand.model.urdf.composite import Part, balanced, moments_of, parts_of, tensor_of
from softhand.model.urdf.document import Element, as_bytes
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.geometry import geometries_of
from softhand.model.urdf.grammar import numbers_of
from softhand.model.urdf.inertias import impossible
from softhand.model.urdf.tree import Tree
from softhand.numerics.arrays import Array

BALANCE = "balance"
"""Repair: the nearest inertia that a body can have."""

_BEAD = 0.005  # [m] radius of the ball that stands for a link without any shape
_START_TAG = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_NAMES = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


class Edit(NamedTuple):
    """Bytes of a text that others shall stand for."""

    start: int
    stop: int
    by: str


def edited(text: str, edits: list[Edit]) -> str:
    """The text with all edits made; each line stays where it is."""
    data = as_bytes(text)
    for edit in sorted(edits, reverse=True):
        lines = b"\n" * data.count(b"\n", edit.start, edit.stop)
        data = data[: edit.start] + as_bytes(edit.by) + lines + data[edit.stop :]
    return data.decode()


def balance(text: str, tree: Tree, is_object: bool, findings: Findings) -> list[Edit]:
    """The nearest possible inertia for each link that makes a body which moves an impossible one; see `balanced`.

    Args:
        text: of the URDF.
        tree: its links and joints.
        is_object: whether the root moves.
        findings: a warning for each, with the moments before and after.
    """
    edits, carriers = [], {joint.child: joint for joint in tree.joints}
    for leader, members in tree.bodies().items():
        if leader == tree.root and not is_object:
            continue
        for part in impossible(parts_of([tree.links[name] for name in members], members, carriers)):
            edits.append(_balanced(text, part, findings))
    return edits


def weigh(
    text: str, tree: Tree, is_object: bool, folder: Path | None, density: float, findings: Findings
) -> tuple[list[Edit], set[str]]:
    """Masses and inertias for each body that moves without any, from its shapes.

    The collision shapes of a link are taken, its visual shapes if it has none or one of these cannot be read. A body
    without shapes is taken as a ball of 5 mm radius.

    Args:
        text: of the URDF.
        tree: its links and joints.
        is_object: whether the root moves.
        folder: where its meshes lie.
        density: [kg/m^3].
        findings: a warning for each link with its mass and moments, and an error where there is no volume.

    Returns:
        The edits, and the links that lead a body whose shapes cannot be taken.
    """
    edits: list[Edit] = []
    failed = set()
    for leader, members in weightless(tree, is_object, masses_of(tree)).items():
        try:
            found = {name: _solid_of(tree.links[name], folder) for name in members}
        except ModelError as error:
            findings.error(tree.links[leader], f"no mass, and none from its shapes: {error}", kind="no volume")
            failed.add(leader)
            continue
        if not any(found.values()):
            found[leader] = _bead()
        edits += [_weighed(text, tree.links[name], *solid, density, findings) for name, solid in found.items() if solid]
    return edits, failed


def _balanced(text: str, part: Part, findings: Findings) -> Edit:
    element = part.element
    values = [value[0] for name in _NAMES if (value := numbers_of(element, name, "nan"))]
    before = tensor_of(values)
    after = balanced(before, part.mass)
    findings.warn(
        element,
        f'repair = "{BALANCE}": its principal moments were {_listed(moments_of(before))}, which no body has, and are '
        f"{_listed(moments_of(after))} kg m^2 now.",
        kind="balanced",
    )
    return replaced(text, element, _inertia(after))


def _weighed(text: str, link: Element, solid: Solid, what: str, density: float, findings: Findings) -> Edit:
    mass, inertia = density * solid.volume, density * solid.inertia
    xyz = " ".join(map(repr, solid.centre.tolist()))
    inertial = f'<inertial><origin xyz="{xyz}"/><mass value="{mass!r}"/>{_inertia(inertia)}</inertial>'
    findings.warn(
        link,
        f"density = {density:g}: from {what}, {1e6 * solid.volume:.4g} cm^3, it has a mass of {mass:.4g} kg and "
        f"principal moments of {_listed(moments_of(inertia))} kg m^2.",
        kind="weighed",
    )
    there = link.find("inertial")
    return replaced(text, there, inertial) if isinstance(there, Element) else _appended(text, link, inertial)


def _solid_of(link: Element, folder: Path | None) -> tuple[Solid, str] | None:
    """The solid of a link and what it is made of; None without shapes."""
    trouble = None
    for purpose in ("collision", "visual"):
        shapes = list(geometries_of(link, folder, purpose))
        if not shapes:
            continue
        try:
            solids = [solid_of(shape) for shape in shapes]
        except ModelError as error:
            trouble = trouble or error
            continue
        hulls = sum(is_hull for _, is_hull in solids)
        how = f", {hulls} of them the hull of a mesh that is open" if hulls else ""
        count = f"its {purpose} shape" if len(solids) == 1 else f"{len(solids)} {purpose} shapes"
        return joined([solid for solid, _ in solids]), count + (
            how if len(solids) > 1 else " (the hull of a mesh that is open)" if hulls else ""
        )
    if trouble is not None:
        raise trouble
    return None


def _bead() -> tuple[Solid, str]:
    return ball(_BEAD), f"a ball of {1e3 * _BEAD:g} mm radius, as it has no shape"


def _inertia(inertia: Array) -> str:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = inertia.tolist()
    values = " ".join(f'{name}="{value!r}"' for name, value in zip(_NAMES, (xx, xy, xz, yy, yz, zz), strict=True))
    return f"<inertia {values}/>"


def replaced(text: str, element: Element, by: str) -> Edit:
    """An element with all that is in it, and what stands for it."""
    data = as_bytes(text)
    tag = _tag_end(data, element)
    is_empty = data[tag - 2 : tag] == b"/>"
    return Edit(element.start, tag if is_empty else data.index(b">", element.end) + 1, by)


def _appended(text: str, element: Element, child: str) -> Edit:
    data = as_bytes(text)
    tag = _tag_end(data, element)
    if data[tag - 2 : tag] == b"/>":
        return Edit(tag - 2, tag, f">{child}</{element.tag}>")
    return Edit(element.end, element.end, child)


def _tag_end(data: bytes, element: Element) -> int:
    found = _START_TAG.match(data, element.start)
    assert found is not None
    return found.end()


def _listed(moments: Array) -> str:
    return ", ".join(f"{value:.4g}" for value in moments + 0.0)  # no -0
