"""How good the grasp of a scenario is at its start, and as much of it as can be said where there is none at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from softhand.assembly.parts import read_face_friction
from softhand.assembly.plant import read_grasp, read_world
from softhand.contact.friction import limit_surface_use
from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError
from softhand.grasping.chains import approach, finger_chain
from softhand.grasping.parts import (
    Material,
    friction_on,
    pressed_depth,
    read_materials,
    size_of,
    skeleton,
    squeeze,
    torsion_length,
)
from softhand.grasping.wrenches import Contacts, closure_margin, singular_values, tangents
from softhand.model.arm import REACHED, Arm
from softhand.model.shapes.shape import Shape
from softhand.model.world import World, joints_of, own_columns, slides_of
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import rotation_of
from softhand.scenario.scenario import Scenario
from softhand.start.reach import initial_joints
from softhand.start.statics import contact_forces

_STARTS = 8  # of a finger that does not reach its point, after the guess
_TOUCH = 0.1  # [N] with which each tip presses at least under the least internal forces


@dataclass(frozen=True, eq=False)
class FingerQuality:
    """One finger of a grasp; NaN is what is not known without a grasp at rest.

    Attributes:
        name: of the tip.
        joint_names: of the joints that move it.
        slides: which of them slide, shape (m,).
        missing: distance of the tip from where it should be, within the joint limits [m]; zero when it gets there.
        stretch: distance of the tip from the finger's first own joint over the length of the finger [1].
        length: of the finger, its joints in line [m].
        angles: of the joints [rad or m], shape (m,).
        reserve: of each joint to its nearer limit, infinite for continuous ones [rad or m], shape (m,).
        torque: that holds the grasp [N m], NaN if a finger does not reach, shape (m,).
        torque_use: the same over the effort limits, shape (m,).
        speeds: singular values of the Jacobian of the tip's centre from the finger's own joints [m/rad], or [m/m] of
            slides, largest first, shape (3,); NaN where the finger has both.
        Phi: angle of the contact on the hemisphere, 0 at the rim, pi/2 at the apex [rad].
        depth: dr [m].
        force: f_x, f_y, f_z [N], tau [N m] on the object, in a contact frame, shape (4,).
        friction_use: |f_t| / (mu f_z), infinite for a contact that would have to pull.
        limit_surface_use: with torsion, see `softhand.contact.friction.limit_surface_use`.
        torsion_length: tau_max / (mu f_z) [m].
    """

    name: str
    joint_names: tuple[str, ...]
    slides: NDArray[np.bool_]
    missing: float
    stretch: float
    length: float
    angles: Array
    reserve: Array
    torque: Array
    torque_use: Array
    speeds: Array
    Phi: float
    depth: float
    force: Array
    friction_use: float
    limit_surface_use: float
    torsion_length: float

    @property
    def manipulability(self) -> float:
        """w = sqrt(det J J^T), the product of `speeds` [m^3/rad^3]; zero for a finger that moves in a plane.

        Yoshikawa, Manipulability of Robotic Mechanisms (1985).
        """
        return float(np.prod(self.speeds))


@dataclass(frozen=True, eq=False)
class GraspQuality:
    """The grasp at the start of a scenario.

    Attributes:
        fingers: one a tip.
        contacts: points about the centre of mass, with the object's length L.
        forces: on the object at the contacts, in the world [N], shape (nc, 3); NaN if the contacts cannot carry it.
        singular_values: of the grasp map with torsion, without dimension, shape (6,).
        singular_values_hard: the same without torsion.
        margin: of force closure, [N] for one newton of normal force in all.
        internal_force: f_N of the scenario [N], shape (pairs,).
        least_internal_force: the smallest that would hold with each tip pressing with 0.1 N, shape (pairs,); None if
            none does.
        refusal: why there is no grasp at rest; None if there is one.
        opening: of the start, how far off their contact points the tips are [m].
        position: of the object frame [m].
        rotation: axes of the object frame, shape (3, 3).
        centre_of_mass: in the world [m].
        weight: of the object [N], in the world.
        shape: of the object.
        fingers_at: origins of the joints and the centre of the tip of each finger in the world [m], from the base on.
        radius: of the tips [m].
    """

    fingers: tuple[FingerQuality, ...]
    contacts: Contacts
    forces: Array
    singular_values: Array
    singular_values_hard: Array
    margin: float
    internal_force: Array
    least_internal_force: Array | None
    refusal: GraspError | None
    opening: float
    position: Array
    rotation: Array
    centre_of_mass: Array
    weight: Array
    shape: Shape
    fingers_at: tuple[Array, ...]
    radius: float

    @property
    def points(self) -> Array:
        """Contact points in the world [m], shape (nc, 3)."""
        return self.centre_of_mass + self.contacts.points

    def finger_rows(self) -> list[tuple[str, ...]]:
        """A table with one column a finger; the first row are their names."""
        fingers = self.fingers
        points = (self.points - self.position) @ self.rotation
        slides = np.concatenate([finger.slides for finger in fingers])
        unit = "mm" if slides.all() else "deg; slides mm" if slides.any() else "deg"
        rate = "mm/mm" if slides.all() else "mm/rad; slides mm/mm" if slides.any() else "mm/rad"
        gap = [("gap to the contact point [mm]", [f"{1e3 * self.opening:.1f}"] * len(fingers))] if self.opening else []
        lines = [
            ("", [finger.name for finger in fingers]),
            ("contact point, object frame [mm]", [_numbers(1e3 * point, "{:.1f}") for point in points]),
            *gap,
            ("reach, of the finger's length [mm]", [_reach(finger) for finger in fingers]),
            (f"joint angles [{unit}]", [_joints(finger, finger.angles) for finger in fingers]),
            (f"to the nearest limit [{unit}]", [_joints(finger, finger.reserve) for finger in fingers]),
            ("torque, of its limit [%]", [_numbers(100.0 * finger.torque_use, "{:.0f}") for finger in fingers]),
            (f"tip moves by [{rate}]", [_speeds(finger) for finger in fingers]),
            ("manipulability [cm^3/rad^3]", [_manipulability(finger) for finger in fingers]),
            ("Phi, from the rim [deg]", [_number(math.degrees(finger.Phi), "{:.1f}") for finger in fingers]),
            ("Phi, to the apex [deg]", [_number(90.0 - math.degrees(finger.Phi), "{:.1f}") for finger in fingers]),
            ("dr [mm]", [_number(1e3 * finger.depth, "{:.2f}") for finger in fingers]),
            ("normal force [N]", [_number(finger.force[2], "{:.2f}") for finger in fingers]),
            ("friction use", [_number(finger.friction_use, "{:.2f}") for finger in fingers]),
            ("limit-surface use", [_number(finger.limit_surface_use, "{:.2f}") for finger in fingers]),
        ]
        return [(label, *values) for label, values in lines]

    def rows(self) -> list[tuple[str, str]]:
        """Label and value of what the grasp is as a whole."""
        L = 1e3 * self.contacts.length
        values, hard = self.singular_values, self.singular_values_hard
        if self.margin > 0.0:
            closure = f"{self.margin:.3f} N per newton of normal force in all"
        else:
            closure = "none: some wrench cannot be answered, however hard the squeeze"
        least = "none: no squeeze between the contacts keeps all in their friction cones"
        if self.least_internal_force is not None:
            least = f"{_numbers(self.least_internal_force, '{:.2f}')} N"
        pairs = ", ".join(f"{i + 1}-{j + 1}" for i, j in contact_pairs(len(self.fingers)))
        return [
            ("singular values of G, soft fingers", _numbers(values, "{:.2f}")),
            ("singular values of G, without torsion", _numbers(hard, "{:.2f}")),
            ("force-closure margin", closure),
            ("characteristic length", f"{L:.1f} mm, by which moments count as forces"),
            ("internal forces of the scenario", f"{_numbers(self.internal_force, '{:.2f}')} N  (fingers {pairs})"),
            ("least internal forces that hold", least),
        ]


def grasp_quality(scenario: Scenario) -> GraspQuality:
    """The figures of the grasp at the start of a scenario, also where it cannot be at rest.

    Moments are taken about the centre of mass and compared with forces by the root of the mean squared distance of the
    object's mass from it, L = sqrt(tr I / 2 m).

    Args:
        scenario: with hand, object and grasp.

    Raises:
        ScenarioError: a name or a setting is wrong.
        ModelError: a URDF cannot be used.
        GraspError: the number of points, forces or guesses does not fit the hand.
    """
    return quality_in(read_world(scenario), scenario)


def quality_in(world: World, scenario: Scenario) -> GraspQuality:
    """`grasp_quality` with hand and object already read."""
    nc, materials = world.n_tips, read_materials(scenario)
    position, rotation = np.array(scenario.object.position), rotation_of(scenario.object.rpy)
    shape, inertia = world.shape, world.model.inertias[world.object_joint]
    surface = [shape.nearest(point) for point in scenario.grasp.contact_points]
    points = position + np.array([point for point, _ in surface]) @ rotation.T
    normals = -np.array([normal for _, normal in surface]) @ rotation.T
    faces = read_face_friction(scenario, shape)
    friction = np.array([friction_on(shape, faces, n, tip) for (_, n), tip in zip(surface, materials, strict=True)])
    is_open = scenario.grasp.opening > 0.0
    forces = np.full((nc, 3), np.nan) if is_open else _forces(world, scenario, points, position, rotation)
    posture = _posture(world, scenario, materials, points, normals, forces)
    arm = Arm(world)
    arm.move(posture.angles)
    torque = arm.gravity_torque()
    if not is_open:
        torque = torque + sum(arm.point_jacobian(i, points[i]).T @ forces[i] for i in range(nc))
    if np.any(posture.missing):
        torque[:] = np.nan  # not all tips press
    fingers = tuple(
        _finger(arm, i, posture, normals[i], forces[i], torque, materials[i], float(friction[i])) for i in range(nc)
    )
    centre = position + rotation @ inertia.lever
    torsion_lengths = np.array([finger.torsion_length for finger in fingers])
    contacts = Contacts(points - centre, normals, friction, torsion_lengths, size_of(world))
    return GraspQuality(
        fingers=fingers,
        contacts=contacts,
        forces=forces,
        singular_values=singular_values(contacts),
        singular_values_hard=singular_values(contacts, has_torsion=False),
        margin=closure_margin(contacts),
        internal_force=np.array(scenario.grasp.internal_force),
        least_internal_force=squeeze(world, points, normals, friction, position, rotation, 1.0, _TOUCH),
        refusal=posture.refusal,
        opening=scenario.grasp.opening,
        position=position,
        rotation=rotation,
        centre_of_mass=centre,
        weight=inertia.mass * world.gravity,
        shape=shape,
        fingers_at=tuple(skeleton(world, arm, i) for i in range(nc)),
        radius=max(tip.law.radius for tip in materials),
    )


@dataclass(frozen=True, eq=False)
class _Posture:
    """Joints and tips at rest, or as near to it as they get; NaN is what is then not known."""

    angles: Array  # (n,)
    missing: Array  # (nc,)
    depth: Array  # (nc,)
    Phi: Array  # (nc,)
    torsion: Array  # (nc,)
    refusal: GraspError | None


def _forces(world: World, scenario: Scenario, points: Array, position: Array, rotation: Array) -> Array:
    """Forces on the object [N], in the world, shape (nc, 3); NaN if the contacts cannot carry it."""
    try:
        return contact_forces(world, list(points), position, rotation, scenario.grasp.internal_force)
    except GraspError:
        return np.full((len(points), 3), np.nan)


def _posture(
    world: World, scenario: Scenario, materials: Sequence[Material], points: Array, normals: Array, forces: Array
) -> _Posture:
    nc = len(points)
    try:
        _, grasp = read_grasp(scenario, world)
    except GraspError as error:
        refusal = error
    else:
        if scenario.grasp.opening:
            unknown = np.full(nc, np.nan)
            return _Posture(joints_of(world, grasp.state.q), np.zeros(nc), unknown, unknown, unknown, None)
        return _Posture(
            joints_of(world, grasp.state.q),
            np.zeros(nc),
            grasp.deformation[:, 0],
            grasp.angles[:, 1],
            grasp.force[:, 3],
            None,
        )
    angles = initial_joints(world, scenario.grasp.joint_guess)
    pressed = [
        tip.law.radius - pressed_depth(tip.law, float(normal @ force))
        for tip, normal, force in zip(materials, normals, forces, strict=True)
    ]
    centres = points - np.array(pressed)[:, None] * normals
    missing = np.array([_approach(world, i, centre, angles) for i, centre in enumerate(centres)])
    unknown = np.full(nc, np.nan)
    return _Posture(angles, missing, unknown, unknown, unknown, refusal)


def _approach(world: World, index: int, target: Array, angles: Array) -> float:
    """Joint angles of a finger that reaches a target or stops as near to it as it gets; the distance left [m]."""
    links, columns = finger_chain(world, index, angles)
    lower, upper = (limit[columns] for limit in world.position_limits)
    within = np.maximum(lower, -math.pi), np.minimum(upper, math.pi)
    others = np.random.default_rng(0).uniform(*within, (_STARTS, len(columns)))
    least = math.inf
    for start in (angles[columns], *others):
        own = start.copy()
        left = approach(links, target, own, lower, upper, np.empty((3, 3)))
        if left < least - REACHED:
            least, angles[columns] = left, own
    return 0.0 if least <= REACHED else least


def _finger(
    arm: Arm, index: int, posture: _Posture, normal: Array, push: Array, torque: Array, tip: Material, friction: float
) -> FingerQuality:
    """One finger, the arm at its posture."""
    world = arm.world
    columns, own = list(world.tips[index].columns), own_columns(world, index)
    lower, upper = world.position_limits
    centre, _ = arm.tip(index)
    slides = slides_of(world)
    speeds = np.linalg.svd(arm.point_jacobian(index, centre)[:, own], compute_uv=False)
    if 0 < np.count_nonzero(slides[own]) < len(own):
        speeds = np.full(3, np.nan)
    chain = skeleton(world, arm, index)[len(columns) - len(own) :]
    length = float(np.sum(np.linalg.norm(np.diff(chain, axis=0), axis=1)))
    t_1, t_2 = tangents(normal)
    force = np.array([t_1 @ push, t_2 @ push, normal @ push, posture.torsion[index]])
    depth = posture.depth[index]
    spin = torsion_length(tip, depth if np.isfinite(depth) else pressed_depth(tip.law, float(force[2])))
    use = math.inf if force[2] <= 0.0 else float(np.hypot(force[0], force[1]) / (friction * force[2]))
    return FingerQuality(
        name=world.tips[index].name,
        joint_names=tuple(world.joint_names[column] for column in columns),
        slides=slides[columns],
        missing=float(posture.missing[index]),
        stretch=float(np.linalg.norm(centre - chain[0])) / length,
        length=length,
        angles=posture.angles[columns],
        reserve=np.minimum(posture.angles - lower, upper - posture.angles)[columns],
        torque=torque[columns],
        torque_use=np.abs(torque[columns]) / world.effort_limit[columns],
        speeds=np.concatenate([speeds, np.zeros(3 - len(speeds))]),
        Phi=float(posture.Phi[index]),
        depth=float(depth),
        force=force,
        friction_use=use,
        limit_surface_use=math.nan if math.isnan(use) else float(limit_surface_use(force, friction, spin)),
        torsion_length=spin,
    )


def _reach(finger: FingerQuality) -> str:
    if finger.missing:
        return f"out of reach by {1e3 * finger.missing:.1f}"
    return f"{1e3 * finger.stretch * finger.length:.0f} of {1e3 * finger.length:.0f}"


def _joints(finger: FingerQuality, values: Array) -> str:
    return _numbers(np.where(finger.slides, 1e3 * values, np.degrees(values)), "{:.1f}")


def _speeds(finger: FingerQuality) -> str:
    if np.isnan(finger.speeds).any():
        return "-"
    return _numbers(finger.speeds, "{:.2f}") if finger.slides.all() else _numbers(1e3 * finger.speeds, "{:.0f}")


def _manipulability(finger: FingerQuality) -> str:
    return "-" if finger.slides.any() else _number(1e6 * finger.manipulability, "{:.0f}")


def _number(value: float, form: str) -> str:
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "pulls"
    text = form.format(value)
    return text if float(text) else form.format(0.0)  # no -0.0


def _numbers(values: Sequence[float] | Array, form: str) -> str:
    return ", ".join("free" if math.isinf(value) else _number(value, form) for value in values)
