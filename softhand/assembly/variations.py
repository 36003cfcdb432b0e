"""From one scenario to others that differ in a few values, doing only what these values touch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from softhand.assembly.instruments import read_actuation, read_sensing
from softhand.assembly.parts import read_controller, read_fingertips, read_reference, read_stepper
from softhand.assembly.plant import read_hand, read_object, read_supports, solve_start
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.taxels import read_taxels
from softhand.contact.pads import Fingertip
from softhand.controllers.controller import Controller
from softhand.laws.law import Law, compile_law
from softhand.model.world import World, load_world
from softhand.scenario.scenario import Scenario
from softhand.start.grasp import Grasp
from softhand.steppers.stepper import check_friction

_OF_BODY = ("urdf", "ellipsoid", "hull", "decompose", "decompose_threshold")
_OF_START = {"gravity", "object", "fingertip", "grasp", "table", "palm", "obstacle"}


class Variations:
    """One scenario, read once, and any number of others that differ from it in some values.

        variations = Variations(load_scenario("target-a"))
        setup = variations.at({"object.mass": 0.3, "fingertip.friction": 0.6})

    `at` gives what `resolve(scenario.with_values(values))` gives, ten times as fast. URDFs and meshes are those that
    were there at the beginning. No two setups share anything that a simulation writes to.

    Attributes:
        scenario: that all others differ from.
        setup: what it is resolved into; not to be simulated itself.

    Args:
        scenario: as the attribute.
        controller: in place of those of all scenarios.
        law: at all tips in place of those of the scenarios.

    Raises:
        SofthandError: as `resolve`.
    """

    def __init__(self, scenario: Scenario, controller: Controller | None = None, law: Law | None = None) -> None:
        self.scenario, self._controller, self._law = scenario, controller, law
        self._hand, self._object = read_hand(scenario), read_object(scenario)
        self.setup = resolve(scenario, controller, law)
        self._code = {tip.law: compile_law(tip.law) for tip in self.setup.fingertips}

    def at(self, values: Mapping[str, Any]) -> Setup:
        """The scenario with some values changed.

        Args:
            values: dotted keys and values, as for `Scenario.with_values`.

        Raises:
            SofthandError: as `Scenario.with_values` and `resolve`.
        """
        return self.to(self.scenario.with_values(values))

    def to(self, now: Scenario) -> Setup:
        """Another scenario, which may differ in anything and is quick where it differs in little.

        Raises:
            SofthandError: as `resolve`.
        """
        before, base = self.scenario, self.setup
        changed = {name for name in Scenario.model_fields if getattr(now, name) != getattr(before, name)}
        if "hand" in changed or any(getattr(now.object, key) != getattr(before.object, key) for key in _OF_BODY):
            return resolve(now, self._controller, self._law)
        controller, reference, stepper = base.controller, base.reference, base.stepper
        if "controller" in changed and self._controller is None:
            controller = read_controller(now)
        if "stepper" in changed:
            stepper = read_stepper(now)
            check_friction(stepper, base.world.mechanics.friction)
        if "reference" in changed:
            reference = read_reference(now)
        held = replace(self._object, mass=now.object.mass, inertia=now.object.inertia)
        world = load_world(self._hand, held, now.gravity, base.world.shape)
        fingertips = self._fingertips(now, world, changed)
        supports = base.supports
        if changed & {"fingertip", "table", "palm", "obstacle"}:
            supports = read_supports(now, world, fingertips)
        grasp = _copy(base.grasp)
        if changed & _OF_START:
            grasp = solve_start(now, world, fingertips, supports, self._code)
        sensing, actuation = read_sensing(now, world), read_actuation(now, world, controller)
        return Setup(
            world, fingertips, supports, grasp, controller, reference, stepper, now, self._law, sensing, actuation,
            read_taxels(now, world) if changed & {"tactile", "control_period"} else base.taxels,
        )  # fmt: skip

    def _fingertips(self, now: Scenario, world: World, changed: set[str]) -> Sequence[Fingertip]:
        base = self.setup.fingertips
        moved = now.grasp.contact_points != self.scenario.grasp.contact_points
        if moved or "fingertip" in changed or now.object.face_friction != self.scenario.object.face_friction:
            return read_fingertips(now, world, self._law, None if moved else [tip.face for tip in base])
        return base


def _copy(grasp: Grasp) -> Grasp:
    """The same start in arrays of its own."""
    arrays = {name: getattr(grasp, name).copy() for name in ("deformation", "force", "angles", "friction_use")}
    return Grasp(grasp.state.copy(), **arrays, leant=grasp.leant)
