"""Open fingers close on a box, lift it off a table, turn it, put it down and let go.

Example: python examples/grasp_and_lift.py
"""

import numpy as np

import softhand

TOLD = ("phase", "touch", "lift-off", "slip")  # kinds of events


def main():
    """Lift a heavier box; return how high it was lifted [m] and what the table carries at the end [N]."""
    scenario = softhand.load_scenario("grasp-and-lift", {"object.mass": 0.25, "fingertip.friction": 0.8})
    recording = softhand.simulate(scenario)
    for event in softhand.summarize(recording).events:
        if event.kind in TOLD:
            print(f"{event.time:6.3f} s  {event.kind:<9} {event.finger:<13} {event.text}")
    up = -np.array(scenario.gravity) / np.linalg.norm(scenario.gravity)  # the hand hangs: z points down
    height = (recording.object_position - recording.object_position[0]) @ up
    on_table = recording.support_force[:, :, 2].sum(axis=1)
    print(f"The box of {scenario.object.mass} kg was lifted by {1e3 * height.max():.2f} mm.")
    print(f"The table carries {on_table[0]:.3f} N at the start and {on_table[-1]:.3f} N at the end.")
    return height.max(), on_table[-1]


if __name__ == "__main__":
    main()
