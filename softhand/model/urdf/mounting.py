"""A hand put into the world and soft tips put onto its links, as further fixed links of its URDF.

What is in the URDF is in every recording: pictures and analyses find mount and tips without knowing of them.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

from softhand.errors import ModelError
from softhand.model.urdf.document import read_document

Vector3 = tuple[float, float, float]

MOUNT = "hand_mount"
_ZERO = (0.0, 0.0, 0.0)
AT_ORIGIN = (_ZERO, _ZERO)
"""Position [m] and roll, pitch, yaw [rad]."""


@dataclass(frozen=True)
class TipPlace:
    """Where a soft tip sits on a link.

    Attributes:
        name: of the tip, and of the link that is made for it.
        frame: the link that carries it.
        position: centre of the hemisphere's flat face in the frame of that link [m].
        rpy: roll, pitch, yaw of the finger frame F there, whose x points out of the tip [rad].
    """

    name: str
    frame: str
    position: Vector3 = _ZERO
    rpy: Vector3 = _ZERO


def mounted(text: str, file: Path, position: Vector3 = _ZERO, rpy: Vector3 = _ZERO) -> str:
    """The URDF with its root link fixed to a new root, `hand_mount`, at a pose; the same text for none.

    Args:
        text: a URDF that has passed all checks.
        file: where it comes from, for messages.
        position: of the root link in the base frame [m].
        rpy: its roll, pitch, yaw [rad].

    Raises:
        ModelError: a link is called `hand_mount`.
    """
    if not any((*position, *rpy)):
        return text
    root = read_document(text, file)
    children = {child.get("link") for child in root.iterfind("joint/child")}
    base = next(name for name in _links(root) if name not in children)
    return _with_link(text, file, MOUNT, MOUNT, base, position, rpy)


def with_tips(text: str, file: Path, places: Sequence[TipPlace]) -> str:
    """The URDF with a link for each soft tip, fixed to the link that carries it.

    Args:
        text: a URDF that has passed all checks.
        file: where it comes from, for messages.
        places: of the tips.

    Raises:
        ModelError: there is no such link to carry a tip, or the name of the tip is taken.
    """
    for place in places:
        links = _links(read_document(text, file))
        if place.frame not in links:
            raise ModelError(
                f"{file}: no link is called '{place.frame}', which the tip '{place.name}' shall sit on. "
                f"The hand has the links {', '.join(links)}.",
                file=str(file),
            )
        text = _with_link(text, file, place.name, place.frame, place.name, place.position, place.rpy)
    return text


def _links(root: object) -> list[str]:
    return [link.get("name", "") for link in root.iterfind("link")]  # type: ignore[attr-defined]


def _with_link(text: str, file: Path, new: str, parent: str, child: str, position: Vector3, rpy: Vector3) -> str:
    """One link more, at one end of one fixed joint more, in the last line of the URDF."""
    root = read_document(text, file)
    joint = f"{new}_place"
    taken = {element.get("name") for element in root if element.tag in ("link", "joint")}
    for name in (new, joint):
        if name in taken:
            raise ModelError(
                f"{file}: a link or joint is called '{name}' already; give the tip another name.", file=str(file)
            )
    xyz, angles = (" ".join(map(repr, map(float, numbers))) for numbers in (position, rpy))
    lines = (
        f'<link name={quoteattr(new)}/><joint name={quoteattr(joint)} type="fixed"><parent link={quoteattr(parent)}/>'
        f'<child link={quoteattr(child)}/><origin xyz="{xyz}" rpy="{angles}"/></joint>'
    )
    end = list(re.finditer(r"</robot\s*>", text))[-1]
    return text[: end.start()] + lines + text[end.start() :]
