"""Fingertip positions from joint angles, and joint angles from fingertip positions."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin

from softhand.model.chain import POINT, Chain, reach
from softhand.model.nearest import draw_near
from softhand.model.world import World, own_columns
from softhand.numerics.arrays import Array
from softhand.numerics.roots import find_root, nearest_root

REACHED = 1e-9  # [m]
_STARTS = 12


class Arm:
    """Forward and inverse kinematics of the hand, free of velocities and of the object.

    Attributes:
        q: configuration of the last `move`, shape (nq,).
        limits: lower and upper limit of each joint [rad or m], shape (2, n).
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self.q = pin.neutral(world.coordinates)
        self.limits = np.array(world.position_limits)
        self._data = world.model.createData()

    def move(self, angles: Array) -> None:
        """Put the joints at these angles [rad or m], shape (n,)."""
        self.world.set_joint_position(angles, self.q)
        pin.computeJointJacobians(self.world.model, self._data, self.world.configuration(self.q))

    def tip(self, index: int) -> tuple[Array, Array]:
        """Position [m], shape (3,), and axes, shape (3, 3), of a finger frame F in the world."""
        tip = self.world.tips[index]
        pose = self._data.oMi[tip.joint]
        return pose.translation + pose.rotation @ tip.position, pose.rotation @ tip.rotation

    def point_jacobian(self, index: int, point: Array) -> Array:
        """Velocity of a world point that moves with a tip, from all joints, shape (3, n)."""
        if self.world.coupling is not None:
            return self._coupled_jacobian(index, point)
        columns = list(self.world.tips[index].columns)
        jacobian = np.zeros((3, self.world.n_joints))
        jacobian[:, columns] = self._data.J[:3, columns] - pin.skew(point) @ self._data.J[3:, columns]
        return jacobian

    def _coupled_jacobian(self, index: int, point: Array) -> Array:
        """`point_jacobian` by the motors: J S."""
        world = self.world
        assert world.coupling is not None
        columns = [world.model.joints[joint].idx_v for joint in world.model.supports[world.tips[index].joint] if joint]
        moved = self._data.J[:3, columns] - pin.skew(point) @ self._data.J[3:, columns]
        return np.asarray(moved @ world.coupling.S[columns])

    def gravity_torque(self) -> Array:
        """N_F at the angles of the last `move` [N m], shape (n,)."""
        world = self.world
        gravity = pin.computeGeneralizedGravity(world.model, self._data, world.configuration(self.q))
        if world.coupling is not None:
            gravity = world.coupled.S.T @ gravity
        return np.array(gravity[: world.n_joints])

    def reach(self, index: int, target: Array, angles: Array, wish: Array | None = None) -> float:
        """Find the angles of one finger that put its tip frame at a point, within the joint limits.

        Joints that move several tips (a wrist) stay where they are. Starts from `angles`, then from other ones. A
        finger of more than three joints reaches a point in many ways; the one nearest to `wish` is taken, each joint
        measured by its range. The arm is left at the angles that are returned.

        Args:
            index: of the tip.
            target: in the world [m], shape (3,).
            angles: of all joints [rad or m]; those of the finger are set if the point is reached, shape (n,).
            wish: where they would best be [rad or m], shape (n,); None for the short way from `angles`.

        Returns:
            The distance that is left [m]: below `REACHED` when the point is reached.
        """
        if self.world.coupling is not None:
            gap = self.reach_anyhow(index, target, angles, wish)
            self.move(angles)
            return gap
        chain, trial = self.world.chains[index], angles.copy()
        gap = float(reach(chain, target, trial, self.limits, REACHED))
        if gap <= REACHED and (wish is None or self._draw_near(chain, target, trial, wish)):
            angles[:] = trial
        else:
            gap = self.reach_anyhow(index, target, angles, wish)
        self.move(angles)
        return gap

    def _draw_near(self, chain: Chain, target: Array, angles: Array, wish: Array) -> bool:
        is_redundant = np.count_nonzero(chain.kinds[:, 2]) > POINT
        return not is_redundant or bool(draw_near(chain, target, angles, wish, self.limits, REACHED))

    def reach_anyhow(self, index: int, target: Array, angles: Array, wish: Array | None = None) -> float:
        """As `reach`, without haste: where Newton's iteration fails, a trust region from other starts."""
        columns = self.own_columns(index)
        lower, upper = (limit[columns] for limit in self.limits)
        trial = angles.copy()

        def miss(values: Array) -> Array:
            trial[columns] = values
            self.move(trial)
            return self.tip(index)[0] - target

        def slope(values: Array) -> Array:
            miss(values)
            return self.point_jacobian(index, self.tip(index)[0])[:, columns]

        within = np.maximum(lower, -math.pi), np.minimum(upper, math.pi)
        others = np.random.default_rng(0).uniform(*within, (_STARTS, len(columns)))
        values, gap = find_root(miss, slope, [angles[columns], *others], lower, upper, REACHED)
        if gap <= REACHED and wish is not None and len(columns) > POINT:
            values = nearest_root(miss, slope, values, wish[columns], lower, upper, REACHED)
        if gap <= REACHED:
            angles[columns] = values
        return gap

    def own_columns(self, index: int) -> list[int]:
        """Velocity indices of the joints that move this tip and no other."""
        return own_columns(self.world, index)
