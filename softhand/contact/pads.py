"""What may touch what: fingertips and supports, and their rows in the table `records.PAD`.

Both are a sphere, or the lowest point of an ellipsoid, that one body carries against a shape that another one carries.
The first rows are the fingertips, each against the object; whatever else may touch is a support: a corner of the object
on the table, two tips, a palm.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from softhand.contact.friction import face_of
from softhand.contact.records import (
    BALL,
    COLUMNS,
    ELLIPSE,
    LAW_ARGUMENTS,
    LEANING,
    MAX_LAW_PARAMETERS,
    MAX_RELAXATIONS,
    OWN_PRESSURE,
    PAD,
    PLANE,
    REMEMBERED,
    SIDE,
    SOLID,
    STORED,
)
from softhand.dampings.damping import Damping
from softhand.errors import LawError
from softhand.laws.law import LEADING, CompiledLaw, Law
from softhand.model.shapes.box import Box
from softhand.model.shapes.face import Face
from softhand.model.shapes.shape import CompiledShape, Shape
from softhand.model.shapes.union import Union
from softhand.model.world import World
from softhand.numerics.arrays import Array

Limit = Literal["exact", "ellipse"]
"""The limit surface of force and torsion: that of the pressure, see `limit.set_limit`, or the usual guess."""


@dataclass(frozen=True)
class Fingertip:
    """Material of one tip and the face that it touches."""

    law: Law
    friction: float
    """Coefficient mu."""
    face: Face
    damping: Damping = Damping()  # noqa: RUF009  frozen
    can_slip: bool = False
    """Whether friction has a limit and the object has edges; else the tip rolls, on plane faces as if endless."""
    static_friction: float | None = None
    """Coefficient until slip begins, not below `friction`; None: the same."""
    torsion_length: float | None = None
    """tau_max / (mu f_z) [m]; None: from the pressure of the law."""
    limit: Limit = "exact"
    elements: int = 1
    """How many slip by themselves, see `elements`; 1: the contact slips as a whole."""
    face_friction: tuple[float, ...] = ()
    """mu on the faces +x, -x, +y, -y, +z, -z of a box in place of `friction`; 0 where that holds; empty: nowhere."""

    def friction_at_start(self, axes: Array) -> float:
        """mu on the face that the tip touches at the start; `axes` are those of the box, shape (3, 3)."""
        own = self.face_friction[face_of(axes, self.face.normal)] if self.face_friction else 0.0
        return own or self.friction

    @property
    def holds_longer(self) -> bool:
        """Whether slip, once begun, goes on at less friction, so that it must be remembered."""
        return self.can_slip and self.static_friction is not None and self.static_friction > self.friction


@dataclass(frozen=True)
class Ball:
    """A sphere, as the shape of a base."""

    centre: Array
    """In the frame of the joint [m], shape (3,)."""
    radius: float
    """[m]"""
    axis: Array
    """Unit vector to the side that is met, in the frame of the joint, shape (3,); the tangential axes turn from it."""


@dataclass(frozen=True)
class Support:
    """A sphere that may touch a shape, beside the fingertips on the object; it slips at the limit of friction.

    Its force is that on the body of the shape.
    """

    name: str
    """Label in recordings, such as `table corner 3`."""
    law: Law
    """In surface coordinates."""
    friction: float
    """Coefficient mu."""
    joint: int
    """Pinocchio joint that carries the sphere, 0 for the world."""
    position: Array
    """Its centre in the frame of the joint [m], shape (3,)."""
    radius: float
    """[m]; 0 for a point, and for an ellipsoid."""
    base: int
    """Pinocchio joint that carries the shape, 0 for the world."""
    shape: Face | Ball | Shape | None
    """In the frame of the base: an endless plane, a ball, a solid; None: the object, which the base carries."""
    face: Face | None = None
    """Of a solid: the one that is met first. Tangential axes are counted from it."""
    side: Face | None = None
    """Of a solid: the one plane side that is met, and no other, by what lies deepest in it; None: all of it."""
    edge: float = 0.0
    """Half the length of an edge along x of `rotation` that meets a solid [m]; 0 for a sphere and all else."""
    way: int = 0
    """Of an edge in a polyhedron: towards which end it leaves it, 1 or -1; 0 in a round body."""
    obstacle: Shape | None = None
    """Which it belongs to, in the world; None: to no obstacle."""
    of: str = ""
    """Name of that obstacle."""
    rotation: Array = field(default_factory=lambda: np.eye(3))
    """Axes of the sphere in the frame of the joint, x where a tip points, shape (3, 3); those of an ellipsoid."""
    semi_axes: tuple[float, float, float] | None = None
    """Of an ellipsoid in the place of the sphere [m], against a plane only: the pad is then the point of it that lies
    deepest."""
    base_share: float = 0.0
    """Share of the depth that the body of the shape takes."""
    damping: Damping = Damping()  # noqa: RUF009  frozen
    static_friction: float | None = None
    torsion_length: float | None = None
    """As those of `Fingertip`."""
    torsion_share: float | None = None
    """tau_max / (mu f_z) over sqrt(r dr), in place of the law's."""
    limit: Limit = "exact"
    kappa: float | None = None
    """tau_max / (mu f_z) over the radius of the contact, of a pressure that is not that of columns."""

    can_slip = True
    elements = 1

    @property
    def holds_longer(self) -> bool:
        """Whether slip, once begun, goes on at less friction."""
        return self.static_friction is not None and self.static_friction > self.friction


