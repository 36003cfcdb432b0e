"""Eq. (59) in plain numpy, for analysis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softhand.controllers.regulation import Regulation
from softhand.errors import RecordingError
from softhand.numerics.arrays import Array
from softhand.plugins import find_plugin
from softhand.scenario.scenario import Scenario
from softhand.sensing.observation import Observation
from softhand.settings.settings import read_settings


@dataclass(frozen=True)
class Gains:
    """Diagonals of the gains of (59): K_O [N/m, N m/rad], shape (6,), K_v [N m s/rad], shape (n,), K_N, shape (np,)."""

    K_O: Array
    K_v: Array
    K_N: Array
    compensated: bool


def read_gains(scenario: Scenario, n_joints: int, n_pairs: int) -> Gains:
    """Gains of (59) in a scenario.

    Raises:
        RecordingError: the controller is another one.
    """
    section = scenario.controller
    law = find_plugin("controllers", section.name, "controller.name")
    if law is not Regulation:
        raise RecordingError(
            f'Theorem 1 is about the controller "regulation"; this run has "{section.name}".', file=None
        )
    settings = read_settings(Regulation, section.parameters, "controller")
    position, orientation = (np.broadcast_to(gain, 3) for gain in (settings.K_O_position, settings.K_O_orientation))
    return Gains(
        np.concatenate([position, orientation]).astype(float),
        np.broadcast_to(settings.K_v, n_joints).astype(float),
        np.broadcast_to(settings.K_N, n_pairs).astype(float),
        settings.torsion_compensation,
    )


def regulation(seen: Observation, gains: Gains, compensated: bool = True) -> tuple[Array, Array]:
    """Contact forces that (59) asks for [N], shape (3 nc,), and its torques [N m], shape (n,)."""
    tau_C = seen.tau_C if compensated else np.zeros_like(seen.tau_C)
    wrench = seen.N_O - gains.K_O * (seen.q_O - seen.desired.coordinates) - seen.J_O_tau.T @ tau_C
    internal = seen.internal_force - gains.K_N * (seen.internal_force - seen.desired.internal_force)
    f = np.linalg.pinv(seen.J_O_f.T, rcond=1e-6) @ wrench + seen.K @ internal
    return f, seen.J_CF_f.T @ f - gains.K_v * seen.joint_velocity + seen.N_F + seen.J_CF_tau.T @ tau_C
