"""The instruments of a run: between what is and what a controller sees."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import accumulate, pairwise

import numpy as np

from softhand.model.compiled_snapshot import room_for_terms
from softhand.model.configuration import CONTINUOUS
from softhand.model.tree import read_tree, reread_tree
from softhand.numerics.arrays import AnyArray, Array
from softhand.numerics.prepared import prepared
from softhand.plant.plant import Plant, Touch
from softhand.references.reference import Desired
from softhand.sensing.fields import FIELDS, pick
from softhand.sensing.groups import parts_of
from softhand.sensing.measuring import Chain
from softhand.sensing.observation import Observation
from softhand.sensing.quantities import QUANTITIES, ROTATION, Quantity, Sensing, counts, items_of
from softhand.sensing.seen import Observed, Parts, Seen, see_measured
from softhand.sensing.sensor import Sensor, Wanted
from softhand.tactile.field import Felt

NEEDED = frozenset(Observed._fields)
"""Fields of the true observation that are measured."""

MEASURED = (
    "joint_position",
    "joint_velocity",
    "object_position",
    "object_rpy",
    "object_twist",
    "internal_force",
    "contact_force",
    "contact_angles",
    "contact_point",
)
"""Fields of what a controller sees that a recording keeps beside the true ones, as `measured_...`."""


class Instruments:
    """Measures true observations, and tells what a controller sees.

    A measurement belongs to a control period and depends on those before it, so they are made in turn; one that is
    asked for again is the same.

    Attributes:
        observation: what a controller sees; live.
        block: its numbers.
        groups: its fields, as `Sensor.groups`.
        truth: what is measured, by quantity, as it is; live.

    Args:
        plant: what is measured.
        truth: its true observation, live.
        sensing: the instruments.
        desired: what is asked for, live.
        block: where `observation` lies; memory of its own if not given.
    """

    def __init__(
        self, plant: Plant, truth: Observation, sensing: Sensing, desired: Desired, block: Array | None = None
    ) -> None:
        self._plant, self._truth, self._desired = plant, truth, desired
        sensor = self._sensor = Sensor(plant, desired, block)
        self.observation, self.block, self.groups = sensor.observation, sensor.block, sensor.groups
        world, contacts = plant.world, plant.contacts
        touch = Touch(plant.pads, plant.columns, np.zeros_like(contacts), np.zeros_like(plant.contact_columns),
                      np.zeros(len(contacts)), plant.touching.resistance)  # fmt: skip
        tree, terms = read_tree(world.model, world.coupled), room_for_terms(world.model, world.coupled)
        self._seen = Seen(tree, np.zeros(world.nq), np.zeros(world.nv), terms, touch)
        items, memory = self._items(sensing)
        size = sum(counts(plant.world.n_joints, plant.world.n_tips).values())
        self.chain = Chain(
            items, np.zeros(size), np.zeros(size), np.zeros(memory), np.zeros(memory), np.full(1, -1),
            np.array([sensing.seed]), np.zeros((2, 3, 3)),
        )  # fmt: skip
        self.truth = self._parts(self.chain.truth)
        self._period = np.zeros(1, np.int64)
        self._see = prepared(see_measured, *self.arguments(self._period, FIELDS))
        self._felt = [pick(Felt, one._views) for one in ((truth, self.observation) if plant.n_taxels else ())] or (
            (),
            (),
        )

    def arguments(self, period: AnyArray, fields: Iterable[str]) -> tuple[object, ...]:
        """Those of `see_measured`.

        Args:
            period: the first number is that of the control period, live.
            fields: of what a controller sees.
        """
        plant, chain = self._plant, self.chain
        return (
            pick(Observed, self._truth._views), self.truth, chain, self._parts(chain.measured), period,
            self._sensor.body, plant.joints, plant.contacts, self._seen, Wanted.of(self._desired), self.groups,
            parts_of(fields),
        )  # fmt: skip

    def see(self, period: int) -> Observation:
        """What a controller sees of the true observation as it is now.

        Args:
            period: number of the control period.
        """
        self._period[0] = period
        self._see()
        for felt, seen in zip(*self._felt, strict=True):
            seen[...] = felt
        self.observation.__dict__["time"] = self.observation._views.clock[0] = self._truth.time
        return self.observation

    def forget(self) -> None:
        """Begin anew, as before the first measurement."""
        self.chain.memory[:], self.chain.last[:] = 0.0, -1

    def carry(self, period: int) -> dict[str, AnyArray]:
        """What `resume` needs to measure in a control period and after it, as copies."""
        is_done = self.chain.last[0] == period
        return {"instruments": (self.chain.before if is_done else self.chain.memory).copy()}

    def resume(self, carried: AnyArray) -> None:
        """Be as when `carry` was called."""
        self.chain.memory[:], self.chain.last[:] = carried, -1

    def become(self, sensing: Sensing) -> bool:
        """Be others that differ in numbers alone, for what the plant has become, in the same memory.

        Returns:
            False where they differ in more; then these are of no use.
        """
        items, memory = self._items(sensing)
        if memory != len(self.chain.memory) or len(items) != len(self.chain.items) or not self._sensor.become():
            return False
        reread_tree(self._seen.tree, self._plant.world.model, self._plant.world.coupled)
        self.chain.items[...], self.chain.seed[:] = items, sensing.seed
        self.forget()
        return True

    def _items(self, sensing: Sensing) -> tuple[AnyArray, int]:
        world = self._plant.world
        return items_of(sensing, world.joints[:-1, 0] == CONTINUOUS, world.n_tips)

    def _parts(self, numbers: Array) -> Parts:
        """Views of all quantities, by name."""
        n, nc = self._plant.world.n_joints, self._plant.world.n_tips
        ends = list(accumulate(counts(n, nc).values(), initial=0))
        return Parts(*(
            numbers[begin:end].reshape(_shape(QUANTITIES[name]))
            for name, (begin, end) in zip(QUANTITIES, pairwise(ends), strict=True)
        ))  # fmt: skip


def _shape(one: Quantity) -> tuple[int, ...]:
    if one.kind == ROTATION:
        return 3, 3
    return (-1, 3) if one.each == "tip axis" else (-1,)
