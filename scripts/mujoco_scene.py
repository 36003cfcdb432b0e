"""The grasp of a softhand scenario as a scene of MuJoCo, and the control law of the paper on MuJoCo's data.

Shared by the benchmarks. All numbers of the scene come from softhand's own model of the URDFs: joint placements and
axes, masses, inertias, tip frames, radius, friction, faces of the object and the grasp at the start.

What cannot be the same is the contact. MuJoCo's soft contact has a normal force that depends on the depth, a damping,
and friction that creeps; it has no tangential and no torsional spring. Here

* normal direction: `solref` and `solimp` of each pair are set so that the force at the depth of the start, and its
  derivative, are those of the fingertip law (F = pi k_r dr^2 and 2 pi k_r dr for the paper's law);
* friction: elliptic cone, condim 4, sliding coefficient mu, torsional coefficient tau_max / N of the law's pressure
  at the depth of the start, `impratio` high so that the grasp creeps little;
* collisions between each tip and the object only, as explicit pairs.

Whatever the scene does not use (islands, actuators, sensors, limits, springs, ...) is switched off, which makes MuJoCo
faster by a few per cent. Joint torques go to `qfrc_applied`, the cheapest way in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin

from softhand.assembly import read_grasp, read_law, read_world
from softhand.compiled import compiled
from softhand.grasp import Grasp
from softhand.linear import least_norm
from softhand.model.configuration import ADDITIVE
from softhand.model.faces import Face
from softhand.model.world import World
from softhand.plant import Fingertip, Plant
from softhand.references import REFERENCES, Reference
from softhand.scenario import Scenario
from softhand.sensing import contact_pairs

IMPEDANCE = 0.9  # d of the contacts at the depth of the start; MuJoCo's defaults are 0.9 to 0.95
IMPRATIO = 100.0  # friction so many times harder than the normal direction; the default 1 lets the object slide down
DAMPING_RATIO = 1.0  # of the contacts; MuJoCo's default
INTEGRATORS = {"implicitfast": "IMPLICITFAST", "Euler": "EULER", "RK4": "RK4"}

_OBJECT = "object"
_UNUSED = ("ISLAND", "SENSOR", "ACTUATION", "AUTORESET", "EQUALITY", "FRICTIONLOSS", "LIMIT", "SPRING", "DAMPER",
           "MIDPHASE")  # fmt: skip


class Void(RuntimeError):
    """The comparison is void: the two sides do not do the same."""


@dataclass(frozen=True)
class Task:
    """What both sides start from: the parts of a scenario, ready.

    Attributes:
        scenario: as it was read.
        fingertips: law, friction and face of each tip.
        grasp: the start at rest.
        plant: softhand's hand, object and contacts.
    """

    scenario: Scenario
    fingertips: Sequence[Fingertip]
    grasp: Grasp
    plant: Plant

    @property
    def world(self) -> World:
        """Hand and object."""
        return self.plant.world

    def reference(self) -> Reference:
        """A reference of one's own, as `assembly.build` makes it."""
        section, start = self.scenario.reference, self.scenario.object
        return REFERENCES[section.kind](
            start=np.concatenate([start.position, start.rpy]),
            target=np.concatenate([section.object_position, section.object_rpy]),
            start_force=self.scenario.grasp.internal_force,
            target_force=section.internal_force,
            duration=section.duration,
        )


def read_task(scenario: Scenario) -> Task:
    """Load the model of a scenario and solve its start."""
    world = read_world(scenario)
    fingertips, grasp = read_grasp(scenario, world, read_law(scenario))
    return Task(scenario, fingertips, grasp, Plant(world, fingertips))


class Scene:
    """The scene, at the start of the grasp.

    Attributes:
        model: MuJoCo's model; joint k of the hand is velocity k of softhand's.
        data: its data.
        seen: the arrays that a controller needs, named as in softhand's observation; set by `sense` and `control`.
        holding: joint torques that hold the start [N m], shape (n,).
    """

    def __init__(self, task: Task, step: float = 0.001, integrator: str = "implicitfast") -> None:
        self.model = _build_model(task, step, integrator)
        self.data = mujoco.MjData(self.model)
        self._joints = _copy_of_joints(task)
        self._qpos = _start_position(task, self.model)
        self._contacts = self.data.contact
        self._views = self._take_views(task)
        self._set_start(np.zeros(self._n))
        self._match_law(task)
        self.holding = self._find_holding(task)
        self.reset()

    def reset(self) -> None:
        """Back to the start, at rest, under the holding torques, contact forces solved."""
        self._set_start(self.holding)

    @property
    def holds(self) -> bool:
        """Whether every tip touches the object."""
        return self.data.ncon == len(self._chains)

    def object_pose(self) -> np.ndarray:
        """Position [m] and quaternion (w, x, y, z) of the object frame, shape (7,)."""
        return self.data.qpos[-7:].copy()

    def sense(self) -> SimpleNamespace:
        """Fill `seen` from the data of the last forward pass, compiled."""
        contacts, data = self._contacts, self.data
        _sense(contacts.pos, contacts.frame, data.efc_force, *self._views, *self._outputs)
        return self.seen

    def control(self, desired: Any, gains: tuple[np.ndarray, ...], torque: np.ndarray) -> None:
        """`sense` and the law (59) in one compiled call.

        Args:
            desired: `references.Desired`.
            gains: K_O, K_v, K_N, effort limits.
            torque: set [N m], shape (n,).
        """
        contacts, data = self._contacts, self.data
        _control(contacts.pos, contacts.frame, data.efc_force, *self._views, *self._outputs,
                 desired.coordinates, desired.internal_force, *gains, torque)  # fmt: skip
