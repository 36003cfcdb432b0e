# %% [markdown]
# # A hand of your own
#
# Any hand that has a URDF will do. Here one is made from nothing: three fingers around a
# palm, three joints each.

# %%
from math import cos, pi, sin
from pathlib import Path

import numpy as np

import softhand

LINK = """
  <joint name="{name}_joint" type="revolute">
    <parent link="{parent}"/> <child link="{name}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/> <axis xyz="{axis}"/>
    <limit lower="-2.4" upper="2.4" effort="1.5" velocity="10"/>
  </joint>
  <link name="{name}"> <inertial>
    <origin xyz="0.025 0 0"/> <mass value="0.04"/>
    <inertia ixx="2e-6" iyy="1e-5" izz="1e-5"
             ixy="0" ixz="0" iyz="0"/>
  </inertial> </link>"""
# name, length [m], axis
LINKS = (("root", 0.03, "0 0 1"), ("middle", 0.06, "0 1 0"), ("end", 0.05, "0 1 0"))
# where each finger stands [rad]
AROUND = {"east": 0.0, "north": 2.0 * pi / 3.0, "south": -2.0 * pi / 3.0}

parts = ['<robot name="claw">', '  <link name="palm"/>']
for side, angle in AROUND.items():
    parent, rpy = "palm", f"0 {-pi / 2} {angle}"
    xyz = f"{0.06 * cos(angle)} {0.06 * sin(angle)} 0"
    for link, length, axis in LINKS:
        name = f"{side}_{link}"
        parts.append(LINK.format(name=name, parent=parent, xyz=xyz, rpy=rpy, axis=axis))
        parent, xyz, rpy = name, f"{length} 0 0", "0 0 0"
Path("claw.urdf").write_text("".join([*parts, "</robot>"]))

# %% [markdown]
# Is the file sound? `check` says what is wrong, or only doubtful, with line and remedy. A
# mass that was forgotten is a common one; let us forget it on purpose.

# %%
broken = Path("claw.urdf").read_text().replace('<mass value="0.04"/>', "", 1)
Path("broken.urdf").write_text(broken)
print("claw.urdf:", softhand.check("claw.urdf").errors or "fine")
for error in softhand.check("broken.urdf").errors:
    print(error)

# %% [markdown]
# A scenario says which frames carry a tip, what the tips are made of, what they hold and
# where they touch it. We take the one with the can and put our hand into it.

# %%
scenario = softhand.load_scenario("can").replace(
    {
        "hand": {
            "urdf": str(Path("claw.urdf").resolve()),
            "tips": [
                {"name": side, "frame": f"{side}_end", "position": [0.05, 0.0, 0.0]}
                for side in AROUND
            ],
        },
        "fingertip": {"law": "conservative", "radius": 0.010, "friction": 0.6},
        "object.position": [0.0, 0.0, 0.095],  # [m]
        "grasp.contact_points": [
            [0.028 * cos(angle), 0.028 * sin(angle), 0.0] for angle in AROUND.values()
        ],
        "grasp.joint_guess": [0.0, 0.8, -1.6] * 3,  # [rad], elbows outward
        "controller.K_N": 1.0,
        "reference.object_position": [0.0, 0.0, 0.110],
        "reference.object_rpy": [0.0, 0.1, 0.2],
        "reference.duration": 0.5,
        "duration": 1.0,
    }
)

# %% [markdown]
# It lifts the can by 15 mm, and turns it:

# %%
recording = softhand.simulate(scenario)
summary = softhand.summarize(recording)
print("lifted by", np.round(1e3 * np.ptp(recording.object_position[:, 2]), 2), "mm")
print(
    f"{summary.position_error:.4f} mm and {summary.orientation_error:.4f} deg off at the end"
)
print(f"friction use {summary.friction_use:.2f}, at {summary.friction_finger}")

# %% [markdown]
# [Bring your own hand](../own-hand.md) does the same with commands, for a claw of four
# fingers, and lets softhand propose where to touch. [Hands](../hands.md) says what a URDF
# may have.
