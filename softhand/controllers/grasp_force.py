"""Joint torques that make the contacts carry a wrench and squeeze."""

from __future__ import annotations

import numpy as np

from softhand.controllers.blocks import (
    add_internal_forces,
    add_torsion,
    push_contacts,
    share_wrench,
    take_off_torsion,
)
from softhand.numerics.compiled import compiled


@compiled
def add_grasp_torque(observed, wrench, squeeze, compensate, torque):
    """tau += J_CF^fT { (G^f)^+ [W - G^tau tau_C] + K f_N } + J_CF^tauT tau_C, from (57) and (46) at rest.

    G^f and G^tau map contact forces and torsion moments to the wrench on the object; T_O^T G = J_O^T. Without
    compensation both terms of tau_C are dropped. Neither weight of the fingers nor damping is in it.

    Args:
        observed: fields of an observation.
        wrench: W, what the contacts shall do to the object about its origin, world axes [N, N m], shape (6,); changed.
        squeeze: f_N [N], shape (np,).
        compensate: whether the measured torsion moments are taken off the wrench and held by the fingers.
        torque: changed [N m], shape (n,).
    """
    f_C, torsion = np.empty(observed.object_force_jacobian.shape[0]), observed.contact_force[:, 3]
    if compensate:
        take_off_torsion(observed.object_torsion_jacobian, torsion, wrench)
        add_torsion(observed.hand_torsion_jacobian, torsion, torque)
    share_wrench(observed.object_force_jacobian, wrench, f_C)
    add_internal_forces(observed.internal_force_basis, squeeze, f_C)
    push_contacts(observed.hand_force_jacobian, f_C, torque)
