"""The two tables of the contact layer: what is fixed at each contact, and what holds at one state.

A contact is a sphere, the pad, carried by one joint, against a shape carried by another, the base. Of a fingertip these
are its hemisphere and the object; "tip" and "object" below mean the two bodies of any contact. An ellipsoid against a
plane is a sphere of no radius, a point, that runs over it.

Structured arrays of one row a contact: kernels read and write them by name, and their fields are live views for
controllers and recordings.
"""

from __future__ import annotations

import numpy as np

from softhand.laws.law import LEADING
from softhand.model.shapes.shape import RESULTS

MAX_LAW_PARAMETERS = 64
LAW_ARGUMENTS = max(map(len, LEADING.values())) + MAX_LAW_PARAMETERS
MAX_RELAXATIONS = 4

STORED, REMEMBERED, LEANING = 3, 4, 2
"""Numbers in z of an element of a contact, or of a contact as a whole: its displacement, and behind it for each
relaxation the forces that it remembers, and behind these, if some law has a moment, the slopes of its energy by the
lean. See `PAD`, remembered and block."""

PLANE, SOLID, BALL, SIDE = range(4)
"""What the base of a contact is shaped like; a side is a plane as far as a solid reaches that it bounds."""

ELLIPSE, COLUMNS, OWN_PRESSURE = range(3)
"""The limit surface: an ellipse, or the exact one of a pressure, that of columns or one with a kappa of its own."""

PAD = np.dtype(
    [
        ("joint", np.int64),  # Pinocchio joint that carries the pad, 0 for the world
        ("base", np.int64),  # Pinocchio joint that carries the shape that it meets
        ("own", np.int64),  # how many of the first columns of the contact move the pad; the others move the base
        ("first_twist", np.int64),  # which column of J velocity 0 has, as this contact sees it; see `World.view`
        ("is_support", np.int64),  # whether it is no fingertip against the object, and idle while it does not touch
        ("rotation", np.float64, (3, 3)),  # axes of the finger frame F in the joint frame
        ("position", np.float64, 3),  # origin of F in the joint frame [m]
        ("radius", np.float64),  # of the undeformed hemisphere [m]; 0 for a point, and for an ellipsoid
        ("semi_axes", np.float64, 3),  # of an ellipsoid along the axes of F [m]; 0 for a sphere
        ("is_edge", np.int64),  # whether the pad is an edge along x of F, which meets a solid with its deepest point
        ("half_length", np.float64),  # of that edge [m]
        ("way", np.int64),  # of that edge in a polyhedron: to which end it leaves it, 1 or -1; 0 for a round body
        ("base_share", np.float64),  # of the depth, taken by the base: the contact point lies so much further out
        ("friction", np.float64),  # coefficient mu, kinetic
        ("static_friction", np.float64),  # coefficient until slip begins
        ("can_slip", np.int64),  # whether friction has a limit
        ("has_faces", np.int64),  # whether faces of the box have a friction of their own
        ("face_friction", np.float64, 6),  # mu on +x, -x, +y, ... of the box; 0: that of the tip
        ("slip_column", np.int64),  # column of z that is 1 while the tip slips; -1 if mu is one number
        ("elements", np.int64),  # that slip by themselves, see `elements`; 1: the contact slips as a whole
        ("element_rows", np.int64),  # address for `elements.rows_at`; 0 where it slips as a whole
        ("block", np.int64),  # numbers in z from one element to the next
        ("torsion_length", np.float64),  # tau_max / (mu f_z) [m] as given, or 0
        ("torsion_share", np.float64),  # the same over sqrt(r dr), or 0 for the pressure of columns
        ("limit", np.int64),  # ELLIPSE, COLUMNS or OWN_PRESSURE
        ("kappa", np.float64),  # of the own pressure: tau_max / (mu f_z) over the radius of the contact
        ("face_normal", np.float64, 3),  # outward, in the object frame
        ("face_tangent", np.float64, 3),  # x axis of C_O, in the object frame
        ("face_offset", np.float64),  # distance of the face from the origin of the object frame [m]
        ("shape", np.int64),  # of the base: PLANE, the face without its edges; SOLID, the body as it is; BALL; SIDE
        ("nearest_function", np.int64),  # address of the solid's nearest point, see `model.shapes.shape`; 0 for a box
        ("chart_function", np.int64),  # address of its surface coordinates; 0 if it has plane faces only
        ("shape_data", np.int64),  # address of its data
        ("box_rotation", np.float64, (3, 3)),  # axes of the box in the object frame
        ("box_centre", np.float64, 3),  # in the object frame [m]
        ("box_half", np.float64, 3),  # half the length of each side [m]
        ("ball_centre", np.float64, 3),  # in the frame of the base [m]
        ("ball_radius", np.float64),  # [m]
        ("force_function", np.int64),  # address of the compiled law
        ("stiffness_function", np.int64),  # address of its derivatives
        ("slope_function", np.int64),  # address of the slope of its energy by the lean; 0 if it transmits no moment
        ("bend_function", np.int64),  # address of the derivatives of that; 0 likewise
        ("is_surface", np.int64),  # coordinates of the law: 1 surface, 0 polar
        ("law_arguments", np.float64, LAW_ARGUMENTS),  # deformation and angles as the kernel sets them, then parameters
        ("is_damped", np.int64),
        ("viscosity", np.float64, 3),  # radial, tangential [N s/m], torsional [N m s/rad]
        ("viscosity_per_force", np.float64, 3),  # the same over the normal force
        ("relaxations", np.int64),  # how many it has
        ("remembered", np.int64),  # numbers in z of each, the same for all contacts of a plant
        ("relaxation", np.float64, (MAX_RELAXATIONS, 2)),  # share, rate [1/s]; the rows in use come first
    ]
)
"""One pad and what it meets."""

