"""The supports that a scenario may have: a table, tips that touch each other, a palm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softhand.contact.pads import Ball, Fingertip, Support
from softhand.dampings.kelvin_voigt import KelvinVoigt
from softhand.laws.law import Law
from softhand.laws.plain import Plain
from softhand.model.shapes.face import Face
from softhand.model.world import World
from softhand.settings.settings import read_settings

WORLD = 0
"""Index of the joint that does not move."""

_POINT_LENGTH = 1e-3  # [m] the law of a point has no torsion, so that any length serves
_COLUMNS_SHARE = 8.0 / 15.0  # tau_max / (mu f_z) of columns over the contact radius, for a light touch
_DEPTH = 0.2  # dr / r where a law is linearised in shear and torsion


def table_plane(height: float, normal: ArrayLike = (0.0, 0.0, 1.0)) -> Face:
    """The plane n . x = height of the world.

    Args:
        height: along the normal, from the origin of the base frame [m].
        normal: of any length, shape (3,).
    """
    n = np.asarray(normal, dtype=float) / np.linalg.norm(np.asarray(normal, dtype=float))
    across = np.cross(n, np.eye(3)[np.argmin(np.abs(n))])
    return Face(n, across / np.linalg.norm(across), height)


def spring(stiffness: float, tangential: float | None = None, torsional: float = 0.0) -> Plain:
    """A plain linear spring: f_n = k d, f_t = k_t s, tau = k_psi psi; k_t = k if not given."""
    return Plain(
        radius=1e-2, c=stiffness, zeta=1.0, k_tangential=stiffness if tangential is None else tangential,
        k_torsional=torsional,
    )  # fmt: skip


def object_on_table(world: World, plane: Face, friction: float, stiffness: float, damping: float) -> list[Support]:
    """Each foot of the object, `Shape.feet`, that may meet the table.

    Args:
        world: with the object.
        plane: of the table, in the world.
        friction: mu.
        stiffness: of a corner, normal and tangential [N/m]; of another foot, times its share.
        damping: of a corner, likewise [N s/m].
    """
    return [
        Support(
            name=f"table {foot.name}",
            law=spring(foot.share * stiffness),
            friction=friction,
            joint=world.object_joint,
            position=foot.position,
            rotation=foot.rotation,
            radius=foot.radius,
            semi_axes=foot.semi_axes,
            base=WORLD,
            shape=plane,
            damping=KelvinVoigt(radial=foot.share * damping, tangential=foot.share * damping, torsional=0.0),
            torsion_length=_POINT_LENGTH,
            limit="ellipse",
        )
        for foot in world.shape.feet()
    ]


def tips_on_table(world: World, fingertips: Sequence[Fingertip], plane: Face, friction: float) -> list[Support]:
    """Each tip as a soft sphere that may meet the table.

    A law in surface coordinates holds there as on the object. One in the paper's has a pole where the tip stands
    upright, so that `plain` stands in for it.
    """
    return [
        Support(
            name=f"table {tip.name}",
            law=fingertip.law if fingertip.law.coordinates == "surface" else plain(fingertip.law),
            friction=friction,
            joint=tip.joint,
            position=tip.position,
            rotation=tip.rotation,
            radius=fingertip.law.radius,
            base=WORLD,
            shape=plane,
            damping=fingertip.damping,
            torsion_length=fingertip.torsion_length,
            torsion_share=fingertip.law.torsion_share,
            limit=fingertip.limit,
            kappa=fingertip.law.torsion_share,
        )
        for tip, fingertip in zip(world.tips, fingertips, strict=True)
    ]


def tips_on_tips(world: World, fingertips: Sequence[Fingertip]) -> list[Support]:
    """Each pair of tips: two soft balls in series, each of which takes half of the depth; see `plain`.

    Friction, damping and torsion are those of the tips, with tau_max of the contact of half the depth.
    """
    found = []
    pairs = combinations(range(world.n_tips), 2)
    for i, j in pairs:
        first, second = world.tips[i], world.tips[j]
        if first.joint == second.joint:
            continue
        if second.columns < first.columns:
            first, second, i, j = second, first, j, i
        tip, other = fingertips[i], fingertips[j]
        share = tip.law.torsion_share / math.sqrt(2.0) if tip.law.torsion_share else _COLUMNS_SHARE
        found.append(
            Support(
                name=f"{first.name}-{second.name}",
                law=plain(tip.law, in_series=True),
                friction=tip.friction,
                joint=first.joint,
                position=first.position,
                rotation=first.rotation,
                radius=tip.law.radius,
                base=second.joint,
                shape=Ball(second.position, other.law.radius, second.rotation[:, 0]),
                base_share=0.5,
                damping=tip.damping,
                static_friction=tip.static_friction,
                torsion_length=tip.torsion_length,
                torsion_share=share,
                limit=tip.limit,
                kappa=tip.law.torsion_share,
            )
        )
    return found


def plain(law: Law, in_series: bool = False) -> Plain:
    """A law in surface coordinates with the normal force of another one, for contacts that it is not made for.

        f_n = c d^zeta,   f_t = k_t s,   tau = k_psi psi

    c and zeta give the normal force of an undeflected tip, F(d), at d = 0.1 r and 0.2 r: exactly at every depth where F
    is a power, as in the paper's (4). k_t and k_psi are those of the law at d = 0.2 r and Phi = 60 deg.

    Two equal tips in series share the force, and each takes half of each displacement: f_n = F(d / 2) = c d^zeta /
    2^zeta, and half of k_t and k_psi.
    """
    Phi = math.radians(60.0)
    depth = _DEPTH * law.radius
    half, whole = (float(law((share * depth, 0.0, 0.0, 0.0), 0.5 * math.pi)[0]) for share in (0.5, 1.0))
    zeta = max(math.log2(whole / half), 1.0)
    reach = law.radius - depth if law.coordinates == "polar" else 1.0
    small = 1e-6
    tangential = float(law((depth, 0.0, small, 0.0), Phi)[2]) / small / reach**2
    torsional = float(law((depth, 0.0, 0.0, small), Phi)[3]) / small
    share = 0.5 if in_series else 1.0
    table = {
        "radius": law.radius,
        "c": whole * (share / depth) ** zeta,
        "zeta": zeta,
        "k_tangential": share * tangential,
        "k_torsional": share * torsional,
    }
    return read_settings(Plain, table, f"fingertip, law '{type(law).__name__}' away from the object")


def pad_on_hand(
    world: World,
    name: str,
    frame: str,
    position: ArrayLike,
    radius: float,
    friction: float,
    stiffness: float,
    damping: float,
) -> Support:
    """A compliant ball that is fixed to a link of the hand and may hold the object.

    Args:
        world: hand and object.
        name: label.
        frame: link or frame of the hand that carries it, its base too.
        position: of the ball's centre in that frame [m], shape (3,).
        radius: [m].
        friction: mu.
        stiffness: normal and tangential [N/m]; torsional, times (radius / 10)^2.
        damping: likewise [N s/m].

    Raises:
        ModelError: the hand has no such frame.
    """
    joint, placement = world.hand_frame(frame)
    lever = 0.1 * radius
    return Support(
        name=name,
        law=spring(stiffness, torsional=stiffness * lever**2),
        friction=friction,
        joint=joint,
        position=placement.act(np.asarray(position, dtype=float)),
        radius=radius,
        base=world.object_joint,
        shape=None,
        face=world.shape.face_at(world.shape.surface_points(1)[0][0]),
        damping=KelvinVoigt(radial=damping, tangential=damping, torsional=damping * lever**2),
    )


def depth_in_table(world: World, plane: Face, position: ArrayLike, rotation: NDArray[np.float64]) -> float:
    """How deep the object lies in the table where it is lowest [m]; negative above it."""
    down = -(rotation.T @ plane.normal)
    deepest = max(foot.reach(down) for foot in world.shape.feet())
    return plane.offset - float(plane.normal @ np.asarray(position, dtype=float)) + deepest
