"""A URDF explained and doubted."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from softhand.model.urdf.examination import examine
from softhand.model.urdf.findings import Findings
from softhand.model.urdf.reading import parse_urdf, read_text
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
    text = read_text(file)
    examination = examine(text, file, folder=file.parent)
    findings, tree = examination.findings, examination.tree
    errors, warnings = ([f"{file}, {one}" for one in some] for some in (findings.errors, findings.warnings))
    if errors or tree is None:
        return UrdfCheckup([], errors, warnings, findings)
    model = parse_urdf(text, file, examination.is_object, file.parent)
    moving = [joint for joint in tree.joints if joint.is_moving]
    carriers = {joint.parent for joint in tree.joints}
    rows = [
        ("kind", "object" if examination.is_object else "hand"),
        ("links", f"{len(tree.links)}, root {tree.root}"),
        ("joints", f"{len(moving)} moving, {len(tree.joints) - len(moving)} fixed"),
        ("moving mass", f"{sum(inertia.mass for inertia in list(model.inertias)[1:]):.4g} kg"),
    ]
    if moving:
        rows.append(("ends", ", ".join(name for name in tree.links if name not in carriers)))
    return UrdfCheckup(rows, errors, warnings, findings)
