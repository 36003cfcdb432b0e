"""The kinds of action by name."""

from __future__ import annotations

from softhand.envs.acting.acting import Acting
from softhand.envs.acting.internal_force import InternalForceActing
from softhand.envs.acting.set_point import SetPointActing
from softhand.envs.acting.torque import JointActing, PlainTorqueActing, TorqueActing

KINDS: dict[str, type[Acting]] = {
    "set-point": SetPointActing,
    "internal-force": InternalForceActing,
    "joint-set-point": JointActing,
    "torque": TorqueActing,
    "plain-torque": PlainTorqueActing,
}
