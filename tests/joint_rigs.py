"""A finger of a few joints in general position that touches nothing, and what its joints have of their own."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin

from softhand.contact.pads import Fingertip
from softhand.laws.radial import Radial
from softhand.model.body import ObjectModel
from softhand.model.hand import HandModel
from softhand.model.joint_mechanics import JointTable
from softhand.model.urdf.examination import HAND, OBJECT
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import World, load_world
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.steppers.midpoint import Midpoint
from softhand.steppers.stepper import Stepper

MASS, CENTRE = 0.03, np.array([0.02, -0.013, 0.031])  # [kg], [m]
INERTIA = np.array([[4.1e-6, 0.3e-6, -0.2e-6], [0.3e-6, 5.2e-6, 0.4e-6], [-0.2e-6, 0.4e-6, 3.3e-6]])  # [kg m^2]
AXES = np.array([[0.36, -0.48, 0.8], [0.6, 0.64, -0.48], [-0.28, 0.96, 0.0]])
GRAVITY = (3.1, -2.2, -8.7)  # [m/s^2]
NO_GRAVITY = (0.0, 0.0, 0.0)
BOX = (
    '<robot name="box"><link name="box"><inertial><mass value="0.2"/>'
    '<inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>'
    '<collision><geometry><box size="0.05 0.05 0.05"/></geometry></collision></link></robot>'
)


def text_of(joints: int, limits: tuple[float, float] = (-9.0, 9.0), dynamics: str = "") -> str:
    """URDF of a finger whose links are all alike."""
    tensor, c = INERTIA, CENTRE
    parts, parent = ['<robot name="finger"><link name="base"/>'], "base"
    for k in range(joints):
        parts.append(
            f'<link name="link{k}"><inertial><origin xyz="{c[0]} {c[1]} {c[2]}"/><mass value="{MASS}"/>'
            f'<inertia ixx="{tensor[0, 0]}" ixy="{tensor[0, 1]}" ixz="{tensor[0, 2]}" iyy="{tensor[1, 1]}" '
            f'iyz="{tensor[1, 2]}" izz="{tensor[2, 2]}"/></inertial></link>'
            f'<joint name="joint{k}" type="revolute"><parent link="{parent}"/><child link="link{k}"/>'
            f'<origin xyz="0.01 0.02 0.03" rpy="0.3 -0.7 0.5"/><axis xyz="{" ".join(map(str, AXES[k]))}"/>'
            f'<limit lower="{limits[0]}" upper="{limits[1]}" effort="2" velocity="20"/>{dynamics}</joint>'
        )
        parent = f"link{k}"
    parts.append(
        f'<link name="tip"/><joint name="mount" type="fixed"><parent link="{parent}"/><child link="tip"/>'
        '<origin xyz="0.03 0 0"/></joint></robot>'
    )
    return "".join(parts)


def finger_world(
    joints: int = 1, gravity: Any = NO_GRAVITY, limits: Any = (-9.0, 9.0), dynamics: str = "", **mechanics: Any
) -> World:
    """The finger and a box, with `JointTable(**mechanics)`."""
    hand = Urdf.parse(text_of(joints, limits, dynamics), Path("finger.urdf"), HAND)
    held = Urdf.parse(BOX, Path("box.urdf"), OBJECT)
    return load_world(HandModel(hand, ("tip",), mechanics=JointTable(**mechanics)), ObjectModel(held), gravity)


class Finger:
    """A plant with its state; the box is far away."""

    def __init__(self, joints: int = 1, **options: Any) -> None:
        self.world = world = finger_world(joints, **options)
        self.plant = Plant(world, [Fingertip(Radial(radius=0.01), 0.5, world.faces[0], can_slip=True)])
        self.state = State(np.zeros(world.nq), np.zeros(world.nv), np.zeros((1, self.plant.n_memory)))
        world.set_object_pose((50.0, 0.0, 0.0), np.eye(3), self.state.q)
        self.torque = np.zeros(joints)
        self.n = joints

    @property
    def q(self) -> Array:
        """Joint angles [rad], live."""
        return self.state.q[: self.n]

    @property
    def v(self) -> Array:
        """Joint velocities [rad/s], live."""
        return self.state.v[: self.n]

    def run(self, step: float, duration: float, stepper: type[Stepper] = Midpoint) -> tuple[Array, Array]:
        """Joint angles and velocities after each step, the begin first, shape (steps + 1, joints) each."""
        integration = stepper(step=step).start(self.plant)
        rows = [(self.q.copy(), self.v.copy())]
        for _ in range(round(duration / step)):
            integration.advance(self.state, self.torque)
            rows.append((self.q.copy(), self.v.copy()))
        return np.array([q for q, _ in rows]), np.array([v for _, v in rows])

    def mass(self) -> Array:
        """Of the joints, at the state, shape (n, n)."""
        return self.plant.rigid.mass_matrix(self.state.q)[: self.n, : self.n]

    def energy(self) -> float:
        """Kinetic and of the weights, of the finger [J]."""
        model, data = self.world.model, self.world.model.createData()
        q, v = self.state.q.copy(), self.state.v.copy()
        kinetic = pin.computeKineticEnergy(model, data, q, v)
        return float(kinetic + pin.computePotentialEnergy(model, data, q))


def inertia_about(axis: Array) -> float:
    """Of one link about its joint axis [kg m^2], by the theorem of Steiner."""
    axis = axis / np.linalg.norm(axis)
    return float(axis @ INERTIA @ axis + MASS * np.sum(np.cross(axis, CENTRE) ** 2))
