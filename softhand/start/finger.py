"""One finger at rest on its contact: in a kernel, and where that does not find it, step by step."""

from __future__ import annotations

import math

import numpy as np

from softhand.contact.pads import Fingertip
from softhand.errors import GraspError
from softhand.laws.law import CompiledLaw
from softhand.model.arm import REACHED, Arm
from softhand.model.chain import POINT
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.start.answering import APEX, RIM, answer_force, formula_of
from softhand.start.elements import load_elements
from softhand.start.press import deform_tip
from softhand.start.reach import reach_point
from softhand.start.settle import SETTLED, TURNS, Settled, settle

_WISHES = 4
"""Turns in which a redundant finger seeks the guess: then the depth is all but found, and the finger only follows it
to the last digit."""


def settle_finger(
    arm: Arm,
    index: int,
    fingertip: Fingertip,
    code: CompiledLaw | None,
    point: Array,
    frame: Array,
    force: Array,
    angles: Array,
    settled: Settled,
) -> None:
    """Joint angles and deformation of one finger that answer a contact force.

    Args:
        arm: of the hand.
        index: of the tip.
        fingertip: its material.
        code: of its law; None if that cannot be compiled.
        point: of contact, in the world [m], shape (3,).
        frame: tangent and inward normal of the face in the world, as columns, shape (3, 2).
        force: on the object, in the world [N], and torsion about the inward normal [N m], shape (4,).
        angles: of all joints [rad or m]; those of the finger are set, shape (n,).
        settled: set.

    Raises:
        GraspError: the point is out of reach, the tip lies at its rim or apex, or its law does not answer.
        LawError: the law answers with what is no number.
    """
    formula, chain = None if code is None else formula_of(fingertip.law, code), arm.world.chains[index]
    if formula is not None and 0 < np.count_nonzero(chain.kinds[:, 2]) <= POINT:
        trial, relaxed = angles.copy(), fingertip.damping.relaxed()
        if settle(chain, formula, point, frame, force, relaxed, arm.limits, REACHED, trial, settled):
            angles[:] = trial
            if fingertip.elements == 1:
                return
    _settle(arm, index, fingertip, code, point, frame, force, angles, settled)


def _settle(
    arm: Arm, index: int, fingertip: Fingertip, code: CompiledLaw | None, point: Array, frame: Array, force: Array,
    angles: Array, settled: Settled,
) -> None:  # fmt: skip
    law, guess = fingertip.law, angles.copy()
    settled.deformation[:] = 0.0
    for turn in range(TURNS):
        wish = guess if turn < _WISHES else None
        previous = settled.deformation.copy()
        reach_point(arm, index, point - (law.radius - previous[0]) * frame[:, 1], angles, wish)
        answer_tip(arm.world, index, fingertip, code, arm.tip(index)[1], frame, force, settled)
        if np.max(np.abs(settled.deformation - previous)) < SETTLED:
            break


def answer_tip(
    world: World, index: int, fingertip: Fingertip, code: CompiledLaw | None, axes: Array, frame: Array, force: Array,
    settled: Settled,
) -> None:  # fmt: skip
    """The deformation with which a tip, where it is, answers a contact force.

    Args:
        world: hand and object.
        index: of the tip.
        fingertip: its material.
        code: of its law; None if that cannot be compiled.
        axes: of F in the world, shape (3, 3).
        frame: tangent and inward normal of the face in the world, as columns, shape (3, 2).
        force: on the object, in the world [N], and torsion about the inward normal [N m], shape (4,).
        settled: set.

    Raises:
        GraspError: the tip lies at its rim or apex, or its law does not answer.
        LawError: the law answers with what is no number.
    """
    law, (tangent, z_C), name = fingertip.law, frame.T, world.tips[index].name
    is_surface = law.coordinates == "surface"
    u = axes.T @ z_C
    Theta, Phi = math.atan2(u[2], u[1]), math.asin(min(max(float(u[0]), -1.0), 1.0))
    if not RIM < Phi < (math.inf if is_surface else APEX):
        place = "rim of the flat face" if Phi <= RIM else "apex, where the paper's coordinates are singular"
        raise GraspError(
            f"{name}: the contact lies at Phi = {math.degrees(Phi):.1f} deg, at the {place}; a start needs "
            f"{math.degrees(RIM):.0f} to {90.0 if is_surface else math.degrees(APEX):.0f} deg. "
            "Move the object or the contact point.",
            finger=name, quantity="Phi", value=Phi,
        )  # fmt: skip
    x_C = tangent if is_surface else axes @ np.array([0.0, -math.sin(Theta), math.cos(Theta)])
    y_C = np.cross(z_C, x_C)
    bearing = math.atan2(axes[:, 0] @ y_C, axes[:, 0] @ x_C)
    wanted = np.array([x_C @ force[:3], y_C @ force[:3], z_C @ force[:3], force[3]])
    asked, deformation = wanted / fingertip.damping.relaxed(), np.zeros(4)
    formula = None if code is None else formula_of(law, code)
    if formula is None or not answer_force(formula, Phi, bearing, asked, deformation, settled.law_force):
        deformation = deform_tip(name, law, Phi, bearing, asked)
    settled.deformation[:], settled.angles[:], settled.contact_force[:] = deformation, (Theta, Phi), wanted
    settled.law_force[:] = law(deformation, Phi, bearing)
    if fingertip.elements > 1:
        assert code is not None
        friction = fingertip.friction_at_start(world.shape.rotation)
        friction *= (fingertip.static_friction or fingertip.friction) / fingertip.friction
        load_elements(name, fingertip, code, friction, Phi, bearing, asked, settled.deformation, settled.elements)
