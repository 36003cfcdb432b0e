"""Joint torques that make the contacts carry a wrench and squeeze."""

from __future__ import annotations

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.linear import least_norm
from softhand.sensing.observation import Observation


def grasp_torque(observation: Observation, wrench: Array, squeeze: Array, compensate_torsion: bool) -> Array:
    """tau = J_CF^fT { (G^f)^+ [W - G^tau tau_C] + K f_N } + J_CF^tauT tau_C, from (57) and (46) at rest.

    G^f and G^tau map contact forces and torsion moments to the wrench on the object; T_O^T G = J_O^T. Without
    compensation both terms of tau_C are dropped. Neither weight of the fingers nor damping is in it.

    Args:
        observation: the grasp now.
        wrench: W, what the contacts shall do to the object about its origin, world axes [N, N m], shape (6,).
        squeeze: f_N [N], shape (np,).
        compensate_torsion: whether the measured torsion moments are taken off the wrench and held by the fingers.

    Returns:
        Joint torques [N m], shape (n,).
    """
    f_C = np.empty(observation.object_force_jacobian.shape[0])
    if compensate_torsion:
        wrench = wrench - observation.object_torsion_jacobian.T @ observation.tau_C
    least_norm(observation.object_force_jacobian, True, wrench, f_C)
    f_C += observation.K @ squeeze
    tau = observation.J_CF_f.T @ f_C
    if compensate_torsion:
        tau += observation.J_CF_tau.T @ observation.tau_C
    return tau
