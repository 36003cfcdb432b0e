"""A controller of your own: a spring that draws the object to its desired pose, at every attitude.

Example: python examples/own_controller.py
"""

import numpy as np
from scipy.spatial.transform import Rotation

import softhand


class PoseSpring(softhand.Controller):
    """Forces at the contacts that pull and turn the object, and squeeze as asked."""

    stiffness: float = 100.0
    """Of the position [N/m]."""
    turning: float = 0.3
    """Of the orientation [N m/rad]."""
    damping: float = 0.005
    """Of the joints [N m s/rad]."""

    def torque(self, observation, memory):
        """One sample: what is observed in, joint torques [N m] out. Nothing is remembered."""
        R = Rotation.from_matrix(observation.object_rotation)
        R_desired = Rotation.from_euler("xyz", observation.object_rpy_desired)  # roll, pitch, yaw
        turn = (R_desired * R.inv()).as_rotvec()  # [rad], about axes of the world
        pull = observation.object_position_desired - observation.object_position  # [m]
        wrench = np.concatenate([self.stiffness * pull, self.turning * turn])
        wrench += observation.object_gravity - observation.object_torsion_jacobian.T @ observation.tau_C
        # the smallest contact forces that do this to the object, and the squeeze, which does nothing to it
        forces = np.linalg.pinv(observation.object_force_jacobian.T) @ wrench
        forces += observation.internal_force_basis @ observation.internal_force_desired
        torque = observation.hand_force_jacobian.T @ forces
        torque += observation.hand_torsion_jacobian.T @ observation.tau_C
        return torque + observation.gravity_torque - self.damping * observation.joint_velocity, memory


def main():
    """Carry the box to target A, and return how far off it ends [m]."""
    quicker = {"duration": 1.0, "reference.duration": 0.6}  # [s]
    recording = softhand.simulate("target-a", PoseSpring(stiffness=150.0), overrides=quicker)
    summary = softhand.summarize(recording)
    print(f"The box ends {summary.position_error:.2f} mm and {summary.orientation_error:.2f} deg from target A.")
    print(f"The squeeze is {summary.force_error:.2f} N from what is asked.")
    return 1e-3 * summary.position_error


if __name__ == "__main__":
    main()
