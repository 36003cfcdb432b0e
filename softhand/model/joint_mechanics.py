"""What joints have of their own: inertia of rotors, damping, dry friction, stops, a top speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, TypeAlias

import numpy as np

from softhand.errors import ScenarioError
from softhand.model.coupling import MotorMap
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

KEY = "hand.joints"

Value: TypeAlias = float | str | tuple[tuple[str, float], ...] | None
"""One number for all joints, "urdf", numbers by the names of joints, or nothing."""


class JointTable(NamedTuple):
    """As a scenario gives it."""

    armature: Value = None
    damping: Value = None
    friction: Value = None
    stop_stiffness: Value = None
    stop_damping: Value = None
    velocity_limit: Value = None


class JointMechanics(NamedTuple):
    """The same for each joint, or motor of coupled joints, of shape (n,) each; of joints that slide in N and m."""

    armature: Array
    """Inertia of the rotor as the joint feels it, gear ratio squared times its own [kg m^2]."""
    damping: Array
    """Viscous [N m s/rad]."""
    friction: Array
    """Dry, the torque that the joint holds and that brakes it while it moves [N m]."""
    stop_stiffness: Array
    """Of the stops at the limits, 0 for none [N m/rad]."""
    stop_damping: Array
    """Damping of the stops over their stiffness and their depth [s/rad]."""
    velocity_limit: Array
    """Speed at which a motor has no torque left, infinite for none [rad/s]."""


def free_joints(n: int) -> JointMechanics:
    """Joints that have nothing of their own."""
    armature, damping, friction, stiffness, dissipation = np.zeros((5, n))
    return JointMechanics(armature, damping, friction, stiffness, dissipation, np.full(n, np.inf))


def read_joint_mechanics(
    table: JointTable | None, hand: Urdf, joint_names: Sequence[str], coupling: MotorMap | None
) -> JointMechanics:
    """The numbers of each joint or motor.

    Args:
        table: of the scenario, if it has one.
        hand: from which "urdf" takes `<dynamics>`.
        joint_names: of the joints, or motors, in their order.
        coupling: of the joints to motors, if any are coupled.

    Raises:
        ScenarioError: a name is that of no joint, or `<dynamics>` of a joint that several motors move is asked for.
    """
    found = free_joints(len(joint_names))
    for name, value in (table or JointTable())._asdict().items():
        key, numbers = f"{KEY}.{name}", getattr(found, name)
        if isinstance(value, tuple):
            for joint, number in value:
                numbers[_index(key, joint, number, joint_names)] = number
        elif isinstance(value, str):
            numbers[:] = _of_urdf(key, name, hand, joint_names, coupling)
        elif value is not None:
            numbers[:] = value
    return found


def _index(key: str, joint: str, number: float, names: Sequence[str]) -> int:
    if joint not in names:
        raise ScenarioError(
            f"{key}: the hand has no joint or motor '{joint}'; there are: {', '.join(names)}.", key=f"{key}.{joint}",
            value=number,
        )  # fmt: skip
    return list(names).index(joint)


def _of_urdf(key: str, attribute: str, hand: Urdf, names: Sequence[str], coupling: MotorMap | None) -> Array:
    """`<dynamics>` or `<limit>` of each joint; with coupled joints what a motor feels of those that it moves.

    The power of damping is d q'^2 = d S^2 m'^2, that of friction |f q'| = f |S| |m'|, where one motor moves the joint.
    """
    is_speed = attribute == "velocity_limit"
    given = _of_joints(hand, *(("limit", "velocity") if is_speed else ("dynamics", attribute)))
    if is_speed:
        given = {name: speed or np.inf for name, speed in given.items()}
    if coupling is None:
        return np.array([given.get(name, np.inf if is_speed else 0.0) for name in names])
    if is_speed:
        return _motor_speeds(given, coupling)
    found, power = np.zeros(len(names)), 2 if attribute == "damping" else 1
    for joint, row in zip(coupling.joint_names, coupling.S, strict=True):
        own = given.get(joint, 0.0)
        moved = np.flatnonzero(row)
        if own and len(moved) > 1:
            raise ScenarioError(
                f'{key}: "urdf" has {attribute} = {own:g} of \'{joint}\', which several motors move, and that is none '
                f"of one motor; give the {attribute} of each motor by name.",
                key=key, value="urdf",
            )  # fmt: skip
        found[moved] += own * np.abs(row[moved]) ** power
    return found


def _motor_speeds(given: Mapping[str, float], coupling: MotorMap) -> Array:
    """The speed at which the first of its joints has its own."""
    found = np.full(len(coupling.motors), np.inf)
    for joint, row in zip(coupling.joint_names, coupling.S, strict=True):
        moved = np.flatnonzero(row)
        found[moved] = np.minimum(found[moved], given.get(joint, np.inf) / np.abs(row[moved]))
    return found


def _of_joints(hand: Urdf, element: str, attribute: str) -> Mapping[str, float]:
    found = {}
    for joint in hand.tree.joints:
        child = joint.element.find(element)
        if joint.is_moving and child is not None:
            found[joint.name] = float(child.get(attribute, "0"))
    return found
