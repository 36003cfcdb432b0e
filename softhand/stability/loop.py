"""The closed loop of (59) near a grasp at rest, as a linear system: where the gain K_O loses the object.

Perturbations of the joints, the object and their velocities, and of what a relaxing damping remembers; the memory of
the contacts follows them by rolling. The plant is linear in them and in the torques, (59) is linear in them and affine
in K_O, so one set of differences serves all gains.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import expm

from softhand.assembly.plant import read_grasp, read_world
from softhand.assembly.probe import Probe
from softhand.contact.damping import relaxation_rate
from softhand.errors import GraspError
from softhand.laws.law import Law
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.references.goal import Goal
from softhand.references.reference import resting
from softhand.scenario.scenario import Scenario
from softhand.stability.regulation import read_gains, regulation

_STEP = 1e-6


@dataclass(frozen=True, eq=False)
class Loop:
    """A linear closed loop; x is the displacement of joints and object, its rate, and the memory of a relaxing damping.

    Attributes:
        A: x' = A x + B u without feedback, shape (s, s), s = 2 nv + 4 relaxations at each contact.
        B: shape (s, n).
        feedback: u = feedback x with K_O = 0, shape (n, s).
        pose_feedback: what one unit of each gain of K_O adds to the feedback, shape (6, n, s).
        use: largest eigenvalue of K_c^-1 K_O at the gains of the scenario; see `InvariantSet`.
    """

    A: Array
    B: Array
    feedback: Array
    pose_feedback: Array
    use: float

    def growth(self, K_O: Array) -> float:
        """Rate at which the fastest growing motion grows [1/s]; below zero all motions die out.

        Args:
            K_O: diagonal of the gain, shape (6,).
        """
        return float(np.max(np.linalg.eigvals(self.A + self.B @ self._feedback(K_O)).real))

    def held_growth(self, gains: Sequence[Array], period: float) -> Array:
        """The same for some gains with the torque held for a control period [s], shape (gains,)."""
        states, inputs = self.B.shape
        both = np.zeros((states + inputs, states + inputs))
        both[:states, :states], both[:states, states:] = self.A, self.B
        result = expm(period * both)
        move, push = result[:states, :states], result[:states, states:]
        radius = [np.max(np.abs(np.linalg.eigvals(move + push @ self._feedback(K_O)))) for K_O in gains]
        return np.log(radius) / period

    def _feedback(self, K_O: Array) -> Array:
        return self.feedback + np.einsum("k,kij->ij", K_O, self.pose_feedback)


def linearise(scenario: Scenario, laws: Law | Sequence[Law] | None = None) -> Loop:
    """The loop about the start of a scenario, asked to stay there.

    Args:
        scenario: with the controller `regulation`.
        laws: in place of the scenario's fingertip laws, one for all or one for each.

    Raises:
        RecordingError: another controller.
        GraspError: there is no grasp at rest, or the fingers start open.
    """
    if scenario.grasp.opening:
        raise GraspError(
            "the fingers start open: there is no grasp to linearise; set grasp.opening = 0 and grasp.internal_force.",
            finger="", quantity="opening", value=scenario.grasp.opening,
        )  # fmt: skip
    world = read_world(scenario)
    fingertips, grasp = read_grasp(scenario, world, laws)
    pose, force = (*scenario.object.position, *scenario.object.rpy), scenario.grasp.internal_force
    probe = Probe(Plant(world, fingertips), resting(Goal(pose, force)))
    gains = read_gains(scenario, world.n_joints, len(force))
    n, nv = world.n_joints, world.model.nv
    seen = probe.at(grasp.state, 0.0)
    free = replace(gains, K_O=np.zeros(6))
    holding = regulation(seen, free, gains.compensated)[1]

    def respond(x: Array) -> Array:
        """Accelerations under the holding torques, rates of the memory, (59) with K_O = 0, q_O, N_O - F_O."""
        state = _moved(probe, grasp.state, x)
        probe.plant.update(state.q, state.v, state.z)
        acceleration = probe.plant.acceleration(holding, np.zeros(nv))
        relaxation_rate(probe.plant.pads, probe.plant.contacts, state.z, forgetting)
        seen = probe.at(state, 0.0)
        return np.concatenate([acceleration, forgetting[remembered], regulation(seen, free, gains.compensated)[1],
                               seen.q_O, seen.N_O - seen.J_O.T @ seen.contact_force.ravel()])  # fmt: skip

    forgetting = np.zeros_like(grasp.state.z)
    remembered = _remembered(probe.plant)
    states = 2 * nv + np.count_nonzero(remembered)
    slope = np.column_stack([
        (respond(move) - respond(-move)) / (2.0 * _STEP) for move in _STEP * np.eye(states)
    ])  # fmt: skip
    rates, torques, by_pose, excess = np.split(slope, np.cumsum([states - nv, n, 6]))
    A, B = np.zeros((states, states)), np.zeros((states, n))
    A[:nv, nv : 2 * nv], A[nv:] = np.eye(nv), rates
    seen = probe.at(grasp.state, 0.0)
    mass = probe.plant.rigid.mass_matrix(grasp.state.q)
    B[nv : 2 * nv] = np.linalg.inv(mass)[:, :n]
    pulls = seen.J_CF_f.T @ np.linalg.pinv(seen.J_O_f.T, rcond=1e-6)
    pose_feedback = -np.einsum("ik,kj->kij", pulls, by_pose)
    # the object moved, the fingers held, all relaxed: K_c + dN_O/dq_O of the invariant set, for any law
    relaxed = excess[:, n:nv] - excess[:, 2 * nv :] @ np.linalg.solve(rates[nv:, 2 * nv :], rates[nv:, n:nv])
    stiffness = np.linalg.solve(by_pose[:, n:nv].T, relaxed.T).T
    use = float(np.linalg.eigvals(np.linalg.solve(stiffness, np.diag(gains.K_O))).real.max())
    return Loop(A, B, torques, pose_feedback, use)


def _remembered(plant: Plant) -> NDArray[np.bool_]:
    """Which numbers of z belong to a relaxation, shape (nc, n_memory); tips may have fewer than others, or none."""
    remembered = np.zeros((len(plant.pads), plant.n_memory), bool)
    for row, pad in zip(remembered, plant.pads, strict=True):
        row[3 : 3 + 4 * np.count_nonzero(pad["relaxation"][:, 1])] = True
    return remembered


def _moved(probe: Probe, start: State, x: Array) -> State:
    """A state beside another one, moved along x; the contacts follow by rolling."""
    nv, z = len(start.v), start.z.copy()
    probe.at(State(start.q, x[:nv], start.z), 0.0)
    z[:, :3] += probe.plant.contacts["deformation_rate"][:, 1:]  # linear in the velocity
    z[_remembered(probe.plant)] += x[2 * nv :]
    return State(pin.integrate(probe.plant.world.model, start.q, x[:nv]), start.v + x[nv : 2 * nv], z)
