"""The reference that stays where the run starts."""

from __future__ import annotations

from softhand.references.goal import Goal
from softhand.references.reference import Motion, Reference, resting


class Hold(Reference):
    """The start, kept: pose, internal force, opening of the fingers."""

    def start(self, start: Goal) -> Motion:
        """At rest from the begin."""
        return resting(start)
