"""The URDFs of the can, the prism, the ball, the screwdriver, the bracket and the mug, and the mesh of the prism.

Example: python scripts/make_objects.py
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from softhand.model.shapes.mass import Solid, joined
from softhand.numerics.spatial import rotation_of

URDF = Path(__file__).parents[1] / "urdf"

CAN_RADIUS, CAN_HEIGHT, CAN_MASS = 0.028, 0.090, 0.200  # [m], [kg]
SIDES = 12  # of the prism, whose vertices lie on the can's rims
BALL_RADIUS, BALL_MASS = 0.030, 0.150  # [m], [kg]

WALLS, MUG_RADIUS, WALL, MUG_HEIGHT = 16, 0.030, 0.004, 0.070  # of the mug: sides, to the middle of one, thickness [m]


class Part(NamedTuple):
    """A shape of an object of several."""

    geometry: str
    size: tuple[float, ...]
    """Edges of a box; radius and length of a cylinder; radius of a sphere [m]."""
    place: tuple[float, float, float]
    yaw: float = 0.0
    pitch: float = 0.0

    def xml(self) -> str:
        """Its `<geometry>`."""
        words = [f"{length:.9g}" for length in self.size]
        if self.geometry == "box":
            return f'<box size="{" ".join(words)}"/>'
        names = ("radius", "length")[: len(words)]
        inside = " ".join(f'{name}="{word}"' for name, word in zip(names, words, strict=True))
        return f"<{self.geometry} {inside}/>"

    def solid(self) -> Solid:
        """Its volume, centre and spread."""
        if self.geometry == "box":
            volume = math.prod(self.size)
            spread = [volume * edge**2 / 12.0 for edge in self.size]
        elif self.geometry == "cylinder":
            r, length = self.size
            volume = math.pi * r**2 * length
            spread = [volume * r**2 / 4.0, volume * r**2 / 4.0, volume * length**2 / 12.0]
        else:
            volume = 4.0 / 3.0 * math.pi * self.size[0] ** 3
            spread = [volume * self.size[0] ** 2 / 5.0] * 3
        turn = rotation_of((0.0, self.pitch, self.yaw))
        return Solid(volume, np.array(self.place), turn @ np.diag(spread) @ turn.T)


SCREWDRIVER = (
    Part("cylinder", (0.014, 0.080), (0.0, 0.0, 0.0)),      # handle, along z
    Part("sphere", (0.014,), (0.0, 0.0, 0.040)),            # its round end
    Part("cylinder", (0.009, 0.034), (0.0, 0.0, -0.054)),   # its neck
    Part("cylinder", (0.0035, 0.100), (0.0, 0.0, -0.100)),  # shaft
)  # fmt: skip
BRACKET = (
    Part("box", (0.070, 0.036, 0.012), (0.0, 0.0, 0.0)),
    Part("box", (0.012, 0.036, 0.060), (-0.029, 0.0, 0.024)),
)


def mug() -> list[Part]:
    """Walls about z, each into its neighbours, a bottom, and a handle of three bars towards +x."""
    width = 2.0 * MUG_RADIUS * math.tan(math.pi / WALLS)
    middle = MUG_RADIUS - 0.5 * WALL
    walls = []
    for k in range(WALLS):
        turn = 2.0 * math.pi * k / WALLS
        place = (middle * math.cos(turn), middle * math.sin(turn), 0.0)
        walls.append(Part("box", (WALL, width, MUG_HEIGHT), place, turn))
    bottom = Part("cylinder", (MUG_RADIUS - 0.5 * WALL, WALL), (0.0, 0.0, 0.5 * (WALL - MUG_HEIGHT)))
    out, bar = 0.050, 0.008
    bars = [
        Part("box", (out - middle, bar, bar), (0.5 * (out + middle), 0.0, z)) for z in (-0.020, 0.020)
    ]  # fmt: skip
    return [*walls, bottom, *bars, Part("box", (bar, bar, 0.040 + bar), (out, 0.0, 0.0))]


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


def _micro(moment: float) -> str:
    return f"{1e6 * moment:.5g}e-6" if abs(moment) > 1e-12 else "0"


def composite(name: str, note: str, mass: float, parts: Sequence[Part], colour: str) -> str:
    """A URDF of one body of several shapes, of uniform density but where they lie in one another."""
    whole = joined([part.solid() for part in parts])
    centre = " ".join(f"{x:.7g}" for x in np.round(whole.centre, 7) + 0.0)
    moments = mass / whole.volume * whole.inertia
    pairs = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    inertia = " ".join(f'{key}="{_micro(moments[at])}"' for key, at in pairs.items())
    lines = []
    for kind in ("visual", "collision"):
        for part in parts:
            xyz = " ".join(f"{round(x, 12) + 0.0:.9g}" for x in part.place)
            turn = f' rpy="0 {part.pitch:.15g} {part.yaw:.15g}"' if part.pitch or part.yaw else ""
            look = f'\n      <material name="{name}"/>' if kind == "visual" else ""
            lines.append(f"""    <{kind}>
      <origin xyz="{xyz}"{turn}/>
      <geometry>{part.xml()}</geometry>{look}
    </{kind}>""")
    shapes = "\n".join(lines)
    return f"""<?xml version="1.0"?>
<!-- {note}.
     The solid is the union of its collision shapes. Units: m, kg. Written by scripts/make_objects.py. -->
<robot name="{name}">
  <material name="{name}"><color rgba="{colour} 1"/></material>
  <link name="{name}">
    <inertial>
      <origin xyz="{centre}"/>
      <mass value="{mass:.3f}"/>
      <inertia {inertia}/>
    </inertial>
{shapes}
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
    composites = (
        ("screwdriver", "Screwdriver along z, its handle of 28 mm diameter, 80 mm long and round at the end, "
         "the blade down", 0.120, SCREWDRIVER, "0.86 0.55 0.20"),
        ("bracket", "Bracket, two plates of 12 x 36 mm at a right angle, 70 mm long and 60 mm high",
         0.150, BRACKET, "0.55 0.58 0.62"),
        ("mug", f"Mug of {WALLS} sides about z, {2e3 * MUG_RADIUS:g} mm wide, {1e3 * MUG_HEIGHT:g} mm high, its handle "
         "towards +x", 0.180, mug(), "0.80 0.78 0.70"),
    )  # fmt: skip
    for name, note, mass, parts, colour in composites:
        (URDF / f"{name}.urdf").write_text(composite(name, note, mass, parts, colour))


if __name__ == "__main__":
    main()
