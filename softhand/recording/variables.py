"""The one list of what a recording can hold."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Variable(NamedTuple):
    """What one array of a recording means.

    Units that differ along the last dimension are listed in its order: "m, rad, rad, rad". Those of joints are that of
    one that turns and that of one that slides: "rad or m"; a recording knows which do, see `Recording.units`.
    """

    dims: tuple[str, ...]
    units: str
    long_name: str
    dtype: type = np.float64


LABELLED_DIMS = ("joint", "contact", "pair", "support", "velocity", "coupled_joint", "taxel", "element")
"""Dimensions whose labels belong to the model, so that each recording brings its own."""

COMPONENTS: dict[str, tuple[str, ...]] = {
    "xyz": ("x", "y", "z"),
    "rpy": ("roll", "pitch", "yaw"),
    "twist": ("v_x", "v_y", "v_z", "w_x", "w_y", "w_z"),
    "deformation_component": ("dr", "dtheta", "dphi", "dpsi"),
    "displacement_component": ("dtheta", "dphi", "dpsi"),
    "surface_component": ("dr", "s1", "s2", "psi"),
    "force_component": ("f_x", "f_y", "f_z", "tau"),
    "moment_component": ("m_x", "m_y", "m_z"),
    "shear_component": ("f_x", "f_y"),
    "angle": ("Theta", "Phi"),
    "coordinate": ("theta", "phi", "alpha_o_1", "alpha_o_2", "psi"),
    "row": ("x", "y", "z"),
    "column": ("x", "y", "z"),
}
"""Dimensions whose labels are the same in every recording."""

MEASURED_PREFIX = "measured_"
"""Before the names of variables that are as a controller saw them; they are there under [sensing] alone."""

COMMANDED = {
    "torque": "joint_torque_commanded",
    "position": "joint_position_commanded",
    "velocity": "joint_velocity_commanded",
}
"""What it asked for, by what it commands; there under [actuation] alone."""

MOMENTS = ("contact_moment", "support_moment")
"""There under laws with a moment alone."""

FOUND_AFTERWARDS = ("slipped_share", "microslip_loss")
"""What a run does not record, but for `slipped_share` with `fingertip.slip_elements`; `softhand.incipient_slip` finds
it in a recording."""

_JOINT, _PAIR, _CONTACT = ("time", "joint"), ("time", "pair"), ("time", "contact")
_XYZ, _RPY, _SUPPORT = ("time", "xyz"), ("time", "rpy"), ("time", "support")
_TAXEL = (*_CONTACT, "taxel")

VARIABLES: dict[str, Variable] = {
    "time": Variable(("time",), "s", "time since the start of the run"),
    "joint_position": Variable(_JOINT, "rad or m", "joint angle, or travel of a slide"),
    "coupled_position": Variable(
        ("time", "coupled_joint"), "rad or m", "angle, or travel, of a joint that motors move through a coupling"
    ),
    "joint_velocity": Variable(_JOINT, "rad/s or m/s", "joint velocity"),
    "joint_torque": Variable(
        _JOINT, "N m or N", "joint torque, or force of a slide, as applied, after the effort limits"
    ),
    "joint_limited": Variable(_JOINT, "1", "1 above the upper, -1 below the lower limit of the joint, else 0", np.int8),
    "torque_limited": Variable(_JOINT, "1", "1 where an effort limit cut the commanded torque, else 0", np.int8),
    "object_position": Variable(_XYZ, "m", "origin of the object frame, in the world"),
    "object_rpy": Variable(_RPY, "rad", "orientation of the object, R = Rz(yaw) Ry(pitch) Rx(roll)"),
    "object_twist": Variable(
        ("time", "twist"),
        "m/s, m/s, m/s, rad/s, rad/s, rad/s",
        "velocity of the origin of the object frame and angular velocity of the object, world axes",
    ),
    "internal_force": Variable(_PAIR, "N", "internal force between two contacts"),
    "tip_position": Variable((*_CONTACT, "xyz"), "m", "centre of the flat face of the hemisphere, in the world"),
    "deformation": Variable((*_CONTACT, "deformation_component"), "m, rad, rad, rad", "fingertip deformation"),
    "contact_force": Variable(
        (*_CONTACT, "force_component"), "N, N, N, N m", "force and torsion on the object, in the contact frame"
    ),
    "contact_moment": Variable(
        (*_CONTACT, "moment_component"),
        "N m",
        "moment on the object that the lean of the tip adds to contact_force, in the contact frame; under laws with a "
        "moment alone",
    ),
    "contact_angles": Variable((*_CONTACT, "angle"), "rad", "angles of the contact on the hemisphere"),
    "contact_point": Variable((*_CONTACT, "xyz"), "m", "contact point, in the world"),
    "contact_rotation": Variable((*_CONTACT, "row", "column"), "1", "rotation from the contact frame to the world"),
    "contact_coordinates": Variable(
        (*_CONTACT, "coordinate"), "rad, rad, m, m, rad", "contact coordinates eta on fingertip and object"
    ),
    "contact_coordinates_rate": Variable(
        (*_CONTACT, "coordinate"), "rad/s, rad/s, m/s, m/s, rad/s", "rate of the contact coordinates eta"
    ),
    "friction_use": Variable(_CONTACT, "1", "tangential force over the friction limit, |f_t|/(mu f_z)"),
    "contact_feature": Variable(
        _CONTACT,
        "1",
        "1 over a face of the object, 2 over an edge, 3 over a vertex; of one of several parts 10 times its number "
        "more, and 1000 where the tip reaches another part as well",
        np.int16,
    ),
    "limit_surface_use": Variable(
        _CONTACT, "1", "load over the coupled limit, sqrt((|f_t|/(mu f_z))^2 + (tau/tau_max)^2)"
    ),
    "is_slipping": Variable(_CONTACT, "1", "1 where the step before slipped, else 0", np.int8),
    "slip_travel": Variable(_CONTACT, "m", "tangential slip since the start, its path length"),
    "slip_twist": Variable(_CONTACT, "rad", "torsional slip since the start, its total amount"),
    "slip_loss": Variable(_CONTACT, "J", "work lost to slip since the start"),
    "slipped_share": Variable(
        _CONTACT,
        "1",
        "share of the contact that slips, 1 where all of it does; with slip_elements, or by softhand.incipient_slip",
    ),
    "element_deformation": Variable(
        (*_CONTACT, "element", "displacement_component"), "rad", "deformation of each element of the contact"
    ),
    "element_force": Variable(
        (*_CONTACT, "element", "force_component"),
        "N, N, N, N m",
        "force and torsion if all of the contact were like that element; contact_force is their mean",
    ),
    "microslip_loss": Variable(
        _CONTACT, "J", "work lost in the parts that slip, since the start; put in by softhand.incipient_slip"
    ),
    "support_force": Variable(
        (*_SUPPORT, "force_component"), "N, N, N, N m", "force and torsion of a support, in its contact frame"
    ),
    "support_moment": Variable((*_SUPPORT, "moment_component"), "N m", "contact_moment of a support, likewise"),
    "support_deformation": Variable(
        (*_SUPPORT, "surface_component"), "m, m, m, rad", "depth, shear and torsion of a support"
    ),
    "support_point": Variable(
        (*_SUPPORT, "xyz"), "m", "contact point of a support where it last touched, in the world"
    ),
    "support_rotation": Variable(
        (*_SUPPORT, "row", "column"), "1", "rotation from the contact frame of a support to the world"
    ),
    "support_is_slipping": Variable(_SUPPORT, "1", "1 where the step before slipped, else 0", np.int8),
    "support_slip_loss": Variable(_SUPPORT, "J", "work lost to slip since the start"),
    "tactile_normal_force": Variable(_TAXEL, "N", "normal force of a taxel, along z of the contact frame"),
    "tactile_shear_force": Variable(
        (*_TAXEL, "shear_component"), "N", "shear force of a taxel on the object, along x and y of the contact frame"
    ),
    "tactile_slip": Variable(_TAXEL, "m/s", "speed of a taxel over the object"),
    "penetration_depth": Variable(_TAXEL, "m", "depth of a taxel of the undeformed tip below the object's surface"),
    "external_force": Variable(
        ("time", "velocity"),
        "N m or N",
        "generalized force of pushes from outside, as applied: of the joints, then of the object in its own frame",
    ),
    "object_position_desired": Variable(_XYZ, "m", "desired origin of the object frame, in the world"),
    "object_rpy_desired": Variable(_RPY, "rad", "desired orientation of the object, R = Rz(yaw) Ry(pitch) Rx(roll)"),
    "internal_force_desired": Variable(_PAIR, "N", "desired internal force between two contacts"),
    COMMANDED["torque"]: Variable(
        _JOINT, "N m or N", "joint torque, or force of a slide, that the controller asked for; under [actuation] alone"
    ),
    COMMANDED["position"]: Variable(_JOINT, "rad or m", "set point that the controller asked a position servo for"),
    COMMANDED["velocity"]: Variable(_JOINT, "rad/s or m/s", "set point that the controller asked a velocity servo for"),
    "measured_joint_position": Variable(_JOINT, "rad or m", "joint_position, as the controller saw it"),
    "measured_joint_velocity": Variable(_JOINT, "rad/s or m/s", "joint_velocity, as the controller saw it"),
    "measured_object_position": Variable(_XYZ, "m", "object_position, as the controller saw it"),
    "measured_object_rpy": Variable(_RPY, "rad", "object_rpy, as the controller saw it"),
    "measured_object_twist": Variable(
        ("time", "twist"), "m/s, m/s, m/s, rad/s, rad/s, rad/s", "object_twist, as the controller saw it"
    ),
    "measured_internal_force": Variable(_PAIR, "N", "internal_force, from what the controller saw"),
    "measured_contact_force": Variable(
        (*_CONTACT, "force_component"), "N, N, N, N m", "contact_force, from what the controller saw"
    ),
    "measured_contact_angles": Variable((*_CONTACT, "angle"), "rad", "contact_angles, as the controller saw them"),
    "measured_contact_point": Variable((*_CONTACT, "xyz"), "m", "contact_point, from what the controller saw"),
}
