"""What is found wrong in a URDF, in words."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from softhand.errors import ModelError
from softhand.model.urdf.document import Element, owner_of

_MOST = 10  # errors in one message
_MANY = 3  # of one kind that are told in one line
_NAMED = 6  # of these


@dataclass(frozen=True)
class Finding:
    """One mistake, or one thing that looks like one."""

    line: int
    element: str
    """Such as `<mass> of link 'palm'`."""
    value: str
    """As it stands in the file; "" if something is missing."""
    message: str
    """What is wrong and what to do."""
    is_error: bool
    kind: str = ""
    """What it has in common with others that are told in one line with it; "" for one of its own."""
    place: str = ""
    """The link or joint, or the name of the element."""

    def __str__(self) -> str:
        return f"line {self.line}, {self.element}: {self.message}"


class Findings(list[Finding]):
    """All findings in one file.

    Attributes:
        file: where the text comes from.
    """

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.file = file

    def error(self, element: Element, message: str, value: str = "", kind: str = "") -> None:
        """Add what makes the file unusable."""
        self._add(element, message, value, kind, True)

    def warn(self, element: Element, message: str, value: str = "", kind: str = "") -> None:
        """Add what the file can be used with, but is hardly meant."""
        self._add(element, message, value, kind, False)

    def _add(self, element: Element, message: str, value: str, kind: str, is_error: bool) -> None:
        self.append(Finding(element.line, element.place, value, message, is_error, kind, owner_of(element)))

    @property
    def errors(self) -> list[Finding]:
        """Those for which the file is refused, by line; many of one kind are one."""
        return _gathered(finding for finding in self if finding.is_error)

    @property
    def warnings(self) -> list[Finding]:
        """The others, likewise."""
        return _gathered(finding for finding in self if not finding.is_error)

    def raise_errors(self) -> None:
        """ModelError with one line an error, if there is any; carries file, line, element and value of the first."""
        errors = self.errors
        if not errors:
            return
        lines = [f"{self.file}, {error}" for error in errors[:_MOST]]
        if len(errors) > _MOST:
            lines.append(f"{self.file}: and {len(errors) - _MOST} more.")
        first = errors[0]
        raise ModelError(
            "\n".join(lines), file=str(self.file), line=first.line, element=first.element, value=first.value
        )


def _gathered(findings: Iterable[Finding]) -> list[Finding]:
    """By line, and many of one kind as one: that of the first, with the names of all."""
    groups: dict[object, list[Finding]] = {}
    for k, finding in enumerate(sorted(findings, key=lambda finding: finding.line)):
        groups.setdefault((finding.kind, finding.element.partition(" ")[0]) if finding.kind else k, []).append(finding)
    told = []
    for group in groups.values():
        told += [_as_one(group)] if len(group) >= _MANY else group
    return sorted(told, key=lambda finding: finding.line)


def _as_one(group: list[Finding]) -> Finding:
    first, names = group[0], list(dict.fromkeys(finding.place for finding in group))
    listed = ", ".join(names[:_NAMED]) + (f" and {len(names) - _NAMED} more" if len(names) > _NAMED else "")
    tag = first.element.partition(" ")[0]
    message = first.message if len({finding.message for finding in group}) == 1 else f"the first: {first.message}"
    return replace(first, element=f"{tag} in {len(group)} places ({listed})", message=message)
