"""A URDF explained and doubted."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from softhand.collision.loose_parts import doubts_of_parts
from softhand.errors import ModelError
from softhand.model.shapes.reading import read_shape
from softhand.model.urdf.document import read_text
from softhand.model.urdf.examination import examine
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.mimic_signs import clashes, remedy
from softhand.model.urdf.mimics import read_mimics
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.record import Record


@dataclass(frozen=True)
class UrdfCheckup(Record):
    """What a URDF is and what is doubtful about it.

    Attributes:
        rows: name and text of what is in it; nothing where there are errors.
        errors: why it is refused, a sentence each.
        warnings: what it can be used with, but is hardly meant, a sentence each.
        findings: all of these with their lines.
    """

    unreported: ClassVar = frozenset({"findings"})

    rows: list[tuple[str, str]]
    errors: list[str]
    warnings: list[str]
    findings: Findings

    def tables(self, name: str) -> list[tuple[str, list[tuple[str, ...]]]]:
        """Title and rows of each table, for a file of that name."""
        return [(name, list(self.rows))] if self.rows else []

    def raise_errors(self, name: str) -> None:
        """One ModelError of all errors, if there are any."""
        self.findings.raise_errors()


def check_urdf(file: Path) -> UrdfCheckup:
    """Examine a URDF.

    Raises:
        ModelError: it is no URDF, or Pinocchio refuses it.
    """
    examination = examine(read_text(file), file, folder=file.parent)
    findings = examination.findings
    errors, warnings = ([f"{file}, {one}" for one in some] for some in (findings.errors, findings.warnings))
    if errors or examination.tree is None:
        return UrdfCheckup([], errors, warnings, findings)
    urdf = Urdf.of(examination)
    model = build_model(urdf)
    moving, joints = urdf.moving_joints, urdf.tree.joints
    rows = [
        ("kind", "object" if urdf.is_object else "hand"),
        ("links", f"{len(urdf.tree.links)}, root {urdf.tree.root}"),
        ("joints", f"{len(moving)} moving, {len(joints) - len(moving)} fixed"),
        ("moving mass", f"{sum(inertia.mass for inertia in list(model.inertias)[1:]):.4g} kg"),
    ]
    mimics = read_mimics(urdf.tree)
    if mimics:
        motors = [joint.name for joint in moving if joint.name not in mimics]
        rows.append(("motors", f"{len(motors)} by <mimic>: {', '.join(motors)}"))
    clashing = clashes(urdf.tree)
    if clashing:
        warnings.append(f"{file}: {'; '.join(map(str, clashing))}; {remedy(clashing)}.")
    if moving:
        rows.append(("ends", ", ".join(urdf.ends)))
    if urdf.is_object:
        try:
            shape = read_shape(urdf, model)
        except ModelError as error:  # why the tips cannot touch it as it is, and what to do
            warnings.append(str(error))
        else:
            rows.append(("shape", _in_words([geometry.kind for geometry in urdf.geometries("collision")])))
            warnings += [f"{file}: {one}" for one in doubts_of_parts(shape)]
    return UrdfCheckup(rows, errors, warnings, findings)


def _in_words(kinds: list[str]) -> str:
    """Such as `4 parts: 3 cylinders, 1 sphere`."""
    if len(kinds) == 1:
        return kinds[0]
    endings = {"box": "es", "mesh": "es"}
    counts = Counter(kinds).items()
    told = ", ".join(f"{count} {kind}{endings.get(kind, 's') if count > 1 else ''}" for kind, count in counts)
    return f"{len(kinds)} parts: {told}"