CONTACT = np.dtype(
    [
        ("rotation", np.float64, (3, 3)),  # R_BC: axes of the contact frame C_F in the world, see `place_contact`
        ("point", np.float64, 3),  # contact point in the world [m]
        ("tip", np.float64, 3),  # origin of F in the world, or the point of an ellipsoid that lies deepest [m]
        ("normal", np.float64, 3),  # outward normal of the object at the contact, in the object frame
        ("feature", np.int64),  # where on the object: 1 a face or curved surface, 2 an edge, 3 a vertex; see `union`
        ("near", np.float64, RESULTS),  # what the function of the shape is asked and answers; scratch
        ("friction", np.float64),  # coefficient mu there, kinetic
        ("static_friction", np.float64),  # until slip begins
        ("lever", np.float64),  # l = tau_max / (mu f_z) [m], see `limit.set_limit`
        ("curve", np.float64, 5),  # c_i of the exact limit surface; zeros: the ellipse
        ("distance", np.float64),  # R = r - dr: from the origin of F to the surface [m]
        ("angles", np.float64, 2),  # Theta, Phi [rad]
        ("sin_Phi", np.float64),
        ("cos_Phi", np.float64),
        ("lean", np.float64, 2),  # x_F along x_C and y_C; surface coordinates only
        ("turning", np.float64, (3, 2)),  # of the frame over the object per way of the tip [rad/m], `leaning`
        ("theta_per_x", np.float64),  # J_delta^-1: dtheta' = theta_per_x v_x, dphi' = phi_per_y v_y,
        ("phi_per_y", np.float64),  # dpsi' = w_z + psi_per_x v_x; 1, 1, 0 for surface coordinates
        ("psi_per_x", np.float64),
        ("velocity", np.float64, 4),  # J_CF q' - J_O v_O: v_x, v_y, v_z [m/s], w_z [rad/s] in C_F
        ("pressing_rate", np.float64),  # dr' as dashpot and friction see it [m/s], see `evaluate_contacts`
        ("deformation", np.float64, 4),  # dr [m], dtheta, dphi, dpsi [rad]; or dr, s1, s2 [m], psi [rad]
        ("deformation_rate", np.float64, 4),  # their rates if nothing slips: less `slip_speed` they are those that are
        ("deformation_force", np.float64, 4),  # of the law: Fr [N], Ftheta, Fphi, Fpsi [N m]; or f_n, f_1, f_2, tau
        ("lean_force", np.float64, 2),  # of the law: dU/dlean [J], zero without a moment
        ("is_idle", np.int64),  # 1 for a support that does not touch: all that follows from touch is then zero
        ("is_broken", np.int64),  # 1 once the law has answered a deformation within reason with NaN or infinity
        ("is_damped", np.int64),  # whether the material relaxes or has dashpots, and touches
        ("kept", np.float64),  # share of the law's force that has not relaxed
        ("recalled", np.float64, 4),  # what else relaxation takes from it, in C_F
        ("lean_recalled", np.float64, 2),  # the same of the slope by the lean
        ("lean_elastic", np.float64, 2),  # what is left of `lean_force`: the contact transmits it
        ("moment", np.float64, 3),  # m of `laws.rolling` on the object, in C_F [N m], of `lean_elastic`
        ("elastic", np.float64, 4),  # force of the material without viscosity: f_x, f_y, f_z [N], tau [N m], in C_F
        ("dashpot", np.float64, 4),  # viscosity along x, y, z [N s/m] and about z [N m s/rad]
        ("force", np.float64, 4),  # f_x, f_y, f_z [N], tau [N m] on the object, in C_F
        ("grip", np.float64),  # mu of the limit that holds now, infinite where friction has none
        ("slip", np.float64, 3),  # what slip took from dtheta, dphi, dpsi, or s1, s2, psi, at the last evaluation
        ("slip_rate", np.float64, 3),  # v_x, v_y [m/s], w_z [rad/s] of slip that dashpots leave room for, in C_F
        ("slip_speed", np.float64, 3),  # what slip took from them in the last step, per time
        ("force_before", np.float64, 3),  # force where slip was last made final, in the coordinates of the law
        ("limit_surface_use", np.float64),
        ("pressed", np.float64),  # normal force that its elements share, if it has some [N]
        ("slipped_share", np.float64),  # of the area, whose elements are at their limit; 0 without elements
        ("is_slipping", np.int64),  # whether the last step slipped, all of the contact
        ("slip_travel", np.float64),  # since the start [m]
        ("slip_twist", np.float64),  # since the start [rad]
        ("slip_loss", np.float64),  # work of friction since the start [J]
        ("derivatives", np.float64, 16),  # what the law gives as stiffness; scratch
        ("stiffness", np.float64, (4, 4)),  # d force / d displacement in C_F
        ("damping", np.float64, 4),  # d force / d velocity in C_F, a diagonal
        ("rolling", np.float64, 3),  # xx, xy, yy [N m] of what columns 4 and 5 of the Jacobian say: `roll_stiffness`
        ("leaning", np.float64, (4, 2)),  # d force / d lean in C_F, see `bend_stiffness`
    ]
)
"""One contact at one state."""
