"""A dexterous hand cannot lift a bottle. Does this one, how hard does it squeeze, and what if it squeezes less?

Three fingers of three joints hold a can of half a kilogram at its side and lift it by 20 mm within a second. From the
grasp alone, `softhand.squeeze` finds the least squeeze that carries the weight and 1 m/s^2 in any direction, with a
fifth of the limit to spare. With it no tip slips and the can arrives; with half of it there is no grasp at rest, and
the start says which friction it would take. In MuJoCo three tips press as hard on the same can, on slides that are
lifted: it arrives lower by what it has crept.

Example: python examples/threads/lift_a_bottle.py
"""

import numpy as np
from peer import mujoco, show

import softhand

MASS, FRICTION, LIFT = 0.5, 0.8, 0.02  # [kg], [1], [m]
CAN = {"object.mass": MASS, "fingertip.contact": "coulomb", "fingertip.friction": FRICTION}
FINGER = """<body euler="0 0 {turn}"><body pos="-0.0375 0 0" gravcomp="1">
  <joint type="slide" axis="1 0 0" damping="10"/>
  <geom type="sphere" size="0.01" mass="0.1" contype="1" conaffinity="2"/></body></body>"""
SCENE = """<mujoco><option timestep="0.001" integrator="implicitfast" cone="elliptic" impratio="10"/>
  <default><geom condim="4" friction="{friction} 0.002 0.0001"/></default><worldbody>
  <body gravcomp="1"><joint name="lift" type="slide" axis="0 0 1"/>
  <inertial mass="1" pos="0 0 0" diaginertia="1 1 1"/>
  {fingers}</body>
  <body name="can"><freejoint/>
  <geom type="cylinder" size="0.028 0.045" mass="{mass}" contype="2" conaffinity="1"/></body>
  </worldbody><actuator><position joint="lift" kp="200000" dampratio="1"/></actuator></mujoco>"""


def ours(squeeze):
    """The run that lifts the can with internal forces of `squeeze` [N]."""
    forces = [float(value) for value in squeeze]
    target = {"object_position": [0.0, 0.020, 0.142 + LIFT], "object_rpy": [0.0, 0.0, 0.0], "internal_force": forces}
    reference = {"kind": "minimum-jerk", "duration": 1.0, **target}
    return softhand.simulate("can", overrides={**CAN, "reference": reference, "grasp.internal_force": forces})


def theirs(press):
    """How high the can is in MuJoCo when three tips that press with `press` [N] have lifted it for two seconds [m]."""
    fingers = "".join(FINGER.format(turn=turn) for turn in (0, 120, 240))
    model = mujoco.MjModel.from_xml_string(SCENE.format(friction=FRICTION, fingers=fingers, mass=MASS))
    data = mujoco.MjData(model)
    data.qfrc_applied[1:4] = press
    for time in np.arange(-0.2, 2.0, 0.001):
        model.opt.gravity[2] = 0.0 if time < 0.0 else -9.81
        x = min(max(time, 0.0), 1.0)
        data.ctrl[0] = LIFT * x**3 * (10.0 - 15.0 * x + 6.0 * x**2)
        mujoco.mj_step(model, data)
    return float(data.body("can").xpos[2])


def main():
    """Returns pressing force [N], rise and slip [m], use of the limit, why half is refused, MuJoCo's rise [m]."""
    least = softhand.squeeze(softhand.load_scenario("can", CAN), acceleration=1.0).least
    run = ours(least)
    press, rise = float(run.contact_force[0, :, 2].mean()), float(run.object_position[-1, 2] - 0.142)
    slip, use = float(run.slip_travel[-1].max()), float(run.limit_surface_use.max())
    try:
        ours(0.5 * least)
        refusal = None
    except softhand.GraspError as error:
        refusal = str(error)
    height = theirs(press) if mujoco else None
    rows = [
        ("squeeze of each tip", f"{press:.2f} N", None),
        (f"lifted, of {1e3 * LIFT:.0f} mm", f"{1e3 * rise:.3f} mm", height and f"{1e3 * height:.3f} mm"),
        ("slipped", f"{1e3 * slip:.3f} mm", None),
        ("largest use of the limit, 0.8 asked for", f"{use:.3f}", None),
    ]
    show("How does a hand of three fingers lift a can of half a kilogram?", rows)
    print(f"With half of it: {refusal}")
    return press, rise, slip, use, refusal, height


if __name__ == "__main__":
    main()
