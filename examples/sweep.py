"""How heavy may the box be? A sweep over its mass and the squeeze in threads, with a table.

Example: python examples/sweep.py
"""

from itertools import product

import softhand

MASSES = (0.1, 0.2, 0.4, 0.6)  # [kg]
SQUEEZES = (2.0, 4.0, 6.0)  # [N]


def main():
    """Print the table, and return it as a dictionary by mass [kg] and squeeze [N]."""
    cases = list(product(MASSES, SQUEEZES))
    forces = [[squeeze, squeeze, 0.75 * squeeze] for _, squeeze in cases]
    runs = softhand.rollout(
        softhand.load_scenario("target-a", {"fingertip.contact": "coulomb", "duration": 0.5}),
        {"mass": [mass for mass, _ in cases], "grasp.internal_force": forces, "reference.internal_force": forces},
        variables=("slip_travel",),
    )
    found = {}
    for case, outcome, travel in zip(cases, runs.outcomes, runs.slip_travel, strict=True):
        slipped = 1e3 * travel[-1].max()  # NaN behind the end of a run
        ends = {"finished": f"slips {slipped:.2f} mm" if slipped > 0.0 else "holds", "grasp": "no grasp"}
        found[case] = ends.get(outcome.reason, f"lost at {outcome.time:.2f} s")
    print("mass [kg]" + "".join(f"{f'{squeeze:g} N':>16}" for squeeze in SQUEEZES))
    for mass in MASSES:
        print(f"{mass:9.1f}" + "".join(f"{found[mass, squeeze]:>16}" for squeeze in SQUEEZES))
    return found


if __name__ == "__main__":
    main()
