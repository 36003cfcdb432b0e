"""A hand where it stands, with its fingertips, as a Pinocchio model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from softhand.model.urdf.examination import HAND
from softhand.model.urdf.mounting import ZERO, TipPlace, mounted, with_tips
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf, Vector3


@dataclass(frozen=True, eq=False)
class HandModel:
    """A hand where it stands, with its fingertips.

    Attributes:
        urdf: joints and links, with the mount and the tips that were placed.
        tips: name of the frame of each fingertip: centre of the hemisphere's flat face, x out of the tip.
        effort_limit: of every joint, in place of those of the URDF [N m or N].
    """

    urdf: Urdf
    tips: tuple[str, ...]
    effort_limit: float | None = None

    @classmethod
    def read(
        cls,
        file: str | Path,
        tips: Sequence[str | TipPlace],
        position: Vector3 = ZERO,
        rpy: Vector3 = ZERO,
        effort_limit: float | None = None,
    ) -> HandModel:
        """Read a hand and put it into the world.

        Args:
            file: URDF, fixed at its root.
            tips: a frame of each fingertip, or its place on a link.
            position: of the root link in the world [m].
            rpy: roll, pitch, yaw of the root link [rad].
            effort_limit: as above.

        Raises:
            ModelError: the file cannot be used, or a tip has no link to sit on.
        """
        urdf = mounted(Urdf.read(file, replace(HAND, effort_counts=effort_limit is None)), position, rpy)
        urdf = with_tips(urdf, [tip for tip in tips if isinstance(tip, TipPlace)])
        return cls(urdf, tuple(tip if isinstance(tip, str) else tip.name for tip in tips), effort_limit)

    def build(self) -> pin.Model:
        """Its Pinocchio model."""
        model = build_model(self.urdf)
        if self.effort_limit is not None:
            model.upperEffortLimit = np.full(model.nv, self.effort_limit)
            model.lowerEffortLimit = -model.upperEffortLimit
        return model
