"""The small systems: tips on a few joints, and one box, written as URDFs and read like any hand."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from softhand.contact.pads import Fingertip, Support
from softhand.laws.law import Law
from softhand.laws.radial import Radial
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.urdf.examination import HAND, OBJECT
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import World, load_world
from softhand.numerics.arrays import Array
from softhand.plant.dynamics import add_contact_force, add_contact_moment
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.stepper import Stepper

Vector = tuple[float, float, float]

G = 9.81  # [m/s^2]
IMMOVABLE = 1e15  # [kg], [kg m^2]
MASS = 0.2  # [kg]
RADIUS = 0.010  # [m]
MU = 0.5
LEFT, RIGHT, TOP, BOTTOM = 1, 0, 4, 5  # faces of the box
UPWARD = (0.0, -0.5 * math.pi, 0.0)  # rpy of a tip that points up [rad]
DOWNWARD = (0.0, 0.5 * math.pi, 0.0)


@dataclass(frozen=True)
class Carriage:
    """A tip at the end of some joints. The mass is at the middle of the tip; the joints before the last weigh nothing.

    Attributes:
        joints: one letter each, from the base: x, y, z slide along an axis of the base, X, Y, Z turn about it.
        origin: of the tip at q = 0 [m].
        rpy: of the tip [rad]; its x axis points out.
        mass: [kg].
        inertia: about each axis [kg m^2].
    """

    joints: str
    origin: Vector = (0.0, 0.0, 0.0)
    rpy: Vector = UPWARD
    mass: float = IMMOVABLE
    inertia: float = IMMOVABLE


@dataclass(frozen=True)
class Body:
    """The box; as a rule it slides and lifts but does not turn.

    Attributes:
        mass: [kg].
        inertia: about x, y and z [kg m^2].
        size: along x, y and z [m].
    """

    mass: float = MASS
    inertia: Vector = (IMMOVABLE, IMMOVABLE, IMMOVABLE)
    size: Vector = (0.056, 0.056, 0.060)


@dataclass
class Rig:
    """A plant with the state that it is in."""

    plant: Plant
    state: State
    torque: Array = field(init=False)
    """Of the joints, held [N m or N], shape (n,)."""

    def __post_init__(self) -> None:
        self.torque = np.zeros(self.plant.world.n_joints)

    @property
    def contact(self) -> np.void:
        """The first contact at the last state evaluated."""
        return self.plant.contacts[0]

    @property
    def position(self) -> Array:
        """Of the box [m], a view, shape (3,)."""
        return self.plant.world.object_position(self.state.q)

    @property
    def velocity(self) -> Array:
        """Of the box in its own frame, linear [m/s] and angular [rad/s], a view, shape (6,)."""
        return self.state.v[-6:]

    def update(self) -> None:
        """Evaluate the plant at the state."""
        self.plant.update(self.state.q, self.state.v, self.state.z)

    def run(self, stepper: Stepper, duration: float, watch: Callable[[float], bool | None] | None = None) -> None:
        """Move on, calling `watch(time)` after each step until it returns True. The contacts are then up to date."""
        integration = stepper.start(self.plant)
        for k in range(round(duration / stepper.step)):
            integration.advance(self.state, self.torque)
            if watch is not None:
                if not isinstance(stepper, Midpoint):
                    self.update()
                if watch((k + 1) * stepper.step):
                    return
        self.update()

    def shear(self, force: ArrayLike, k: float) -> None:
        """Store in the first contact what makes the tangential part of a force on the box [N], world, springs k."""
        self.update()
        self.state.z[0, :2] = (self.contact["rotation"].T @ np.asarray(force, dtype=float))[:2] / k

    def wind_up(self) -> None:
        """Bring all contacts to the limit of friction along their velocity, as if they had slipped for long."""
        self.update()
        self.state.z[:, :3] = self.plant.contacts["deformation_rate"][:, 1:]
        self.update()
        self.plant.note_slip(self.state.z)
        for name in ("slip_travel", "slip_twist", "slip_loss"):
            self.plant.contacts[name] = 0.0

    def energy(self) -> float:
        """Kinetic, of the weights, and of the springs [J], at the state."""
        model, data = self.plant.world.model, self.plant.world.model.createData()
        self.update()
        total = pin.computeKineticEnergy(model, data, self.state.q, self.state.v)
        total += pin.computePotentialEnergy(model, data, self.state.q)
        for material, contact in zip(self.plant.materials, self.plant.contacts, strict=True):
            law = material.law
            assert law.energy is not None
            total += law.energy(*contact["deformation"], *contact["lean"], *law.parameters())
        return float(total)

    def contact_forces(self) -> Array:
        """What the contacts do to each velocity at the last state, shape (nv,)."""
        out = np.zeros(self.plant.world.nv)
        for columns, jacobian, contact in zip(
            self.plant.columns, self.plant.contact_columns, self.plant.contacts, strict=True
        ):
            add_contact_force(columns, jacobian, contact["force"], out)
            add_contact_moment(columns, jacobian, contact["lean_elastic"], out)
        return out


def make_world(
    carriages: Sequence[Carriage],
    body: Body,
    gravity: ArrayLike = (0.0, 0.0, -G),
    turn: ArrayLike | None = None,
    shift: ArrayLike = (0.0, 0.0, 0.0),
) -> World:
    """Carriages and box as a world; `turn`, shape (3, 3), and `shift` [m] move the base of the carriages."""
    names = [f"tip_{k}" for k in range(len(carriages))]
    rpy = pin.rpy.matrixToRpy(np.eye(3) if turn is None else np.asarray(turn, dtype=float))
    parts = [
        '<robot name="rig"><link name="base"/><link name="mount"/>'
        f'<joint name="base_mount" type="fixed"><parent link="base"/><child link="mount"/>{_origin(shift, rpy)}</joint>'
    ]
    parts += [_carriage(name, carriage) for name, carriage in zip(names, carriages, strict=True)]
    box = (
        f'<robot name="box"><link name="box">{_inertial(1.0, 1.0, 1.0, 1.0)}'
        f'<collision><geometry><box size="{_numbers(body.size)}"/></geometry></collision></link></robot>'
    )
    hand = Urdf.parse("".join([*parts, "</robot>"]), Path("rig.urdf"), HAND)
    held = Urdf.parse(box, Path("box.urdf"), OBJECT)
    world = load_world(HandModel(hand, tuple(names)), ObjectModel(held), np.asarray(gravity, dtype=float).tolist())
    # no real body is as heavy, or as light, as these, so that a file with them would be refused
    world.model.inertias[world.object_joint] = pin.Inertia(body.mass, np.zeros(3), np.diag(body.inertia))
    for name, carriage in zip(names, carriages, strict=True):
        for k in range(len(carriage.joints)):
            share = 1.0 if k == len(carriage.joints) - 1 else 1e-12
            inertia = pin.Inertia(share * carriage.mass, np.zeros(3), share * carriage.inertia * np.eye(3))
            world.model.inertias[world.model.getJointId(f"{name}_{k}_joint")] = inertia
    return world


def make_rig(
    world: World,
    fingertips: Sequence[Fingertip],
    position: ArrayLike,
    rotation: ArrayLike | None = None,
    supports: Sequence[Support] = (),
) -> Rig:
    """All at rest, joints at 0, with the box at a position [m], shape (3,), and turned, shape (3, 3)."""
    plant = Plant(world, fingertips, supports)
    q = np.zeros(world.nq)
    world.set_object_pose(position, np.eye(3) if rotation is None else np.asarray(rotation, dtype=float), q)
    return Rig(plant, State(q, np.zeros(world.nv), np.zeros((len(plant.contacts), plant.n_memory))))


def tip(world: World, face: int, law: Law | None = None, friction: float = MU, **options: object) -> Fingertip:
    """A tip with a limit of friction, against one face of the box."""
    return Fingertip(law or Radial(radius=RADIUS), friction, world.faces[face], **{"can_slip": True, **options})  # type: ignore[arg-type]


def block(
    depth: float,
    law: Law | None = None,
    *,
    body: Body = Body(),
    gravity: ArrayLike = (0.0, 0.0, -G),
    joints: str = "Z",
    **options: object,
) -> Rig:
    """A box that lies, `depth` [m] deep, on a tip which points up and does not give way."""
    world = make_world([Carriage(joints)], body, gravity)
    fingertip = tip(world, BOTTOM, law, **options)  # type: ignore[arg-type]
    return make_rig(world, [fingertip], (0.0, 0.0, fingertip.law.radius - depth + 0.5 * body.size[2]))


def ball(depth: float, weight: ArrayLike, law: Law, mass: float = MASS, **options: object) -> Rig:
    """A solid sphere with the tip as its underside, on an immovable floor; it moves in the plane x, z.

    Its joints are x, z, Y, and their forces are its weight [N]: along x and z, shape (2,).
    """
    rolling = law.radius - depth
    carriage = Carriage("xzY", (0.0, 0.0, rolling), DOWNWARD, mass, 0.4 * mass * rolling**2)
    body = Body(IMMOVABLE, size=(1.0, 1.0, 1.0))
    world = make_world([carriage], body, (0.0, 0.0, 0.0))
    rig = make_rig(world, [tip(world, TOP, law, **options)], (0.0, 0.0, -0.5))  # type: ignore[arg-type]
    rig.torque[:2] = weight
    return rig


def pinch(
    force: float = 6.0,
    law: Law | None = None,
    *,
    tip_mass: float = 0.05,
    turn: ArrayLike | None = None,
    shift: ArrayLike = (0.0, 0.0, 0.0),
    **options: object,
) -> Rig:
    """Two tips that slide along x press a free box of 0.2 kg between them with a force [N] a side, at rest along x.

    Each tip weighs `tip_mass` [kg]. `turn`, shape (3, 3), and `shift` [m] move the whole world, gravity included.
    """
    rotation = np.eye(3) if turn is None else np.asarray(turn, dtype=float)
    law = law or Radial(radius=RADIUS)
    middle = depth_of(law, force)
    body = Body(inertia=(81.93e-6, 112.78e-6, 74.70e-6), size=(0.056, 0.036, 0.060))
    out = 0.5 * body.size[0] + law.radius - middle
    carriages = [
        Carriage("x", (out, 0.0, 0.0), (0.0, 0.0, math.pi), tip_mass, 1e-5),
        Carriage("x", (-out, 0.0, 0.0), (0.0, 0.0, 0.0), tip_mass, 1e-5),
    ]
    world = make_world(carriages, body, rotation @ (0.0, 0.0, -G), rotation, shift)
    fingertips = [tip(world, face, law, **options) for face in (RIGHT, LEFT)]  # type: ignore[arg-type]
    rig = make_rig(world, fingertips, shift, rotation)
    rig.torque[:] = -force, force
    return rig


def depth_of(law: Law, force: float) -> float:
    """Where the law presses with a force [N], by bisection [m]."""
    low, high = 0.0, law.radius
    for _ in range(200):
        middle = 0.5 * (low + high)
        if law((middle, 0.0, 0.0, 0.0), 0.5 * math.pi)[0] < force:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def zero_crossing(times: Sequence[float] | Array, values: Sequence[float] | Array) -> float:
    """Where the values first change sign, between samples along a line; NaN if they do not."""
    for k in range(1, len(values)):
        if values[k - 1] * values[k] <= 0.0 and values[k - 1] != 0.0:
            share = values[k - 1] / (values[k - 1] - values[k])
            return times[k - 1] + share * (times[k] - times[k - 1])
    return math.nan


def _carriage(name: str, carriage: Carriage) -> str:
    parent, parts = "mount", []
    for k, letter in enumerate(carriage.joints):
        kind = "prismatic" if letter.islower() else "revolute"
        axis = [float(letter.lower() == other) for other in "xyz"]
        origin = carriage.origin if k == 0 else (0.0, 0.0, 0.0)
        parts.append(
            f'<link name="{name}_{k}">{_inertial(1.0, 1.0, 1.0, 1.0)}</link>'
            f'<joint name="{name}_{k}_joint" type="{kind}"><parent link="{parent}"/><child link="{name}_{k}"/>'
            f'{_origin(origin)}<axis xyz="{_numbers(axis)}"/>'
            '<limit lower="-1e3" upper="1e3" effort="1e3" velocity="1e3"/></joint>'
        )
        parent = f"{name}_{k}"
    parts.append(
        f'<link name="{name}"/><joint name="{name}_mount" type="fixed"><parent link="{parent}"/>'
        f'<child link="{name}"/>{_origin((0.0, 0.0, 0.0), carriage.rpy)}</joint>'
    )
    return "".join(parts)


def _numbers(values: ArrayLike) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values))


def _origin(xyz: ArrayLike, rpy: ArrayLike = (0.0, 0.0, 0.0)) -> str:
    return f'<origin xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"/>'


def _inertial(mass: float, ixx: float, iyy: float, izz: float) -> str:
    return (
        f'<inertial><mass value="{mass!r}"/>'
        f'<inertia ixx="{ixx!r}" ixy="0" ixz="0" iyy="{iyy!r}" iyz="0" izz="{izz!r}"/></inertial>'
    )
