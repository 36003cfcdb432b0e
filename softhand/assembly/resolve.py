"""A scenario resolved into the things that a run is made of."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from softhand.assembly.instruments import read_actuation, read_sensing
from softhand.assembly.parts import (
    read_controller,
    read_fingertips,
    read_reference,
    read_stepper,
    read_tip,
    written,
)
from softhand.assembly.plant import read_supports, read_world, solve_start
from softhand.assembly.taxels import read_taxels
from softhand.contact.pads import Fingertip, Support
from softhand.controllers.controller import Controller
from softhand.errors import ScenarioError
from softhand.laws.law import Law
from softhand.model.world import World
from softhand.references.reference import Reference
from softhand.scenario.fingertip import TipSection
from softhand.scenario.scenario import Scenario
from softhand.sensing.quantities import Sensing
from softhand.settings.wording import show
from softhand.simulation.actuation import Actuation
from softhand.start.grasp import Grasp
from softhand.steppers.stepper import Stepper, check_friction
from softhand.tactile.taxels import Taxels


@dataclass(frozen=True)
class Setup:
    """All that a run is made of.

    Attributes:
        world: hand and object.
        fingertips: material and face of each tip.
        supports: what else may touch.
        grasp: the start.
        controller: with its settings.
        reference: what the controller is asked for.
        stepper: the time integration.
        asked: the scenario as it was given.
        law: at all tips in place of those of the scenario, if any.
        sensing: the instruments, if there are any.
        actuation: the drives, if there are any.
        taxels: on the tips, if there are any.
    """

    world: World
    fingertips: Sequence[Fingertip]
    supports: Sequence[Support]
    grasp: Grasp
    controller: Controller
    reference: Reference
    stepper: Stepper
    asked: Scenario
    law: Law | None = None
    sensing: Sensing | None = None
    actuation: Actuation | None = None
    taxels: Taxels | None = None

    @cached_property
    def scenario(self) -> Scenario:
        """The same as text would have it, with the defaults of all plugins written out."""
        stepper = {**written("steppers", self.stepper), "terms": self.asked.stepper.terms}
        return self.asked.with_values(
            {
                "fingertip": written_fingertip(self.asked, self.law),
                "controller": written("controllers", self.controller),
                "reference": written("references", self.reference, "kind"),
                "stepper": stepper,
            }
        )


def resolve(scenario: Scenario, controller: Controller | None = None, law: Law | None = None) -> Setup:
    """Read everything that a scenario names, once, and solve its start.

    Args:
        scenario: what to run.
        controller: in place of the scenario's.
        law: at all tips in place of the scenario's.

    Raises:
        SofthandError: as `build`.
    """
    for name, given, kind in (("controller", controller, Controller), ("law", law, Law)):
        if given is not None and not isinstance(given, kind):
            raise ScenarioError(
                f"{name}: got {show(given)}; give a softhand.{kind.__name__}, and values of the scenario by name, such "
                "as mass=0.3 or overrides={'object.mass': 0.3}.",
                key=name, value=given,
            )  # fmt: skip
    controller = controller or read_controller(scenario)
    stepper, reference = read_stepper(scenario), read_reference(scenario)
    world = read_world(scenario)
    check_friction(stepper, world.mechanics.friction)
    fingertips = read_fingertips(scenario, world, law)
    supports = read_supports(scenario, world, fingertips)
    grasp = solve_start(scenario, world, fingertips, supports)
    sensing, actuation = read_sensing(scenario, world), read_actuation(scenario, world, controller)
    return Setup(
        world, fingertips, supports, grasp, controller, reference, stepper, scenario, law, sensing, actuation,
        read_taxels(scenario, world),
    )  # fmt: skip


def written_fingertip(scenario: Scenario, law: Law | None) -> dict[str, Any]:
    """The section `fingertip`, and in it the table of each tip that has one, with all parameters."""
    table = read_tip(scenario, law=law).table()
    for tip in scenario.fingertip.tips or {}:
        own = read_tip(scenario, tip, law)
        shared = set(type(own.section).model_fields) - set(TipSection.model_fields)
        kept = {key: value for key, value in own.table().items() if key not in shared}
        table.setdefault("tips", {})[tip] = kept
    return table
