"""A box is shaken below the limit of friction. Which friction lets it creep? One load, four models.

Example: python examples/shaken_grasp.py
"""

import numpy as np

import softhand

TIP, MU, RADIUS, LEVER = 0, 0.5, 0.010, 0.003  # finger 1; [1], [m], [m]
STIFFNESS = 2400.0  # of the tip across [N/m]
SHAKES = [{"force": [0.0, 0.0, -2.0], "start": 0.5 + 0.2 * k, "duration": 0.1} for k in range(10)]
SHAKEN = {
    "duration": 2.5,  # [s]
    "reference.object_position": [0.0, 0.010, 0.142],  # [m], where the box starts
    "reference.object_rpy": [0.0, 0.0, 0.0],  # [rad]
    "reference.internal_force": [4.0, 4.0, 3.0],  # [N], what squeezes it at the start
    "fingertip.contact": "coulomb",
    "fingertip.damping": {"name": "kelvin-voigt"},
    "push": SHAKES,  # [N] on the box
}


def creep(model, recording):
    """How far the tip of a model creeps a shake, under the load of the tip in the run, over the last five [m]."""
    depths, places = recording.deformation[:, TIP, 0], []
    for (f_x, f_y, f_z, tau), depth in zip(recording.contact_force[:, TIP], depths, strict=True):
        if isinstance(model, softhand.Patch):
            model.press(f_z, np.sqrt(RADIUS * depth))
        else:
            model.press(MU * f_z, LEVER)
        places.append(model.load(f_x, f_y, tau).displacement[:2])
    return np.linalg.norm(places[-1] - places[-1001]) / 5


def main():
    """Run, and return how far each model creeps a shake [m], and the tip in the run."""
    recording = softhand.simulate("target-a", overrides=SHAKEN)
    models = {
        "LuGre": softhand.Bristles(STIFFNESS, 1.0, LEVER),
        "elasto-plastic": softhand.Bristles(STIFFNESS, 1.0, LEVER, breakaway=0.95),
        "columns, softhand.Patch": softhand.Patch(0.006, 58.6e3, friction=MU),
    }
    print(f"The tip uses up to {recording.limit_surface_use[:, TIP].max():.0%} of what friction holds.")
    found = {name: creep(model, recording) for name, model in models.items()}
    found["the run of softhand"] = recording.slip_travel[-1, TIP] / 10
    for name, way in found.items():
        print(f"{name:>24} creeps {1e3 * way:7.4f} mm a shake")
    return found


if __name__ == "__main__":
    main()
