"""The start of a scenario, which is asked to stay there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from softhand.assembly.parts import read_controller, read_start
from softhand.assembly.plant import read_grasp, read_supports, read_world
from softhand.assembly.probe import Probe
from softhand.controllers.controller import Controller
from softhand.laws.law import Law
from softhand.model.world import World
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.references.reference import resting
from softhand.scenario.scenario import Scenario


@dataclass(frozen=True, eq=False)
class HeldStart:
    """A start at rest whose reference stays there.

    Attributes:
        probe: of its plant, supports included.
        state: of the start.
        controller: of the scenario.
        period: for which a torque is held [s].
    """

    probe: Probe
    state: State
    controller: Controller
    period: float


def held_start(scenario: Scenario, laws: Law | Sequence[Law] | None = None, world: World | None = None) -> HeldStart:
    """The start of a scenario, asked to stay there.

    Args:
        scenario: of which the reference is not used.
        laws: in place of the scenario's fingertip laws, one for all or one for each.
        world: hand and object, if they are read already.

    Raises:
        GraspError: there is no start at rest.
    """
    world, controller = world or read_world(scenario), read_controller(scenario)
    fingertips, grasp = read_grasp(scenario, world, laws)
    plant = Plant(world, fingertips, read_supports(scenario, world, fingertips), scenario.stepper.terms)
    probe = Probe(plant, resting(read_start(scenario)))
    return HeldStart(probe, plant.with_supports(grasp.state), controller, controller.period or scenario.control_period)
