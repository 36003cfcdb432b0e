"""Where the links of a hand are at given joint angles."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from softhand.model.coupling import CouplingTable, read_map
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array


class Skeleton:
    """Forward kinematics of all frames of a hand.

    Attributes:
        model: the Pinocchio model of the hand alone.
    """

    def __init__(self, hand: Urdf, table: CouplingTable | None = None) -> None:
        self.model = build_model(hand)
        self._map = read_map(hand, self.model, table)
        self._data = self.model.createData()
        self._q = pin.neutral(self.model)

    def move(self, angles: Array) -> None:
        """Put the joints, or the motors of coupled ones, at these angles [rad or m], shape (n,)."""
        if self._map is not None:
            angles = self._map.joint_positions(angles)
        for joint in list(self.model.joints)[1:]:
            angle = angles[joint.idx_v]
            self._q[joint.idx_q : joint.idx_q + joint.nq] = (np.cos(angle), np.sin(angle)) if joint.nq == 2 else angle
        pin.framesForwardKinematics(self.model, self._data, self._q)

    def frame(self, name: str) -> Array:
        """Pose of a link or another frame in the world, shape (4, 4)."""
        pose: Array = self._data.oMf[self._index(name)].homogeneous
        return pose

    @property
    def links(self) -> list[str]:
        """Names of all links."""
        return [frame.name for frame in self.model.frames if frame.type == pin.FrameType.BODY]

    def link_of(self, index: int) -> str:
        """Name of the link whose frame is that of a joint, as a URDF has it; "" for the base."""
        for frame in self.model.frames:
            if frame.type == pin.FrameType.BODY and frame.parentJoint == index and frame.placement.isIdentity():
                return str(frame.name)
        return ""

    def coincide(self, one: str, other: str) -> bool:
        """Whether two frames are the same place of the same body."""
        a, b = (self.model.frames[self._index(name)] for name in (one, other))
        return bool(a.parentJoint == b.parentJoint and a.placement.isApprox(b.placement))

    def seat(self, link: str, tip: str) -> Array | None:
        """Pose of a soft tip on a link that is fixed to another, a rigid tip, shape (4, 4); None on any other link."""
        model = self.model
        place = model.frames[model.frames[self._index(tip)].parentFrame]
        holder = model.frames[self._index(link)]
        fixed = (model.frames[holder.parentFrame].type, place.type) == (pin.FrameType.FIXED_JOINT,) * 2
        if not fixed or place.parentFrame != self._index(link):
            return None
        pose: Array = holder.placement.actInv(place.placement).homogeneous
        return pose

    @property
    def base(self) -> Array:
        """Middle of where the fingers start [m], shape (3,)."""
        starts = [self.model.jointPlacements[k].translation for k in range(1, self.model.njoints)]
        return np.asarray(np.mean([p for k, p in enumerate(starts, 1) if self.model.parents[k] == 0], axis=0))

    def joint(self, index: int) -> Array:
        """Pose of a joint in the world, shape (4, 4)."""
        pose: Array = self._data.oMi[index].homogeneous
        return pose

    def carrier(self, link: str) -> int:
        """Index of the joint that moves a link; 0 for the base."""
        return int(self.model.frames[self._index(link)].parentJoint)

    def _index(self, name: str) -> int:
        """Of a frame; that of the link where a joint has the same name."""
        model, link = self.model, pin.FrameType.BODY
        return int(model.getFrameId(name, link) if model.existFrame(name, link) else model.getFrameId(name))

    def axis(self, index: int) -> Array:
        """Axis of a joint in its own frame, shape (3,)."""
        joint = self.model.joints[index]
        q = pin.neutral(self.model)
        data = self.model.createData()
        pin.computeJointJacobians(self.model, data, q)
        column = pin.getJointJacobian(self.model, data, index, pin.LOCAL)[:, joint.idx_v]
        axis: Array = column[3:] if np.any(column[3:]) else column[:3]
        return axis

    def bones(self, tips: list[str]) -> list[tuple[int, Array]]:
        """What each joint carries in its own frame: origins of the next joints and of the tips, shape (3,) each."""
        model = self.model
        ends = [(model.parents[k], model.jointPlacements[k].translation.copy()) for k in range(1, model.njoints)]
        for tip in tips:
            frame = model.frames[self._index(tip)]
            ends.append((frame.parentJoint, frame.placement.translation.copy()))
        return [(int(joint), end) for joint, end in ends if np.linalg.norm(end) > 1e-6]
