"""A tip is loaded in steps, and the force that it reports jumps about. What should it report?

A gripper squeezes by 2 N more each 0.3 s, from 4 to 12 N, and less again. Once a step has settled, a tip must press
with what is asked, lie as deep as before under the same load on the way down, and be quiet. Told are the error and the
scatter of the force over the last 50 ms of each step, how far a step overshoots, and what differs between up and down.
MuJoCo, given the same forces at its jaws, is as regular here. What overshoots is the lightly damped tip; the contact of
MuJoCo is critically damped.

Example: python examples/threads/stepped_load.py
"""

import numpy as np
from peer import Gripper, mujoco, show

import softhand

STEPS, LASTS = (4.0, 6.0, 8.0, 10.0, 12.0, 10.0, 8.0, 6.0, 4.0), 300  # [N], [ms]


def ours():
    """Pressing force of a tip [N] and its depth [m], a row each millisecond."""
    legs = [{"phase": "hold", "duration": 0.299, "internal_force": [STEPS[0]]}]
    for force in STEPS[1:]:
        legs.append({"phase": "step", "duration": 0.001, "internal_force": [force]})
        legs.append({"phase": "hold", "duration": 0.299, "internal_force": [force]})
    changes = {
        "grasp.internal_force": [STEPS[0]],
        "controller.K_N": 1.0,  # no feedback of forces, as at the peer
        "reference": {"kind": "waypoints", "waypoints": legs},
        "duration": 0.001 * (LASTS * len(STEPS) - 1),
        "fingertip.damping": {"name": "kelvin-voigt", "radial": 5.0, "tangential": 8.0, "torsional": 1e-4},
    }
    run = softhand.simulate("parallel-gripper", overrides=changes)
    return np.column_stack([run.contact_force[:, 0, 2], run.deformation[:, 0, 0]])


def theirs():
    """The same in MuJoCo."""
    gripper, rows = Gripper(STEPS[0], impratio=100), []
    for force in STEPS:
        gripper.data.ctrl[1:] = force
        for _ in range(LASTS):
            gripper.run(0.001)
            rows.append((gripper.forces()[0, 0], -gripper.data.contact[0].dist))
    return np.array(rows)


def read(rows):
    """Largest error, scatter and overshoot of the force [N], and the difference of depth between up and down [m]."""
    force, depth = (column.reshape(len(STEPS), LASTS) for column in rows.T)
    settled, asked = force[:, -50:], np.array(STEPS)
    up = np.sign(np.diff(asked))
    over = np.max(up[:, None] * (force[1:] - asked[1:, None]))
    back = np.abs(depth[:, -1] - depth[::-1, -1]).max()
    return [float(x) for x in (np.abs(settled.mean(axis=1) - asked).max(), settled.std(axis=1).max(), over, back)]


def main():
    """Returns what `read` has of both."""
    found, peer = read(ours()), read(theirs()) if mujoco else None
    names = ("error of a settled step", "scatter of a settled step", "overshoot", "depth, up less down")
    units = ("N", "N", "N", "m")
    rows = [(name, f"{found[k]:.2g} {units[k]}", peer and f"{peer[k]:.2g} {units[k]}") for k, name in enumerate(names)]
    show("Does the force of a tip follow a load in steps?", rows)
    return found, peer


if __name__ == "__main__":
    main()
