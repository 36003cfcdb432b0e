"""Forces that are read back do not add up, and a stiffness has no unit. What is the force, and how deep the tip?

A box hangs between two tips. The shears of both must add up to its weight, each must press with what was asked, and the
depth must follow from the law of the tip alone: here f = pi k_r d^2 with k_r in N/m^2, whatever the mass of what is
held. In MuJoCo forces add up as well. The depth there is that of a reference acceleration: with the default of
`solref`, a time constant, a tip sinks the less into a box the heavier that is, by the same force. The documentation has
the formula, r = a (1 - d) tau^2 at rest; it is the model, not a fault.

Example: python examples/threads/force_readback.py
"""

import math

from peer import Gripper, mujoco, show

import softhand

SQUEEZE, K_R, G = 8.0, 0.377e6, 9.81
MASSES = (0.05, 0.2, 0.8)  # [kg], of the box


def ours(mass):
    """Error of the force up and of the pressing force [N], depth [m] of the left tip."""
    changes = {"reference": {"kind": "hold"}, "duration": 0.2}
    run = softhand.simulate("gripper", overrides=changes, mass=mass)
    force = run.contact_force[-1]
    up = force[0, 1] - force[1, 1]  # y_C of one tip points up, that of the other down
    return up - mass * G, force[0, 2] - SQUEEZE, run.deformation[-1, 0, 0]


def theirs(mass):
    """The same in MuJoCo."""
    gripper = Gripper(SQUEEZE, mass=mass, impratio=100).run(1.0)
    force = gripper.forces()
    return force[:, 1].sum() - mass * G, force[0, 0] - SQUEEZE, -gripper.data.contact[0].dist


def main():
    """Returns rows of the mass [kg], ours and MuJoCo's, and the depth by the formula of the law [m]."""
    rows, told, depth = [], [], math.sqrt(SQUEEZE / (math.pi * K_R))
    for mass in MASSES:
        found, peer = ours(mass), theirs(mass) if mujoco else None
        rows.append((mass, found, peer))
        told += [
            (f"{mass} kg: shear less weight", f"{found[0]:.1e} N", peer and f"{peer[0]:.1e} N"),
            ("  pressing force less 8 N", f"{found[1]:.1e} N", peer and f"{peer[1]:.1e} N"),
        ]
        texts = [values and f"{1e3 * values[2]:.3f} mm" for values in (found, peer)]
        told.append((f"  depth, {1e3 * depth:.3f} mm by the law", *texts))
    show("Do the forces add up, and what does the depth depend on?", told)
    return rows, depth


if __name__ == "__main__":
    main()
