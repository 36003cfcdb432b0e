"""How contact forces answer a small wrench on the held object, at rest under its controller."""

from __future__ import annotations

import numpy as np

from softhand.closed_loop.feedback import differentiate
from softhand.closed_loop.grasp_stiffness import settled
from softhand.closed_loop.linearize import beside
from softhand.closed_loop.object_tangent import tangent
from softhand.closed_loop.start import HeldStart
from softhand.holding.held import Held, limit_use
from softhand.numerics.arrays import Array
from softhand.numerics.spatial import cross_matrix
from softhand.plant.state import State
from softhand.plugins import plugin_name

_MOVE = 1e-6  # of the joints and the object [rad, m], for differences
_LEAST = 1e-9  # of the largest singular value
_FAR = 1e4  # [N, N m], beyond which a push has no limit
_HALVINGS = 40


def response(start: HeldStart) -> tuple[Array, Array]:
    """Contact forces and torsions by a wrench about the centre of mass, in base axes, as `Held` has them.

    The tangent of hand, object and controller, as in `grasp_stiffness` with joints="controller", gives how hand and
    object move; the contacts stick and roll, and their forces follow by the laws of the tips.

    Returns:
        Shape (3 nc, 6) and (nc, 6).

    Raises:
        ControllerError: the torque depends on a sum over time, which has no value at rest.
    """
    start.must_be_known("The answer of a grasp under its controller")
    probe, plant = start.probe, start.probe.plant
    world, n = plant.world, plant.world.n_joints
    still = State(start.state.q, np.zeros_like(start.state.v), start.state.z)
    plant.update(*still.arrays)
    name = plugin_name("controllers", type(start.controller))
    control = differentiate(start.controller, probe, still, start.period)
    K = tangent(plant, still, settled(control, name)).matrix
    R = world.object_rotation(still.q)
    arm = R @ np.array(world.model.inertias[world.object_joint].lever)
    about_origin = np.eye(6)
    about_origin[3:, :3] = cross_matrix(arm)
    loads = np.vstack([np.zeros((n, 6)), about_origin])
    moves = np.linalg.pinv(K, rcond=_LEAST) @ loads
    turned = np.zeros_like(moves)
    turned[:n] = moves[:n]
    turned[n : n + 3], turned[n + 3 :] = R.T @ moves[n : n + 3], R.T @ moves[n + 3 :]
    columns = []
    for move in turned.T:
        scale = _MOVE / max(float(np.max(np.abs(move))), _MOVE)
        x = np.concatenate([scale * move, np.zeros(control.by_state.shape[1] - len(move))])
        ahead, behind = (probe.at(beside(plant, still, way), start.time).contact_force.copy() for way in (x, -x))
        columns.append((ahead - behind) / (2.0 * scale))
    by_wrench = np.stack(columns, axis=-1)
    probe.at(still, start.time)
    return by_wrench[:, :3].reshape(-1, 6), by_wrench[:, 3]


def linear_reach(held: Held, by_wrench: tuple[Array, Array], ways: Array) -> Array:
    """How far a wrench may grow along each way until a tip slips or lifts, or a joint is at its effort limit.

    The contact forces of now and of `response` are counted; what holds is convex, and left once on each way.

    Args:
        held: the contacts, with the forces of now.
        by_wrench: of `response`.
        ways: wrenches, shape (ways, 6).

    Returns:
        Factors on the ways, infinite where nothing limits it, 0 where it does not hold now, shape (ways,).
    """
    torque = held.hand_weight @ held.gravity + held.hand_force.T @ held.force + held.hand_torsion.T @ held.torsion
    f, tau = ways @ by_wrench[0].T, ways @ by_wrench[1].T
    moved = f @ held.hand_force + tau @ held.hand_torsion

    def holds(size: Array) -> Array:
        s = size[:, None]
        use = limit_use(held, held.force + s * f, held.torsion + s * tau)
        inside: Array = np.all(use <= 1.0, axis=1) & np.all(np.abs(torque + s * moved) <= held.effort, axis=1)
        return inside

    low, high = np.zeros(len(ways)), np.full(len(ways), _FAR)
    endless = holds(high)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        inside = holds(middle)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.where(endless, np.inf, low)
