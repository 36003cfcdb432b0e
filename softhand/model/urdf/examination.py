"""All checks of a URDF in their order."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from softhand.errors import ModelError
from softhand.model.urdf.bodies import NO_MASS, check_bodies
from softhand.model.urdf.document import Element, read_document
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.grammar import check_grammar
from softhand.model.urdf.inertias import IMPOSSIBLE
from softhand.model.urdf.joints import check_angles, check_joints, check_types
from softhand.model.urdf.mimic_signs import turned
from softhand.model.urdf.repair import balance, edited, weigh
from softhand.model.urdf.shapes import check_shapes
from softhand.model.urdf.tree import MOVING, Tree, read_tree


@dataclass(frozen=True)
class Role:
    """What a URDF shall be, and what of it counts. What does not count may be wrong.

    Attributes:
        is_object: one rigid body that moves freely, or a hand fixed at its root; None to tell it by its joints.
        effort_counts: whether torques are limited by its efforts.
        shape_counts: whether the collision shape of an object is touched; that of a hand never is.
        repair: `balance` to put the nearest possible inertia in the place of one that no body has; "" to refuse it.
        density: of what moves without a mass, to take mass and inertia from its shapes [kg/m^3]; None to refuse it.
        turned: joints that follow by `<mimic>`, and of each whether its limits or its multiplier have the wrong sign.
    """

    is_object: bool | None = None
    effort_counts: bool = True
    shape_counts: bool = True
    repair: str = ""
    density: float | None = None
    turned: tuple[tuple[str, str], ...] = ()


EITHER, HAND, OBJECT = Role(), Role(is_object=False), Role(is_object=True)


@dataclass(frozen=True)
class Examination:
    """What was found in a URDF.

    Attributes:
        text: the URDF.
        file: where it comes from.
        folder: where its meshes lie; None if they were not looked for.
        root: its elements.
        findings: errors and warnings.
        tree: links and joints; None if they are none.
        is_object: whether its root moves freely.
    """

    text: str
    file: Path
    folder: Path | None
    root: Element
    findings: Findings
    tree: Tree | None
    is_object: bool


def examine(text: str, file: Path, role: Role = EITHER, folder: Path | None = None) -> Examination:
    """Check a URDF from its text alone.

    Args:
        text: the URDF.
        file: where it comes from, for messages.
        role: what it shall be.
        folder: where its meshes lie; they are not looked for if None.

    Raises:
        ModelError: it is no XML or no URDF. All else is among the findings.
    """
    found = _examine(text, file, role, folder)
    return _mended(found, role) if role.repair or role.density is not None or role.turned else found


def _mended(found: Examination, role: Role) -> Examination:
    """With the inertias and the signs that are asked for in its text, and a warning for each."""
    others = [finding for finding in found.findings if finding.kind not in (IMPOSSIBLE, NO_MASS)]
    if found.tree is None or any(finding.is_error for finding in others):
        found.findings[:] = others  # what these would tell is mended as soon as the others are
        return found
    notes, failed = Findings(found.file), set[str]()
    edits = balance(found.text, found.tree, found.is_object, notes) if role.repair else []
    if role.density is not None:
        more, failed = weigh(found.text, found.tree, found.is_object, found.folder, role.density, notes)
        edits += more
    edits += turned(found.text, found.tree, role.turned, notes)
    if edits:
        found = _examine(edited(found.text, edits), found.file, role, found.folder)
    told = [one for one in found.findings if not (one.kind == NO_MASS and one.place in failed)]
    found.findings[:] = [*told, *notes]
    return found


def _examine(text: str, file: Path, role: Role, folder: Path | None) -> Examination:
    root = read_document(text, file)
    if root.tag != "robot":
        message = f"{file}, line {root.line}: the root element is <{root.tag}>; a URDF starts with <robot>."
        raise ModelError(message, file=str(file), line=root.line, element=root.place, value=root.tag)
    findings = Findings(file)
    is_object = role.is_object
    if is_object is None:
        is_object = not any(joint.get("type") in MOVING for joint in root.iterfind("joint"))
    check_grammar(root, findings)
    check_types(root, findings)
    check_angles(root, findings)
    check_shapes(root, folder, is_object and role.shape_counts, findings)
    tree = read_tree(root, findings)
    if tree is not None:
        check_joints(tree, role.effort_counts, findings)
        check_bodies(tree, is_object, findings)
        if is_object:
            _check_rigid(tree, findings)
    return Examination(text, file, folder, root, findings, tree, is_object)


def _check_rigid(tree: Tree, findings: Findings) -> None:
    moving = next((joint for joint in tree.joints if joint.is_moving), None)
    if moving is not None:
        findings.error(
            moving.element, f'type="{moving.kind}": an object is one rigid body; make its joints fixed.', moving.kind
        )
