"""The samples of a run: what is copied at each, and the recording that is made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.errors import ScenarioError
from softhand.numerics.arrays import AnyArray, Array
from softhand.plant.plant import Plant
from softhand.recording.events import events_as_text, find_events, phases_as_text
from softhand.recording.recording import Recording
from softhand.recording.variables import VARIABLES
from softhand.sensing.fields import RECORDED, room, split
from softhand.sensing.sensor import Sensor
from softhand.simulation.faults import out_of_range
from softhand.simulation.finishing import finished
from softhand.simulation.recorder import Recorder
from softhand.version import __version__


class Samples:
    """Samples of one run, as they come.

    The fields of an observation that are recorded lie together in its block, so that a sample is one copy of them, and
    one each of the torques and of the pushes.

    Args:
        plant: what runs.
        sensor: with the observation of each sample.
        torque: as applied, live, shape (n,).
        limited: 1 where an effort limit cut the command, live, shape (n,).
        capacity: samples at most.
        period: between two samples [s].

    Attributes:
        turns: whole turns that angles had made at the first sample, by the name of their array; after `recording`, at
            the last. A recording has angles that go on beyond one turn.

    Raises:
        ScenarioError: they do not fit into memory.
    """

    def __init__(
        self, plant: Plant, sensor: Sensor, torque: Array, limited: AnyArray, capacity: int, period: float
    ) -> None:
        self._plant, self._sizes, self._period = plant, sensor.observation.known.sizes, period
        live = {
            "observed": sensor.block[: room(self._sizes, RECORDED)],
            "joint_torque": torque,
            "torque_limited": limited,
            "external_force": plant.external,
        }
        try:
            self._recorder = Recorder(live, capacity)
        except (MemoryError, ValueError) as error:
            raise ScenarioError(
                f"duration: {capacity:,} samples do not fit into memory ({error}); shorten duration or lengthen "
                "control_period.",
                key="duration",
                value=(capacity - 1) * period,
            ) from error
        self.record = self._recorder.record
        self.turns: dict[str, Array] = {}

    def __len__(self) -> int:
        return len(self._recorder)

    def contact_angles(self) -> Array:
        """Theta and Phi of the tips so far [rad], shape (samples, nc, 2)."""
        angles: Array = self._observed()["contact_angles"]
        return angles

    def recording(
        self,
        first: int,
        scenario: str,
        reason: str,
        phases: tuple[tuple[str, float], ...],
        attributes: Mapping[str, Any],
    ) -> Recording:
        """All samples so far as a recording.

        Args:
            first: control periods before the first sample.
            scenario: TOML text that the run can be repeated from.
            reason: why it ended early; "" if it did not.
            phases: names and begins [s], from the reference.
            attributes: further figures.
        """
        variables = self._variables(first)
        recording = Recording(
            variables=variables,
            labels=labels_of(self._plant, "external_force" in variables),
            scenario=scenario,
            version=__version__,
            complete=not reason,
            reason=reason,
            stop_time=float(variables["time"][-1]) if len(self) else 0.0,
            attributes={**attributes, **self._notes(variables)},
            hand_urdf=self._plant.world.hand_text,
            object_urdf=self._plant.world.object_text,
        )
        if phases:
            recording.attributes["phases"] = phases_as_text(phases)
        recording.attributes["events"] = events_as_text(find_events(recording))
        return recording

    def _observed(self) -> dict[str, Any]:
        """The fields of all samples, shape (samples, ...) each."""
        return split(self._recorder["observed"], self._sizes, RECORDED)

    def _variables(self, first: int) -> dict[str, AnyArray]:
        count = len(self)
        found: dict[str, AnyArray] = {
            "time": np.round((first + np.arange(count)) * self._period, 12),
            "joint_torque": self._recorder["joint_torque"],
            "torque_limited": self._recorder["torque_limited"],
            **self._observed(),
        }
        found = finished(found, self._plant, self.turns)
        external = self._recorder["external_force"]
        if np.any(external):
            found["external_force"] = external
        return {name: found[name] for name in VARIABLES if name in found}

    def _notes(self, variables: dict[str, AnyArray]) -> dict[str, str]:
        """What a reader of the recording must know of the fingertip law."""
        if not len(self):
            return {}
        Phi, dr = variables["contact_angles"][..., 1], variables["deformation"][..., 0]
        note = out_of_range(variables["time"], dr, Phi, self._plant)
        return {"out_of_range": note} if note else {}


def labels_of(plant: Plant, is_pushed: bool = False) -> dict[str, tuple[str, ...]]:
    """Names along the dimensions of a recording; those of the velocities if pushes are in it."""
    world, supports = plant.world, plant.supports
    labels = {
        "joint": world.joint_names,
        "contact": tuple(tip.name for tip in world.tips),
        "pair": tuple(f"{i + 1}{j + 1}" for i, j in contact_pairs(world.n_tips)),
    }
    if is_pushed:
        labels["velocity"] = (*world.joint_names, *(f"object {name}" for name in ("x", "y", "z", "rx", "ry", "rz")))
    return labels | ({"support": tuple(support.name for support in supports)} if supports else {})
