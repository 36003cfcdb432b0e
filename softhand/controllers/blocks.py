"""Parts of control laws as small compiled functions, for formulas of one's own and for those that ship.

Each takes arrays and numbers, and sets or changes its last argument. So it can be called from a compiled `formula` with
fields of `observed`, and from plain Python with those of an observation:

    blocks = softhand.blocks
    forces = np.zeros(9)
    blocks.share_wrench(observation.object_force_jacobian, wrench, forces)

Letters are those of docs/theory.md: n joints, nc contacts, np pairs of contacts; forces act on the object.
"""

from __future__ import annotations

import math

from softhand.controllers.pose import add_pose_spring, euler_error, pose_error, turn_error
from softhand.numerics.compiled import compiled
from softhand.numerics.linear import least_norm

__all__ = [
    "add_internal_forces",
    "add_pose_spring",
    "add_torsion",
    "add_twist_damper",
    "clamp_to_cone",
    "euler_error",
    "feed_back_internal_forces",
    "hold_joints",
    "hold_weight",
    "low_pass",
    "minimum_jerk",
    "pose_error",
    "push_contacts",
    "push_tips",
    "share_wrench",
    "take_off_torsion",
    "turn_error",
]


@compiled
def hold_joints(gravity_torque, damping, joint_velocity, torque):
    """tau = N_F - K_v q_F', what holds the hand itself.

    Args:
        gravity_torque: N_F [N m], shape (n,).
        damping: K_v [N m s/rad], shape (n,).
        joint_velocity: q_F' [rad/s], shape (n,).
        torque: set [N m], shape (n,).
    """
    for j in range(torque.shape[0]):
        torque[j] = gravity_torque[j] - damping[j] * joint_velocity[j]


@compiled
def hold_weight(mass, lever, rotation, gravity, wrench):
    """W = (-m g, R c x (-m g)), what holds the object, by its attitude alone; `object_gravity` of an observation.

    Args:
        mass: m [kg].
        lever: c, from the origin of the object to its centre of mass, in its axes [m], shape (3,).
        rotation: R, axes of the object as columns, shape (3, 3).
        gravity: g [m/s^2], shape (3,).
        wrench: set, force [N] and moment about the origin [N m], world axes, shape (6,).
    """
    x, y, z = -mass * gravity[0], -mass * gravity[1], -mass * gravity[2]
    a = rotation[0, 0] * lever[0] + rotation[0, 1] * lever[1] + rotation[0, 2] * lever[2]
    b = rotation[1, 0] * lever[0] + rotation[1, 1] * lever[1] + rotation[1, 2] * lever[2]
    c = rotation[2, 0] * lever[0] + rotation[2, 1] * lever[1] + rotation[2, 2] * lever[2]
    wrench[0], wrench[1], wrench[2] = x, y, z
    wrench[3], wrench[4], wrench[5] = b * z - c * y, c * x - a * z, a * y - b * x


@compiled
def add_twist_damper(damping, twist, twist_desired, wrench):
    """W -= D (t - t_d), world axes.

    Args:
        damping: D [N s/m, N m s/rad], shape (6,).
        twist: t, velocity [m/s] and angular velocity [rad/s] of the object, shape (6,).
        twist_desired: t_d, shape (6,).
        wrench: changed [N, N m], shape (6,).
    """
    for k in range(6):
        wrench[k] -= damping[k] * (twist[k] - twist_desired[k])


@compiled
def take_off_torsion(torsion_rows, torsion, wrench):
    """W -= G^tau tau_C: the torsion moments of soft tips are there already; the first half of their compensation.

    Args:
        torsion_rows: G^tauT, `object_torsion_jacobian`, or `J_O_tau` for forces along q_O, shape (nc, 6).
        torsion: tau_C [N m], shape (nc,).
        wrench: changed, shape (6,).
    """
    for i in range(torsion.shape[0]):
        for k in range(6):
            wrench[k] -= torsion_rows[i, k] * torsion[i]


@compiled
def add_torsion(hand_torsion_jacobian, torsion, torque):
    """tau += J_CF^tauT tau_C: the fingers hold the torsion moments; the second half.

    Args:
        hand_torsion_jacobian: J_CF^tau, shape (nc, n).
        torsion: tau_C [N m], shape (nc,).
        torque: changed [N m], shape (n,).
    """
    for i in range(torsion.shape[0]):
        for j in range(torque.shape[0]):
            torque[j] += hand_torsion_jacobian[i, j] * torsion[i]


