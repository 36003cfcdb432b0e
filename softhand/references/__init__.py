"""What the controller is asked for, against time."""

from typing import TYPE_CHECKING

from softhand.plugins import attributes

if TYPE_CHECKING:  # for editors
    from softhand.references.hold import Hold as Hold
    from softhand.references.reference import Reference as Reference
    from softhand.references.straight import MinimumJerk as MinimumJerk
    from softhand.references.straight import Step as Step
    from softhand.references.waypoints import Waypoints as Waypoints
else:
    __getattr__, __dir__ = attributes("references")
