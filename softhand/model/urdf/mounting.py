"""A hand put into the world and soft tips put onto its links, as further fixed links of its URDF.

What is in the URDF is in every recording: pictures and analyses find mount and tips without knowing of them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from softhand.errors import ModelError
from softhand.model.urdf.urdf import Urdf, Vector3

MOUNT = "hand_mount"
ZERO: Vector3 = (0.0, 0.0, 0.0)


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
    position: Vector3 = ZERO
    rpy: Vector3 = ZERO


def mounted(hand: Urdf, position: Vector3, rpy: Vector3) -> Urdf:
    """The hand with its root link fixed to a new root, `hand_mount`, at a pose; the same hand for none.

    Args:
        hand: as it is.
        position: of the root link in the base frame [m].
        rpy: its roll, pitch, yaw [rad].

    Raises:
        ModelError: a link is called `hand_mount`.
    """
    return hand.with_link(MOUNT, MOUNT, hand.tree.root, position, rpy) if any((*position, *rpy)) else hand


def with_tips(hand: Urdf, places: Sequence[TipPlace]) -> Urdf:
    """The hand with a link for each soft tip, fixed to the link that carries it.

    Raises:
        ModelError: there is no such link to carry a tip, or the name of the tip is taken.
    """
    for place in places:
        if place.frame not in hand.tree.links:
            raise ModelError(
                f"{hand.file}: no link is called '{place.frame}', which the tip '{place.name}' shall sit on. "
                f"The hand has the links {', '.join(hand.tree.links)}.",
                file=str(hand.file),
            )
        hand = hand.with_link(place.name, place.frame, place.name, place.position, place.rpy)
    return hand
