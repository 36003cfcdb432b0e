"""Every controller that ships as a plain formula of numpy, from its docstring and from what it is handed.

A formula takes the settings and the observations that the controller was handed, one a control period, the first at its
start. It returns the torques for the last of them, shape (n,). No formula knows a simulation.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import pinocchio as pin
from hands import Array

from softhand import Controller
from softhand.contact.pairs import contact_pairs
from softhand.controllers.object_estimator import ObjectEstimator
from softhand.grasping.materials import Material
from softhand.sensing.observation import Observation
from softhand.settings.toml import tomllib

Seen: TypeAlias = Sequence[Observation]
Formula: TypeAlias = Callable[[Any, Seen], Array]


def inverse(matrix: Array) -> Array:
    """Pseudo-inverse; what is as small as rounding does not count."""
    return np.linalg.pinv(matrix, rcond=1e-6)


def spread(gain: Any, size: int) -> Array:
    """One number for all, or one for each."""
    return np.broadcast_to(np.asarray(gain, dtype=float), size)


def of_pose(position: Any, orientation: Any) -> Array:
    """Gains of q_O."""
    return np.concatenate([spread(position, 3), spread(orientation, 3)])


def rotation(rpy: Array) -> Array:
    """R_z(yaw) R_y(pitch) R_x(roll)."""
    return pin.rpy.rpyToMatrix(*rpy)


def turn(start: Array, end: Array) -> Array:
    """log(end start^T): rotation vector from one orientation to another, world axes."""
    return pin.log3(end @ start.T)


def turning(rpy: Array) -> Array:
    """Angular velocity from the rates of roll, pitch and yaw."""
    return np.column_stack([rotation(rpy)[:, 0], rotation([0.0, 0.0, rpy[2]])[:, 1], [0.0, 0.0, 1.0]])


def wrapped(angles: Array) -> Array:
    """In (-pi, pi]."""
    return np.pi - (np.pi - angles) % (2.0 * np.pi)


def block(corner: Array) -> Array:
    """Of a position and what belongs to the orientation."""
    full = np.eye(6)
    full[3:, 3:] = corner
    return full


def pose_error(controller: Any, position: Array, R: Array, rpy: Array, desired: Array) -> tuple[Array, Array]:
    """The pose error, and X of twist = X (rate of its coordinates), with T_O from the angles."""
    if controller.orientation_error == "euler":
        return np.concatenate([position - desired[:3], wrapped(rpy - desired[3:])]), block(turning(rpy))
    return np.concatenate([position - desired[:3], R.T @ turn(rotation(desired[3:]), R)]), block(R)


def pose_task(controller: Any, now: Observation) -> tuple[Array, Array, Array, Array]:
    """The pose error, its rate, the desired acceleration, and X."""
    desired, R = now.desired, now.object_rotation
    error, X = pose_error(controller, now.object_position, R, now.object_rpy, desired.coordinates)
    if controller.orientation_error == "euler":
        rate = np.linalg.inv(now.coordinate_map) @ now.object_twist - desired.coordinates_rate
        return error, rate, desired.coordinates_acceleration, now.coordinate_map
    return error, X.T @ (now.object_twist - desired.twist), X.T @ desired.twist_rate, X


def grasp_torque(now: Observation, wrench: Array, squeeze: Array, compensate: bool) -> Array:
    """J_CF^fT {G^f+ [W - G^tau tau_C] + K f} + J_CF^tauT tau_C."""
    tau_C = compensate * now.contact_force[:, 3]
    f_C = inverse(now.object_force_jacobian.T) @ (wrench - now.object_torsion_jacobian.T @ tau_C)
    f_C += now.internal_force_basis @ squeeze
    return now.hand_force_jacobian.T @ f_C + now.hand_torsion_jacobian.T @ tau_C


def at_joints(controller: Any, now: Observation, gain: str = "K_v") -> Array:
    """N_F - K_v q_F'."""
    return now.gravity_torque - spread(getattr(controller, gain), len(now.joint_velocity)) * now.joint_velocity


