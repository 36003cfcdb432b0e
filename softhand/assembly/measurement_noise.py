"""The noise of the instruments of a scenario as a covariance, component by component."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from softhand.assembly.instruments import read_sensing
from softhand.assembly.plant import read_world
from softhand.model.world import World, slides_of
from softhand.numerics.arrays import Array
from softhand.scenario.instruments import SensingSection
from softhand.scenario.scenario import Scenario, as_scenario
from softhand.sensing.quantities import QUANTITIES
from softhand.settings.wording import unit_of


@dataclass(frozen=True, eq=False)
class MeasurementNoise:
    """The noise of one sample of each instrument, white from sample to sample, before the low-pass filter.

    Attributes:
        names: of the components: the quantity, then the joint, the axis or the tip.
        units: of each.
        covariance: diagonal, of noise alone, in the squares of the units, shape (m, m).
        rounding: variance q^2 / 12 that rounding to multiples of q adds, if the noise is larger than that, shape (m,).
        biases: the bias of each instrument by its key, a list of its components. Put over the scenario, they make a
            parameter of each of these components: `linearize(scenario, overrides=noise.biases,
            parameters=noise.biases)` has its parameters in the order of `names`.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    covariance: Array
    rounding: Array
    biases: Mapping[str, tuple[float, ...]]


def measurement_noise(
    scenario: Scenario | str | Path, overrides: Mapping[str, Any] | None = None, **values: Any
) -> MeasurementNoise:
    """What is random in what a controller sees, by component.

        noise = softhand.measurement_noise("hold", {"sensing.joint_position.noise": 1e-3})
        model = softhand.linearize("hold", overrides=noise.biases, parameters=noise.biases, closed=True,
                                   outputs=["joint_torque"])
        by_error = model.closed.F                               # of the commanded torque by each component

    Args:
        scenario: as in `simulate`.
        overrides: likewise.
        values: likewise.

    Raises:
        SofthandError: the scenario, its hand or its object cannot be read.
    """
    scenario = as_scenario(scenario, overrides, **values)
    world = read_world(scenario)
    sensing, section = read_sensing(scenario, world), scenario.sensing
    names: list[str] = []
    units: list[str] = []
    variances: list[Array] = [np.zeros(0)]
    rounding: list[Array] = [np.zeros(0)]
    biases: dict[str, tuple[float, ...]] = {}
    for name, channel in sensing.channels.items() if sensing is not None and section is not None else ():
        labels = component_labels(name, world)
        names += [f"{name} {label}" for label in labels]
        units += _units(name, world)
        variances.append(channel.noise**2)
        rounding.append(np.full(len(labels), channel.quantum**2 / 12.0))
        biases[f"sensing.{name}.bias"] = tuple(channel.bias.tolist())
    variance = np.concatenate(variances)
    return MeasurementNoise(tuple(names), tuple(units), np.diag(variance), np.concatenate(rounding), biases)


def component_labels(name: str, world: World) -> list[str]:
    """Of the joint, the axis or the tip that each component of a quantity belongs to."""
    tips = [tip.name for tip in world.tips]
    return {
        "joint": list(world.joint_names),
        "axis": list("xyz"),
        "tip": tips,
        "tip axis": [f"{tip} {axis}" for tip in tips for axis in "xyz"],
    }[QUANTITIES[name].each]


def _units(name: str, world: World) -> list[str]:
    hinge, is_either, slide = unit_of(SensingSection.model_fields[name].description).partition(" or ")
    if not is_either:
        return [hinge] * len(component_labels(name, world))
    return [slide if slides else hinge for slides in slides_of(world)]