Contact = Fingertip | Support


def block_size(contacts: Sequence[Contact]) -> int:
    """Numbers of each element of a contact in z of a `State`: its displacement, then those of each relaxation."""
    return STORED + remembered_of(contacts) * max(len(contact.damping.relaxation()) for contact in contacts)


def memory_size(contacts: Sequence[Contact]) -> int:
    """Numbers of each contact in z of a `State`: a block for each element, one more for slip."""
    blocks = max(contact.elements for contact in contacts)
    return blocks * block_size(contacts) + any(contact.holds_longer for contact in contacts)


def remembered_of(contacts: Sequence[Contact]) -> int:
    """Numbers of each contact in z for one relaxation: the forces, and if some law has a moment, the slopes by lean."""
    leans = any(contact.law.moment is not None for contact in contacts)
    return REMEMBERED + LEANING * leans


def contact_columns(
    world: World, supports: Sequence[Support]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """The velocities that move each contact.

    Velocities that move both bodies alike, those of a wrist, move no contact of theirs and are left out.

    Returns:
        Columns of each contact, those of the pad before those of the base, padded with -1, shape (nc, width); how many
        are of the pad, shape (nc,); first column of each row of the mass matrix and of what the contacts add to it,
        shape (nv,).
    """
    rows, own, envelope = [], [], world.envelope
    for joint, base in _bodies_of(world, supports):
        of_pad, of_base = world.columns_of(joint), world.columns_of(base)
        if world.coupling is not None and world.object_joint not in (joint, base):  # by view: the pad less the base
            of_pad, of_base = sorted({*of_pad, *of_base}), []
        pad = [column for column in of_pad if column not in of_base]
        rows.append(pad + [column for column in of_base if column not in of_pad])
        own.append(len(pad))
        if rows[-1]:
            envelope[rows[-1]] = np.minimum(envelope[rows[-1]], min(rows[-1]))
    width = max(map(len, rows))
    columns = np.array([row + [-1] * (width - len(row)) for row in rows], dtype=np.int64)
    return columns, np.array(own, dtype=np.int64), envelope


def _bodies_of(world: World, supports: Sequence[Support]) -> list[tuple[int, int]]:
    """Joint of pad and base of each contact."""
    pairs = [(tip.joint, world.object_joint) for tip in world.tips]
    return pairs + [(support.joint, support.base) for support in supports]


def build_pads(
    world: World, fingertips: Sequence[Fingertip], supports: Sequence[Support], code: dict[Law, CompiledLaw]
) -> NDArray[np.void]:
    """Table `records.PAD`, fingertips first.

    Raises:
        LawError: a law or a damping has more numbers than fit.
    """
    pads = np.zeros(len(fingertips) + len(supports), PAD)
    every: list[Contact] = [*fingertips, *supports]
    n_memory, block = memory_size(every), block_size(every)
    for pad, tip, fingertip in zip(pads, world.tips, fingertips, strict=False):
        pad["joint"], pad["rotation"], pad["position"] = tip.joint, tip.rotation, tip.position
        pad["base"], pad["radius"] = world.object_joint, fingertip.law.radius
        _set_face(pad, fingertip.face)
        _set_solid(pad, world.shape, fingertip.can_slip or fingertip.face.is_curved)
        set_material(pad, fingertip, code[fingertip.law], n_memory)
        pad["torsion_share"] = fingertip.law.torsion_share or 0.0
        choose_limit(pad, fingertip.limit, fingertip.law.torsion_share)
        pad["has_faces"], pad["face_friction"] = any(fingertip.face_friction), fingertip.face_friction or 0.0
    for pad, support in zip(pads[len(fingertips) :], supports, strict=True):
        pad["is_support"] = 1
        pad["joint"], pad["rotation"], pad["position"] = support.joint, support.rotation, support.position
        pad["base"], pad["radius"], pad["base_share"] = support.base, support.radius, support.base_share
        pad["semi_axes"] = support.semi_axes or 0.0
        pad["is_edge"], pad["half_length"], pad["way"] = support.edge > 0.0, support.edge, support.way
        _set_shape(pad, world, support)
        set_material(pad, support, code[support.law], n_memory)
        pad["torsion_share"] = support.torsion_share or support.law.torsion_share or 0.0
        choose_limit(pad, support.limit, support.kappa or support.law.torsion_share)
    pads["elements"], pads["block"] = [contact.elements for contact in every], block
    pads["remembered"] = remembered_of(every)
    pads["first_twist"] = [world.view(*bodies) for bodies in _bodies_of(world, supports)]
    return pads


def _set_shape(pad: np.void, world: World, support: Support) -> None:
    shape = support.shape
    if isinstance(shape, Face):
        pad["shape"] = PLANE
        _set_face(pad, shape)
    elif isinstance(shape, Ball):
        pad["shape"], pad["ball_centre"], pad["ball_radius"] = BALL, shape.centre, shape.radius
        across = np.cross(shape.axis, np.eye(3)[np.argmin(np.abs(shape.axis))])
        pad["face_normal"], pad["face_tangent"] = shape.axis, across / np.linalg.norm(across)
    else:
        assert support.face is not None
        _set_face(pad, support.side or support.face)
        _set_solid(pad, shape or world.shape)
        if support.side is not None:
            pad["shape"] = SIDE


def _set_face(pad: np.void, face: Face) -> None:
    pad["face_normal"], pad["face_tangent"], pad["face_offset"] = face.normal, face.tangent, face.offset


def _set_solid(pad: np.void, shape: Shape, as_it_is: bool = True) -> None:
    pad["shape"] = SOLID if as_it_is or isinstance(shape, Union) else PLANE
    if isinstance(shape, CompiledShape):
        pad["nearest_function"], pad["chart_function"] = shape.nearest_function, shape.chart_function
        pad["shape_data"] = shape.data.ctypes.data
    elif isinstance(shape, Box):
        pad["box_rotation"], pad["box_centre"], pad["box_half"] = shape.rotation, shape.centre, shape.half


def set_material(pad: np.void, contact: Contact, code: CompiledLaw, n_memory: int) -> None:
    """All that does not depend on where the contact is."""
    law, name = contact.law, type(contact.law).__name__
    if len(code.parameters) > MAX_LAW_PARAMETERS:
        raise LawError(
            f"law '{name}' has {len(code.parameters)} parameters; at most {MAX_LAW_PARAMETERS} fit.", law=name
        )
    pad["force_function"], pad["stiffness_function"] = code.force.address, code.stiffness.address
    if code.slope is not None:
        if isinstance(contact, Support) and (contact.semi_axes is not None or contact.edge > 0.0):
            raise LawError(
                f"law '{name}' has a `moment`, which {contact.name} does not transmit: an ellipsoid or an edge has no "
                "axis that leans; give it a law without one.",
                law=name,
            )
        pad["slope_function"], pad["bend_function"] = code.slope.address, code.bend.address
    leading = len(LEADING[law.coordinates])
    arguments = np.zeros(LAW_ARGUMENTS)
    arguments[leading : leading + len(code.parameters)] = code.parameters
    pad["law_arguments"] = arguments
    pad["is_surface"] = law.coordinates == "surface"
    pad["friction"], pad["can_slip"] = contact.friction, contact.can_slip
    pad["static_friction"] = contact.static_friction or contact.friction
    pad["slip_column"] = n_memory - 1 if contact.holds_longer else -1
    pad["torsion_length"] = contact.torsion_length or 0.0
    _set_damping(pad, contact.damping)


def choose_limit(pad: np.void, limit: Limit, kappa: float | None) -> None:
    """Set the kind of the limit surface; kappa is tau_max / (mu f_z) over the radius of the contact, if it is fixed."""
    pad["limit"] = ELLIPSE if limit == "ellipse" else OWN_PRESSURE if kappa else COLUMNS
    pad["kappa"] = kappa or 0.0


def _set_damping(pad: np.void, damping: Damping) -> None:
    pad["viscosity"], pad["viscosity_per_force"] = damping.viscosity(), damping.viscosity_per_force()
    pairs = damping.relaxation()
    pad["relaxations"] = len(pairs)
    if len(pairs) > MAX_RELAXATIONS:
        raise LawError(
            f"damping '{type(damping).__name__}' has {len(pairs)} relaxations; at most {MAX_RELAXATIONS} fit.",
            law=type(damping).__name__,
        )
    for k, pair in enumerate(pairs):
        pad["relaxation"][k] = pair
    pad["is_damped"] = any(damping.viscosity()) or any(damping.viscosity_per_force()) or bool(pairs)
