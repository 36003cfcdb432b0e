"""A hand where it stands, with its fingertips, as a Pinocchio model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import pinocchio as pin

from softhand.model.coupling import CouplingTable
from softhand.model.joint_mechanics import JointTable
from softhand.model.urdf.carrying import ArmPlace, carried
from softhand.model.urdf.examination import HAND
from softhand.model.urdf.mimics import read_mimics
from softhand.model.urdf.mounting import ZERO, TipPlace, mounted, with_tips
from softhand.model.urdf.urdf import Urdf, Vector3


@dataclass(frozen=True, eq=False)
class HandModel:
    """A hand where it stands, with its fingertips.

    Attributes:
        urdf: joints and links, with the mount and the tips that were placed.
        tips: name of the frame of each fingertip: centre of the hemisphere's flat face, x out of the tip.
        effort_limit: of every joint of the hand, in place of those of the URDF [N m or N].
        coupling: of its joints to motors, beside what its URDF says.
        mechanics: what its joints have of their own.
        carriers: names of the joints of the arm that carries it, whose effort limits stay.
    """

    urdf: Urdf
    tips: tuple[str, ...]
    effort_limit: float | None = None
    coupling: CouplingTable | None = None
    mechanics: JointTable | None = None
    carriers: frozenset[str] = frozenset()

    @classmethod
    def read(
        cls,
        file: str | Path,
        tips: Sequence[str | TipPlace],
        position: Vector3 = ZERO,
        rpy: Vector3 = ZERO,
        effort_limit: float | None = None,
        repair: str = "",
        density: float | None = None,
        coupling: CouplingTable | None = None,
        mechanics: JointTable | None = None,
        arm: ArmPlace | None = None,
        turned: tuple[tuple[str, str], ...] = (),
    ) -> HandModel:
        """Read a hand and put it into the world.

        Args:
            file: URDF, fixed at its root.
            tips: a frame of each fingertip, or its place on a link.
            position: of the root link in the world, with an arm of that of the arm [m].
            rpy: roll, pitch, yaw of that link [rad].
            effort_limit: as above.
            repair: `balance` to take the nearest possible inertia in the place of one that no body has.
            density: from which links that move without a mass get one by their shapes [kg/m^3].
            coupling: as above.
            mechanics: as above.
            arm: that carries it; none for a hand that is fixed to the world.
            turned: joints that follow by `<mimic>` and have the wrong sign, see `mimic_signs.turned`.

        Raises:
            ModelError: the file cannot be used, or a tip has no link to sit on.
        """
        counts = effort_limit is None and coupling is None
        bare = Urdf.read(file, replace(HAND, effort_counts=counts, repair=repair, density=density, turned=turned))
        places = [
            replace(t, position=_numbers(t.position), rpy=_numbers(t.rpy)) for t in tips if not isinstance(t, str)
        ]
        urdf = _placed(bare, arm, _numbers(position), _numbers(rpy), tuple(places))
        names = tuple(tip if isinstance(tip, str) else tip.name for tip in tips)
        own = {joint.name for joint in bare.moving_joints}
        carriers = frozenset(joint.name for joint in urdf.moving_joints if joint.name not in own)
        return cls(urdf, names, effort_limit, coupling, mechanics, carriers)

    @property
    def has_mimics(self) -> bool:
        """Whether a joint follows another one by its URDF."""
        return bool(read_mimics(self.urdf.tree))

    def limit_efforts(self, model: pin.Model) -> None:
        """Put the effort limit, if there is one, on the joints of the hand in a model."""
        if self.effort_limit is None:
            return
        own = [joint.name for joint in self.urdf.moving_joints if joint.name not in self.carriers]
        rows = [model.joints[model.getJointId(name)].idx_v for name in own]
        for bound, sign in (("upperEffortLimit", 1.0), ("lowerEffortLimit", -1.0)):
            limits = getattr(model, bound).copy()
            limits[rows] = sign * self.effort_limit
            setattr(model, bound, limits)


def _numbers(vector: Vector3) -> Vector3:
    x, y, z = (float(number) for number in vector)
    return x, y, z


@lru_cache(maxsize=16)
def _placed(urdf: Urdf, arm: ArmPlace | None, position: Vector3, rpy: Vector3, tips: tuple[TipPlace, ...]) -> Urdf:
    """The hand with arm, mount and tips: the same object for the same hand, so that what is made of it can be kept."""
    return with_tips(mounted(urdf if arm is None else carried(urdf, arm), position, rpy), tips)
