"""Rigid-body terms at one state from a kernel of softhand, in place of Pinocchio."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from softhand.model.coupled import Coupled, Terms, sizes_of
from softhand.model.rigid import rigid_poses, rigid_terms
from softhand.model.tree import read_tree, reread_tree
from softhand.model.world import World
from softhand.numerics.arrays import Array
from softhand.numerics.prepared import prepared


def room_for_terms(model: pin.Model, coupled: Coupled | None = None) -> Terms:
    """Arrays that `rigid.rigid_terms` fills, laid out as those of Pinocchio."""
    nv, columns = sizes_of(model, coupled)
    poses = np.zeros((model.njoints, 12))
    poses[0, [0, 4, 8]] = 1.0
    return Terms(np.zeros((nv, nv), order="F"), np.zeros((6, columns), order="F"), np.zeros(nv), poses)


class CompiledSnapshot:
    """As `Snapshot`, in all that can be seen.

    Attributes:
        tree: what the kernel knows of the model.

    Raises:
        ModelError: the model has a joint that the kernel does not know.
    """

    def __init__(self, world: World) -> None:
        self.tree = read_tree(world.model, world.coupled)
        self.terms = room_for_terms(world.model, world.coupled)
        self.M, self.J, self.nle, self.poses = self.terms
        self._q, self._v = np.zeros(world.nq), np.zeros(world.nv)

    def become(self, world: World) -> None:
        """Be that of another world of the same hand and object, with other gravity, another mass, other rotors."""
        reread_tree(self.tree, world.model, world.coupled)
        for array in (self.M, self.J, self.nle, self.poses[1:]):
            array[...] = 0.0

    @cached_property
    def _update(self) -> Callable[[], Any]:
        return prepared(rigid_terms, self.tree, self._q, self._v, self.terms)

    @cached_property
    def _sense(self) -> Callable[[], Any]:
        return prepared(rigid_poses, self.tree, self._q, self.terms)

    def update(self, q: Array, v: Array) -> None:
        """Run at configuration q, shape (nq,), and velocity v, shape (nv,)."""
        self._q[:], self._v[:] = q, v
        self._update()

    def updates(self, q: Array, v: Array) -> tuple[Callable[[], Any], ...]:
        """The one call of `update` for arrays that stay where they are."""
        return (prepared(rigid_terms, self.tree, q, v, self.terms),)

    def sense(self, q: Array) -> None:
        """Run at configuration q for what a controller needs: J and poses; not M, no velocity terms."""
        self._q[:] = q
        self._sense()
