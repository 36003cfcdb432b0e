"""The figures of one finger of a grasp."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from softhand.contact.limit import limit_use
from softhand.contact.records import CONTACT
from softhand.grasping.materials import Material, Torsion
from softhand.grasping.posture import Posture
from softhand.grasping.situation import skeleton
from softhand.grasping.wrenches import tangents
from softhand.model.arm import Arm
from softhand.model.world import own_columns, slides_of
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record


@dataclass(frozen=True, eq=False)
class FingerQuality(Record):
    """One finger of a grasp; NaN is what is not known without a grasp at rest.

    Attributes:
        name: of the tip.
        joint_names: of the joints that move it.
        slides: which of them slide, shape (m,).
        missing: distance of the tip from where it should be, within the joint limits [m]; zero when it gets there.
        stretch: distance of the tip from the finger's first own joint over the length of the finger [1].
        length: of the finger, its joints in line [m].
        angles: of the joints [rad or m], shape (m,).
        reserve: of each joint to its nearer limit, infinite for continuous ones [rad or m], shape (m,).
        torque: that holds the grasp [N m], NaN if a finger does not reach, shape (m,).
        torque_use: the same over the effort limits, shape (m,).
        speeds: singular values of the Jacobian of the tip's centre from the finger's own joints [m/rad], or [m/m] of
            slides, largest first, shape (3,); NaN where the finger has both.
        Phi: angle of the contact on the hemisphere, 0 at the rim, pi/2 at the apex [rad].
        depth: dr [m].
        force: f_x, f_y, f_z [N], tau [N m] on the object, in a contact frame, shape (4,).
        friction_use: |f_t| / (mu f_z), infinite for a contact that would have to pull.
        limit_surface_use: with torsion, see `softhand.contact.limit.limit_use`.
        torsion: how the tip holds against a spin, its length tau_max / (mu f_z) [m] and the curve of its limit surface.
    """

    units: ClassVar = {
        "missing": "m", "stretch": "1", "length": "m", "angles": "rad, m of slides", "reserve": "rad, m of slides",
        "torque": "N m, N of slides", "torque_use": "1", "speeds": "m/rad, 1 of slides", "manipulability": "m^3/rad^3",
        "Phi": "rad", "depth": "m", "force": "N, N, N, N m", "friction_use": "1", "limit_surface_use": "1",
        "torsion": "m, 1",
    }  # fmt: skip

    name: str
    joint_names: tuple[str, ...]
    slides: NDArray[np.bool_]
    missing: float
    stretch: float
    length: float
    angles: Array
    reserve: Array
    torque: Array
    torque_use: Array
    speeds: Array
    Phi: float
    depth: float
    force: Array
    friction_use: float
    limit_surface_use: float
    torsion: Torsion

    @property
    def manipulability(self) -> float:
        """w = sqrt(det J J^T), the product of `speeds` [m^3/rad^3]; zero for a finger that moves in a plane.

        Yoshikawa, Manipulability of Robotic Mechanisms (1985).
        """
        return float(np.prod(self.speeds))


def judge_finger(
    arm: Arm, index: int, posture: Posture, normal: Array, push: Array, torque: Array, tip: Material, friction: float
) -> FingerQuality:
    """The figures of one finger.

    Args:
        arm: at the posture.
        index: of the finger.
        posture: of all fingers.
        normal: into the object at its contact, in the world, shape (3,).
        push: force on the object there [N], in the world, shape (3,).
        torque: that holds the grasp, of all joints [N m], shape (n,).
        tip: its material.
        friction: mu there.
    """
    world = arm.world
    columns, own = list(world.tips[index].columns), own_columns(world, index)
    if world.coupling is not None or not own:  # no finger moves by itself, or this one is the fixed jaw of an arm
        own = columns
    lower, upper = world.position_limits
    centre, slides = arm.tip(index)[0], slides_of(world)
    speeds = np.linalg.svd(arm.point_jacobian(index, centre)[:, own], compute_uv=False)
    if 0 < np.count_nonzero(slides[own]) < len(own):
        speeds = np.full(3, np.nan)
    chain = skeleton(world, arm, index)[len(columns) - len(own) :]
    length = float(np.sum(np.linalg.norm(np.diff(chain, axis=0), axis=1)))
    force = np.array([*(axis @ push for axis in (*tangents(normal), normal)), posture.torsion[index]])
    depth = float(posture.depth[index])
    torsion = tip.torsion(depth if math.isfinite(depth) else tip.depth(float(force[2])))
    use = math.inf if force[2] <= 0.0 else float(np.hypot(force[0], force[1]) / (friction * force[2]))
    return FingerQuality(
        name=world.tips[index].name,
        joint_names=tuple(world.joint_names[column] for column in columns),
        slides=slides[columns],
        missing=float(posture.missing[index]),
        stretch=float(np.linalg.norm(centre - chain[0])) / length if length else 0.0,
        length=length,
        angles=posture.angles[columns],
        reserve=np.minimum(posture.angles - lower, upper - posture.angles)[columns],
        torque=torque[columns],
        torque_use=np.abs(torque[columns]) / world.effort_limit[columns],
        speeds=np.concatenate([speeds, np.zeros(3 - len(speeds))]),
        Phi=float(posture.Phi[index]),
        depth=depth,
        force=force,
        friction_use=use,
        limit_surface_use=_limit_use(torsion, force, friction * force[2]),
        torsion=torsion,
    )


def _limit_use(torsion: Torsion, force: Array, room: float) -> float:
    """`contact.friction.limit_use` of a force; NaN if it is not known."""
    if not np.isfinite(force).all():
        return math.nan
    contact = np.zeros(1, CONTACT)[0]
    contact["curve"] = torsion.curve
    return float(limit_use(contact, (force[0], force[1], force[3] / torsion.length), room))
