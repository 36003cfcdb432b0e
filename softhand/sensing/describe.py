"""Kernels that fill the fields of an observation from the bodies and contacts at one state."""

from __future__ import annotations

import math

from softhand.contact.elements import DISPLACEMENT, FORCE, rows_at
from softhand.contact.kinematics import contact_coordinates
from softhand.contact.limit import limit_use, set_limit
from softhand.contact.scaled import traction
from softhand.model.configuration import CONTINUOUS
from softhand.numerics.branches import usually
from softhand.numerics.compiled import compiled
from softhand.numerics.rotations import set_rpy


@compiled
def describe_joints(body, q, v, joints):
    """q, q_F, q_F', N_F."""
    for k in range(joints.joint_position.shape[0]):
        i = body.joints[k, 1]
        is_angle = body.joints[k, 0] == CONTINUOUS
        joints.joint_position[k] = math.atan2(q[i + 1], q[i]) if is_angle else q[i]
        joints.joint_velocity[k], joints.gravity_torque[k] = v[k], body.gravity_terms[k]
    for k in range(q.shape[0]):
        joints.configuration[k] = q[k]


@compiled
def copy_desired(desired, asked):
    """q_Od and its rates, f_Nd, opening, share of the weight, standoff."""
    for k in range(6):
        asked.object_coordinates_desired[k] = desired.coordinates[k]
        asked.object_coordinates_rate_desired[k] = desired.coordinates_rate[k]
        asked.object_coordinates_acceleration_desired[k] = desired.coordinates_acceleration[k]
        asked.object_twist_desired[k] = desired.twist[k]
        asked.object_twist_rate_desired[k] = desired.twist_rate[k]
    for k in range(3):
        asked.standoff_desired[k], asked.standoff_rate_desired[k] = desired.standoff[k], desired.standoff_rate[k]
        asked.standoff_acceleration_desired[k] = desired.standoff_acceleration[k]
    for k in range(desired.internal_force.shape[0]):
        asked.internal_force_desired[k] = desired.internal_force[k]
    asked.opening_desired[0], asked.carried_desired[0] = desired.opening[0], desired.carried[0]


@compiled
def describe_object(pose, v, gravity, object_):
    """q_O, T_O, twist in world axes, N_O."""
    q_O, rotation, T_O = object_.object_coordinates, object_.object_rotation, object_.coordinate_map
    for row in range(3):
        q_O[row] = pose[9 + row]
        for k in range(3):
            rotation[row, k] = pose[3 * k + row]
    set_rpy(rotation, q_O[3:6])
    # angular velocity = roll' x'' + pitch' y' + yaw' z
    cos_yaw, sin_yaw = math.cos(q_O[5]), math.sin(q_O[5])
    for k in range(3):
        T_O[k, k] = 1.0
    T_O[3, 3], T_O[4, 3], T_O[5, 3] = rotation[0, 0], rotation[1, 0], rotation[2, 0]
    T_O[3, 4], T_O[4, 4], T_O[5, 4] = -sin_yaw, cos_yaw, 0.0
    T_O[3, 5], T_O[4, 5], T_O[5, 5] = 0.0, 0.0, 1.0
    # from body to world axes; gravity terms are the wrench that holds, about the origin of the object frame
    twist, wrench, N_O, column = object_.object_twist, object_.object_gravity, object_.N_O, v.shape[0] - 6
    for k in range(6):
        twist[k], wrench[k], N_O[k] = 0.0, 0.0, 0.0
    for row in range(3):
        for k in range(3):
            twist[row] += rotation[row, k] * v[column + k]
            twist[3 + row] += rotation[row, k] * v[column + 3 + k]
            wrench[row] += rotation[row, k] * gravity[column + k]
            wrench[3 + row] += rotation[row, k] * gravity[column + 3 + k]
        N_O[row] = wrench[row]
        for k in range(3):
            N_O[3 + k] += T_O[3 + row, 3 + k] * wrench[3 + row]


