"""Semi-implicit (symplectic) Euler: first order, the simplest rule that keeps energy on average."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from softhand.contact.damping import relax
from softhand.contact.kinematics import integrate_memory
from softhand.model.configuration import integrate
from softhand.numerics.compiled import compiled
from softhand.plant.plant import Plant
from softhand.plant.resistance import hold
from softhand.plant.state import State
from softhand.steppers.stepper import Integration, Stepper


class SemiImplicitEuler(Stepper):
    """Semi-implicit Euler: v first, then q and z with the new v.

        v+ = v + h M^-1 {(tau, 0) - (C v + N) - J^T C_F},   q+ = q (+) h v+,   z+ = z + h z'(v+)

    First order and explicit in the forces: it needs h below 2 / (highest contact frequency), 0.5 ms for the reference
    hand. Use `midpoint` for anything but comparisons.
    """

    stable_up_to = 2.0
    holds_friction = True

    def start(self, plant: Plant) -> Integration:
        """Ready to integrate this plant."""
        return _EulerIntegration(plant, self.step)


class _EulerIntegration(Integration):
    def __init__(self, plant: Plant, step: float) -> None:
        super().__init__(plant)
        self._plant, self._step = plant, step
        self._dv = np.zeros(plant.world.nv)

    def advance(self, state: State, torque: NDArray[np.float64]) -> None:
        plant = self._plant
        plant.settle(state)
        plant.update(state.q, state.v, state.z)
        plant.acceleration(torque, self._dv)
        _move(
            plant.touching,
            plant.joints,
            plant.mass_factor,
            plant.envelope,
            self._dv,
            self._step,
            state.q,
            state.v,
            state.z,
        )
        plant.settle(state, self._step)


@compiled
def _move(touch, joints, mass, envelope, acceleration, step, q, v, z):
    for k in range(v.shape[0]):
        v[k] += step * acceleration[k]
    if touch.resistance.friction.shape[0]:
        hold(touch.resistance, mass, envelope, step, v, touch.resistance.change)
    integrate(joints, q, v, step, q)
    integrate_memory(touch.pads, touch.columns, touch.contacts, touch.jacobian, v, step, z)
    relax(touch.pads, touch.contacts, step, z)
