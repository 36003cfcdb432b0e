"""How heavy may the box be? A plain loop over its mass and the squeeze, with a table.

Example: python examples/sweep.py
"""

import softhand

MASSES = (0.1, 0.2, 0.4, 0.6)  # [kg]
SQUEEZES = (2.0, 4.0, 6.0)  # [N]
SLIPS = {"fingertip.contact": "coulomb", "duration": 0.5}


def run(mass, squeeze):
    """What becomes of the box when the fingers squeeze so hard: a few words."""
    force = [squeeze, squeeze, 0.75 * squeeze]
    values = {"object.mass": mass, "grasp.internal_force": force, "reference.internal_force": force}
    try:
        recording = softhand.simulate("target-a", overrides=SLIPS | values)
    except softhand.GraspError:
        return "no grasp"
    except softhand.SimulationStopped as stop:
        return f"lost at {stop.time:.2f} s"
    slipped = softhand.summarize(recording).slipped
    return f"slips {1e3 * max(slipped.values()):.2f} mm" if slipped else "holds"


def main():
    """Print the table, and return it as a dictionary by mass [kg] and squeeze [N]."""
    found = {}
    print("mass [kg]" + "".join(f"{f'{squeeze:g} N':>16}" for squeeze in SQUEEZES))
    for mass in MASSES:
        for squeeze in SQUEEZES:
            found[mass, squeeze] = run(mass, squeeze)
        print(f"{mass:9.1f}" + "".join(f"{found[mass, squeeze]:>16}" for squeeze in SQUEEZES))
    return found


if __name__ == "__main__":
    main()