@compiled
def describe_tips(body, columns, poses, J, contacts, tips):
    """Finger frames F and their Jacobians."""
    n = tips.tip_jacobian.shape[2]
    for i in range(body.tip_joints.shape[0]):
        pose, R = poses[body.tip_joints[i]], body.tip_rotations[i]
        x, y, z = contacts[i].tip[0], contacts[i].tip[1], contacts[i].tip[2]
        tips.tip_position[i, 0], tips.tip_position[i, 1], tips.tip_position[i, 2] = x, y, z
        for row in range(3):
            a, b, c = pose[row], pose[3 + row], pose[6 + row]
            for k in range(3):
                tips.tip_rotation[i, row, k] = a * R[0, k] + b * R[1, k] + c * R[2, k]
        linear, angular = tips.tip_jacobian[i], tips.tip_angular_jacobian[i]
        for a in range(columns.shape[1]):
            column = columns[i, a]
            if column < 0 or column >= n:
                break
            seen = column + body.tip_views[i]
            wx, wy, wz = J[3, seen], J[4, seen], J[5, seen]
            angular[0, column], angular[1, column], angular[2, column] = wx, wy, wz
            linear[0, column] = J[0, seen] + wy * z - wz * y
            linear[1, column] = J[1, seen] + wz * x - wx * z
            linear[2, column] = J[2, seen] + wx * y - wy * x


@compiled
def describe_contacts(touch, at_tips):
    """Forces, deformations, slip."""
    for i in range(at_tips.is_slipping.shape[0]):
        contact = touch.contacts[i]
        for k in range(4):
            at_tips.contact_force[i, k], at_tips.deformation[i, k] = contact.force[k], contact.deformation[k]
            at_tips.deformation_rate[i, k] = contact.deformation_rate[k]
            if k > 0:
                at_tips.deformation_rate[i, k] -= contact.slip_speed[k - 1]
        for row in range(3):
            at_tips.contact_point[i, row] = contact.point[row]
            for k in range(3):
                at_tips.contact_rotation[i, row, k] = contact.rotation[row, k]
        at_tips.contact_angles[i, 0], at_tips.contact_angles[i, 1] = contact.angles[0], contact.angles[1]
        at_tips.contact_feature[i], at_tips.is_slipping[i] = contact.feature, contact.is_slipping
        at_tips.slip_travel[i], at_tips.slip_twist[i] = contact.slip_travel, contact.slip_twist
        at_tips.slip_loss[i] = contact.slip_loss
    for i in range(at_tips.slipped_share.shape[0]):
        contact = touch.contacts[i]
        at_tips.slipped_share[i] = contact.slipped_share if touch.pads[i].elements > 1 else contact.is_slipping
        _describe_elements(touch.pads[i], contact, at_tips.element_deformation[i], at_tips.element_force[i])
    for i in range(at_tips.contact_moment.shape[0]):
        for k in range(3):
            at_tips.contact_moment[i, k] = touch.contacts[i].moment[k]


@compiled
def _describe_elements(pad, contact, deformation, force):
    """Of each, zeros for those that a contact has not."""
    n = pad.elements
    for element in range(deformation.shape[0]):
        for k in range(3):
            deformation[element, k] = contact.deformation[1 + k] if element < n else 0.0
        for k in range(4):
            force[element, k] = contact.force[k] if element < n else 0.0
    if n > 1:
        rows = rows_at(pad.element_rows, n)
        for element in range(n):
            for k in range(3):
                deformation[element, k] = rows[element, DISPLACEMENT + k]
            for k in range(4):
                force[element, k] = rows[element, FORCE + k]


@compiled
def describe_friction(touch, at_tips):
    """How near the contacts are to slipping."""
    for i in range(at_tips.friction_use.shape[0]):
        pad, contact = touch.pads[i], touch.contacts[i]
        at_tips.friction_use[i] = _friction_use(contact)
        if not pad.can_slip:
            set_limit(pad, contact)
            room = contact.friction * contact.force[2]
            contact.limit_surface_use = limit_use(contact, traction(contact), room)
        at_tips.limit_surface_use[i] = contact.limit_surface_use


@compiled
def describe_rolling(touch, poses, J, v, at_tips):
    """eta and its rate."""
    object_pose = poses[poses.shape[0] - 1]
    for i in range(at_tips.contact_coordinates.shape[0]):
        coordinates, rate = at_tips.contact_coordinates[i], at_tips.contact_coordinates_rate[i]
        contact_coordinates(touch.pads[i], touch.contacts[i], touch.columns[i], object_pose, J, v, coordinates, rate)


