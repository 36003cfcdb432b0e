"""Mass matrix and velocity terms at any configuration, apart from the data of a running simulation."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from softhand.model.compiled_snapshot import room_for_terms
from softhand.model.coupled import Coupled, Terms, expand_configuration, room, uncoupled
from softhand.model.tree import Tree, read_tree
from softhand.numerics.arrays import Array


class RigidTerms:
    """M and C v of a model, from the configuration and the velocity alone."""

    def __init__(self, model: pin.Model, coupled: Coupled | None = None) -> None:
        self._model = model
        self._coupled = room(coupled or uncoupled())

    def __reduce__(self) -> tuple[type[RigidTerms], tuple[pin.Model, Coupled]]:
        return RigidTerms, (self._model, self._coupled)

    @cached_property
    def _data(self) -> pin.Data:
        return self._model.createData()

    @cached_property
    def _above(self) -> NDArray[np.bool_]:
        return ~np.tri(self._model.nv, k=-1, dtype=bool)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Of the joints of the hand, in the order of the velocities."""
        return tuple(self._model.names[1:-1])

    @cached_property
    def compiled(self) -> tuple[Tree, Terms]:
        """What `rigid.rigid_terms` needs for this model, and room for its results.

        Raises:
            ModelError: the model has a joint that the kernel does not know.
        """
        return read_tree(self._model, self._coupled), room_for_terms(self._model, self._coupled)

    def mass_matrix(self, q: Array) -> Array:
        """M, both triangles, shape (nv, nv).

        Args:
            q: configuration, shape (nq,).
        """
        if self._is_coupled:
            expand_configuration(self._coupled, np.ascontiguousarray(q))
            return self._S.T @ self._whole_mass(self._coupled.q) @ self._S + np.diag(self._coupled.armature)
        return self._whole_mass(q)

    def velocity_terms(self, q: Array, v: Array) -> Array:
        """C(q, v) v, shape (nv,).

        Args:
            q: configuration, shape (nq,).
            v: velocity, shape (nv,).
        """
        if self._is_coupled:
            expand_configuration(self._coupled, np.ascontiguousarray(q))
            return np.asarray(self._S.T @ self._whole_velocity_terms(self._coupled.q, self._S @ v))
        return self._whole_velocity_terms(q, v)

    @property
    def _is_coupled(self) -> bool:
        return bool(self._coupled.S.size)

    @property
    def _S(self) -> Array:
        return self._coupled.S

    def _whole_mass(self, q: Array) -> Array:
        upper = pin.crba(self._model, self._data, q)
        return np.where(self._above, upper, upper.T)

    def _whole_velocity_terms(self, q: Array, v: Array) -> Array:
        gravity = pin.computeGeneralizedGravity(self._model, self._data, q).copy()
        return np.asarray(pin.nonLinearEffects(self._model, self._data, q, v) - gravity)
