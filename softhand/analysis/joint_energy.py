"""What joints take of the energy of a run: damping, dry friction and stops, from recorded angles and velocities."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.recording.recording import Recording


class JointEnergy(NamedTuple):
    """Since the start, at each sample [J], shape (samples,) each."""

    damping: Array
    """Integral of d q'^2."""
    friction: Array
    """f |dq|, summed."""
    stops: Array
    """What the stops hold, k x^2 / 2 at a depth x."""
    stop_damping: Array
    """What they took beside: the integral of (torque - k x) x'."""


def joint_energy(recording: Recording, plant: Plant) -> JointEnergy:
    """By Simpson's rule from sample to sample, on the cubic that has the angles and velocities of both.

    A joint that friction holds does not move, and takes nothing; one that turns back between two samples is taken to
    have gone the straight way.
    """
    own, n = plant.touching.resistance, plant.world.n_joints
    q, v = np.unwrap(recording.joint_position, axis=0), recording.joint_velocity[:, :n]
    moved, step = np.diff(q, axis=0), np.diff(recording.time)[:, None]
    middle = 0.5 * (q[1:] + q[:-1]) + 0.125 * step * (v[:-1] - v[1:])
    halfway = 1.5 * moved / np.where(step > 0.0, step, 1.0) - 0.25 * (v[:-1] + v[1:])

    def integral(begin: Array, half: Array, end: Array) -> Array:
        parts = np.sum(step / 6.0 * (begin + 4.0 * half + end), axis=1)
        return np.concatenate([[0.0], np.cumsum(parts)])

    nothing = np.zeros(len(recording))
    damping = friction = stops = taken = nothing
    if own.force.size:
        damping = integral(*(own.damping * w**2 for w in (v[:-1], halfway, v[1:])))
    if own.friction.size:
        friction = np.concatenate([[0.0], np.cumsum(np.abs(moved) @ own.friction)])
    if len(own.places):
        columns = own.places[:, 1]
        power = [_stop_power(plant, x[:, columns], w[:, columns]) for x, w in ((q, v), (middle, halfway))]
        taken = integral(power[0][:-1], power[1], power[0][1:])
        held = 0.5 * np.sum(own.stiffness * _depth(plant, q[:, columns]) ** 2, axis=1)
        stops = held - held[0]
    return JointEnergy(damping, friction, stops, taken)


def rotor_energy(plant: Plant, v: Array) -> float:
    """Kinetic energy of the rotors of coupled joints, which the model of all joints has not [J]."""
    rotors = plant.world.mechanics.armature
    return 0.5 * float(rotors @ v[: len(rotors)] ** 2) if plant.world.coupling is not None else 0.0


def _depth(plant: Plant, q: Array) -> Array:
    """In the stops, above 0 beyond the upper and below 0 beyond the lower limit."""
    lower, upper = plant.touching.resistance.limits.T
    return np.maximum(q - upper, 0.0) - np.maximum(lower - q, 0.0)


def _stop_power(plant: Plant, q: Array, v: Array) -> Array:
    """(torque - k x) x' of each stop."""
    own, depth = plant.touching.resistance, _depth(plant, q)
    rate = np.sign(depth) * v
    share = np.maximum(1.0 + own.dissipation * rate, 0.0) - 1.0
    return own.stiffness * np.abs(depth) * share * rate
