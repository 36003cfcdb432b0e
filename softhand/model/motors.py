"""The coordinates of coupled joints: a model whose joints are the motors, and tables by which kernels project."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import pinocchio as pin

from softhand.model.configuration import ADDITIVE, CONTINUOUS
from softhand.model.coupled import Coupled
from softhand.model.coupling import Coupling

_TWIST, _POSE = 6, 7


def motor_model(coupling: Coupling) -> pin.Model:
    """A model with one joint a motor and the free-flyer of the object, for what only asks how q is laid out."""
    model = pin.Model()
    for name, kind in zip(coupling.motors, coupling.kinds, strict=True):
        joint = pin.JointModelRUBX() if kind == CONTINUOUS else pin.JointModelPX()
        model.addJoint(0, joint, pin.SE3.Identity(), name)
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "object")
    return model


def motors_of(coupling: Coupling, joints: Sequence[int]) -> tuple[int, ...]:
    """The motors that move any of some joints, in their order."""
    return tuple(np.flatnonzero(np.any(coupling.S[list(joints)] != 0.0, axis=0)).tolist())


def view_of(coupling: Coupling, model: pin.Model, tips: Sequence[int], joint: int, base: int) -> int:
    """First column of J of what the motors do to the body of a joint, or to a tip as another tip sees it.

    Args:
        coupling: of the hand.
        model: of hand and object.
        tips: joint that carries each tip.
        joint: whose body moves.
        base: what it is seen from: another tip's joint, or any other body, whose motion is not subtracted.
    """
    views = _views(model, tips)
    pair = joint, base
    return model.nv + (len(coupling.motors) + _TWIST) * views.index(pair if pair in views else (joint, 0))


def _views(model: pin.Model, tips: Sequence[int]) -> list[tuple[int, int]]:
    """Joint and base of each view: first of each body alone, the object as the first, then of each two tips."""
    alone = [(joint, 0) for joint in (model.njoints - 1, *range(model.njoints - 1))]
    return [*alone, *((one, other) for a, b in combinations(tips, 2) for one, other in ((a, b), (b, a)))]


def coupled_of(coupling: Coupling, coordinates: pin.Model, model: pin.Model, tips: Sequence[int]) -> Coupled:
    """The tables for kernels.

    Args:
        coupling: of the hand.
        coordinates: `motor_model`.
        model: of hand and object with all joints.
        tips: joint that carries each tip.
    """
    n_joints, n_motors = coupling.S.shape
    S = np.zeros((model.nv, n_motors + _TWIST))
    S[:n_joints, :n_motors] = coupling.S
    S[n_joints:, n_motors:] = np.eye(_TWIST)
    places = [joint.idx_q for joint in list(coordinates.joints)[1:-1]]
    rows = []
    for k, joint in enumerate(list(model.joints)[1:-1]):
        motors = np.flatnonzero(coupling.S[k])
        is_copied = joint.nq == 2 and len(motors) == 1 and coupling.kinds[motors[0]] == CONTINUOUS
        kind = CONTINUOUS if joint.nq == 2 else ADDITIVE
        rows.append((kind, joint.idx_q, places[motors[0]] if is_copied else -1))
    entries, ratios = [], []
    for view, (joint, base) in enumerate(_views(model, tips)):
        first = model.nv + S.shape[1] * view
        for sign, body in ((1.0, joint), (-1.0, base)):
            for column in _columns(model, body):
                for motor in np.flatnonzero(S[column, :n_motors]).tolist():
                    entries.append((first + motor, column))
                    ratios.append(sign * S[column, motor])
        for k in range(_TWIST):
            entries.append((first + n_motors + k, n_joints + k))
            ratios.append(1.0)
    return Coupled(
        S,
        coupling.offset,
        np.array(rows, dtype=np.int64),
        np.array(places, dtype=np.int64),
        np.array(entries, dtype=np.int64),
        np.array(ratios),
        np.zeros(S.shape[1]),
        np.zeros(model.nq),
        np.zeros(model.nv),
        np.zeros((model.nv, model.nv), order="F"),
        np.zeros(model.nv),
    )


def _columns(model: pin.Model, joint: int) -> list[int]:
    """Velocities of the hand's joints that move a body of the hand; none for the object."""
    if joint == model.njoints - 1:
        return []
    return [model.joints[index].idx_v for index in list(model.supports[joint])[1:]]
