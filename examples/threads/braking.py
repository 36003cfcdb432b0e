"""A box slides between two tips, fast and then slower, and comes to rest. What is the friction at each speed?

A blow makes the box slide; then two tips of 8 N and mu = 0.6 brake it. Coulomb's friction is mu times the pressing
force at any speed, and once the box has stopped it stays. Friction that is over-damped brakes less the slower it is.
Measured are friction over mu N while the box slows down, how hard the tips press meanwhile, and what speed is left at
the end. In MuJoCo the time constant of `solref` is that of the friction too: a soft contact has a viscous friction at
low speed, so a stiff contact is shown beside the default. And its contact problem is convex, for which sliding presses
the tips apart.

Example: python examples/threads/braking.py
"""

import numpy as np
from peer import Gripper, mujoco, show

import softhand

BLOW, LASTS, FRICTION = -24.0, 0.007, 0.6  # [N] on the box, [s], [1]
SPEEDS = (0.3, 0.1, 0.03)  # [m/s], at which friction is read
END = 0.4  # [s]


def ours():
    """Time [s], speed down [m/s], friction over mu N and pressing force of a tip [N], a row each millisecond."""
    blow = {"force": [0.0, 0.0, BLOW], "start": 0.0, "duration": LASTS}
    damping = {"name": "kelvin-voigt", "radial": 1.0, "tangential": 8.0, "torsional": 1e-4}
    changes = {"reference": {"kind": "hold"}, "duration": END, "push": [blow], "fingertip.damping": damping}
    run = softhand.simulate("gripper", overrides=changes)
    shear = np.linalg.norm(run.contact_force[:, :, :2], axis=2).sum(axis=1)
    press = run.contact_force[:, :, 2].sum(axis=1)
    speed = -np.gradient(run.object_position[:, 2], run.time)
    return np.column_stack([run.time, speed, shear / (FRICTION * press), 0.5 * press])


def theirs(solref):
    """The same in MuJoCo, while the tips touch."""
    gripper, rows = Gripper(friction=FRICTION, solref=solref), []
    for k in range(round(1e3 * END)):
        before = gripper.slid
        press, up = gripper.run(0.001, load=BLOW if k < 1e3 * LASTS else 0.0).forces().sum(axis=0)
        if press > 0.0:
            rows.append((gripper.data.time, 1e3 * (gripper.slid - before), up / (FRICTION * press), 0.5 * press))
    return np.array(rows)


def read(rows):
    """Friction over mu N as the speed falls to each of `SPEEDS`, largest pressing force [N], last speed [m/s]."""
    braking = rows[rows[:, 0] > LASTS + 0.002]
    uses = [braking[np.argmax(braking[:, 1] < speed), 2] for speed in SPEEDS]
    return [*uses, float(rows[:, 3].max()), float(np.mean(rows[-20:, 1]))]


def main():
    """Returns what `read` has of ours, and of MuJoCo's with its default and with a stiff contact."""
    found = read(ours())
    peer = [read(theirs(solref)) for solref in ("0.02 1", "0.004 1")] if mujoco else []
    names = [f"friction / (mu N) at {speed} m/s" for speed in SPEEDS]
    names += ["largest pressing force [N]", "speed left [m/s]"]
    rows = [(name, f"{found[k]:.4g}", *(f"{values[k]:.4g}" for values in peer)) for k, name in enumerate(names)]
    show("Does friction depend on the speed, and does the box stop?", rows, ("MuJoCo", "MuJoCo, stiff"))
    return found, peer


if __name__ == "__main__":
    main()
