"""The gains of (59) as the paper's proof reads them, and the contact forces that (59) asks for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from softhand.assembly.parts import read_controller
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.pose import PoseTask, pose_task
from softhand.controllers.regulation import Regulation
from softhand.errors import RecordingError
from softhand.numerics.arrays import Array
from softhand.scenario.scenario import Scenario
from softhand.sensing.observation import Observation


@dataclass(frozen=True, eq=False)
class Gains:
    """Diagonals of the gains of (59).

    Attributes:
        law: the controller with these gains, its torsion compensated as the proof has it and without our posture term.
        K_O: [N/m, N m/rad], shape (6,).
        K_v: [N m s/rad], shape (n,).
        K_N: shape (pairs,).
    """

    law: Regulation
    K_O: Array
    K_v: Array
    K_N: Array

    @classmethod
    def of(cls, law: Regulation, n_joints: int, n_pairs: int) -> Gains:
        """Those of a controller."""
        return cls(
            law=law.model_copy(update={"torsion_compensation": True, "K_posture": 0.0}),
            K_O=pose_diagonal("K_O", law.K_O_position, law.K_O_orientation),
            K_v=diagonal("K_v", law.K_v, n_joints),
            K_N=diagonal("K_N", law.K_N, n_pairs),
        )

    def asked_forces(self, observation: Observation) -> Array:
        """The contact forces f that (59) asks for [N], shape (3 nc,).

        f = (J_O^fT)^+ [N_O - K_O e - J_O^tauT tau_C] + K [f_N - K_N (f_N - f_Nd)],   e the pose error of the law
        """
        G, f_N = observation.object_force_jacobian.T, observation.internal_force
        wrench = observation.object_gravity - observation.object_torsion_jacobian.T @ observation.tau_C
        task = self.task(observation)
        wrench -= task.wrench(self.K_O * task.error)
        internal = f_N - self.K_N * (f_N - observation.internal_force_desired)
        forces: Array = np.linalg.pinv(G, rcond=1e-6) @ wrench + observation.internal_force_basis @ internal
        return forces

    def task(self, observation: Observation) -> PoseTask:
        """The pose error as the law has it."""
        return pose_task("Regulation", observation, self.law.orientation_error)

    def spring(self, observation: Observation) -> Array:
        """What K_O is in the coordinates q_O while the error is small, T_O^T X^-T K_O X^-1 T_O, shape (6, 6).

        X is the map of the law's own coordinates: K_O itself where these are position, roll, pitch and yaw.
        """
        into_own = np.linalg.solve(self.task(observation).map, observation.coordinate_map)
        spring: Array = into_own.T @ np.diag(self.K_O) @ into_own
        return spring


def read_gains(scenario: Scenario, n_joints: int, n_pairs: int) -> Gains:
    """Gains of (59) in a scenario.

    Raises:
        RecordingError: the controller is another one.
    """
    law = read_controller(scenario)
    if not isinstance(law, Regulation):
        raise RecordingError(
            f'Theorem 1 is about the controller "regulation"; this run has "{scenario.controller.name}".', file=None
        )
    return Gains.of(law, n_joints, n_pairs)
