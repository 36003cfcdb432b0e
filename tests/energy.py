"""A grasp that rings between lossless springs: nothing drives or brakes it, so its energy tells of the tips.

Each joint has a spring beside the constant torque that holds the start. A stepper holds its torques over a step; the
torque held here is the spring's at the middle between the two ends of the step, so that it gives over the step exactly
what the spring loses. What is left of the drift is that of the stepper and of the fingertip law. Semi-implicit Euler
gets the torque at the start of the step: with its own order of updates any other would brake.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from hands import (
    CONTACT_POINTS,
    FINGER_GUESS,
    START_FORCE,
    START_POSITION,
    Array,
    Task,
    holding_torque,
    make_fingertips,
    reference_task,
)

from softhand.analysis.energy import tip_energy
from softhand.laws.law import Law
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.start.grasp import solve_grasp
from softhand.steppers.semi_implicit_euler import SemiImplicitEuler
from softhand.steppers.stepper import Stepper

SPRING = 10.0  # [N m/rad], at each joint


@dataclass(frozen=True)
class Ringing:
    """Energies along a run [J], one number a sample."""

    time: Array
    total: Array
    """Kinetic, gravity, tips and joint springs."""
    kinetic: Array
    Phi: Array
    """[rad], shape (samples, nc)."""
    force: Array
    """On the object in the world [N], shape (samples, nc, 3)."""

    @property
    def exchanged(self) -> float:
        """What goes to and fro: the largest kinetic energy."""
        return float(np.max(self.kinetic))

    @property
    def drift(self) -> float:
        """Largest change of the total over the exchanged energy."""
        return float(np.max(np.abs(self.total - self.total[0]))) / self.exchanged


def task_with(law: Law, height: float = START_POSITION[2]) -> Task:
    """The reference hand with other tips, and the box at another height [m]."""
    world = reference_task().world
    fingertips = make_fingertips(world, law, CONTACT_POINTS)
    position = (*START_POSITION[:2], height)
    grasp = solve_grasp(world, fingertips, CONTACT_POINTS, START_FORCE, position, np.eye(3), np.tile(FINGER_GUESS, 3))
    return Task(world, fingertips, grasp, CONTACT_POINTS, START_FORCE)


def ring(task: Task, stepper: Stepper, duration: float, speed: float = 0.5, every: float = 2e-3) -> Ringing:
    """The start of a task, pushed, between springs at its joints.

    Args:
        task: hand, object, start.
        stepper: one that ships.
        duration: [s].
        speed: of the push; 1 sets the joints in motion at about 0.5 rad/s.
        every: a sample so often [s].
    """
    plant, state, n = task.plant(), task.grasp.state.copy(), task.world.n_joints
    hold, rest = holding_torque(plant, state), state.q[:n].copy()
    rng = np.random.default_rng(0)
    state.v[:] = speed * np.concatenate([rng.normal(0, 0.5, n), rng.normal(0, 0.02, 3), rng.normal(0, 0.5, 3)])
    integration, before = stepper.start(plant), state.copy()
    is_euler = isinstance(stepper, SemiImplicitEuler)
    rounds = 1 if is_euler else 3
    probe = task.plant()  # of its own: some steppers go on from what they left in theirs
    samples = [_sample(task, probe, state, hold, rest)]
    period = round(every / stepper.step)
    for k in range(round(duration / stepper.step)):
        _copy(state, before)
        middle = state.q[:n] + (0.0 if is_euler else 0.5) * stepper.step * state.v[:n]
        carried = integration.carry()
        plant_before = plant.carry() if carried else {}
        for again in range(rounds):
            if again:
                _copy(before, state)
            if again and carried:  # a step that is made again must begin where the one before ended
                plant.resume(state, plant_before)
                integration.resume(carried)
            integration.advance(state, hold - SPRING * (middle - rest))
            middle = 0.5 * (before.q[:n] + state.q[:n])
        if (k + 1) % period == 0:
            samples.append(_sample(task, probe, state, hold, rest))
    total, kinetic, Phi, force = (np.array(values) for values in zip(*samples, strict=True))
    return Ringing(np.arange(len(total)) * every, total, kinetic, Phi, force)


def _copy(source: State, target: State) -> None:
    for name in ("q", "v", "z"):
        getattr(target, name)[...] = getattr(source, name)


def _sample(task: Task, plant: Plant, state: State, hold: Array, rest: Array) -> tuple[float, float, Array, Array]:
    model = task.world.model
    data = model.createData()
    plant.update(state.q, state.v, state.z)
    contacts = plant.contacts
    kinetic = pin.computeKineticEnergy(model, data, state.q, state.v)
    gravity = pin.computePotentialEnergy(model, data, state.q)
    tips = sum(tip_energy(tip, contact) for tip, contact in zip(task.fingertips, contacts, strict=True))
    away = state.q[: len(rest)] - rest
    springs = 0.5 * SPRING * float(away @ away) - float(hold @ away)
    force = np.einsum("irk,ik->ir", contacts["rotation"], contacts["force"][:, :3])
    return kinetic + gravity + tips + springs, kinetic, contacts["angles"][:, 1].copy(), force
