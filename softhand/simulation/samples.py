"""The samples of a run: what is copied at each, and the recording that is made of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from softhand.contact.pairs import contact_pairs
from softhand.numerics.arrays import AnyArray, Array
from softhand.plant.plant import Plant
from softhand.recording.events import events_as_text, find_events, phases_as_text
from softhand.recording.recording import Recording
from softhand.recording.variables import VARIABLES
from softhand.sensing.fields import RECORDED, Sizes, split
from softhand.sensing.instruments import MEASURED
from softhand.simulation import growing
from softhand.simulation.faults import out_of_range
from softhand.simulation.finishing import finished, measured_in
from softhand.simulation.interrupts import interrupts_held
from softhand.simulation.keep import Keep
from softhand.simulation.recorder import Recorder
from softhand.version import __version__

_CHUNK = 500  # samples that are put away at once, at least


class Samples:
    """Samples of one run, as they come.

    The fields of an observation that are recorded lie together in its block, so that a sample is one copy of them, and
    one each of the torques and of the pushes.

    Args:
        plant: what runs.
        live: what a sample is a copy of: "observed" and, if there are instruments, "measured", the recorded begin of
            the block of an observation; variables by their names.
        sizes: of the observation.
        period: between two control periods [s].
        keep: which variables are kept, and how often.
        expected: samples of the whole run, if that is known: they are put away at once where memory allows, which saves
            a copy.

    Attributes:
        turns: whole turns that angles had made at the first sample, by the name of their array; at the end, at the
            last. A recording has angles that go on beyond one turn.
        largest_Phi: of each tip so far [rad], shape (nc,).
    """

    def __init__(
        self,
        plant: Plant,
        live: Mapping[str, AnyArray],
        sizes: Sizes,
        period: float,
        keep: Keep,
        expected: int = 0,
    ) -> None:
        self._plant, self._sizes, self._period, self._keep = plant, sizes, period, keep
        self._k = np.zeros((), np.int64)
        live = {"period": self._k, **live}
        self._variables_in = [name for name in live if name in VARIABLES]
        self._is_measured = "measured" in live
        room = growing.IN_MEMORY // max(sum(array.nbytes for array in live.values()), 1)
        self._chunk = max(_CHUNK, min(expected, room))
        self._recorder, self._kept, self._count = Recorder(live, self._chunk), growing.Growing(), 0
        self.turns: dict[str, Array] = {}
        self.largest_Phi = np.full(plant.world.n_tips, -np.inf)

    def record(self, k: int, always: bool = False) -> None:
        """Take the sample of a control period if it is one of those that are kept, or always."""
        if always or k % self._keep.every == 0:
            self._k[...] = k
            self._recorder.record()
            self._count += 1
            if len(self._recorder) == self._chunk:
                self._put_away()

    @property
    def time(self) -> float:
        """Of the last sample [s]."""
        return round(int(self._k) * self._period, 12)

    def __len__(self) -> int:
        return self._count

    def _put_away(self) -> None:
        """The last samples as variables."""
        with interrupts_held() as held:
            self._take_rows()
        if held.came:
            raise KeyboardInterrupt

    def _take_rows(self) -> None:
        rows = self._recorder
        found = {
            "time": np.round(rows["period"] * self._period, 12),
            **split(rows["observed"], self._sizes, RECORDED),
            **{name: rows[name] for name in self._variables_in},
        }
        self.largest_Phi = np.maximum(self.largest_Phi, found["contact_angles"][..., 1].max(axis=0, initial=-np.inf))
        found = finished(found, self._plant, self.turns)
        if self._is_measured:
            found |= measured_in(split(rows["measured"], self._sizes, MEASURED), self._plant, self.turns)
        kept = {"time", *self._keep.variables}
        self._kept.add({name: found[name].astype(VARIABLES[name].dtype, copy=False) for name in found if name in kept})
        rows.clear()

    def recording(
        self,
        scenario: str,
        reason: str,
        phases: tuple[tuple[str, float], ...],
        attributes: Mapping[str, Any],
    ) -> Recording:
        """All samples so far as a recording.

        Args:
            scenario: TOML text that the run can be repeated from.
            reason: why it ended early; "" if it did not.
            phases: names and begins [s], from the reference.
            attributes: further figures.
        """
        variables = self._variables()
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

    def _variables(self) -> dict[str, AnyArray]:
        if len(self._recorder) or not self._count:
            self._take_rows()
        found = self._kept.arrays()
        if not np.any(found.get("external_force", 0.0)):
            found.pop("external_force", None)
        return {name: found[name] for name in VARIABLES if name in found}

    def _notes(self, variables: dict[str, AnyArray]) -> dict[str, str]:
        """What a reader of the recording must know of the fingertip law."""
        if not (len(self) and {"contact_angles", "deformation"} <= set(variables)):
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
    if world.coupling is not None:
        labels["coupled_joint"] = tuple(world.coupling.joint_names[k] for k in world.coupling.coupled_joints)
    if plant.n_taxels:
        labels["taxel"] = tuple(str(number) for number in range(1, plant.n_taxels + 1))
    if plant.n_elements:
        labels["element"] = tuple(str(number) for number in range(1, plant.n_elements + 1))
    return labels | ({"support": tuple(support.name for support in supports)} if supports else {})
