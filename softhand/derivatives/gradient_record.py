"""The gradient of a run as a result."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from softhand.derivatives.switches import Crossing
from softhand.numerics.arrays import Array
from softhand.numerics.record import Record


@dataclass(frozen=True, eq=False, repr=False)
class Gradient(Record):
    """What a run costs, and its derivatives.

    Attributes:
        value: of the cost.
        costs: of each term of it, by name.
        parameters: names.
        values: of the parameters.
        parameter_units: of the parameters.
        slopes: d cost / d parameter, in the unit of the cost over that of the parameter, shape (parameters,).
        torque: d cost / d torque of each control period [1/(N m), 1/N], shape (periods, n); None without given torques.
        joints: names along it.
        switches: that the run crossed, see `Crossing`; the derivatives hold for runs that cross them at the same steps.
        duration: of the run [s].
        mode: `adjoint` or `tangent`.
    """

    units: ClassVar = {"duration": "s"}

    value: float
    costs: Mapping[str, float]
    parameters: tuple[str, ...]
    values: Array
    parameter_units: tuple[str, ...]
    slopes: Array
    torque: Array | None
    joints: tuple[str, ...]
    switches: tuple[Crossing, ...]
    duration: float
    mode: str

    def __getitem__(self, name: str) -> float:
        """d cost / d parameter, by the name of the parameter or its last part."""
        found = [k for k, one in enumerate(self.parameters) if name in (one, one.rsplit(".", 1)[-1])]
        if len(found) != 1:
            raise KeyError(f"no parameter {name!r}; there are: {', '.join(self.parameters)}")
        return float(self.slopes[found[0]])

    def rows(self) -> list[dict[str, Any]]:
        """A row a parameter: name, value, unit, derivative, and what one percent more of it does to the cost."""
        return [
            {"parameter": name, "value": float(value), "unit": unit, "slope": float(slope),
             "one percent": 0.01 * float(value) * float(slope)}
            for name, value, unit, slope in zip(
                self.parameters, self.values, self.parameter_units, self.slopes, strict=True
            )
        ]  # fmt: skip

    def __repr__(self) -> str:
        told = f"<Gradient: cost {self.value:.6g}, {len(self.parameters)} parameters"
        told += f", {len(self.torque)} torques of {len(self.joints)} joints" if self.torque is not None else ""
        return f"{told}, {len(self.switches)} switches crossed>"
