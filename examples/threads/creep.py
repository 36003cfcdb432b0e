"""A box is held well inside the friction that there is, and nothing moves. Does it stay, or does it sink slowly?

Two tips press with 8 N each, mu = 0.6: they could carry 9.6 N, and the box weighs 2 N. What is below the limit of
friction must not slip at all, however long one waits. softhand stores the shear of a tip, so there is a force at rest;
a friction that follows from the velocity alone has none, and creeps. MuJoCo's documentation says so of its own and
gives two remedies, a higher `impratio` and the post-processing `noslip_iterations`; both are shown.

Example: python examples/threads/creep.py
"""

from peer import Gripper, mujoco, show

import softhand

HOLD = {"duration": 2.0, "reference": {"kind": "hold"}}
SETTINGS = {"default, impratio 1": (1, 0), "impratio 10": (10, 0), "impratio 100": (100, 0), "noslip 3": (10, 3)}


def ours():
    """Speed of the box over the second half of the run, and what its tips have slipped [m/s], [m]."""
    run = softhand.simulate("gripper", overrides=HOLD)
    late = run.time >= 0.5 * run.time[-1]
    sunk = run.object_position[late][0, 2] - run.object_position[late][-1, 2]
    return sunk / (0.5 * run.time[-1]), run.slip_travel[-1].max()


def theirs(impratio, noslip):
    """The same speed in MuJoCo [m/s]."""
    gripper = Gripper(impratio=impratio, noslip=noslip).run(1.0)
    before = gripper.slid
    return gripper.run(1.0).slid - before


def main():
    """Returns the speeds [m/s] at which the box sinks: ours, what slipped, and MuJoCo's by its setting."""
    speed, slipped = ours()
    peer = {name: theirs(*values) for name, values in SETTINGS.items()} if mujoco else {}
    rows = [("slipped in 2 s", f"{1e3 * slipped:.3f} mm", None), ("sinks by", f"{1e6 * speed:.3g} um/s", None)]
    rows += [(f"sinks by, {name}", "", f"{1e6 * value:.3g} um/s") for name, value in peer.items()]
    show("Does a box creep that is held with five times the friction that it needs?", rows)
    return speed, slipped, peer


if __name__ == "__main__":
    main()
