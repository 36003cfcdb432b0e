"""How good the grasp of a scenario is at its start, and as much of it as can be said where there is none at rest."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np

from softhand.assembly.plant import read_world
from softhand.contact.grasp_map import grasp_map
from softhand.contact.mobility import mobility
from softhand.contact.pairs import contact_pairs
from softhand.errors import GraspError
from softhand.grasping.finger_quality import FingerQuality, judge_finger
from softhand.grasping.margin import closure_margin
from softhand.grasping.posture import Posture, find_posture
from softhand.grasping.quality_rows import finger_rows, numbers
from softhand.grasping.situation import Situation, situation_of, skeleton
from softhand.grasping.wrenches import Contacts, singular_values
from softhand.model.arm import Arm
from softhand.model.shapes.shape import Shape
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.simulation.regulated import regulated_rows

_TOUCH = 0.1  # [N] with which each tip presses at least under the least internal forces


@dataclass(frozen=True, eq=False)
class GraspQuality(Record):
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
        regulated: of a hand with coupled joints, what its motors can regulate: label and text of each line.
    """

    units: ClassVar = {
        "points": "m", "forces": "N", "singular_values": "1", "singular_values_hard": "1",
        "margin": "N/N", "internal_force": "N", "least_internal_force": "N", "opening": "m", "position": "m",
        "rotation": "1", "centre_of_mass": "m", "weight": "N", "fingers_at": "m", "radius": "m",
    }  # fmt: skip
    unreported: ClassVar = frozenset({"shape"})

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
    regulated: tuple[tuple[str, str], ...] = ()

    @property
    def points(self) -> Array:
        """Contact points in the world [m], shape (nc, 3)."""
        return self.centre_of_mass + self.contacts.points

    def finger_rows(self) -> list[tuple[str, ...]]:
        """A table with one column a finger; the first row are their names."""
        return finger_rows(self.fingers, (self.points - self.position) @ self.rotation, self.opening)

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
            least = f"{numbers(self.least_internal_force, '{:.2f}')} N"
        pairs = ", ".join(f"{i + 1}-{j + 1}" for i, j in contact_pairs(len(self.fingers)))
        return [
            ("singular values of G, soft fingers", numbers(values, "{:.2f}")),
            ("singular values of G, without torsion", numbers(hard, "{:.2f}")),
            ("force-closure margin", closure),
            ("characteristic length", f"{L:.1f} mm, by which moments count as forces"),
            ("internal forces of the scenario", f"{numbers(self.internal_force, '{:.2f}')} N  (fingers {pairs})"),
            ("least internal forces that hold", least),
            *self.regulated,
        ]


def grasp_quality(scenario: Scenario | str | Path) -> GraspQuality:
    """The figures of the grasp at the start of a scenario, also where it cannot be at rest.

    Moments are taken about the centre of mass and compared with forces by the root of the mean squared distance of the
    object's mass from it, L = sqrt(tr I / 2 m).

    Args:
        scenario: with hand, object and grasp, or its name or path.

    Raises:
        ScenarioError: a name or a setting is wrong.
        ModelError: a URDF cannot be used.
        GraspError: the number of points, forces or guesses does not fit the hand.
    """
    scenario = as_scenario(scenario)
    return quality_in(read_world(scenario), scenario)


def quality_in(world: World, scenario: Scenario, with_least: bool = True) -> GraspQuality:
    """`grasp_quality` with hand and object already read, without the least internal forces if nobody needs them."""
    here = situation_of(scenario, world)
    surface = [here.shape.nearest(point) for point in scenario.grasp.contact_points]
    points = here.to_world(np.array([point for point, _ in surface]))
    normals = -np.array([normal for _, normal in surface]) @ here.rotation.T
    friction = np.array([here.friction(i, normal) for i, (_, normal) in enumerate(surface)])
    forces = _forces(here, points)
    posture = find_posture(world, scenario, here.materials, points, normals, forces)
    arm = Arm(world)
    arm.move(posture.angles)
    if posture.leant is not None:
        forces = posture.leant.forces
    torque = _holding_torque(arm, posture, points, forces, scenario.grasp.opening > 0.0)
    fingers = tuple(
        judge_finger(arm, i, posture, normals[i], forces[i], torque, here.materials[i], float(friction[i]))
        for i in range(world.n_tips)
    )
    centre = here.to_world(here.centre)
    lengths, curves = zip(*(finger.torsion for finger in fingers), strict=True)
    contacts = Contacts(points - centre, normals, friction, np.array(lengths), here.length, np.array(curves))
    return GraspQuality(
        fingers=fingers,
        contacts=contacts,
        forces=forces,
        singular_values=singular_values(contacts),
        singular_values_hard=singular_values(contacts, has_torsion=False),
        margin=closure_margin(contacts),
        internal_force=np.array(scenario.grasp.internal_force),
        least_internal_force=here.squeeze(points, normals, friction, 1.0, _TOUCH) if with_least else None,
        refusal=posture.refusal,
        opening=scenario.grasp.opening,
        position=here.position,
        rotation=here.rotation,
        centre_of_mass=centre,
        weight=world.model.inertias[world.object_joint].mass * world.gravity,
        shape=here.shape,
        fingers_at=tuple(skeleton(world, arm, i) for i in range(world.n_tips)),
        radius=max(tip.law.radius for tip in here.materials),
        regulated=_regulated(here, arm, points),
    )


def _regulated(here: Situation, arm: Arm, points: Array) -> tuple[tuple[str, str], ...]:
    """What the motors of coupled joints can regulate, in words; nothing without coupled joints."""
    world = here.world
    if world.coupling is None:
        return ()
    J = np.vstack([arm.point_jacobian(i, point) for i, point in enumerate(points)])
    K = np.zeros((3 * len(points), len(contact_pairs(len(points)))))
    for k, (i, j) in enumerate(contact_pairs(len(points))):
        way = (points[j] - points[i]) / np.linalg.norm(points[j] - points[i])
        K[3 * i : 3 * i + 3, k], K[3 * j : 3 * j + 3, k] = way, -way
    found = mobility(J, grasp_map(points - here.position), K, here.length)
    return tuple(regulated_rows(found, world.coupling))


def _forces(here: Situation, points: Array) -> Array:
    """Forces on the object [N], in the world, shape (nc, 3); NaN if the contacts cannot carry it, or do not touch."""
    grasp = here.scenario.grasp
    if grasp.opening > 0.0:
        return np.full((len(points), 3), np.nan)
    try:
        return here.forces(points, grasp.internal_force)
    except GraspError:
        return np.full((len(points), 3), np.nan)


def _holding_torque(arm: Arm, posture: Posture, points: Array, forces: Array, is_open: bool) -> Array:
    """N_F + J^T f of all joints [N m], shape (n,); N_F alone for open fingers, NaN where not all tips press."""
    torque = arm.gravity_torque()
    if np.any(posture.missing):
        return np.full_like(torque, np.nan)
    if is_open:
        return torque
    if posture.leant is not None:
        torque += posture.leant.torque
    return torque + sum(arm.point_jacobian(i, points[i]).T @ forces[i] for i in range(len(points)))
