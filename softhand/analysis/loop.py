"""The closed loop of (59) near a grasp at rest, as a linear system: where the gain K_O loses the object.

Perturbations of the joints, the object and their velocities, and of what a relaxing damping remembers; the memory of
the contacts follows them by rolling. The plant is linear in them and in the torques, (59) is linear in them and affine
in K_O, so one set of differences serves all gains.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.linalg import expm

from softhand.analysis.lyapunov import read_gains, regulation
from softhand.analysis.probe import Probe
from softhand.assembly import read_grasp, read_laws, read_world
from softhand.contact.damping import relaxation_rate
from softhand.errors import GraspError, LawError
from softhand.laws.law import Law
from softhand.plant import Plant, State
from softhand.references import Step
from softhand.scenario import Scenario

Array = NDArray[np.float64]

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
    probe = Probe(Plant(world, fingertips), Step(pose, pose, force, force, 1.0))
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
    mass = probe.plant.snapshot.mass_matrix(grasp.state.q)
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


@dataclass(frozen=True, eq=False)
class Scan:
    """Growth rates over the stiffness of the tips and the gain K_O.

    Attributes:
        stiffness: factors on the coefficients of the law, shape (s,).
        gain: factors on K_O, shape (g,).
        growth: rate of the fastest growing motion [1/s], NaN without a grasp, shape (g, s).
        held_growth: the same with the torque held for the control period, shape (g, s).
        use: largest eigenvalue of K_c^-1 K_O at the gain factor 1, shape (s,).
    """

    stiffness: Array
    gain: Array
    growth: Array
    held_growth: Array
    use: Array

    def largest_gain(self, column: int) -> float:
        """Factor on K_O at which a controller without sampling loses the object; NaN if not within the scan."""
        growth = self.growth[:, column]
        lost = np.flatnonzero(growth > 0.0)
        if not lost.size or lost[0] == 0:
            return float("nan")
        k = lost[0]
        share = -growth[k - 1] / (growth[k] - growth[k - 1])
        return float(self.gain[k - 1] * (self.gain[k] / self.gain[k - 1]) ** share)


def scan(
    scenario: Scenario,
    stiffness: Sequence[float],
    gain: Sequence[float],
    progress: Callable[[float], None] | None = None,
) -> Scan:
    """Where regulation is lost: K_O against the stiffness of the contacts.

    Args:
        scenario: whose start is held; controller `regulation`.
        stiffness: factors on the coefficients of the law.
        gain: factors on K_O.
        progress: called with the number of stiffnesses done.

    Raises:
        LawError: the law has no coefficients that scale its force.
        RecordingError: another controller.
    """
    laws = [(law, _scaling_fields(law)) for law in read_laws(scenario)]
    K_O = scenario_gains(scenario)
    held, continuous = np.full((len(gain), len(stiffness)), np.nan), np.full((len(gain), len(stiffness)), np.nan)
    use = np.full(len(stiffness), np.nan)
    for s, factor in enumerate(stiffness):
        scaled = [law.model_copy(update={name: factor * getattr(law, name) for name in names}) for law, names in laws]
        try:
            loop = linearise(scenario, scaled)
        except GraspError:  # so soft that the tips are pressed flat
            continue
        use[s] = loop.use
        every = [share * K_O for share in gain]
        continuous[:, s] = [loop.growth(gains) for gains in every]
        held[:, s] = loop.held_growth(every, scenario.control_period)
        if progress is not None:
            progress(s + 1.0)
    return Scan(np.asarray(stiffness, dtype=float), np.asarray(gain, dtype=float), continuous, held, use)


def scenario_gains(scenario: Scenario) -> Array:
    """Diagonal of K_O of a scenario with the controller `regulation`, shape (6,)."""
    return read_gains(scenario, read_world(scenario).n_joints, len(scenario.grasp.internal_force)).K_O


def _scaling_fields(law: Law) -> list[str]:
    """Fields that scale the force of a law together: twice their values, twice the force."""
    rng = np.random.default_rng(0)
    probes = [((*rng.uniform(0.05, 0.4, 1) * law.radius, *rng.uniform(-0.3, 0.3, 3)), phi) for phi in (0.7, 1.1, 1.5)]

    def forces(names: Sequence[str], factor: float) -> Array:
        changed = law.model_copy(update={name: factor * getattr(law, name) for name in names})
        return np.array([changed(np.array(deformation), phi) for deformation, phi in probes])

    names = [name for name, value in dict(law).items() if name != "radius" and type(value) is float]
    base = forces([], 1.0)
    straight = [
        name for name in names
        if np.allclose(forces([name], 3.0) - base, 2.0 * (forces([name], 2.0) - base), rtol=1e-9, atol=0.0)
        and not np.array_equal(forces([name], 2.0), base)
    ]  # fmt: skip
    if not straight or not np.allclose(forces(straight, 2.0), 2.0 * base, rtol=1e-9, atol=0.0):
        raise LawError(
            f"law '{type(law).__name__}' cannot be made stiffer as a whole: its force is not in proportion to its "
            "coefficients.",
            law=type(law).__name__,
        )
    return straight
