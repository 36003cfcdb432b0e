"""A controller of your own as compiled code: ten lines from `softhand.blocks`, run by the thousand without Python.

Example: python examples/own_formula.py
"""

import numpy as np

import softhand

blocks = softhand.blocks


class PoseDamper(softhand.Controller):
    """Spring and damper at the object, and the internal forces fed back."""

    K: tuple[float, ...] = (100.0, 100.0, 100.0, 0.3, 0.3, 0.3)
    """Spring of position [N/m] and orientation [N m/rad]."""
    D: tuple[float, ...] = (1.0, 1.0, 1.0, 0.001, 0.001, 0.001)
    """Damper [N s/m, N m s/rad]."""
    K_N: tuple[float, ...] = (1.5, 1.5, 1.5)
    """Gain of each internal force."""
    K_v: float = 0.005
    """Damping of the joints [N m s/rad]."""

    @staticmethod
    def formula(observed, settings, memory, torque):
        """Sets the joint torques [N m]; numba compiles it. Nothing is remembered."""
        error, squeeze, forces = np.empty(6), np.empty(3), np.empty(9)
        wrench, torsion = observed.object_gravity.copy(), observed.contact_force[:, 3]
        blocks.pose_error(observed.q_O, observed.object_rotation, observed.object_coordinates_desired, error)
        blocks.add_pose_spring(settings.K, error, observed.object_rotation, wrench)
        blocks.add_twist_damper(settings.D, observed.object_twist, observed.object_twist_desired, wrench)
        blocks.take_off_torsion(observed.object_torsion_jacobian, torsion, wrench)
        blocks.share_wrench(observed.object_force_jacobian, wrench, forces)
        blocks.feed_back_internal_forces(observed.f_N, observed.internal_force_desired, settings.K_N, squeeze)
        blocks.add_internal_forces(observed.K, squeeze, forces)
        torque[:] = observed.N_F - settings.K_v * observed.joint_velocity
        blocks.push_contacts(observed.J_CF_f, forces, torque)
        blocks.add_torsion(observed.J_CF_tau, torsion, torque)


def main():
    """Carry the box to target A, and return how far off it ends [mm] and [deg]."""
    recording = softhand.simulate("target-a", PoseDamper())
    position = 1e3 * np.linalg.norm(recording.object_position[-1] - recording.object_position_desired[-1])
    turn = np.degrees(np.abs(recording.object_rpy[-1] - recording.object_rpy_desired[-1]).max())
    print(f"The box ends {position:.4f} mm and {turn:.4f} deg from target A.")
    return position, turn


if __name__ == "__main__":
    main()
