"""What is found wrong in a URDF, in words."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from softhand.errors import ModelError
from softhand.model.urdf.document import Element

_MOST = 10  # errors in one message


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

    def error(self, element: Element, message: str, value: str = "") -> None:
        """Add what makes the file unusable."""
        self.append(Finding(element.line, element.place, value, message, True))

    def warn(self, element: Element, message: str, value: str = "") -> None:
        """Add what the file can be used with, but is hardly meant."""
        self.append(Finding(element.line, element.place, value, message, False))

    @property
    def errors(self) -> list[Finding]:
        """Those for which the file is refused, by line."""
        return sorted((finding for finding in self if finding.is_error), key=lambda finding: finding.line)

    @property
    def warnings(self) -> list[Finding]:
        """The others, by line."""
        return sorted((finding for finding in self if not finding.is_error), key=lambda finding: finding.line)

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
