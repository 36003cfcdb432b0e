"""Thousands of grasps as arrays: what `sample_grasps` returns and keeps in one file."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from softhand.numerics.arrays import Array
from softhand.recording.named_arrays import Column, NamedArrays, labels_as_columns
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import read_settings
from softhand.settings.toml import parse_toml
from softhand.studies.grasps.variables import KEPT, LABELS


@dataclass(frozen=True, eq=False, repr=False)
class GraspCache(NamedArrays):
    """Grasps at rest of one hand and one object; `len` is how many, `cache["margin"]` or `cache.margin` an array.

    Attributes:
        variables: arrays by their names in `variables.KEPT`, shape (grasps, ...).
        labels: names along `finger`, `joint` and `pair`.
        scenario: hand and object, as TOML text.
        seed: of the sampling.
        spread: of the poses: largest way along each axis [m], and turn [rad].
        poses: how many poses of the object were looked at to the end.
        refused: how often what stood in the way: of a pose, or of a choice of places.
        version: of softhand.
    """

    kind: ClassVar = "grasps"
    title: ClassVar = "softhand: grasps"

    variables: dict[str, Array]
    labels: dict[str, tuple[str, ...]]
    scenario: str
    seed: int
    spread: tuple[float, float]
    poses: int
    refused: dict[str, int]
    version: str

    def __len__(self) -> int:
        return len(self.variables["margin"])

    def __repr__(self) -> str:
        told = f"margin {self.margin.min():.3f} to {self.margin.max():.3f}" if len(self) else "none"
        return f"<GraspCache: {len(self)} grasps from {self.poses} poses, {told}>"

    def grasp(self, index: int) -> Scenario:
        """The scenario with one of the grasps, ready to run."""
        base = read_settings(Scenario, parse_toml(self.scenario), "")
        return base.with_values({
            "object.position": self.object_position[index].tolist(),
            "object.rpy": self.object_rpy[index].tolist(),
            "grasp.contact_points": self.contact_points[index].tolist(),
            "grasp.internal_force": self.internal_force[index].tolist(),
            "grasp.joint_guess": self.joint_position[index].tolist(),
        })  # fmt: skip

    def rows(self) -> list[tuple[str, str, str, str]]:
        """Least, middle and largest of the numbers of a grasp, a line each; the first line are the headings."""
        rows = [("", "least", "median", "largest")]
        for name, kept in KEPT.items():
            if kept.dims in ((), ("finger",), ("joint",)) and name not in ("pose", "joint_position", "joint_torque"):
                values = self[name][np.isfinite(self[name])]
                if len(values):
                    unit = "" if kept.units == "1" else f" [{kept.units}]"
                    least, median, largest = (f"{np.quantile(values, q):.4g}" for q in (0.0, 0.5, 1.0))
                    rows.append((f"{name}{unit}", least, median, largest))
        return rows

    def first(self, count: int, poses: int) -> GraspCache:
        """The first grasps alone, and so many poses as looked at to the end."""
        some = {name: array[:count] for name, array in self.variables.items()}
        return GraspCache(
            some, self.labels, self.scenario, self.seed, self.spread, poses, self.refused, self.version
        )  # fmt: skip

    def _columns(self) -> dict[str, Column]:
        return {
            name: Column(
                ("grasp", *KEPT[name].dims), array, {"units": KEPT[name].units, "long_name": KEPT[name].long_name}
            )
            for name, array in self.variables.items()
        }

    def _coordinates(self) -> dict[str, Column]:
        return labels_as_columns({**LABELS, **self.labels})

    def _about(self) -> dict[str, Any]:
        return {
            "softhand_version": self.version, "scenario": self.scenario, "seed": self.seed,
            "spread": json.dumps(list(self.spread)), "poses": self.poses, "refused": json.dumps(self.refused),
        }  # fmt: skip

    @classmethod
    def _read(cls, file: Any) -> GraspCache:
        about = file.attrs
        position, turn = json.loads(about["spread"])
        return cls(
            variables={name: np.array(file[name][...]) for name in KEPT},
            labels={dim: tuple(file[dim][...]) for dim in ("finger", "joint", "pair")},
            scenario=about["scenario"],
            seed=int(about["seed"]),
            spread=(position, turn),
            poses=int(about["poses"]),
            refused=json.loads(about["refused"]),
            version=about["softhand_version"],
        )
