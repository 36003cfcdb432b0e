"""The URDFs of the can, the prism and the ball, and the mesh of the prism.

Example: python scripts/make_objects.py
"""

from __future__ import annotations

import math
from pathlib import Path

URDF = Path(__file__).parents[1] / "urdf"

CAN_RADIUS, CAN_HEIGHT, CAN_MASS = 0.028, 0.090, 0.200  # [m], [kg]
SIDES = 12  # of the prism, whose vertices lie on the can's rims
BALL_RADIUS, BALL_MASS = 0.030, 0.150  # [m], [kg]


def prism(sides: int, radius: float, height: float) -> str:
    """A regular prism about z as the text of an OBJ file, vertices on a cylinder [m], ends as polygons."""
    angles = [2.0 * math.pi * (k + 0.5) / sides for k in range(sides)]  # a face looks along x
    lines = [f"# regular prism of {sides} sides, {1e3 * radius:g} mm to its edges, {1e3 * height:g} mm high; in m"]
    for z in (-0.5 * height, 0.5 * height):
        lines += [f"v {radius * math.cos(a):.15g} {radius * math.sin(a):.15g} {z:.15g}" for a in angles]
    for k in range(sides):
        a, b = 1 + k, 1 + (k + 1) % sides
        lines.append(f"f {a} {b} {b + sides} {a + sides}")
    lines.append("f " + " ".join(str(k) for k in range(sides, 0, -1)))
    lines.append("f " + " ".join(str(sides + k) for k in range(1, sides + 1)))
    return "\n".join(lines) + "\n"


def prism_inertia(sides: int, radius: float, height: float, mass: float) -> tuple[float, float, float]:
    """Of a solid regular prism about x, y and z through its centre [kg m^2]."""
    across = mass * radius**2 / 12.0 * (2.0 + math.cos(2.0 * math.pi / sides))
    along = mass * height**2 / 12.0
    return across + along, across + along, 2.0 * across


def urdf(name: str, note: str, mass: float, inertia: tuple[float, float, float], geometry: str, colour: str) -> str:
    """A URDF of one solid body."""
    ixx, iyy, izz = (f"{1e6 * moment:.6g}e-6" for moment in inertia)
    return f"""<?xml version="1.0"?>
<!-- {note}.
     The object frame O is its centre. Units: m, kg. Written by scripts/make_objects.py. -->
<robot name="{name}">
  <material name="{name}"><color rgba="{colour} 1"/></material>
  <link name="{name}">
    <inertial>
      <mass value="{mass:.3f}"/>
      <inertia ixx="{ixx}" ixy="0" ixz="0" iyy="{iyy}" iyz="0" izz="{izz}"/>
    </inertial>
    <visual>
      <geometry>{geometry}</geometry>
      <material name="{name}"/>
    </visual>
    <collision>
      <geometry>{geometry}</geometry>
    </collision>
  </link>
</robot>
"""


def main() -> None:
    """Write all files."""
    r, h, m = CAN_RADIUS, CAN_HEIGHT, CAN_MASS
    across = m * (3.0 * r**2 + h**2) / 12.0
    can = urdf(
        "can", f"Can of {2e3 * r:g} mm diameter, {1e3 * h:g} mm high", m, (across, across, 0.5 * m * r**2),
        f'<cylinder radius="{r}" length="{h}"/>', "0.80 0.45 0.36",
    )  # fmt: skip
    (URDF / "can.urdf").write_text(can)
    (URDF / "meshes").mkdir(exist_ok=True)
    (URDF / "meshes" / "prism.obj").write_text(prism(SIDES, r, h))
    note = f"Prism of {SIDES} sides, {2e3 * r:g} mm between opposite edges, {1e3 * h:g} mm high"
    text = urdf(
        "prism", note, m, prism_inertia(SIDES, r, h, m), '<mesh filename="meshes/prism.obj"/>', "0.45 0.68 0.42"
    )
    (URDF / "prism.urdf").write_text(text)
    moment = 0.4 * BALL_MASS * BALL_RADIUS**2
    ball = urdf(
        "ball", f"Ball of {2e3 * BALL_RADIUS:g} mm diameter", BALL_MASS, (moment, moment, moment),
        f'<sphere radius="{BALL_RADIUS}"/>', "0.36 0.55 0.80",
    )  # fmt: skip
    (URDF / "ball.urdf").write_text(ball)


if __name__ == "__main__":
    main()
