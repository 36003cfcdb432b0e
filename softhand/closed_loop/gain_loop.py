"""The loop of (59) as a function of its gain K_O, and how much of the contact stiffness K_O takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm

from softhand.closed_loop.gains import Gains
from softhand.closed_loop.linearize import LinearModel, linearize_plant, slope
from softhand.closed_loop.start import HeldStart
from softhand.controllers.regulation import Regulation
from softhand.numerics.arrays import Array
from softhand.plant.state import State


@dataclass(frozen=True, eq=False)
class GainLoop:
    """The linear closed loop of (59), whose torque is affine in K_O.

    Attributes:
        model: the plant.
        without: feedback of the state with K_O = 0, shape (n, s).
        by_gain: what one unit of each gain of K_O adds to it, shape (6, n, s).
        K_O: diagonal of the gain of the scenario [N/m, N m/rad], shape (6,).
        use: largest eigenvalue of K_c^-1 K_O at that gain; see `InvariantSet`.
    """

    model: LinearModel
    without: Array
    by_gain: Array
    K_O: Array
    use: float

    def growth(self, K_O: Array) -> float:
        """Rate of the fastest growing motion without sampling [1/s], with another gain, shape (6,)."""
        return growth(self.model, self._feedback(K_O))

    def held_growth(self, gains: Sequence[Array], period: float) -> Array:
        """The same with the torque held for a period [s], for some gains, shape (gains,)."""
        move, push = held(self.model, period)
        radius = [np.max(np.abs(np.linalg.eigvals(move + push @ self._feedback(K_O)))) for K_O in gains]
        return np.log(radius) / period

    def _feedback(self, K_O: Array) -> Array:
        return self.without + np.einsum("k,kij->ij", K_O, self.by_gain)


def close_gain_loop(start: HeldStart) -> GainLoop:
    """The loop about a start with the controller `regulation`."""
    start.must_be_known("The loop of a held grasp")
    law, probe, n = start.controller, start.probe, start.probe.plant.world.n_joints
    assert isinstance(law, Regulation)
    first = probe.at(start.state, 0.0)
    laws = [_with_gain(law, K_O) for K_O in (np.zeros(6), *np.eye(6))]
    memories = [each.start(first) for each in laws]  # of which nothing changes

    def respond(state: State) -> Array:
        observation = probe.at(state, start.period)
        return np.concatenate([each.torque(observation, one)[0] for each, one in zip(laws, memories, strict=True)])

    free, *each = np.split(slope(probe.plant, start.state, respond), len(laws))
    model = linearize_plant(probe.plant, start.state, respond(start.state)[:n])
    observation = start.probe.at(start.state, 0.0)
    gains = Gains.of(law, len(observation.joint_position), len(observation.internal_force))
    use = np.linalg.eigvals(np.linalg.solve(contact_stiffness(start, model, gains), np.diag(gains.K_O))).real.max()
    return GainLoop(model, free, np.stack(each) - free, gains.K_O, float(use))


def _with_gain(law: Regulation, K_O: Array) -> Regulation:
    return law.model_copy(update={"K_O_position": K_O[:3].tolist(), "K_O_orientation": K_O[3:].tolist()})


def contact_stiffness(start: HeldStart, model: LinearModel, gains: Gains) -> Array:
    """K_c + dN_O/dq_O of the invariant set, for any law: the object moved, the fingers held, all relaxed.

    Returns:
        In the coordinates of the pose error of the controller [N/m, N, N m/rad], shape (6, 6).
    """

    def respond(state: State) -> Array:
        observation = start.probe.at(state, 0.0)
        task = gains.task(observation)
        load = observation.object_gravity - observation.grasp_matrix @ observation.contact_force.ravel()
        load -= np.kron(np.eye(2), observation.object_rotation) @ start.probe.plant.moment_force()[-6:]
        return np.concatenate([task.error, task.map.T @ load])

    n, nv = start.probe.plant.world.n_joints, len(start.state.v)
    by_pose, load = np.split(slope(start.probe.plant, start.state, respond), 2)
    forgetting = model.A[2 * nv :]
    relaxed = load[:, n:nv] - load[:, 2 * nv :] @ np.linalg.solve(forgetting[:, 2 * nv :], forgetting[:, n:nv])
    stiffness: Array = np.linalg.solve(by_pose[:, n:nv].T, relaxed.T).T
    return stiffness


def growth(model: LinearModel, by_state: Array) -> float:
    """Largest real part of the eigenvalues of A + B K [1/s], K the feedback of the state, shape (n, s)."""
    return float(np.max(np.linalg.eigvals(model.A + model.B @ by_state).real))


def held(model: LinearModel, period: float) -> tuple[Array, Array]:
    """Phi and Gamma of x(t + period) = Phi x(t) + Gamma u, the torque held for a period [s]."""
    states, inputs = model.B.shape
    both = np.zeros((states + inputs, states + inputs))
    both[:states, :states], both[:states, states:] = model.A, model.B
    result = expm(period * both)
    return result[:states, :states], result[:states, states:]