@compiled
def share_wrench(force_rows, wrench, forces):
    """f_C = (G^f)^+ W, the smallest contact forces that do this to the object.

    Args:
        force_rows: G^fT, `object_force_jacobian`, or `J_O_f` for forces along q_O, shape (3 nc, 6).
        wrench: W [N, N m], shape (6,).
        forces: set, f_C in the contact frames [N], shape (3 nc,).
    """
    least_norm(force_rows, True, wrench, forces)


@compiled
def feed_back_internal_forces(internal_force, internal_force_desired, gain, squeeze):
    """f = f_N - K_N (f_N - f_Nd), from (59): with K_N > 1 more than what is missing.

    Args:
        internal_force: f_N [N], shape (np,).
        internal_force_desired: f_Nd [N], shape (np,).
        gain: K_N, shape (np,).
        squeeze: set, f [N], shape (np,).
    """
    for k in range(squeeze.shape[0]):
        squeeze[k] = internal_force[k] - gain[k] * (internal_force[k] - internal_force_desired[k])


@compiled
def add_internal_forces(basis, squeeze, forces):
    """f_C += K f: forces that add up to nothing.

    Args:
        basis: K, `internal_force_basis`, shape (3 nc, np).
        squeeze: f, between each pair of contacts [N], shape (np,).
        forces: changed, f_C [N], shape (3 nc,).
    """
    for row in range(forces.shape[0]):
        for k in range(squeeze.shape[0]):
            forces[row] += basis[row, k] * squeeze[k]


@compiled
def clamp_to_cone(friction, least, forces):
    """Bring contact forces into their friction cones: f_z >= least, |f_x, f_y| <= mu f_z. The direction of f_t stays.

    What is cut off is missing from the wrench: use it to keep tips from being asked to slip.

    Args:
        friction: mu.
        least: normal force below which no tip shall press [N].
        forces: changed, f_C in the contact frames [N], shape (3 nc,).
    """
    for i in range(0, forces.shape[0], 3):
        forces[i + 2] = max(forces[i + 2], least)
        along = math.sqrt(forces[i] * forces[i] + forces[i + 1] * forces[i + 1])
        most = friction * forces[i + 2]
        if along > most:
            forces[i] *= most / along
            forces[i + 1] *= most / along


@compiled
def push_contacts(hand_force_jacobian, forces, torque):
    """tau += J_CF^fT f_C.

    Args:
        hand_force_jacobian: J_CF^f, shape (3 nc, n).
        forces: f_C in the contact frames [N], shape (3 nc,).
        torque: changed [N m], shape (n,).
    """
    for row in range(forces.shape[0]):
        for j in range(torque.shape[0]):
            torque[j] += hand_force_jacobian[row, j] * forces[row]


@compiled
def push_tips(tip_jacobian, forces, torque):
    """tau += sum J_i^T f_i, forces at the tip centres.

    Args:
        tip_jacobian: J_i, shape (nc, 3, n).
        forces: f_i, world axes [N], shape (nc, 3).
        torque: changed [N m], shape (n,).
    """
    for i in range(forces.shape[0]):
        for k in range(3):
            for j in range(torque.shape[0]):
                torque[j] += tip_jacobian[i, k, j] * forces[i, k]


@compiled
def low_pass(signal, time_constant, time_step, filtered):
    """y += (1 - exp(-dt / T)) (x - y): a first-order filter T y' = x - y, exact where x is held over the sample.

    Args:
        signal: x, shape (m,).
        time_constant: T [s]; 0 for none.
        time_step: dt since the sample before [s].
        filtered: y, changed; a part of the memory, shape (m,).
    """
    share = 1.0
    if time_constant > 0.0:
        share = -math.expm1(-time_step / time_constant)
    for k in range(filtered.shape[0]):
        filtered[k] += share * (signal[k] - filtered[k])


@compiled
def minimum_jerk(start, end, duration, time):
    """x = x_0 + (x_1 - x_0) (10 s^3 - 15 s^4 + 6 s^5), s = t / T within 0 and 1 [Flash and Hogan 1985].

    Args:
        start: x_0, a number in any unit.
        end: x_1.
        duration: T [s], above 0.
        time: t since the begin [s].

    Returns:
        x, x' [1/s] and x'' [1/s^2].
    """
    s, way = min(max(time / duration, 0.0), 1.0), end - start
    x = start + way * s * s * s * (10.0 + s * (6.0 * s - 15.0))
    rate = way * 30.0 * s * s * (1.0 + s * (s - 2.0)) / duration
    return x, rate, way * 60.0 * s * (1.0 + s * (2.0 * s - 3.0)) / (duration * duration)
