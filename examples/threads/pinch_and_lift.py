"""A box is pinched and lifted, and is lost on the way up. How hard must the gripper squeeze, by how fast it lifts?

A gripper on a vertical slide lifts a box by 50 mm in a quarter of a second. To hold the weight takes a squeeze of m g /
(2 mu), and the acceleration takes its share beside. The first run squeezes more than enough and tells how fast the box
is accelerated; `softhand.squeeze` says what squeeze that takes. With a tenth more nothing slips; with a tenth more than
the weight alone takes, the box slides. In MuJoCo it slides a little with the first and is lost with the other.

Example: python examples/threads/pinch_and_lift.py
"""

from pathlib import Path

import numpy as np
from peer import Gripper, mujoco, show

import softhand

HEIGHT, TIME, END = 0.05, 0.25, 0.5  # [m], [s], [s]
SLIDE = {
    "hand.arm": {"urdf": str(Path(__file__).parent / "lift.urdf"), "position": [0.0, 0.0, 0.170]},
    "hand.arm.rpy": [3.141592653589793, 0.0, 0.0],
    "hand.position": [0.0, 0.0, 0.0],
    "hand.rpy": [0.0, 0.0, 0.0],
    "controller.K_O_position": [300.0, 0.0, 8000.0],  # [N/m]
    "controller.K_v": [200.0, 10.0, 10.0],  # [N s/m]
    "controller.K_N": 1.0,
    "fingertip.damping": {"name": "kelvin-voigt", "radial": 1.0, "tangential": 8.0, "torsional": 1e-4},
}


def ours(squeeze):
    """The run in which the slide lifts the box, held with `squeeze` [N]."""
    target = {"object_position": [0.0, 0.0, 0.070 + HEIGHT], "object_rpy": [0.0, 0.0, 0.0]}
    reference = {"kind": "minimum-jerk", "duration": TIME, "internal_force": [squeeze], **target}
    changes = {**SLIDE, "grasp.internal_force": [squeeze], "reference": reference, "duration": END}
    return softhand.simulate("gripper", overrides=changes)


def theirs(squeeze):
    """How far the box has slid at the end of the same lift in MuJoCo, along minimum jerk [m]."""
    gripper = Gripper(squeeze)
    for time in np.arange(0.0, END, 0.001):
        x = min(time / TIME, 1.0)
        gripper.run(0.001, lift=HEIGHT * x**3 * (10.0 - 15.0 * x + 6.0 * x**2))
    return gripper.slid


def main():
    """Returns the largest acceleration [m/s^2], both least squeezes [N], and what slid with each and a tenth [m]."""
    run = ours(8.0)
    velocity = run.object_twist[:, 2]
    top = float(np.gradient(velocity, run.time).max())
    push = [0.0, 0.0, -0.2 * top, 0.0, 0.0, 0.0]  # [N], what the acceleration is to the box
    weight = softhand.squeeze("gripper", margin=0.0).least[0]
    moved = softhand.squeeze("gripper", margin=0.0, wrenches=[push]).least[0]
    squeezes = {"enough for the weight": 1.1 * weight, "enough to lift": 1.1 * moved}
    slid = {name: float(ours(value).slip_travel[-1].max()) for name, value in squeezes.items()}
    peer = {name: theirs(value) for name, value in squeezes.items()} if mujoco else {}
    rows = [("largest acceleration", f"{top:.2f} m/s^2", None)]
    for name, value in squeezes.items():
        theirs_slid = f"{1e3 * peer[name]:.2f} mm" if peer else None
        rows.append((f"{name}, {value:.2f} N: slides", f"{1e3 * slid[name]:.2f} mm", theirs_slid))
    show("Which squeeze does it take to lift a box in a quarter of a second?", rows)
    return top, weight, moved, slid, peer


if __name__ == "__main__":
    main()