@compiled
def describe_jacobians(touch, object_pose, jacobians):
    """J_CF by joints, J_O by the twist of the object."""
    for i in range(jacobians.hand_torsion_jacobian.shape[0]):
        contact, columns = touch.contacts[i], touch.columns[i]
        for a in range(columns.shape[0]):
            column = columns[a]
            if column < 0 or column >= jacobians.hand_torsion_jacobian.shape[1]:
                break
            for row in range(3):
                jacobians.hand_force_jacobian[3 * i + row, column] = touch.jacobian[i, a, row]
            jacobians.hand_torsion_jacobian[i, column] = touch.jacobian[i, a, 3]
        rows = jacobians.object_force_jacobian[3 * i : 3 * i + 3], jacobians.object_torsion_jacobian[i]
        _object_rows(contact, object_pose, rows[0], rows[1])


@compiled
def describe_paper_jacobians(touch, object_pose, T_O, jacobians):
    """J_O by the coordinates of the object."""
    for i in range(jacobians.J_O_tau.shape[0]):
        rows = jacobians.J_O_f[3 * i : 3 * i + 3], jacobians.J_O_tau[i]
        _object_rows_in_coordinates(touch.contacts[i], object_pose, T_O, rows[0], rows[1])


@compiled
def _friction_use(contact):
    """|f_t| / (mu f_z)."""
    f = contact.force
    limit = contact.friction * max(f[2], 0.0)
    tangential = math.hypot(f[0], f[1])
    if usually(limit > 0.0):
        return tangential / limit
    return math.inf if tangential > 0.0 else 0.0


@compiled
def _object_rows(contact, object_pose, force_rows, moment_row):
    """Velocity of the object's point at the contact and spin about its normal in C_F, from the twist."""
    R = contact.rotation
    ax, ay, az = (contact.point[0] - object_pose[9], contact.point[1] - object_pose[10],
                  contact.point[2] - object_pose[11])  # fmt: skip
    for row in range(3):
        x, y, z = R[0, row], R[1, row], R[2, row]
        force_rows[row, 0], force_rows[row, 1], force_rows[row, 2] = x, y, z
        # r . (w x a) = w . (a x r)
        force_rows[row, 3], force_rows[row, 4], force_rows[row, 5] = ay * z - az * y, az * x - ax * z, ax * y - ay * x
    for k in range(3):
        moment_row[k], moment_row[3 + k] = 0.0, R[k, 2]


@compiled
def _object_rows_in_coordinates(contact, object_pose, T_O, J_O_f, J_O_tau):
    """The same from q_O', whose columns of T_O are the angular velocities w of roll', pitch' and yaw'."""
    R = contact.rotation
    ax, ay, az = (contact.point[0] - object_pose[9], contact.point[1] - object_pose[10],
                  contact.point[2] - object_pose[11])  # fmt: skip
    for k in range(3):
        wx, wy, wz = T_O[3, 3 + k], T_O[4, 3 + k], T_O[5, 3 + k]
        vx, vy, vz = wy * az - wz * ay, wz * ax - wx * az, wx * ay - wy * ax
        for row in range(3):
            J_O_f[row, k] = R[k, row]
            J_O_f[row, 3 + k] = R[0, row] * vx + R[1, row] * vy + R[2, row] * vz
        J_O_tau[k], J_O_tau[3 + k] = 0.0, R[0, 2] * wx + R[1, 2] * wy + R[2, 2] * wz


@compiled
def describe_supports(contacts, first, supports):
    """What else touches: force, depth and shear, place, slip."""
    for i in range(supports.support_slip_loss.shape[0]):
        contact = contacts[first + i]
        for k in range(4):
            supports.support_force[i, k] = contact.force[k]
            supports.support_deformation[i, k] = contact.deformation[k]
        for row in range(3):
            supports.support_point[i, row] = contact.point[row]
            for k in range(3):
                supports.support_rotation[i, row, k] = contact.rotation[row, k]
        supports.support_is_slipping[i], supports.support_slip_loss[i] = contact.is_slipping, contact.slip_loss
    for i in range(supports.support_moment.shape[0]):
        for k in range(3):
            supports.support_moment[i, k] = contacts[first + i].moment[k]
