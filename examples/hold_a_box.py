"""Three soft fingers hold a box while somebody knocks on it.

Example: python examples/hold_a_box.py
"""

import numpy as np

import softhand

STAY = {
    "duration": 0.6,  # [s]
    "reference.object_position": [0.0, 0.010, 0.142],  # [m], where the box starts
    "reference.object_rpy": [0.0, 0.0, 0.0],  # [rad]
    "reference.internal_force": [4.0, 4.0, 3.0],  # [N], what squeezes it at the start
    "fingertip.damping": {"name": "kelvin-voigt"},  # undamped tips ring after a knock
    "push": [{"force": [0.0, 0.0, -3.0], "start": 0.05, "duration": 0.02}],  # [N] on the box; [s]
}


def main():
    """Run, and return how far the box gives way and how far off it is at the end [m]."""
    recording = softhand.simulate("target-a", overrides=STAY)
    off = np.linalg.norm(recording.object_position - recording.object_position[0], axis=1)
    summary = softhand.summarize(recording)
    print(f"The box gives way by {1e3 * off.max():.2f} mm; at the end it is back to {1e6 * off[-1]:.0f} um.")
    print(f"{summary.friction_finger} came nearest to slipping: it used {summary.friction_use:.0%} of its friction.")
    return off.max(), off[-1]


if __name__ == "__main__":
    main()
