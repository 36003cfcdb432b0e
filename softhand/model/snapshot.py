"""Rigid-body terms at one state, from Pinocchio, which runs here and nowhere else in a step."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.lib.stride_tricks import as_strided

from softhand.model.coupled import (
    Terms,
    expand_configuration,
    expand_velocity,
    project_terms,
    room,
    set_views,
    sizes_of,
)
from softhand.model.world import World
from softhand.numerics.arrays import Array

_WORLD = pin.Convention.WORLD
_DOUBLES_PER_POSE = 12


class Snapshot:
    """M, C v + g, Jacobians and joint poses at the last state given to `update` or `sense`.

    All arrays are live views of Pinocchio's data: they change with the next update. Copy what you keep.

    Attributes:
        M: mass matrix, upper triangle only, set by `update` only [kg, kg m, kg m^2], shape (nv, nv).
        J: joint Jacobians; column k is the twist that velocity k gives to the bodies it moves: velocity of the point at
            the world origin, then angular velocity, in world axes, shape (6, nv).
        nle: Coriolis, centrifugal and gravity terms, C(q, v) v + N(q), shape (nv,).
        poses: pose of each joint frame in the world, rotation by columns then translation [m], shape (joints, 12).
        terms: the four together.
    """

    def __init__(self, world: World) -> None:
        self._model = world.model
        self._data = world.model.createData()
        self._coupled = None if world.coupling is None else room(world.coupled)
        self.M: Array = self._data.M
        self.J: Array = self._data.J
        self.nle: Array = self._data.nle
        self.poses = self._view_poses()
        if self._coupled is not None:
            nv, columns = sizes_of(world.model, self._coupled)
            self.M, self.J = np.zeros((nv, nv), order="F"), np.zeros((6, columns), order="F")
            self.nle = np.zeros(nv)
        self.terms = Terms(self.M, self.J, self.nle, self.poses)

    def _view_poses(self) -> Array:
        """All joint poses as one array; they lie one behind the other in Pinocchio's vector."""
        first = self._data.oMi[0].rotation
        stride = 8 * _DOUBLES_PER_POSE
        for index in range(self._model.njoints):
            address = first.ctypes.data + index * stride
            pose = self._data.oMi[index]
            if pose.rotation.ctypes.data != address or pose.translation.ctypes.data != address + 8 * 9:
                raise RuntimeError(f"Pinocchio {pin.__version__} lays out joint poses differently; please report this.")
        return as_strided(first.T, shape=(self._model.njoints, _DOUBLES_PER_POSE), strides=(stride, 8))

    def update(self, q: Array, v: Array) -> None:
        """Run at configuration q, shape (nq,), and velocity v, shape (nv,)."""
        if self._coupled is not None:
            self._update_coupled(q, v)
            return
        pin.crba(self._model, self._data, q, _WORLD)
        pin.nonLinearEffects(self._model, self._data, q, v)

    def updates(self, q: Array, v: Array) -> tuple[Callable[[], Any], ...]:
        """The calls of `update` for arrays that stay where they are, to be made one after the other."""
        if self._coupled is not None:
            return (partial(self._update_coupled, q, v),)
        return (
            partial(pin.crba, self._model, self._data, q, _WORLD),
            partial(pin.nonLinearEffects, self._model, self._data, q, v),
        )

    def sense(self, q: Array) -> None:
        """Run at configuration q for what a controller needs: J and poses; not M, no velocity terms."""
        if self._coupled is None:
            pin.computeJointJacobians(self._model, self._data, q)
            return
        expand_configuration(self._coupled, q)
        pin.computeJointJacobians(self._model, self._data, self._coupled.q)
        self.J[:, : self._model.nv] = self._data.J
        set_views(self._coupled, self.J)

    def _update_coupled(self, q: Array, v: Array) -> None:
        """Terms of all joints, projected."""
        coupled, data = self._coupled, self._data
        assert coupled is not None
        expand_configuration(coupled, q)
        expand_velocity(coupled, v)
        pin.crba(self._model, data, coupled.q, _WORLD)
        pin.nonLinearEffects(self._model, data, coupled.q, coupled.v)
        self.J[:, : self._model.nv] = data.J
        project_terms(coupled, data.M, data.nle, self.terms)
