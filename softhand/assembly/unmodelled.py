"""What of joints and drives a tool does not model: told as an error, in the place of a number for another hand."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, TypeAlias

import numpy as np

from softhand.contact.pads import Fingertip
from softhand.errors import ScenarioError
from softhand.model.joint_mechanics import JointMechanics
from softhand.simulation.actuation import Actuation
from softhand.tactile.field import Felt

Part: TypeAlias = Literal["damping", "friction", "stop_stiffness"]

_WHY = {
    "damping": "damping of the joints",
    "friction": "dry friction of the joints, which holds them or brakes them and has no slope between",
    "stop_stiffness": "stops of the joints",
}


def must_model(
    tool: str, mechanics: JointMechanics, actuation: Actuation | None = None, parts: Iterable[Part] = ("friction",)
) -> None:
    """Nothing, if a tool models all that there is.

    Args:
        tool: in words, as the begin of a sentence.
        mechanics: of the joints.
        actuation: the drives; servos are never modelled.
        parts: of the joints that this tool does not.

    Raises:
        ScenarioError: there is one of them.
    """
    for part in parts:
        values = getattr(mechanics, part)
        if np.any(values):
            raise ScenarioError(
                f"hand.joints.{part}: {tool} does not know {_WHY[part]}; look at a run, or leave it out: "
                f"hand.joints.{part} = 0.0.",
                key=f"hand.joints.{part}", value=np.asarray(values).tolist(),
            )  # fmt: skip
    if actuation is not None and actuation.servos is not None:
        raise ScenarioError(
            f"actuation.servo: {tool} does not know servos, which feed back between controller and joints; look at a "
            "run, or leave the section [actuation.servo] out.",
            key="actuation.servo", value=actuation.servos.kind,
        )  # fmt: skip


def must_slip_as_a_whole(tool: str, fingertips: Iterable[Fingertip]) -> None:
    """Nothing, if no contact has elements that slip by themselves, whose slopes jump from load to unload.

    Args:
        tool: in words, as the begin of a sentence.
        fingertips: of the plant.

    Raises:
        ScenarioError: one has.
    """
    most = max(fingertip.elements for fingertip in fingertips)
    if most > 1:
        raise ScenarioError(
            f"fingertip.slip_elements: {tool} knows contacts that slip as a whole, not by {most} elements; look at a "
            "run, or set fingertip.slip_elements = 1.",
            key="fingertip.slip_elements", value=most,
        )  # fmt: skip


def must_not_feel(tool: str, key: str, names: Iterable[str] | None) -> None:
    """Nothing, unless there are taxels among the fields that a controller reads, or the variables that are asked for.

    Args:
        tool: in words, as the begin of a sentence.
        key: what the names are of, such as "controller".
        names: None if nobody knows them.

    Raises:
        ScenarioError: there are.
    """
    felt = sorted(set(Felt._fields) & set(names or ()))
    if felt:
        raise ScenarioError(
            f"{key}: {tool} does not know taxels, and {felt[0]!r} is what they feel; leave it out, or look at a run.",
            key=key, value=felt[0],
        )  # fmt: skip


def is_modelled(mechanics: JointMechanics, actuation: Actuation | None) -> bool:
    """Whether a loop of plant and controller alone is what runs, dry friction and servos apart."""
    return not np.any(mechanics.friction) and (actuation is None or actuation.servos is None)
