"""A plant, what it is asked for, and its controller with one parameter moved."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from softhand.assembly.instruments import read_sensing
from softhand.assembly.parts import read_fingertips, read_reference, read_start
from softhand.assembly.plant import read_supports, read_world
from softhand.assembly.probe import Probe
from softhand.controllers.controller import Controller
from softhand.derivatives.model import remembered_in
from softhand.derivatives.parameters import Parameter
from softhand.derivatives.situation import Situation
from softhand.errors import ScenarioError
from softhand.plant.plant import Plant
from softhand.settings.settings import read_settings


class Varied(NamedTuple):
    """What a parameter changes."""

    plant: Plant
    """With compiled terms, for the steps."""
    probe: Probe
    """Of another plant of the same kind, for what is observed."""
    controller: Controller

    @classmethod
    def of(cls, at: Situation, parameter: Parameter, amount: float) -> Varied:
        """With the parameter moved by so much.

        Raises:
            ScenarioError: the scenario does not take that value, or a state of it is made of other numbers.
        """
        setup = at.setup
        scenario = setup.scenario.with_values(parameter.moved(amount))
        world = read_world(scenario)
        fingertips = read_fingertips(scenario, world, at.law)
        supports = read_supports(scenario, world, fingertips)
        plant, seen = (Plant(world, fingertips, supports, "compiled", setup.taxels) for _ in range(2))
        if not np.array_equal(remembered_in(plant), remembered_in(at.plant)) or plant.n_memory != at.plant.n_memory:
            raise ScenarioError(
                f"parameters: {parameter.key} beside {parameter.value:g} changes what a state is made of; "
                "give it another value in the scenario first.",
                key="parameters", value=parameter.key,
            )  # fmt: skip
        controller = setup.controller
        if parameter.key.startswith("controller."):
            controller = read_settings(type(controller), scenario.controller.parameters, "controller")
        motion = read_reference(scenario).start(read_start(scenario))
        return cls(plant, Probe(seen, motion, read_sensing(scenario, world)), controller)