def regulation(controller: Any, seen: Seen) -> Array:
    """(59), the desired share of N_O, and the posture in the null space of J_CF^f."""
    now, desired = seen[-1], seen[-1].object_coordinates_desired
    K_O, n = of_pose(controller.K_O_position, controller.K_O_orientation), len(now.joint_position)
    error, X = pose_error(controller, now.object_position, now.object_rotation, now.object_rpy, desired)
    squeeze = now.internal_force - controller.K_N * (now.internal_force - now.internal_force_desired)
    tau_C, J = controller.torsion_compensation * now.contact_force[:, 3], now.hand_force_jacobian
    if controller.orientation_error == "euler":  # as the paper has it
        wrench = now.carried_desired * now.N_O - K_O * error - now.J_O_tau.T @ tau_C
        f_C = inverse(now.J_O_f.T) @ wrench
    else:
        wrench = now.carried_desired * now.object_gravity - X @ (K_O * error) - now.object_torsion_jacobian.T @ tau_C
        f_C = inverse(now.object_force_jacobian.T) @ wrench
    tau = J.T @ (f_C + now.internal_force_basis @ squeeze) + now.hand_torsion_jacobian.T @ tau_C
    pull = spread(controller.K_posture, n) * (seen[0].joint_position - now.joint_position)
    return tau + at_joints(controller, now) + pull - inverse(J) @ J @ pull


def finger_only(controller: Any, seen: Seen) -> Array:
    """(59) at what `ObjectEstimator` makes of the joints and the contact forces."""
    estimator = ObjectEstimator(seen[0])
    estimate = estimator.start(seen[0])
    for observation in seen:
        estimate = estimator.update(observation, estimate)
    now, f_C, R = seen[-1], seen[-1].contact_force[:, :3].ravel(), estimate.rotation
    weight = -now.object_mass * now.gravity
    holding = np.concatenate([weight, np.cross(R @ now.object_lever, weight)])
    K_O = of_pose(controller.K_O_position, controller.K_O_orientation)
    error, X = pose_error(controller, estimate.position, R, pin.rpy.matrixToRpy(R), now.object_coordinates_desired)
    tau_C = controller.torsion_compensation * estimate.tau_C
    wrench = holding - np.linalg.inv(X).T @ (K_O * error) - estimate.torsion_rows.T @ tau_C
    K = np.zeros((len(f_C), len(now.internal_force)))
    for k, (i, j) in enumerate(contact_pairs(len(estimate.point))):
        line = (estimate.point[j] - estimate.point[i]) / np.linalg.norm(estimate.point[j] - estimate.point[i])
        K[3 * i : 3 * i + 3, k] = estimate.axes[i].T @ line
        K[3 * j : 3 * j + 3, k] = -estimate.axes[j].T @ line
    f_N = inverse(K) @ f_C
    f = inverse(estimate.force_rows.T) @ wrench + K @ (f_N - controller.K_N * (f_N - now.internal_force_desired))
    return estimate.J_CF_f.T @ f + estimate.J_CF_tau.T @ tau_C + at_joints(controller, now)


