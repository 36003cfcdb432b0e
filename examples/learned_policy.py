"""A policy that examples/learning.py found, seed 3 after 80 generations, beside the law that it moves the set point of.

As a plugin it is a controller like any other:

    softhand compare turned.toml --plugin examples/learned_policy.py --controller "regulation(K_v=0.03),learned"

Example: python examples/learned_policy.py
"""

import numpy as np

import softhand

# columns: missing x, y, z, turn about x, y, z; the same from the object to the set point; velocity, angular velocity
# fmt: off
WEIGHTS = (
    4.79, -0.429, -0.699, 1.18, -1.16, 0.455, -1.24, -0.423, -0.124,  # x
    -0.591, -1.43, 0.0571, -1.09, 0.572, -0.656, 0.0361, 2.1, 0.0259,
    1.37, 4.38, -0.526, 0.0056, -0.777, 1.7, 0.226, -3.98, 0.917,  # y
    -0.236, -0.729, 1.87, -0.451, -0.164, -3.68, -0.959, 0.931, -2.3,
    -1.22, -1.69, 4.41, 0.146, 1.24, 1.52, 0.159, 0.358, -1.54,  # z
    0.536, -0.572, -1.24, 0.028, 2.45, -0.362, -0.609, 0.83, -0.0472,
    -0.0196, -0.0683, 0.465, 4.09, -2.06, -0.0257, 0.141, -1.05, -0.844,  # about x
    -2.62, -0.239, -0.965, 1.76, 0.188, 0.907, -1.1, 1.63, 0.329,
    -0.0748, 0.391, -3.36, 2.02, 5.19, 1.29, -1.68, 0.32, 0.776,  # about y
    0.116, -0.688, 0.957, 0.353, -0.548, -1.25, 0.992, -1.81, -1.13,
    -0.437, 0.464, -1.64, -0.65, -0.689, 4.77, -0.148, -0.839, 0.573,  # about z
    -0.39, 1.3, 0.791, 0.394, -0.0339, -0.732, 0.194, 0.0374, -3.22,
)
# fmt: on

TARGET = {
    "kind": "step", "object_position": [-0.008, 0.018, 0.136], "object_rpy": [-0.14, 0.1, 0.12],
    "internal_force": [4.0, 4.0, 3.0],
}  # fmt: skip
SLIDES = {"fingertip.contact": "coulomb", "fingertip.friction": 0.8, "duration": 1.5, "reference": TARGET}


class Learned(softhand.LinearSetPoint):
    """The policy."""

    weights: tuple[float, ...] = WEIGHTS


def main():
    """Carry the box to a pose that is asked for at once, without and with the policy; the times to 1 mm [s]."""
    task, times = softhand.load_scenario("hold", SLIDES), {}
    for name, controller in (("regulation", None), ("learned", Learned())):
        recording = softhand.simulate(task, controller)
        away = np.linalg.norm(recording.object_position - recording.object_position_desired, axis=1)
        times[name] = float(recording.time[np.flatnonzero(away > 1e-3)[-1]])
        use = recording.limit_surface_use.max()
        print(f"{name:<10} within 1 mm after {times[name]:.2f} s, {1e3 * away[-1]:.3f} mm off at last, limit {use:.2f}")
    return times


if __name__ == "__main__":
    main()
