"""Small hands of the structures that are sold: jaws on one motor, coupled fingers, tips along z, meshes of a package.

Each finger stands on the palm with z along it; its joints turn about y, which bends it inward, towards its own x.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import cos, pi, sin
from pathlib import Path

import trimesh

Joint = tuple[str, float, float, str]
"""Axis, limits [rad], and the joint before it that it follows with a ratio, as `1.1`, or nothing."""

BEND: Joint = ("0 1 0", -0.6, 1.6, "")
SPREAD: Joint = ("1 0 0", -0.5, 0.5, "")
FOLLOWS: Joint = ("0 1 0", -0.6, 1.6, "0.9")


def finger(
    name: str,
    at: Sequence[float],
    heading: float,
    joints: Sequence[Joint],
    lengths: Sequence[float],
    shape: Callable[[float], str],
    inertial: bool = True,
) -> str:
    """Joints and links of one finger; a link of length 0 has no shape."""
    text, parent = "", "palm"
    origin = f'<origin xyz="{at[0]} {at[1]} 0" rpy="0 0 {heading}"/>'
    for k, ((axis, lower, upper, follows), length) in enumerate(zip(joints, lengths, strict=True)):
        link, mass = f"{name}_{k}", 0.02 + 0.6 * length
        across = mass * length**2 / 12.0 + 2e-6
        body = (
            f'<inertial><origin xyz="0 0 {length / 2}"/><mass value="{mass}"/><inertia ixx="{across}" iyy="{across}" '
            'izz="2e-6" ixy="0" ixz="0" iyz="0"/></inertial>'
        )
        mimic = f'<mimic joint="{name}_{k - 1}_joint" multiplier="{follows}"/>' if follows else ""
        text += (
            f'<joint name="{link}_joint" type="revolute"><parent link="{parent}"/><child link="{link}"/>{origin}'
            f'<axis xyz="{axis}"/><limit lower="{lower}" upper="{upper}" effort="1" velocity="5"/>{mimic}</joint>'
            f'<link name="{link}">{body if inertial else ""}{shape(length) if length else ""}</link>'
        )
        parent, origin = link, f'<origin xyz="0 0 {length}"/>'
    return text


def rod(length: float) -> str:
    """A cylinder of 8 mm radius along a link."""
    return (
        f'<collision><origin xyz="0 0 {length / 2}"/><geometry><cylinder radius="0.008" length="{length}"/></geometry>'
        "</collision>"
    )


def hand(*fingers: str) -> str:
    """Fingers on a palm."""
    return f'<robot name="small"><link name="palm"/>{"".join(fingers)}</robot>'


def around(count: int, radius: float, joints: Sequence[Joint], lengths: Sequence[float], **more: object) -> str:
    """Equal fingers around a palm, bending to its middle."""
    more.setdefault("shape", rod)
    return hand(
        *(
            finger(f"f{k}", (radius * cos(a), radius * sin(a)), a + pi, joints, lengths, **more)  # type: ignore[arg-type]
            for k, a in ((k, 2.0 * pi * k / count) for k in range(count))
        )
    )


def jaws() -> str:
    """Two jaws on slides, the right one following the left one; nothing but boxes tells of tips."""
    jaw = (
        '<link name="{0}"><inertial><origin xyz="0 0 0.04"/><mass value="0.05"/><inertia ixx="3e-5" iyy="3e-5" '
        'izz="5e-6" ixy="0" ixz="0" iyz="0"/></inertial><collision><origin xyz="0 0 0.04"/><geometry>'
        '<box size="0.012 0.02 0.08"/></geometry></collision></link><joint name="{0}_slide" type="prismatic">'
        '<parent link="palm"/><child link="{0}"/><origin xyz="{1} 0 0"/><axis xyz="{2} 0 0"/>'
        '<limit lower="0" upper="0.03" effort="40" velocity="1"/>{3}</joint>'
    )
    follows = '<mimic joint="left_slide" multiplier="1"/>'
    return hand(jaw.format("left", -0.045, 1, ""), jaw.format("right", 0.045, -1, follows))


def two_and_a_thumb() -> str:
    """Two fingers side by side and a thumb across, of two joints, the outer one following the inner one."""
    joints, lengths = [BEND, FOLLOWS], [0.05, 0.045]
    long = [finger(f"f{k}", (-0.045, 0.016 * (2 * k - 1)), 0.0, joints, lengths, rod) for k in range(2)]
    return hand(*long, finger("thumb", (0.045, 0.0), pi, joints, lengths, rod))


def four_by_four(inertial: bool = True) -> str:
    """Three fingers side by side and a thumb across, four joints each."""
    joints, lengths = [SPREAD, BEND, BEND, BEND], [0.0, 0.05, 0.035, 0.03]
    long = [finger(f"f{k}", (-0.04, 0.032 * k), 0.0, joints, lengths, rod, inertial) for k in (-1, 0, 1)]
    return hand(*long, finger("thumb", (0.05, 0.0), pi, joints, lengths, rod, inertial))


def five_coupled() -> str:
    """Four fingers of one motor each, and a thumb of two."""
    long = [finger(f"f{k}", (-0.035, 0.022 * (k - 1.5)), 0.0, [BEND, FOLLOWS], [0.045, 0.04], rod) for k in range(4)]
    thumb = finger("thumb", (0.045, 0.0), pi, [SPREAD, BEND, FOLLOWS], [0.0, 0.045, 0.035], rod)
    return hand(*long, thumb)


def of_package(folder: Path) -> str:
    """Three fingers of three joints whose shapes are meshes of a package of ROS, which is made below a folder."""
    meshes = folder / "small_description" / "meshes"
    meshes.mkdir(parents=True)
    for length in (0.05, 0.04):
        solid = trimesh.creation.capsule(height=length - 0.016, radius=0.008)
        solid.apply_translation([0.0, 0.0, 0.5 * length - solid.bounds.mean(axis=0)[2]])
        solid.export(meshes / f"link_{round(1e3 * length)}.stl")

    def mesh(length: float) -> str:
        name = f"package://small_description/meshes/link_{round(1e3 * length)}.stl"
        return f'<collision><geometry><mesh filename="{name}"/></geometry></collision>'

    return around(3, 0.045, [SPREAD, BEND, BEND], [0.0, 0.05, 0.04], shape=mesh)
