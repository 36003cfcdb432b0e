"""Joint torques that make the contacts carry a wrench and squeeze."""

from __future__ import annotations

import numpy as np

from softhand.numerics.arrays import Array
from softhand.numerics.linear import least_norm
from softhand.sensing.observation import Observation


def grasp_torque(observation: Observation, wrench: Array, squeeze: Array, compensate_torsion: bool) -> Array:
    """tau = J_CF^fT { (J_O^fT)^+ [F - J_O^tauT tau_C] + K f_N } + J_CF^tauT tau_C, from (57) and (46) at rest.

    Without compensation both terms of tau_C are dropped. Neither weight of the fingers nor damping is in it.

    Args:
        observation: the grasp now.
        wrench: F, what the contacts shall do to the object in the coordinates q_O [N, N m], shape (6,).
        squeeze: f_N [N], shape (np,).
        compensate_torsion: whether the measured torsion moments are taken off the wrench and held by the fingers.

    Returns:
        Joint torques [N m], shape (n,).
    """
    f_C = np.empty(observation.J_O_f.shape[0])
    if compensate_torsion:
        wrench = wrench - observation.J_O_tau.T @ observation.tau_C
    least_norm(observation.J_O_f, True, wrench, f_C)
    f_C += observation.K @ squeeze
    tau = observation.J_CF_f.T @ f_C
    if compensate_torsion:
        tau += observation.J_CF_tau.T @ observation.tau_C
    return tau
