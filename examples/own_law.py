"""A fingertip law of your own: a gel that gets harder the deeper it is pressed.

Example: python examples/own_law.py
"""

import numpy as np

import softhand


class Gel(softhand.Law):
    """Springs in four directions; the radial one hardens."""

    k: float = 1500.0
    """Stiffness of a light touch [N/m]."""
    hardening: float = 0.002
    """Depth at which the radial stiffness has doubled [m]."""

    @staticmethod
    def force(dr, dtheta, dphi, dpsi, phi, radius, k, hardening):
        """Radial force [N] and three moments [N m] for a deformation; compiled as it stands."""
        depth = max(dr, 0.0)
        bending = k * radius**2  # [N m/rad]
        return k * depth * (1.0 + 0.5 * depth / hardening), bending * dtheta, bending * dphi, 0.01 * bending * dpsi


def main():
    """Hold the box with such tips; return the normal forces [N] and depths [m] of the start."""
    gel = Gel(radius=0.010, k=1800.0)
    recording = softhand.simulate("target-a", law=gel, overrides={"duration": 1.0, "reference.duration": 0.6})
    normal, depth = recording.contact_force[0, :, 2], recording.deformation[0, :, 0]
    for name, force, deep in zip(recording.labels["contact"], normal, depth, strict=True):
        print(f"{name} presses with {force:.2f} N and is {1e3 * deep:.2f} mm deep.")
    summary = softhand.summarize(recording)
    print(f"The paper's controller knows nothing of the gel; it ends {summary.position_error:.2f} mm from the target.")
    return np.stack([normal, depth])


if __name__ == "__main__":
    main()
