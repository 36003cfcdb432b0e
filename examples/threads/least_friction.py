"""A gripper loses the cube whatever coefficient of friction is set. Which load does it hold, by which coefficient?

The load of a pinched box is raised until it slides away. Coulomb says at which load that is: 2 mu N less its weight.
softhand has it within the step of the ramp, at each mu, and has not slipped by a nanometre at 95 % of it. The least
coefficient for a load comes without any run from `softhand.squeeze`. In MuJoCo the box creeps before. Where bodies
differ, MuJoCo takes the larger coefficient, softhand that of the tip or of the face.

Example: python examples/threads/least_friction.py
"""

import numpy as np
from peer import Gripper, mujoco, show

import softhand

SQUEEZE, WEIGHT = 8.0, 0.2 * 9.81  # [N]
FRICTIONS = (0.3, 0.6, 1.2)
STEPS, PERIOD = 50, 0.02  # of the load, from 0 to 1.2 times what can be held; [s]


def ramp(friction):
    """Loads on the box beyond its weight [N], shape (STEPS,)."""
    return 1.2 * (2.0 * friction * SQUEEZE - WEIGHT) * np.arange(1, STEPS + 1) / STEPS


def ours(friction):
    """Load at which the box starts to slip [N], and what it has slipped at 95 % of the limit [m]."""
    loads = ramp(friction)
    pushes = [{"force": [0.0, 0.0, -load], "start": k * PERIOD, "duration": PERIOD} for k, load in enumerate(loads)]
    damping = {"name": "kelvin-voigt", "radial": 5.0, "tangential": 10.0, "torsional": 1e-4}
    changes = {"reference": {"kind": "hold"}, "duration": STEPS * PERIOD, "push": pushes, "fingertip.damping": damping}
    run = softhand.simulate("gripper", overrides=changes, friction=friction)
    travel = run.slip_travel.max(axis=1)
    before = int(0.95 / 1.2 * STEPS * PERIOD * 1e3)
    return loads[min(int(run.time[np.argmax(travel > 0.0)] / PERIOD), STEPS - 1)], travel[before]


def theirs(friction):
    """Load at which the box has slid by 1 mm in MuJoCo [N], and what it has slid at 95 % of the limit [m]."""
    gripper, found, slid = Gripper(SQUEEZE, friction), np.nan, 0.0
    for load in ramp(friction):
        slid = slid if load > 0.95 / 1.2 * ramp(friction)[-1] else gripper.slid
        if gripper.run(PERIOD, load=-load).slid > 1e-3:
            found = load
            break
    return found, slid


def main():
    """Returns rows of mu, the limit [N], ours and MuJoCo's."""
    rows, told = [], []
    for friction in FRICTIONS:
        limit = 2.0 * friction * SQUEEZE - WEIGHT
        found, peer = ours(friction), theirs(friction) if mujoco else None
        rows.append((friction, limit, found, peer))
        told.append((f"mu {friction}: slides at, of {limit:.2f} N", f"{found[0]:.2f} N", peer and f"{peer[0]:.2f} N"))
        told.append(("  slid before, at 95 %", f"{1e3 * found[1]:.3f} mm", peer and f"{1e3 * peer[1]:.3f} mm"))
    least = softhand.squeeze("gripper", margin=0.0, friction=0.6).least[0]
    told.append(("least squeeze for the weight at mu 0.6", f"{least:.4f} N", None))
    show("Which load does a pinch of 8 N hold?", told)
    return rows, least


if __name__ == "__main__":
    main()
