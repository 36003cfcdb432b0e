"""Hand and object in one Pinocchio model, made once for the same two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.errors import ModelError
from softhand.model.chain import Chain, read_chain
from softhand.model.configuration import ADDITIVE, CONTINUOUS, FREE_FLYER
from softhand.model.coupled import Coupled, uncoupled
from softhand.model.coupling import Coupling, CouplingTable, read_coupling
from softhand.model.motors import coupled_of, motor_model, motors_of
from softhand.model.urdf.pinocchio_model import build_model
from softhand.model.urdf.urdf import Urdf


@dataclass(frozen=True)
class Tip:
    """Where a soft fingertip sits: its frame F in the frame of the joint that carries it."""

    name: str
    joint: int
    """Index of the Pinocchio joint."""
    rotation: NDArray[np.float64]
    """Axes of F in the joint frame, shape (3, 3)."""
    position: NDArray[np.float64]
    """Origin of F in the joint frame [m], shape (3,)."""
    columns: tuple[int, ...]
    """Velocity indices of the joints that move this tip, from the base outward."""


class Joined(NamedTuple):
    """What hand and object have in common with all worlds of the same two; copied, never changed."""

    model: pin.Model
    flyer: pin.Model
    """Of the object alone."""
    tips: tuple[Tip, ...]
    coordinates: pin.Model
    """What q and v belong to: the model itself, or with coupled joints one whose joints are the motors."""
    joint_names: tuple[str, ...]
    joints: NDArray[np.int64]
    chains: tuple[Chain, ...]
    coupling: Coupling | None
    coupled: Coupled


@lru_cache(maxsize=8)
def join_models(
    hand: Urdf,
    tips: tuple[str, ...],
    body: Urdf,
    table: CouplingTable | None = None,
    effort_limit: float | None = None,
) -> Joined:
    """Hand and object in one model; kept for each two, as reading them takes longer than copying."""
    fingers, flyer = build_model(hand), build_model(body)
    coupling = read_coupling(hand, fingers, table, effort_limit)
    places = tuple(_find_tip(fingers, name, hand.file) for name in tips)
    names = tuple(fingers.names)[1:]
    renamed = pin.Model(flyer)
    _make_names_distinct(fingers, renamed)
    model = pin.appendModel(fingers, renamed, 0, pin.SE3.Identity())
    if coupling is not None:
        coordinates = motor_model(coupling)
        places = tuple(replace(place, columns=motors_of(coupling, place.columns)) for place in places)
        coupled = coupled_of(coupling, coordinates, model, [place.joint for place in places])
        return Joined(
            model, flyer, places, coordinates, coupling.motors, _list_joints(coordinates), (), coupling, coupled
        )
    chains = tuple(
        read_chain(model, tip.joint, tip.rotation, tip.position, columns_of(places, index))
        for index, tip in enumerate(places)
    )
    return Joined(model, flyer, places, model, names, _list_joints(model), chains, None, uncoupled())


def _list_joints(model: pin.Model) -> NDArray[np.int64]:
    """As `World.joints`."""
    kinds = {1: ADDITIVE, 2: CONTINUOUS, 7: FREE_FLYER}
    rows = [(kinds[joint.nq], joint.idx_q, joint.idx_v) for joint in list(model.joints)[1:]]
    return np.array(rows, dtype=np.int64)


def columns_of(tips: Sequence[Tip], index: int) -> list[int]:
    """Velocity indices of the joints that move only this tip."""
    shared = {column for k, tip in enumerate(tips) if k != index for column in tip.columns}
    return [column for column in tips[index].columns if column not in shared]


def shared_columns(tips: Sequence[Tip]) -> list[int]:
    """Velocity indices of the joints that move several tips, from the base outward: those of an arm, of a wrist."""
    every = [column for tip in tips for column in tip.columns]
    return [column for column in dict.fromkeys(every) if every.count(column) > 1]


def _make_names_distinct(hand: pin.Model, body: pin.Model) -> None:
    """Rename what Pinocchio could not tell apart in one model; it finds joints by names of their own."""
    flyer = next(frame for frame in body.frames if frame.type == pin.FrameType.JOINT)
    others = {*hand.names, *(frame.name for frame in [*hand.frames, *body.frames] if frame.type != flyer.type)}
    while flyer.name in others:
        flyer.name = body.names[1] = f"object {flyer.name}"
    links = {frame.name for frame in hand.frames if frame.type == pin.FrameType.BODY}
    for frame in hand.frames:
        if frame.type != pin.FrameType.BODY and frame.name in links:
            frame.name = f"joint {frame.name}"
    taken = {frame.name for frame in hand.frames}
    for frame in body.frames:
        if frame.type == pin.FrameType.BODY and frame.name in taken:
            frame.name = f"object {frame.name}"


def _find_tip(hand: pin.Model, name: str, file: Path) -> Tip:
    frame = find_frame(hand, name, file, hand.njoints)
    if frame.parentJoint == 0:
        raise ModelError(f"{file}: the tip '{name}' is fixed to the base; no joint moves it.", file=str(file))
    chain = list(hand.supports[frame.parentJoint])[1:]
    columns = tuple(hand.joints[index].idx_v for index in chain)
    return Tip(name, frame.parentJoint, frame.placement.rotation.copy(), frame.placement.translation.copy(), columns)


def find_frame(model: pin.Model, name: str, file: Path, n_joints: int) -> pin.Frame:
    """The frame of that name at one of the first joints; Pinocchio gives no error for an unknown one."""
    frames = [frame for frame in model.frames if frame.parentJoint < n_joints]
    links = [frame.name for frame in frames if frame.type == pin.FrameType.BODY]
    found = [frame for frame in frames if frame.name == name]
    if not found:
        raise ModelError(
            f"{file}: no link or frame is called '{name}'. The hand has the links {', '.join(links)}.", file=str(file)
        )
    # a joint may have the name of a link, and then not that of the link that it carries
    return next((frame for frame in found if frame.type == pin.FrameType.BODY), found[0])
