# %% [markdown]
# # A controller of your own
#
# A controller is handed what is measured, once a millisecond, and answers with the torques
# of the joints. It is a class with one method.

# %%
import numpy as np
from scipy.spatial.transform import Rotation

import softhand

# %% [markdown]
# This one ties the object to where it should be by a spring, shares the force of the spring
# out among the fingertips, and adds the squeeze. The fields of the class are its settings;
# their units are in the comments.


# %%
class PoseSpring(softhand.Controller):
    stiffness: float = 150.0  # [N/m]
    turning: float = 0.3  # [N m/rad]

    def torque(self, observation, memory):
        now, R = observation, Rotation.from_matrix(observation.object_rotation)
        way = now.object_position_desired - now.object_position
        turn = (Rotation.from_euler("xyz", now.object_rpy_desired) * R.inv()).as_rotvec()
        wrench = now.object_gravity + np.concatenate(
            [self.stiffness * way, self.turning * turn]
        )
        forces = np.linalg.pinv(now.object_force_jacobian.T) @ wrench
        forces += now.internal_force_basis @ now.internal_force_desired
        torque = now.hand_force_jacobian.T @ forces + now.gravity_torque
        return torque - 0.005 * now.joint_velocity, memory


TASK = softhand.load_scenario("target-a", {"duration": 0.8, "reference.duration": 0.5})
recording = softhand.simulate(TASK, PoseSpring())
summary = softhand.summarize(recording)
print(f"ends {summary.position_error:.2f} mm and {summary.orientation_error:.2f} deg off")

# %% [markdown]
# The box comes near and not there: nothing makes up for the twist of the tips. The shipped
# controller `regulation` does. Everything that a controller may look at is a field of
# [`Observation`](../api/parts.md#softhand.Observation).
#
# ## The same, compiled
#
# Plain Python is fine for one run. For thousands write the law as a `formula`, which is
# compiled: it sets `torque` in place, out of the parts in `softhand.blocks` or your own
# loops.

# %%
blocks = softhand.blocks


class CompiledSpring(softhand.Controller):
    K: tuple[float, ...] = (150.0, 150.0, 150.0, 0.3, 0.3, 0.3)  # [N/m, N m/rad]

    @staticmethod
    def formula(observed, settings, memory, torque):
        error, forces = np.empty(6), np.empty(9)
        wrench, torsion = observed.object_gravity.copy(), observed.contact_force[:, 3]
        blocks.pose_error(
            observed.q_O,
            observed.object_rotation,
            observed.object_coordinates_desired,
            error,
        )
        blocks.add_pose_spring(settings.K, error, observed.object_rotation, wrench)
        blocks.take_off_torsion(observed.object_torsion_jacobian, torsion, wrench)
        blocks.share_wrench(observed.object_force_jacobian, wrench, forces)
        blocks.add_internal_forces(observed.K, observed.internal_force_desired, forces)
        torque[:] = observed.N_F - 0.005 * observed.joint_velocity
        blocks.push_contacts(observed.J_CF_f, forces, torque)
        blocks.add_torsion(observed.J_CF_tau, torsion, torque)


summary = softhand.summarize(softhand.simulate(TASK, CompiledSpring()))
print(f"ends {summary.position_error:.3f} mm and {summary.orientation_error:.3f} deg off")

# %% [markdown]
# This one also takes the measured torsion into account, two lines, and comes nearer.
# Because it is compiled, many runs go through it at once, in threads: here the same task
# with eight masses.

# %%
runs = softhand.rollout(
    TASK, {"mass": np.linspace(0.15, 0.25, 8)}, controller=CompiledSpring()
)
off = np.linalg.norm(runs.object_position[:, -1] - [-0.010, 0.030, 0.127], axis=1)
print(
    "finished:",
    int(runs.finished.sum()),
    "of",
    len(runs),
    "| compiled:",
    bool(np.all(runs.compiled)),
)
print("off at the end:", np.round(1e3 * off, 2), "mm")

# %% [markdown]
# Is the loop that it closes stable? That is [a tutorial of its own](stable_loop.py).
