"""Which model of a parallel gripper can one trust? Both jaws on one motor, by `<mimic>`: do they stay together?

The box in the gripper is pushed along the jaws with 3 N. Jaws on one gear cannot give way to the side: only the tips
do, and the box goes by what their springs say. softhand takes the coupled joint out of the equations, so the jaws agree
to the last digit, and the tips differ by the push. In MuJoCo the gear is an equality constraint, which is soft as all
of them are: shown are its default and the stiffer numbers of the grippers in MuJoCo Menagerie.

Example: python examples/threads/parallel_gripper.py
"""

import math

from peer import Gripper, mujoco, show

import softhand

PUSH, SQUEEZE, K_R = 3.0, 8.0, 0.377e6  # [N], [N], [N/m^2]
ABOVE = 0.010  # [m], of the line between the tips above the middle of the box; the push is on that line
CHANGES = {
    "reference": {"kind": "hold"},
    "duration": 0.6,
    "push": [{"force": [PUSH, 0.0, 0.0], "point": [0.0, 0.0, ABOVE], "start": 0.0, "duration": 0.6}],
    "fingertip.damping": {"name": "kelvin-voigt", "radial": 5.0, "tangential": 8.0, "torsional": 1e-4},
}
GEAR = '<equality><joint joint1="left" joint2="right" solref="{}" solimp="{}"/></equality>'
GEARS = {"default": ("0.02 1", "0.9 0.95 0.001"), "as in Menagerie": ("0.005 1", "0.95 0.99 0.001")}


def ours():
    """How far the box goes, how far the jaws differ [m], and by how much the tips press differently [N]."""
    run = softhand.simulate("parallel-gripper", overrides=CHANGES)
    force = run.contact_force[-1, :, 2]
    return run.object_position[-1, 0], run.joint_position[-1, 0] - run.coupled_position[-1, 0], force[1] - force[0]


def theirs(solref, solimp):
    """The same in MuJoCo."""
    gripper = Gripper(SQUEEZE, impratio=100, more=GEAR.format(solref, solimp))
    gripper.data.body("box").xfrc_applied[:] = [PUSH, 0.0, 0.0, 0.0, PUSH * ABOVE, 0.0]
    for _ in range(600):
        mujoco.mj_step(gripper.model, gripper.data)
    joint, force = gripper.data.joint, gripper.forces()[:, 0]
    apart = joint("left").qpos[0] - joint("right").qpos[0]
    return gripper.data.body("box").xpos[0], float(apart), abs(force[1] - force[0])


def main():
    """Returns what the tips' springs say [m], what `ours` has, and MuJoCo's by its setting."""
    depths = [math.sqrt((SQUEEZE + sign * 0.5 * PUSH) / (math.pi * K_R)) for sign in (1.0, -1.0)]
    springs = 0.5 * (depths[0] - depths[1])  # without shear, as (4) has it
    found, peer = ours(), [theirs(*values) for values in GEARS.values()] if mujoco else []
    names = (f"box goes, {1e3 * springs:.3f} mm by the springs", "jaws differ", "tips differ, of 3 N")
    scale, unit = (1e3, 1e3, 1.0), ("mm", "mm", "N")
    rows = [
        (name, *(f"{scale[k] * values[k]:.4f} {unit[k]}" for values in (found, *peer))) for k, name in enumerate(names)
    ]
    show("Do the jaws of a parallel gripper stay together?", rows, [f"MuJoCo, {name}" for name in GEARS])
    return springs, found, peer


if __name__ == "__main__":
    main()
