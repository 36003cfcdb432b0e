"""Motors of a hand whose joints are coupled: a linear map from the motors to the joints, from `<mimic>` or a table."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.errors import ScenarioError
from softhand.model.configuration import ADDITIVE, CONTINUOUS
from softhand.model.urdf.mimic_signs import Clash, clashes, remedy
from softhand.model.urdf.mimics import Mimic, read_mimics
from softhand.model.urdf.urdf import Urdf
from softhand.numerics.arrays import Array

KEY = "hand.coupling"
_DEPENDENT = 1e-9  # smallest over largest singular value of a map of full rank


class MotorLimits(NamedTuple):
    """What a motor may do; None for what its joints tell."""

    effort: float | None = None
    """[N m or N]"""
    lower: float | None = None
    """[rad or m]"""
    upper: float | None = None


class CouplingTable(NamedTuple):
    """The table of a scenario. All tuples of (name, value), so that it can be a key."""

    joints: tuple[tuple[str, tuple[tuple[str, float], ...]], ...] = ()
    """Of each joint the motors that move it, and by how much."""
    offsets: tuple[tuple[str, float], ...] = ()
    """Of joints, where they are with all motors at zero [rad or m]."""
    motors: tuple[tuple[str, MotorLimits], ...] = ()
    """Limits of motors."""


@dataclass(frozen=True, eq=False)
class MotorMap:
    """Joint positions q_F = S m + offset of motor positions m; so q_F' = S m', and the torque of motors is S^T tau_F.

    Attributes:
        motors: names.
        joint_names: of all joints, in Pinocchio's order.
        S: shape (joints, motors).
        offset: of the joints at m = 0 [rad or m], shape (joints,).
    """

    motors: tuple[str, ...]
    joint_names: tuple[str, ...]
    S: Array
    offset: Array

    def joint_positions(self, motors: Array) -> Array:
        """q_F of motor positions [rad or m], shapes (..., joints) and (..., motors)."""
        return np.asarray(motors @ self.S.T + self.offset)


@dataclass(frozen=True, eq=False)
class Coupling(MotorMap):
    """The map of the motors of a hand, and what they may do.

    Attributes:
        kinds: ADDITIVE, or CONTINUOUS for a motor of one endless joint alone, shape (motors,).
        slides: which motors slide, shape (motors,).
        effort: largest torque of each motor [N m or N], shape (motors,).
        limits: lower and upper limit of each motor [rad or m]: what the limits of all its joints leave to it, whatever
            other motors of these joints do; shape (2, motors).
        joint_limits: of all joints, infinite for endless ones, shape (2, joints).
        table: what the scenario says of it, if anything.
    """

    kinds: NDArray[np.int64]
    slides: NDArray[np.bool_]
    effort: Array
    limits: Array
    joint_limits: Array
    table: CouplingTable | None

    @property
    def is_shared(self) -> NDArray[np.bool_]:
        """Which joints several motors move, so that `limits` do not keep them within theirs, shape (joints,)."""
        return np.count_nonzero(self.S, axis=1) > 1

    @property
    def coupled_joints(self) -> NDArray[np.int64]:
        """Those that are not the coordinate of a motor itself: index of each."""
        own = np.count_nonzero(self.S, axis=1) == 1
        plain = np.array([bool(own[k] and self.S[k].max() == 1.0 and not self.offset[k]) for k in range(len(own))])
        named = np.array([name in self.motors for name in self.joint_names])
        return np.flatnonzero(~(plain & named))


def read_map(hand: Urdf, model: pin.Model, table: CouplingTable | None) -> MotorMap | None:
    """What moves what; None for a hand without coupling. Limits are not looked at.

    Args:
        hand: its `<mimic>` joints count.
        model: of the hand alone.
        table: of the scenario, if it has one.

    Raises:
        ScenarioError: as `read_coupling`, where it is not of limits.
    """
    mimics = read_mimics(hand.tree)
    if not mimics and table is None:
        return None
    table = table or CouplingTable()
    names = tuple(model.names)[1:]
    rows, offsets = _rows(names, mimics, table)
    motors = tuple(dict.fromkeys(motor for name in names for motor in rows[name]))
    S = np.array([[rows[name].get(motor, 0.0) for motor in motors] for name in names])
    _check_motors(motors, table)
    _check_rank(S, motors)
    return MotorMap(motors, names, S, np.array([offsets[name] for name in names]))


def read_coupling(
    hand: Urdf, model: pin.Model, table: CouplingTable | None, effort_limit: float | None
) -> Coupling | None:
    """The coupling of a hand; None for a hand without any, each of whose joints is a motor.

    Args:
        hand: its `<mimic>` joints count.
        model: of the hand alone.
        table: of the scenario, if it has one.
        effort_limit: of every motor for which the table has none, in place of that of the joint that it is called
            after.

    Raises:
        ScenarioError: the table names a joint or motor that is none, or couples what follows another joint already; a
            joint is moved by no motor; motors are not independent; a motor has no effort limit or no range.
    """
    found, said, table = read_map(hand, model, table), table, table or CouplingTable()
    if found is None:
        return None
    motors, names, S, offset = found.motors, found.joint_names, found.S, found.offset
    joints = list(model.joints)[1:]
    slides = _sliding(model)
    endless = np.array([joint.nq == 2 for joint in joints])
    alone = [bool(np.count_nonzero(S[:, m]) == 1 and _is_plain(S, offset, m)) for m in range(len(motors))]
    kinds = [CONTINUOUS if alone[m] and endless[int(np.argmax(S[:, m]))] else ADDITIVE for m in range(len(motors))]
    lower, upper = np.full(len(names), -np.inf), np.full(len(names), np.inf)
    for k, joint in enumerate(joints):
        if not endless[k]:
            lower[k], upper[k] = model.lowerPositionLimit[joint.idx_q], model.upperPositionLimit[joint.idx_q]
    joint_limits = np.array([lower, upper])
    return Coupling(
        motors,
        names,
        S,
        offset,
        np.array(kinds, dtype=np.int64),
        np.array([all(slides[S[:, m] != 0.0]) for m in range(len(motors))]),
        _efforts(hand, model, motors, table, effort_limit),
        _limits(motors, S, offset, joint_limits, table, clashes(hand.tree)),
        joint_limits,
        said,
    )


def _is_plain(S: Array, offset: Array, motor: int) -> bool:
    """Whether the one joint of a motor has its coordinate."""
    joint = int(np.argmax(S[:, motor]))
    return bool(S[joint, motor] == 1.0 and np.count_nonzero(S[joint]) == 1 and offset[joint] == 0.0)


def _rows(
    names: Sequence[str], mimics: dict[str, Mimic], table: CouplingTable
) -> tuple[dict[str, dict[str, float]], dict[str, float]]:
    """Ratios of the motors of each joint, and its offset."""
    given, offsets = {name: dict(ratios) for name, ratios in table.joints}, dict(table.offsets)
    for name in given:
        _require_joint(f"{KEY}.joints", name, names)
        if name in mimics:
            leader = mimics[name].leader
            raise ScenarioError(
                f"{KEY}.joints: '{name}' follows '{leader}' by the <mimic> of the URDF already; remove one of the two.",
                key=f"{KEY}.joints.{name}", value=given[name],
            )  # fmt: skip
        if not any(given[name].values()):
            raise ScenarioError(
                f"{KEY}.joints: no motor moves '{name}'; give it a ratio that is not 0, or make the joint fixed.",
                key=f"{KEY}.joints.{name}", value=given[name],
            )  # fmt: skip
        for motor in given[name]:
            _require_motor(name, motor, mimics, given)
    for name in offsets:
        _require_joint(f"{KEY}.offsets", name, names)
        if name not in given:
            raise ScenarioError(
                f"{KEY}.offsets: '{name}' has no row in {KEY}.joints that an offset could be added to; give it one.",
                key=f"{KEY}.offsets.{name}", value=offsets[name],
            )  # fmt: skip
    rows = {name: {motor: ratio for motor, ratio in given.get(name, {name: 1.0}).items() if ratio} for name in names}
    shifts = {name: offsets.get(name, 0.0) for name in names}
    for name, (leader, multiplier, offset) in mimics.items():
        rows[name] = {motor: multiplier * ratio for motor, ratio in rows[leader].items()}
        shifts[name] = multiplier * shifts[leader] + offset
    return rows, shifts


def _require_joint(key: str, name: str, names: Sequence[str]) -> None:
    if name not in names:
        raise ScenarioError(
            f"{key}: the hand has no moving joint '{name}'; there are: {', '.join(names)}.", key=f"{key}.{name}",
            value=name,
        )  # fmt: skip


def _require_motor(joint: str, motor: str, mimics: dict[str, Mimic], given: dict[str, dict[str, float]]) -> None:
    """A motor may be called after a joint that it moves, or as no joint is."""
    if motor in mimics:
        why = f"a joint which follows '{mimics[motor].leader}' itself; name that one"
    elif motor in given and motor not in given[motor]:
        why = f"a joint with a row of its own; name its motors, {', '.join(given[motor])}"
    else:
        return
    raise ScenarioError(
        f"{KEY}.joints: '{joint}' is moved by '{motor}', {why}.", key=f"{KEY}.joints.{joint}", value=motor
    )


def _check_motors(motors: Sequence[str], table: CouplingTable) -> None:
    for name, _ in table.motors:
        if name not in motors:
            raise ScenarioError(
                f"{KEY}.motors: no motor is called '{name}'; there are: {', '.join(motors)}.",
                key=f"{KEY}.motors.{name}", value=name,
            )  # fmt: skip


def _check_rank(S: Array, motors: Sequence[str]) -> None:
    """Different motor positions are different joint positions."""
    scaled = S / np.linalg.norm(S, axis=0)
    _, sizes, ways = np.linalg.svd(scaled)
    if len(motors) > S.shape[0] or sizes[-1] < _DEPENDENT * sizes[0]:
        way = ways[-1] / np.linalg.norm(S, axis=0)
        some = [name for name, share in zip(motors, way, strict=True) if abs(share) > 1e-6 * np.abs(way).max()]
        raise ScenarioError(
            f"{KEY}.joints: the motors {', '.join(some)} can turn together without moving any joint, as the rows are "
            f"dependent: {len(motors)} motors move {S.shape[0]} joints with rank {np.linalg.matrix_rank(scaled)}; take "
            "one of them out, or let it move another joint.",
            key=f"{KEY}.joints", value=some,
        )  # fmt: skip


def _sliding(model: pin.Model) -> NDArray[np.bool_]:
    data = model.createData()
    pin.forwardKinematics(model, data, pin.neutral(model))
    axes = [np.asarray(data.joints[index].S).ravel() for index in range(1, model.njoints)]
    return np.array([bool(np.linalg.norm(axis[3:]) < 0.5) for axis in axes])


def _efforts(
    hand: Urdf, model: pin.Model, motors: Sequence[str], table: CouplingTable, effort_limit: float | None
) -> Array:
    """From the table, else the limit of all, else the joint of that name."""
    given, names, found = dict(table.motors), list(model.names)[1:], []
    for motor in motors:
        effort = given.get(motor, MotorLimits()).effort
        if effort is None:
            effort = effort_limit
        if effort is None and motor in names:
            effort = float(model.upperEffortLimit[model.joints[names.index(motor) + 1].idx_v])
        if not effort:
            what = "no joint is called so" if motor not in names else "that of its joint is 0"
            raise ScenarioError(
                f"{KEY}.motors: the motor '{motor}' has no effort limit, as {what}; write "
                f"{KEY}.motors.{motor}.effort = 2.0 [N m or N], or hand.effort_limit.",
                key=f"{KEY}.motors.{motor}.effort", value=effort,
            )  # fmt: skip
        found.append(effort)
    return np.array(found)


def _limits(
    motors: Sequence[str], S: Array, offset: Array, joint_limits: Array, table: CouplingTable, clashing: list[Clash]
) -> Array:
    """The tightest limits of each motor, shape (2, motors)."""
    limits = np.array([np.full(len(motors), -np.inf), np.full(len(motors), np.inf)])
    for m, motor in enumerate(motors):
        given = dict(table.motors).get(motor, MotorLimits())
        if given.lower is not None:
            limits[0, m] = given.lower
        if given.upper is not None:
            limits[1, m] = given.upper
    for k in range(len(S)):
        moved = np.flatnonzero(S[k])
        if len(moved) == 1:
            m = moved[0]
            ends = sorted((joint_limits[:, k] - offset[k]) / S[k, m])
            limits[0, m], limits[1, m] = max(limits[0, m], ends[0]), min(limits[1, m], ends[1])
    if np.any(np.count_nonzero(S, axis=1) > 1) and np.all(limits[0] <= limits[1]):
        limits = _spanned(S, offset, joint_limits, limits)
    for m, motor in enumerate(motors):
        if not limits[0, m] < limits[1, m]:
            if clashing:
                raise ScenarioError(
                    f"{KEY}: the limits of its joints leave the motor '{clashing[0].mimic.leader}' no range: "
                    f"{'; '.join(map(str, clashing))}; {remedy(clashing)}.",
                    key="hand.mimic_signs", value=motor,
                )  # fmt: skip
            raise ScenarioError(
                f"{KEY}: the limits of its joints leave the motor '{motor}' no range: it would have to be above "
                f"{limits[0, m]:.6g} and below {limits[1, m]:.6g}; mend the limits, ratios or offsets of its joints.",
                key=KEY, value=motor,
            )  # fmt: skip
    return limits


def _spanned(S: Array, offset: Array, joint_limits: Array, limits: Array) -> Array:
    """How far each motor gets if the others help: linear programs over the limits of the joints."""
    from scipy.optimize import linprog  # which few hands need

    rows, ends = [], []
    for sign, bound in ((-1.0, joint_limits[0]), (1.0, joint_limits[1])):
        kept = np.isfinite(bound)
        rows.append(sign * S[kept])
        ends.append(sign * (bound - offset)[kept])
    found = limits.copy()
    for m in range(S.shape[1]):
        for row, sign in ((0, 1.0), (1, -1.0)):
            way = np.zeros(S.shape[1])
            way[m] = sign
            answer = linprog(way, np.concatenate(rows), np.concatenate(ends), bounds=limits.T)
            if answer.status == 0:
                found[row, m] = answer.x[m]
            elif answer.status == 2:  # infeasible
                found[:, m] = np.inf, -np.inf
    return found
