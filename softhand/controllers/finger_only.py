"""The paper's controller without any measurement of the object: Remark 5."""

from __future__ import annotations

from typing import Any

import numpy as np

from softhand.controllers.controller import Controller, Torque
from softhand.controllers.gains import diagonal, pose_diagonal
from softhand.controllers.object_estimator import Estimate, ObjectEstimator
from softhand.controllers.pose import OrientationError, euler_error, pose_error, require_regular
from softhand.numerics.arrays import Array
from softhand.numerics.linear import least_norm
from softhand.numerics.spatial import turning_of
from softhand.sensing.observation import Observation
from softhand.settings.settings import Gain


class FingerOnly(Controller):
    """Eq. (59) with q_O, f_N and tau_C computed from q_F, q_F' and f_C: no sensor for the object.

    [Nakashima] Remark 5 says that this is possible and leaves the way to an earlier paper; the way here is that of
    `ObjectEstimator`. The law of the tips, the faces and the weight of the object, and its pose at the start are known;
    after the start nothing else is read than the joints and the contact forces, in C_F. Form of the controller:
    certain. The estimate is as good as the known law. It slides away where tips slip or creep, for as long as they do,
    and nothing brings it back: on target A the object ends 0.31 mm and 0.95 deg off where one tip slips 0.59 mm, and
    0.56 mm and 0.24 deg off with damping `fung`; with `regulation` 0.01 mm and 0.07 deg at the same time.
    """

    orientation_error: OrientationError = "rotation-vector"
    """As in `regulation`."""
    torsion_compensation: bool = True
    """Whether the estimated torsion moments are compensated."""
    K_O_position: Gain = 100.0
    """Stiffness of the position [N/m], one number or three."""
    K_O_orientation: Gain = 0.3
    """Stiffness of the orientation [N m/rad], one number or three, as in `regulation`."""
    K_v: Gain = 0.005
    """Damping of the joints [N m s/rad or N s/m], one number or one a joint."""
    K_N: Gain = 1.5
    """Gain of the internal force [1], one number or one a pair of contacts."""

    def start(self, observation: Observation) -> Any:
        """The gains, and the estimator at the pose of the start."""
        n, pairs = observation.joint_position.shape[0], observation.internal_force.shape[0]
        gains = (
            pose_diagonal("K_O", self.K_O_position, self.K_O_orientation),
            diagonal("K_v", self.K_v, n),
            diagonal("K_N", self.K_N, pairs),
        )
        estimator = ObjectEstimator(observation)
        return gains, estimator, estimator.start(observation)

    def torque(self, observation: Observation, memory: Any) -> tuple[Torque, Any]:
        """(59) at the estimate."""
        gains, estimator, before = memory
        now: Estimate = estimator.update(observation, before)
        K_O, K_v, K_N = gains
        K = now.kernel()
        f_N = np.empty(K.shape[1])
        least_norm(K, False, observation.f_C, f_N)
        wrench = estimator.weight(now.rotation) - self._pull(observation, now, K_O)
        tau = observation.gravity_torque - K_v * observation.joint_velocity
        if self.torsion_compensation:
            wrench -= now.torsion_rows.T @ now.tau_C
            tau += now.J_CF_tau.T @ now.tau_C
        f_C = np.empty(observation.f_C.shape)
        least_norm(now.force_rows, True, wrench, f_C)
        f_C += K @ (f_N - K_N * (f_N - observation.internal_force_desired))
        return tau + now.J_CF_f.T @ f_C, (gains, estimator, now)

    def _pull(self, observation: Observation, now: Estimate, K_O: Array) -> Array:
        """K_O e at the estimate, as a wrench about the origin of the object, world axes, shape (6,)."""
        desired, error, axes = observation.object_coordinates_desired, np.empty(6), np.eye(6)
        if self.orientation_error == "euler":
            require_regular("FingerOnly", observation.time, now.q_O[4], desired[4])
            euler_error(now.q_O, desired, error)
            axes[3:, 3:] = turning_of(now.q_O[3:])
        else:
            pose_error(now.position, now.rotation, desired, np.empty((3, 3)), error)
            axes[3:, 3:] = now.rotation
        return np.asarray(np.linalg.solve(axes.T, K_O * error))
