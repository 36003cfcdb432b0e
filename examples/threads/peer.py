"""What the threads share: MuJoCo, if it is installed, the gripper of softhand in it, and figures of both.

The gripper is that of the scenario `gripper`: two jaws of 0.1 kg on slides, balls of 10 mm as tips, a box of 0.2 kg
between them, a force on each jaw. MuJoCo is set as its documentation recommends for manipulation: elliptic cones,
condim 4, the integrator implicitfast, contacts as soft as its default, impratio 10 as in the grippers and hands of
MuJoCo Menagerie. https://mujoco.readthedocs.io/en/stable/modeling.html#preventing-slip
"""

from importlib import import_module
from importlib.util import find_spec

import numpy as np

mujoco = import_module("mujoco") if find_spec("mujoco") else None

GRIPPER = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast" cone="elliptic"
    impratio="{impratio}" noslip_iterations="{noslip}"/>
  <default><geom condim="4" friction="{friction} 0.002 0.0001" solref="{solref}"/></default>
  <worldbody>
    <body name="lift" pos="0 0 0.01" gravcomp="1">
      <joint name="lift" type="slide" axis="0 0 1"/>
      <inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>
      <body name="left" pos="-0.038 0 0" gravcomp="1">
        <joint name="left" type="slide" axis="1 0 0" damping="10"/>
        <geom name="left" type="sphere" size="0.01" mass="0.1"/>
      </body>
      <body name="right" pos="0.038 0 0" gravcomp="1">
        <joint name="right" type="slide" axis="-1 0 0" damping="10"/>
        <geom name="right" type="sphere" size="0.01" mass="0.1"/>
      </body>
    </body>
    <body name="box"><freejoint/><geom name="box" type="box" size="0.028 0.018 0.030" mass="{mass}"/></body>
  </worldbody>
  <actuator>
    <position joint="lift" kp="200000" dampratio="1"/><motor joint="left"/><motor joint="right"/>
  </actuator>
  {more}
</mujoco>"""


class Gripper:
    """The gripper in MuJoCo, closed on the box with `squeeze` [N] and left to settle for 0.2 s without weight."""

    def __init__(self, squeeze=8.0, friction=0.6, mass=0.2, impratio=10, noslip=0, solref="0.02 1", more=""):
        values = {"friction": friction, "mass": mass, "impratio": impratio, "noslip": noslip, "solref": solref}
        self.model = mujoco.MjModel.from_xml_string(GRIPPER.format(**values, more=more))
        self.data = mujoco.MjData(self.model)
        self.data.ctrl[1:] = squeeze
        gravity, self.model.opt.gravity = self.model.opt.gravity.copy(), 0.0
        self.run(0.2)
        self.model.opt.gravity = gravity
        self.data.time = 0.0

    def run(self, duration, load=0.0, lift=0.0):
        """Goes on for `duration` [s] with a force up on the box, `load` [N], and the jaws at a height `lift` [m]."""
        self.data.ctrl[0] = lift
        self.data.body("box").xfrc_applied[2] = load
        for _ in range(round(duration / self.model.opt.timestep)):
            mujoco.mj_step(self.model, self.data)
        return self

    @property
    def height(self):
        """Of the box above where it began [m]."""
        return float(self.data.body("box").xpos[2])

    @property
    def slid(self):
        """How far the box has slid down between the tips [m]."""
        return float(self.data.joint("lift").qpos[0]) - self.height

    def forces(self):
        """Pressing force and force up on the box of each tip that touches it [N], shape (contacts, 2)."""
        found, force = [], np.zeros(6)
        for k, contact in enumerate(self.data.contact):
            mujoco.mj_contactForce(self.model, self.data, k, force)
            sign = 1.0 if self.model.geom(contact.geom[1]).name == "box" else -1.0  # MuJoCo's: on the second of the two
            found.append((force[0], sign * float(force[:3] @ contact.frame.reshape(3, 3)[:, 2])))
        return np.array(found).reshape(-1, 2)


def show(question, rows, peers=("MuJoCo",)):
    """Prints a question and a row each of what was measured: its name, softhand's figure, those of the peers."""
    print(question)
    width = max(len(row[0]) for row in rows)
    print(f"{'':<{width}}" + "".join(f"  {name:>24}" for name in ("softhand", *peers)))
    for name, *figures in rows:
        figures += [None] * (1 + len(peers) - len(figures))
        print(f"{name:<{width}}" + "".join(f"  {'-' if figure is None else figure:>24}" for figure in figures))
    if mujoco is None:
        print("MuJoCo is not installed: pip install 'softhand[bench]'")
