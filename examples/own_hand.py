"""A hand of your own, from a URDF: three fingers around a palm lift a can and turn it.

Example: python examples/own_hand.py
"""

from math import cos, pi, sin
from pathlib import Path
from tempfile import TemporaryDirectory

import softhand

LINK = """
  <joint name="{name}_joint" type="revolute">
    <parent link="{parent}"/> <child link="{name}"/>
    <origin xyz="{xyz}" rpy="{rpy}"/> <axis xyz="{axis}"/>
    <limit lower="-2.4" upper="2.4" effort="1.5" velocity="10"/>
  </joint> <link name="{name}"> <inertial>
    <origin xyz="0.025 0 0"/> <mass value="0.04"/> <inertia ixx="2e-6" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/>
  </inertial> </link>"""
LINKS = (("root", 0.03, "0 0 1"), ("middle", 0.06, "0 1 0"), ("end", 0.05, "0 1 0"))  # length [m], axis
AROUND = {"east": 0.0, "north": 2.0 * pi / 3.0, "south": -2.0 * pi / 3.0}  # [rad], where each finger stands


def urdf():
    """The text of the URDF: x along each link, z towards the middle of the hand."""
    parts = ['<robot name="claw">', '  <link name="palm"/>']
    for side, angle in AROUND.items():
        parent, xyz, rpy = "palm", f"{0.06 * cos(angle)} {0.06 * sin(angle)} 0", f"0 {-pi / 2} {angle}"
        for link, length, axis in LINKS:
            name = f"{side}_{link}"
            parts.append(LINK.format(name=name, parent=parent, xyz=xyz, rpy=rpy, axis=axis))
            parent, xyz, rpy = name, f"{length} 0 0", "0 0 0"
    return "".join([*parts, "</robot>"])


def main():
    """Lift the can, and return how high it is lifted [m]."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "claw.urdf")
        file.write_text(urdf())
        tips = [{"name": side, "frame": f"{side}_end", "position": [0.05, 0.0, 0.0]} for side in AROUND]
        scenario = softhand.load_scenario("can").replace({
            "hand": {"urdf": str(file), "tips": tips},
            "fingertip": {"law": "conservative", "radius": 0.010, "friction": 0.6},
            "object.position": [0.0, 0.0, 0.095],
            "grasp.contact_points": [[0.028 * cos(angle), 0.028 * sin(angle), 0.0] for angle in AROUND.values()],
            "grasp.joint_guess": [0.0, 0.8, -1.6] * 3,  # [rad], elbows outward
            "controller.K_N": 1.0,
            "reference.object_position": [0.0, 0.0, 0.110],
            "reference.object_rpy": [0.0, 0.1, 0.2],
        })  # fmt: skip
        recording = softhand.simulate(scenario)
    lifted = recording.object_position[-1, 2] - scenario.object.position[2]
    use = softhand.summarize(recording).limit_surface_use
    print(f"The can was lifted by {1e3 * lifted:.2f} mm; the tips used {use:.0%} of the friction that there is.")
    return lifted


if __name__ == "__main__":
    main()