def point_contact(controller: Any, seen: Seen) -> Array:
    """Contacts at x_i + r z_C,i."""
    now = seen[-1]
    normals, count = now.contact_rotation[:, :, 2], len(now.tip_position)
    arms = np.array([tip.law.radius for tip in now.fingertips])[:, None] * normals
    points = now.tip_position + arms
    J_f = [J + np.cross(W, arm, axisa=0).T for J, W, arm in
           zip(now.tip_jacobian, now.tip_angular_jacobian, arms, strict=True)]  # fmt: skip
    G_f = np.hstack([np.vstack([np.eye(3), pin.skew(point - now.object_position)]) for point in points])
    weight = -now.object_mass * now.gravity
    missing = now.object_coordinates_desired[:3] - now.object_position
    force = weight + controller.K_position * missing - controller.D_position * now.object_twist[:3]
    moment = np.cross(now.object_rotation @ now.object_lever, weight)
    moment += controller.K_orientation * turn(now.object_rotation, rotation(now.object_rpy_desired))
    moment -= controller.D_orientation * now.object_twist[3:]
    tau_C = controller.torsion_compensation * now.contact_force[:, 3]
    f_d = (inverse(G_f) @ np.concatenate([force, moment - normals.T @ tau_C])).reshape(count, 3)
    for (i, j), f_N in zip(contact_pairs(count), now.internal_force_desired, strict=True):
        line = f_N * (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
        f_d[i] += line
        f_d[j] -= line
    tau = at_joints(controller, now)
    for J, W, normal, f, torsion in zip(J_f, now.tip_angular_jacobian, normals, f_d, tau_C, strict=True):
        tau += J.T @ f + torsion * W.T @ normal
    return tau


def object_impedance(controller: Any, seen: Seen) -> Array:
    """Spring, damper and virtual mass at the object."""
    now = seen[-1]
    M_d = of_pose(controller.M_position, controller.M_orientation)
    D = of_pose(controller.D_position, controller.D_orientation)
    K = of_pose(controller.K_position, controller.K_orientation)
    error, rate, acceleration, X = pose_task(controller, now)
    wrench = now.object_gravity + np.linalg.inv(X).T @ (M_d * acceleration - D * rate - K * error)
    squeeze = controller.K_int * now.internal_force_desired
    return grasp_torque(now, wrench, squeeze, controller.torsion_compensation) + at_joints(controller, now)


def computed_torque(controller: Any, seen: Seen) -> Array:
    """e'' + K_d e' + K_p e = 0 by the equations of motion in rigid contact; A' from the last two samples."""
    now = seen[-1]
    K_p = of_pose(controller.K_p_position, controller.K_p_orientation)
    K_d = of_pose(controller.K_d_position, controller.K_d_orientation)
    error, rate, acceleration, X = pose_task(controller, now)
    b = X @ (acceleration - K_d * rate - K_p * error)
    if controller.orientation_error == "euler":  # T_O' q_O'
        roll, pitch, yaw = (np.linalg.inv(now.coordinate_map) @ now.object_twist)[3:]
        roll_axis, pitch_axis, yaw_axis = turning(now.object_rpy).T
        b[3:] += pitch * np.cross(yaw * yaw_axis, pitch_axis)
        b[3:] += roll * np.cross(yaw * yaw_axis + pitch * pitch_axis, roll_axis)
    A = inverse(now.hand_force_jacobian) @ now.object_force_jacobian
    A_rate = np.zeros_like(A)
    if len(seen) > 1 and now.time > seen[-2].time:
        before = inverse(seen[-2].hand_force_jacobian) @ seen[-2].object_force_jacobian
        A_rate = (A - before) / (now.time - seen[-2].time)
    wrench = now.object_mass_matrix @ b + now.object_velocity_terms + now.object_gravity
    tau = grasp_torque(now, wrench, now.internal_force_desired, controller.torsion_compensation)
    tau += now.hand_mass_matrix @ (A @ b + A_rate @ now.object_twist) + now.hand_velocity_terms
    return tau + at_joints(controller, now)


def frame_of_tips(x: Array) -> tuple[Array, Array]:
    """Mean of the tips, and r_x, r_y, r_z of the first three as columns."""
    r_z, r_y = np.cross(x[2] - x[0], x[1] - x[0]), x[0] - x[1]
    r_z, r_y = r_z / np.linalg.norm(r_z), r_y / np.linalg.norm(r_y)
    return x.mean(axis=0), np.column_stack([np.cross(r_y, r_z), r_y, r_z])


def turning_of_tips(x: Array) -> Array:
    """B_i of w = sum B_i x_i' of that frame, from the rates of its axes, shape (3, 3, 3)."""
    r_x, r_y, r_z = frame_of_tips(x)[1].T
    line, side, length = x[0] - x[1], x[2] - x[0], np.linalg.norm(x[0] - x[1])
    area = np.linalg.norm(np.cross(side, x[1] - x[0]))
    turning = np.zeros((3, 3, 3))
    for i in range(3):
        for k, rate in enumerate(np.eye(3)):
            v = np.zeros((3, 3))
            v[i] = rate
            r_y_rate = ((v[0] - v[1]) - r_y * (r_y @ (v[0] - v[1]))) / length
            normal_rate = np.cross(v[2] - v[0], -line) + np.cross(side, v[1] - v[0])
            r_z_rate = (normal_rate - r_z * (r_z @ normal_rate)) / area
            # w with w x r_y = r_y', w x r_z = r_z'
            turning[i, :, k] = (r_y_rate @ r_z) * r_x + (r_z_rate @ r_x) * r_y - (r_y_rate @ r_x) * r_z
    return turning


def pull_of_tips(at_start: Observation) -> Array:
    """f_d for a mean squeeze of 1 N at the start [N]."""
    x = at_start.tip_position
    radii = np.array([tip.law.radius for tip in at_start.fingertips])
    return radii.sum() * np.mean([1.0 / np.linalg.norm(x[j] - x[i]) for i, j in contact_pairs(len(x))])


def blind(controller: Any, seen: Seen) -> Array:
    """The fingertips stand for the object."""
    start, now = seen[0], seen[-1]
    x, wanted, count = now.tip_position, rotation(now.object_rpy_desired), len(now.tip_position)
    centre, axes = frame_of_tips(start.tip_position)
    arm, axes_in_object = (start.object_rotation.T @ (centre - start.object_position),
                           start.object_rotation.T @ axes)  # fmt: skip
    x_v, axes = frame_of_tips(x)
    radii = np.array([tip.law.radius for tip in now.fingertips])
    f_d = pull_of_tips(start) * np.mean(now.internal_force_desired)
    moment = controller.K_o * turn(axes, wanted @ axes_in_object)
    common = controller.K_p * (now.object_coordinates_desired[:3] + wanted @ arm - x_v) - controller.mass * now.gravity
    B, tau = turning_of_tips(x[:3]), at_joints(controller, now, "damping")
    for i, J in enumerate(now.tip_jacobian):
        force = f_d / radii.sum() * sum(x[j] - x[i] for j in range(count)) + common / count
        tau += J.T @ (force + (B[i].T @ moment if i < 3 else 0.0))
    return tau


def axis_of(spin: Array) -> Array:
    """Axis of the last joint that turns a tip."""
    return spin[:, np.flatnonzero(np.any(spin != 0.0, axis=0))[-1]]


def opposing(controller: Any, seen: Seen) -> Array:
    """Two tips pull towards each other and keep their attitude."""
    start, now = seen[0], seen[-1]
    radii = [tip.law.radius for tip in now.fingertips]
    f_d = pull_of_tips(start) * now.internal_force_desired[0]
    line = now.tip_position[1] - now.tip_position[0]
    tau = at_joints(controller, now, "damping")
    for i, sign in enumerate((1.0, -1.0)):
        spin = start.tip_angular_jacobian[i]
        e = spin.T @ axis_of(spin)
        N = radii[i] / controller.gamma * (e @ (now.joint_position - start.joint_position))
        force = sign * f_d / sum(radii) * line - 0.5 * controller.mass * now.gravity
        tau += now.tip_jacobian[i].T @ force - radii[i] * N * e
    return tau


def angle_feedback(controller: Any, seen: Seen) -> Array:
    """Press along the normals, turn by tangential forces."""
    now, b = seen[-1], axis_of(seen[0].tip_angular_jacobian[0])
    p_c = now.object_position + now.object_rotation @ now.object_lever
    normals, points = now.contact_rotation[:, :, 2], now.contact_point
    pressing = now.internal_force_desired[0] * normals - 0.5 * now.object_mass * now.gravity
    e = b @ turn(now.object_rotation, rotation(now.object_rpy_desired))
    M = controller.K * e - controller.D * (b @ now.object_twist[3:])
    M -= b @ sum(np.cross(point - p_c, force) for point, force in zip(points, pressing, strict=True))
    w = np.cross(b, points[0] - points[1])
    tau = at_joints(controller, now)
    for i, sign in enumerate((1.0, -1.0)):
        force = now.contact_rotation[i].T @ (pressing[i] + sign * M * w / (w @ w))
        tau += now.hand_force_jacobian[3 * i : 3 * i + 3].T @ force
    return tau


def two_phase(controller: Any, seen: Seen) -> Array:
    """The angle moves the set points of stiff joints."""
    start, now, n = seen[0], seen[-1], len(seen[0].joint_position)
    K_q = spread(controller.K_q, n)
    b, line = axis_of(start.tip_angular_jacobian[0]), start.contact_point[0] - start.contact_point[1]
    t = np.cross(b, line / np.linalg.norm(line))
    way = inverse(start.tip_jacobian[0]) @ t - inverse(start.tip_jacobian[1]) @ t
    holding = start.gravity_torque + start.hand_jacobian.T @ start.contact_force.ravel()

    def error(observation: Observation) -> float:
        wanted = rotation(observation.object_rpy_desired)
        return float(b @ turn(observation.object_rotation, wanted))

    integral = sum(error(there) * (there.time - here.time) for here, there in pairwise(seen))
    q_d = start.joint_position + holding / K_q + way * (controller.K_P * error(now) + controller.K_I * integral)
    return K_q * (q_d - now.joint_position) - spread(controller.K_d, n) * now.joint_velocity


def set_points(controller: Any, seen: Seen) -> Array:
    """A way of minimum jerk from where the joints were, or to velocities."""
    start, n = seen[0].joint_position, len(seen[0].joint_position)
    x = (seen[-1].time - seen[0].time) / controller.duration if controller.duration else 1.0
    share = float(np.polyval([6.0, -15.0, 10.0, 0.0, 0.0, 0.0], min(x, 1.0)))
    if controller.velocity is not None:
        return share * np.asarray(controller.velocity)
    way = 0.0 if controller.position is None else np.asarray(controller.position) - start
    return start + spread(controller.offset, n) + share * way


def pick_and_place(controller: Any, seen: Seen) -> Array:
    """Free tips on springs to their feet at the start, (59) while all tips touch and shall hold."""
    start, now = seen[0], seen[-1]
    if np.mean(now.internal_force_desired) >= controller.touch_force and np.all(now.contact_force[:, 2] > 0.0):
        return regulation(controller, seen)
    tau = at_joints(controller, now)
    for i, (tip, J) in enumerate(zip(now.fingertips, now.tip_jacobian, strict=True)):
        normal = start.object_rotation @ tip.face.normal
        height = normal @ (start.tip_position[i] - start.object_position) - tip.face.offset
        place = start.tip_position[i] + (tip.law.radius + now.opening_desired - height) * normal
        force = controller.K_tip * (place - now.tip_position[i]) - controller.D_tip * (J @ now.joint_velocity)
        tau += J.T @ force
    return tau


def arm_pick_and_place(controller: Any, seen: Seen) -> Array:
    """The same with free tips fixed to the palm, and the palm brought along by the joints that carry it."""
    start, now = seen[0], seen[-1]
    n, known = len(now.joint_position), now.known
    model = pin.Model(known.rigid.__reduce__()[1][0])
    data, columns, moves = model.createData(), list(known.palm_columns), np.ones(n)
    moves[columns] = 0.0

    def palm(seen: Observation) -> pin.SE3:
        pin.forwardKinematics(model, data, seen.configuration)
        return data.oMi[known.palm_joint].copy()

    def desired(seen: Observation) -> pin.SE3:
        return pin.SE3(rotation(seen.object_rpy_desired), seen.object_position_desired + seen.standoff_desired)

    fingers = controller.model_copy(update={"K_v": tuple(moves * spread(controller.K_v, n))})
    held = np.mean(now.internal_force_desired) >= controller.touch_force and np.all(now.contact_force[:, 2] > 0.0)
    tau = regulation(fingers, seen) if held else at_joints(fingers, now)
    for i, (tip, J) in enumerate(zip(now.fingertips, moves * now.tip_jacobian, strict=True)):
        normal = desired(start).rotation @ tip.face.normal
        height = normal @ (start.tip_position[i] - desired(start).translation) - tip.face.offset
        foot = palm(start).inverse().act(start.tip_position[i] - height * normal)
        off = (tip.law.radius + now.opening_desired) * (palm(start).rotation.T @ normal)
        force = controller.K_tip * (palm(now).act(foot + off) - now.tip_position[i])
        tau += (not held) * (J.T @ (force - controller.D_tip * (J @ now.joint_velocity)))
    there = desired(now) * desired(start).inverse() * palm(start)
    v, axes = np.concatenate([now.joint_velocity, np.zeros(6)]), pin.LOCAL_WORLD_ALIGNED
    pin.forwardKinematics(model, data, now.configuration, v, np.zeros(n + 6))
    here, bias = data.oMi[known.palm_joint], pin.getClassicalAcceleration(model, data, known.palm_joint, axes)
    V = pin.getVelocity(model, data, known.palm_joint, axes)
    w, rate = now.object_twist_desired[3:], now.object_twist_rate_desired
    arm = there.translation - desired(now).translation
    V_d = np.concatenate([now.object_twist_desired[:3] + now.standoff_rate_desired + np.cross(w, arm), w])
    A_d = rate.copy()
    A_d[:3] += now.standoff_acceleration_desired + np.cross(rate[3:], arm) + np.cross(w, np.cross(w, arm))
    error = np.concatenate([here.translation - there.translation, turn(there.rotation, here.rotation)])
    J = pin.computeJointJacobians(model, data, now.configuration)
    J = pin.getJointJacobian(model, data, known.palm_joint, axes)[:, columns]
    wish = -controller.K_idle * (now.joint_position - start.joint_position) - controller.D_palm * now.joint_velocity
    sought = A_d - controller.D_palm * (V.vector - V_d) - controller.K_palm * error - bias.vector
    a = wish[columns] + inverse(J) @ (sought - J @ wish[columns])
    M = pin.crba(model, data, now.configuration)
    M = np.triu(M) + np.triu(M, 1).T
    model.gravity.setZero()
    return tau + M[:n, columns] @ a + pin.nonLinearEffects(model, data, now.configuration, v)[:n]


def least_squeeze(controller: Any, seen: Seen) -> Array:
    """(59) with the filtered squeeze of the least barrier value, which Newton finds here from affine functions."""
    first = seen[0]
    squeeze, time = first.internal_force.copy(), first.time
    for now in seen:
        wanted, f_C, tau = _wanted(controller, now, squeeze)
        more = np.sum((now.internal_force_basis @ (wanted - squeeze))[2::3])
        passed = max(now.time - time, 0.0)
        squeeze = squeeze + passed / (passed + (controller.rise if more > 0.0 else controller.release)) * (
            wanted - squeeze
        )
        time = now.time
    f_N = now.internal_force - controller.K_N * (now.internal_force - squeeze)
    return tau + now.hand_force_jacobian.T @ (f_C + now.internal_force_basis @ f_N)


def _wanted(controller: Any, now: Observation, last: Array) -> tuple[Array, Array, Array]:
    """f_N of the least value, contact forces without squeeze, joint torques without contact forces."""
    K_O = of_pose(controller.K_O_position, controller.K_O_orientation)
    R, desired, K = now.object_rotation, now.object_coordinates_desired, now.internal_force_basis
    error = np.concatenate([now.object_position - desired[:3], R.T @ turn(rotation(desired[3:]), R)])
    tau_C = controller.torsion_compensation * now.contact_force[:, 3]
    wrench = now.carried_desired * now.object_gravity - block(R) @ (K_O * error) - now.object_torsion_jacobian.T @ tau_C
    f_C = inverse(now.object_force_jacobian.T) @ wrench
    tau = at_joints(controller, now) + now.hand_torsion_jacobian.T @ tau_C
    n, e = K.shape[1], np.eye(K.shape[1] + 1)[-1]
    affine = [(row, value) for row, value in zip(np.column_stack([K, 0.0 * K[:, 0]]), f_C, strict=True)]
    reach: list[float] = []
    cones, planes = [], [(e, 0.0), (e - sum(row for row, _ in affine[2::3]), controller.most - np.sum(f_C[2::3]))]
    for i, tip in enumerate(now.fingertips):
        material = Material(tip.law, tip.friction, tip.torsion_length or 0.0, tip.limit)
        torsion = material.torsion(now.deformation[i, 0])
        spin, (x, y) = now.contact_force[i, 3] / torsion.length, (f_C + K @ last)[3 * i : 3 * i + 2]
        u = (x * x + y * y) / (x * x + y * y + spin * spin)
        k = (1.0 - controller.margin) * tip.friction / np.sqrt(1.0 + u * (1.0 - u) * np.polyval(torsion.curve[::-1], u))
        (f_x, a), (f_y, b), (f_z, c) = affine[3 * i : 3 * i + 3]
        cones.append((np.array([k * f_z + e, f_x, f_y, 0.0 * e]), np.array([k * c, a, b, spin])))
        planes.append((f_z + k * e, c - controller.touch))
        reach.append(k)
    J, base = now.hand_force_jacobian, tau + now.hand_force_jacobian.T @ f_C
    for j, effort in enumerate(now.effort_limit):
        row = np.append(J[:, j] @ K, 0.0) / effort
        planes += [(0.1 * e - row, 1.0 - base[j] / effort), (0.1 * e + row, 1.0 + base[j] / effort)]
    cost = sum(row for row, _ in affine[2::3]) + 20.0 / min(reach) * e
    return _least(cost, cones, planes, np.append(last, 1e3))[:n], f_C, tau


def _least(cost: Array, cones: list[tuple[Array, Array]], planes: list[tuple[Array, float]], x: Array) -> Array:
    """min w cost x - sum log of squared cones - sum log of planes, for w up to 300, with half a millionth |f_N|^2."""
    A, b = np.array([row for row, _ in planes]), np.array([value for _, value in planes])
    sign, ridge = np.array([1.0, -1.0, -1.0, -1.0]), 1e-6 * np.append(np.ones(len(x) - 1), 0.0)

    def value(x: Array, w: float) -> float:
        s, room = [C @ x + d for C, d in cones], A @ x + b
        D = [float(sign @ (c * c)) for c in s]
        if min(*D, *room) <= 0.0 or min(c[0] for c in s) <= 0.0:
            return np.inf
        return float(w * cost @ x - np.sum(np.log(D)) - np.sum(np.log(room)) + 0.5 * ridge @ (x * x))

    for w in 0.3 * 3.0 ** np.arange(0.0, 20.0):
        w = min(w, 300.0)
        for _ in range(60):
            room = A @ x + b
            g, H = w * cost + ridge * x - A.T @ (1.0 / room), np.diag(ridge) + A.T @ (A / room[:, None] ** 2)
            for C, d in cones:
                s = C @ x + d
                D, slope = float(sign @ (s * s)), 2.0 * C.T @ (sign * s)
                g, H = g - slope / D, H + np.outer(slope, slope) / D**2 - 2.0 * C.T @ (sign[:, None] * C) / D
            step, length = -np.linalg.solve(H, g), 1.0
            if -g @ step < 1e-22:
                break
            while -g @ step > 1e-6 and not value(x + length * step, w) < value(x, w) + 0.1 * length * g @ step:
                length *= 0.5
            x = x + length * step
        if w == 300.0:
            break
    return x


def state_feedback(controller: Any, seen: Seen) -> Array:
    """tau = u* + N_u r - K x - K_I i, with the numbers of the file."""
    given = tomllib.loads(Path(controller.gain_file).read_text())
    table = {name: np.array(value) for name, value in given.items()}
    sums = np.zeros(len(table["integrals"]))
    for k, o in enumerate(seen):
        R, R_d, R_0 = o.object_rotation, rotation(o.object_rpy_desired), table["object_rotation"]
        r = np.concatenate([
            R_0.T @ (o.object_position_desired - table["object_position"]), pin.log3(R_0.T @ R_d),
            o.internal_force_desired - table["internal_force"],
        ])  # fmt: skip
        asked = np.concatenate([R_0.T @ o.object_twist_desired[:3], R_d.T @ o.object_twist_desired[3:]])
        e = np.concatenate([
            R_d.T @ (o.object_position - o.object_position_desired), pin.log3(R_d.T @ R),
            o.internal_force - o.internal_force_desired,
        ])  # fmt: skip
        N = table["joint_follow"]
        x = np.concatenate([
            o.joint_position - table["joint_position"] - N @ r, e[:6],
            o.joint_velocity - N[:, :6] @ asked, np.kron(np.eye(2), R.T) @ (o.object_twist - o.object_twist_desired),
        ])  # fmt: skip
        if k == len(seen) - 1:
            return table["torque"] + table["torque_follow"] @ r - table["K"] @ x - table["K_integral"] @ sums
        sums = sums + table["period"] * e[table["integrals"].astype(int)]
    raise AssertionError


FORMULAS: dict[str, Formula] = {
    "regulation": regulation,
    "least-squeeze": least_squeeze,
    "finger-only": finger_only,
    "point-contact": point_contact,
    "object-impedance": object_impedance,
    "computed-torque": computed_torque,
    "state-feedback": state_feedback,
    "blind": blind,
    "opposing": opposing,
    "angle-feedback": angle_feedback,
    "two-phase": two_phase,
    "set-points": set_points,
    "pick-and-place": pick_and_place,
    "arm-pick-and-place": arm_pick_and_place,
}


def torque_of(controller: Controller, seen: Seen) -> Array:
    """What the controller itself returns for the last of these observations."""
    memory = controller.start(seen[0])
    for observation in seen:
        tau, memory = controller.torque(observation, memory)
    return tau
