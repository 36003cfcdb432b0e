"""How good the grasp of a scenario is at its start, and as much of it as can be said where there is none at rest."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.analysis.chains import approach, finger_chain
from softhand.analysis.wrenches import Contacts, closure_margin, least_squeeze, singular_values, tangents
from softhand.assembly import read_grasp, read_law, read_world
from softhand.contact.friction import limit_surface_use, spin_length
from softhand.contact.records import PAD
from softhand.errors import GraspError
from softhand.grasp import contact_forces, initial_joints, plain_depth
from softhand.laws.law import Law
from softhand.model.arm import REACHED, Arm
from softhand.model.configuration import rotation_of
from softhand.model.faces import Box
from softhand.model.world import World
from softhand.observation import contact_pairs
from softhand.scenario import Scenario

Array = NDArray[np.float64]

_USUAL_PHI = math.radians(60.0)  # where a tip is taken to press whose angle is not known
_LEAST_FORCE = 1.0  # [N] with which a tip is taken to press whose force is not known
_TOUCH = 0.1  # [N] with which each tip presses at least under the least internal forces


@dataclass(frozen=True, eq=False)
class FingerQuality:
    """One finger of a grasp; NaN is what is not known without a grasp at rest.

    Attributes:
        name: of the tip.
        joint_names: of the joints that move it.
        missing: distance of the tip from where it should be, within the joint limits [m]; zero when it gets there.
        stretch: distance of the tip from the finger's first own joint over the length of the finger [1].
        length: of the finger, its joints in line [m].
        angles: of the joints [rad or m], shape (m,).
        reserve: of each joint to its nearer limit, infinite for continuous ones [rad or m], shape (m,).
        torque: that holds the grasp [N m], NaN if a finger does not reach, shape (m,).
        torque_use: the same over the effort limits, shape (m,).
        speeds: singular values of the Jacobian of the tip's centre from the finger's own joints [m/rad], largest first,
            shape (3,).
        Phi: angle of the contact on the hemisphere, 0 at the rim, pi/2 at the apex [rad].
        depth: dr [m].
        force: f_x, f_y, f_z [N], tau [N m] on the object, in a contact frame, shape (4,).
        friction_use: |f_t| / (mu f_z), infinite for a contact that would have to pull.
        limit_surface_use: with torsion, see `softhand.contact.friction.limit_surface_use`.
        torsion_length: tau_max / (mu f_z) [m].
    """

    name: str
    joint_names: tuple[str, ...]
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
        """w = sqrt(det J J^T), the product of `speeds` [m^3/rad^3]; Yoshikawa, Manipulability of Robotic Mechanisms
        (1985). Zero for a finger that moves in a plane."""
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
        least_internal_force: the smallest that would hold, with each tip pressing with 0.1 N, shape (pairs,); None if none does.
        refusal: why there is no grasp at rest; None if there is one.
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
    position: Array
    rotation: Array
    centre_of_mass: Array
    weight: Array
    shape: Box
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
        lines = [
            ("", [finger.name for finger in fingers]),
            ("contact point, object frame [mm]", [_numbers(1e3 * point, "{:.1f}") for point in points]),
            ("reach, of the finger's length [mm]", [_reach(finger) for finger in fingers]),
            ("joint angles [deg]", [_numbers(np.degrees(finger.angles), "{:.1f}") for finger in fingers]),
            ("to the nearest limit [deg]", [_numbers(np.degrees(finger.reserve), "{:.1f}") for finger in fingers]),
            ("torque, of its limit [%]", [_numbers(100.0 * finger.torque_use, "{:.0f}") for finger in fingers]),
            ("tip moves by [mm/rad]", [_numbers(1e3 * finger.speeds, "{:.0f}") for finger in fingers]),
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
    law, friction = read_law(scenario), scenario.fingertip.friction
    position, rotation = np.array(scenario.object.position), rotation_of(scenario.object.rpy)
    nc = world.n_tips
    internal_force = np.array(scenario.grasp.internal_force)
    shape, refusal = shape_of(world), None
    surface = [shape.nearest(point) for point in scenario.grasp.contact_points]
    points = position + np.array([point for point, _ in surface]) @ rotation.T
    normals = -np.array([normal for _, normal in surface]) @ rotation.T
    depths, angles_of_contact = np.full(nc, np.nan), np.full(nc, np.nan)
    forces = np.full((nc, 3), np.nan)
    missing = np.zeros(nc)
    arm = Arm(world)
    try:
        forces = contact_forces(world, list(points), position, rotation, internal_force)
    except GraspError as error:
        refusal = error
    try:
        _, grasp = read_grasp(scenario, world, law)
        depths, angles_of_contact = grasp.deformation[:, 0], grasp.angles[:, 1]
        angles = joints_of(world, grasp.state.q)
        torsion = grasp.force[:, 3]
    except GraspError as error:
        refusal = error
        angles = initial_joints(world, scenario.grasp.joint_guess)
        torsion = np.full(nc, np.nan)
        for i in range(nc):
            depth = pressed_depth(law, -1.0 if np.isnan(forces[i]).any() else float(normals[i] @ forces[i]))
            missing[i] = _approach(world, arm, i, points[i] - (law.radius - depth) * normals[i], angles)
    arm.move(angles)
    effort = arm.gravity_torque() + sum(arm.point_jacobian(i, points[i]).T @ forces[i] for i in range(nc))
    if np.any(missing > REACHED):
        effort[:] = np.nan
    fingers = []
    for i in range(nc):
        pressing = float(normals[i] @ forces[i])
        depth = depths[i] if np.isfinite(depths[i]) else pressed_depth(law, pressing)
        length = torsion_length(scenario, law, depth)
        t_1, t_2 = tangents(normals[i])
        force = np.array([t_1 @ forces[i], t_2 @ forces[i], pressing, torsion[i]])
        fingers.append(
            _finger(world, arm, i, angles, missing[i], effort, float(angles_of_contact[i]), float(depths[i]), force,
                    friction, length)
        )  # fmt: skip
    inertia = world.model.inertias[world.object_joint]
    centre = position + rotation @ inertia.lever
    contacts = Contacts(
        points - centre, normals, np.full(nc, friction), np.array([f.torsion_length for f in fingers]), size_of(world)
    )
    return GraspQuality(
        fingers=tuple(fingers),
        contacts=contacts,
        forces=forces,
        singular_values=singular_values(contacts),
        singular_values_hard=singular_values(contacts, has_torsion=False),
        margin=closure_margin(contacts),
        internal_force=internal_force,
        least_internal_force=squeeze(world, points, normals, friction, position, rotation, 1.0, _TOUCH),
        refusal=refusal,
        position=position,
        rotation=rotation,
        centre_of_mass=centre,
        weight=inertia.mass * world.gravity,
        shape=shape,
        fingers_at=tuple(skeleton(world, arm, i) for i in range(nc)),
        radius=law.radius,
    )


def _approach(world: World, arm: Arm, index: int, target: Array, angles: Array) -> float:
    """Joint angles of a finger that reaches a target or stops as near to it as it gets; the distance left [m]."""
    gap = arm.reach(index, target, angles)
    if gap <= REACHED:
        return gap
    links, columns = finger_chain(world, index, angles)
    lower, upper = (limit[columns] for limit in world.position_limits)
    own = angles[columns].copy()
    left = approach(links, target, own, lower, upper, np.empty((3, 3)))
    angles[columns] = own
    return left


def _finger(
    world: World, arm: Arm, index: int, angles: Array, missing: float, effort: Array, Phi: float, depth: float,
    force: Array, friction: float, length: float,
) -> FingerQuality:  # fmt: skip
    columns = list(world.tips[index].columns)
    own = own_columns(world, index)
    lower, upper = world.position_limits
    centre, _ = arm.tip(index)
    speeds = np.linalg.svd(arm.point_jacobian(index, centre)[:, own], compute_uv=False)
    chain = skeleton(world, arm, index)[len(columns) - len(own) :]
    reach = float(np.sum(np.linalg.norm(np.diff(chain, axis=0), axis=1)))
    pulls = not force[2] > 0.0 and not np.isnan(force[2])
    with_torsion = np.nan_to_num(force) if pulls or np.isnan(force[3]) else force
    use = math.inf if pulls else float(np.hypot(force[0], force[1]) / (friction * force[2]))
    coupled = use if pulls or np.isnan(force).any() else limit_surface_use(with_torsion, friction, length)
    return FingerQuality(
        name=world.tips[index].name,
        joint_names=tuple(world.joint_names[column] for column in columns),
        missing=missing if missing > REACHED else 0.0,
        stretch=float(np.linalg.norm(centre - chain[0])) / reach,
        length=reach,
        angles=angles[columns],
        reserve=np.minimum(angles - lower, upper - angles)[columns],
        torque=effort[columns],
        torque_use=np.abs(effort[columns]) / world.effort_limit[columns],
        speeds=np.concatenate([speeds, np.zeros(3 - len(speeds))]),
        Phi=Phi,
        depth=depth,
        force=force,
        friction_use=use,
        limit_surface_use=float(coupled),
        torsion_length=length,
    )


def shape_of(world: World) -> Box:
    """The solid that the tips meet: `surface_points` and `nearest` are all that is used of it."""
    return world.box


def size_of(world: World) -> float:
    """L = sqrt(tr I / 2 m): root of the mean squared distance of the mass from its centre [m]."""
    inertia = world.model.inertias[world.object_joint]
    return math.sqrt(float(np.trace(inertia.inertia)) / (2.0 * inertia.mass))


def squeeze(
    world: World, points: Array, normals: Array, friction: float, position: Array, rotation: Array, use: float = 1.0,
    least_normal: float = 0.0,
) -> Array | None:  # fmt: skip
    """`least_squeeze` of contacts in the world, shape (nc, 3) each; None too where they cannot carry the weight."""
    nc = len(points)
    pairs = len(contact_pairs(nc))
    try:
        carried = contact_forces(world, list(points), position, rotation, np.zeros(pairs))
    except GraspError:
        return None
    each = [contact_forces(world, list(points), position, rotation, unit) - carried for unit in np.eye(pairs)]
    return least_squeeze(carried, np.stack(each, axis=2), normals, np.full(nc, friction), use, least_normal)


def pressed_depth(law: Law, pressing: float) -> float:
    """dr [m] under a normal force without shear; that of 1 N if the force is not known or pulls."""
    return plain_depth(law, _USUAL_PHI, 0.0, pressing if pressing > _LEAST_FORCE else _LEAST_FORCE)


def torsion_length(scenario: Scenario, law: Law, depth: float) -> float:
    """tau_max / (mu f_z) at a depth [m]."""
    pad = np.zeros(1, PAD)[0]
    pad["radius"], pad["torsion_share"] = law.radius, law.torsion_share or 0.0
    pad["torsion_length"] = scenario.fingertip.torsion_length or 0.0
    return float(spin_length(pad, law.radius - depth))


def own_columns(world: World, index: int) -> list[int]:
    """Velocity indices of the joints that move only this tip."""
    shared = {column for k, tip in enumerate(world.tips) if k != index for column in tip.columns}
    return [column for column in world.tips[index].columns if column not in shared]


def joints_of(world: World, q: Array) -> Array:
    """Joint angles [rad or m], shape (n,), of a configuration of the model."""
    angles = np.zeros(world.n_joints)
    for joint in list(world.model.joints)[1:-1]:
        own = q[joint.idx_q : joint.idx_q + joint.nq]
        angles[joint.idx_v] = own[0] if joint.nq == 1 else math.atan2(own[1], own[0])
    return angles


def skeleton(world: World, arm: Arm, index: int) -> Array:
    """Origins of the joints of a finger and the centre of its tip at the last `move` [m], shape (joints + 1, 3)."""
    data = world.model.createData()
    pin.forwardKinematics(world.model, data, arm.q)
    chain = list(world.model.supports[world.tips[index].joint])[1:]
    return np.array([*(data.oMi[joint].translation for joint in chain), arm.tip(index)[0]])


def _reach(finger: FingerQuality) -> str:
    if finger.missing:
        return f"out of reach by {1e3 * finger.missing:.1f}"
    return f"{1e3 * finger.stretch * finger.length:.0f} of {1e3 * finger.length:.0f}"


def _number(value: float, form: str) -> str:
    if math.isnan(value):
        return "-"
    if math.isinf(value):
        return "pulls"
    text = form.format(value)
    return text if float(text) else form.format(0.0)  # no -0.0


def _numbers(values: Sequence[float] | Array, form: str) -> str:
    return ", ".join("free" if math.isinf(value) else _number(value, form) for value in values)
