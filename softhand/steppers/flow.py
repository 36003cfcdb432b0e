"""The plant as y' = f(y) for one plain vector y, for explicit methods that know nothing of joints and contacts."""

from __future__ import annotations

from softhand.contact.damping import memory_rate
from softhand.model.configuration import coordinate_rate, normalize
from softhand.numerics.arrays import Array
from softhand.plant.plant import Plant
from softhand.plant.state import State


class Flow:
    """y = (q, v, z) as one vector, quaternion included as four plain numbers."""

    def __init__(self, plant: Plant) -> None:
        model = plant.world
        self._plant = plant
        self._nq, self._nv, self._nc = model.nq, model.nv, len(plant.contacts)
        self._n_memory = plant.n_memory
        self.size = self._nq + self._nv + self._nc * self._n_memory

    def gather(self, state: State, y: Array) -> None:
        """Write the state to y, shape (size,)."""
        for part, values in zip(self._split(y), (state.q, state.v, state.z), strict=True):
            part[...] = values

    def scatter(self, y: Array, state: State) -> None:
        """Write y to the state, quaternions brought back to length one."""
        for part, values in zip(self._split(y), (state.q, state.v, state.z), strict=True):
            values[...] = part
        normalize(self._plant.joints, state.q)

    def rate(self, y: Array, torque: Array, out: Array) -> Array:
        """out = f(y) under held torques [N m]."""
        q, v, z = self._split(y)
        q_rate, v_rate, z_rate = self._split(out)
        self._plant.update(q, v, z)
        self._plant.acceleration(torque, v_rate)
        coordinate_rate(self._plant.joints, q, v, q_rate)
        memory_rate(self._plant.pads, self._plant.contacts, z, z_rate)
        return out

    def _split(self, y: Array) -> tuple[Array, Array, Array]:
        v = self._nq + self._nv
        return y[: self._nq], y[self._nq : v], y[v:].reshape(self._nc, self._n_memory)
