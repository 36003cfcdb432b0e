"""Controllers side by side on one task, then fingertip laws under one controller.

Example: python examples/compare_controllers.py
"""

import math

import softhand

CONTROLLERS = ["regulation", "regulation(torsion_compensation=false)", "object-impedance", "blind"]
LAWS = ["nakashima", "radial"]


def show(name, row):
    """Print when a run settled, what is left of its errors, and how much friction it used."""
    figures = row.performance
    if figures is None:
        print(f"{name:<40} {row.outcome}")
        return
    settled = "never" if math.isinf(figures.settling_time) else f"{figures.settling_time:.2f} s"
    left = f"{figures.position_error:8.3f} mm {figures.orientation_error:8.3f} deg"
    print(f"{name:<40} {settled:>8} {left} {figures.friction_use:9.0%}")


def main():
    """Compare on target A; return the position error that each controller leaves [mm]."""
    task = softhand.load_scenario("target-a", {"duration": 1.5})
    rows = softhand.compare(task, controllers=CONTROLLERS)
    print(f"{'controller':<40} {'settled':>8} {'errors that stay':>24} {'friction':>9}")
    for row in rows:
        show(row.controller, row)
    print("law, under the paper's controller")
    for row in softhand.compare(task, laws=LAWS):
        show(row.law, row)
    return {row.controller: row.performance.position_error for row in rows}


if __name__ == "__main__":
    main()
