"""The plugins of a scenario, ready to use: laws, dampings, fingertips, reference, controller, stepper."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from softhand.contact.pads import Fingertip
from softhand.controllers.controller import Controller
from softhand.dampings.damping import Damping, check_damping
from softhand.errors import ScenarioError
from softhand.laws.law import Law, check_law
from softhand.model.shapes.box import Box
from softhand.model.shapes.face import Face
from softhand.model.world import World
from softhand.plugins import find_plugin, plugin_name
from softhand.references.goal import Goal
from softhand.references.reference import Motion, Reference
from softhand.scenario.bodies import FACES
from softhand.scenario.fingertip import FingertipSection
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import Settings, read_settings
from softhand.start.grasp import faces_of
from softhand.steppers.stepper import Stepper


@dataclass(frozen=True)
class TipMaterial:
    """What a fingertip is made of, or all which have no table of their own.

    Attributes:
        section: what holds there.
        law: with its parameters.
        damping: that of the scenario, or of the law if it has none.
    """

    section: FingertipSection
    law: Law
    damping: Damping

    def table(self) -> dict[str, Any]:
        """The section with all parameters of law and damping."""
        damping = {} if self.section.damping is None else {"damping": written("dampings", self.damping)}
        return {**self.section.own(), **written("laws", self.law, "law"), **damping}


def written(kind: str, settings: Settings, key: str = "name") -> dict[str, Any]:
    """The table by which a scenario chooses a plugin with these settings."""
    return {key: plugin_name(kind, type(settings)), **settings.model_dump(exclude_none=True)}


def read_tip(scenario: Scenario, tip: str = "", law: Law | None = None) -> TipMaterial:
    """The material of one fingertip, or of all which have no table of their own; with another law if given.

    Raises:
        ScenarioError: a name or a setting is wrong.
        LawError: the formula of the law cannot be used.
    """
    own = tip in (scenario.fingertip.tips or {})
    section, path = scenario.fingertip.at(tip), f"fingertip.tips.{tip}" if own else "fingertip"
    if law is None:
        law = read_settings(find_plugin("laws", section.law, f"{path}.law"), section.parameters, path)
    assert law is not None
    check_law(law)
    damping, chosen = law.damping, section.damping
    if chosen is not None:
        damping_class = find_plugin("dampings", chosen.name, f"{path}.damping.name")
        damping = read_settings(damping_class, chosen.parameters, f"{path}.damping")
    check_damping(damping, f"{path}.damping")
    return TipMaterial(section, law, damping)


def read_law(scenario: Scenario, tip: str = "") -> Law:
    """The law of one fingertip of a scenario with its parameters, or that of all which have none of their own."""
    return read_tip(scenario, tip).law


def read_laws(scenario: Scenario) -> tuple[Law, ...]:
    """The law of each fingertip of a scenario."""
    return tuple(read_law(scenario, tip) for tip in scenario.hand.names)


def read_fingertips(
    scenario: Scenario,
    world: World,
    laws: Law | Sequence[Law] | None = None,
    faces: Sequence[Face] | None = None,
) -> list[Fingertip]:
    """The fingertips of a scenario, each with its face; with other laws, or one law at all, if given.

    The faces at the contact points are looked for if they are not given as well.
    """
    names, own = scenario.hand.names, scenario.fingertip.tips or {}
    others = [laws] * len(names) if laws is None or isinstance(laws, Law) else laws
    faces = faces or faces_of(world, scenario.grasp.contact_points)
    face_friction = read_face_friction(scenario, world.shape)
    materials: dict[tuple[str, int], TipMaterial] = {}  # read once where they are the same
    fingertips = []
    for name, other, face in zip(names, others, faces, strict=True):
        kind = name if name in own else "", id(other)
        if kind not in materials:
            materials[kind] = read_tip(scenario, name, other)
        tip = materials[kind]
        fingertips.append(
            Fingertip(
                tip.law,
                tip.section.friction,
                face,
                tip.damping,
                can_slip=tip.section.contact == "coulomb",
                static_friction=tip.section.static_friction,
                torsion_length=tip.section.torsion_length,
                limit=tip.section.limit,
                elements=tip.section.slip_elements,
                face_friction=face_friction,
            )
        )
    return fingertips


def read_face_friction(scenario: Scenario, shape: object) -> tuple[float, ...]:
    """Coefficients by face as `Fingertip` has them; none if the scenario names none.

    Raises:
        ScenarioError: it does, and the object is no box.
    """
    table = scenario.object.face_friction
    if not table:
        return ()
    if not isinstance(shape, Box):
        raise ScenarioError(
            f"object.face_friction: only a box has faces {', '.join(FACES)}, and the object is a "
            f"{type(shape).__name__.lower()}; remove the key, or use fingertip.friction.",
            key="object.face_friction",
            value=table,
        )
    return tuple(table.get(name, 0.0) for name in FACES)


def read_controller(scenario: Scenario) -> Controller:
    """The controller of a scenario with its settings."""
    section = scenario.controller
    controller_class = find_plugin("controllers", section.name, "controller.name")
    controller: Controller = read_settings(controller_class, section.parameters, "controller")
    return controller


def read_stepper(scenario: Scenario) -> Stepper:
    """The stepper of a scenario with its settings."""
    section = scenario.stepper
    stepper_class = find_plugin("steppers", section.name, "stepper.name")
    stepper: Stepper = read_settings(stepper_class, {"step": section.step, **section.parameters}, "stepper")
    return stepper


def read_reference(scenario: Scenario) -> Reference:
    """What the controller is asked for, with its settings."""
    section = scenario.reference
    reference_class = find_plugin("references", section.kind, "reference.kind")
    table = section.model_dump(exclude={"kind"}, exclude_none=True)
    for key in ("waypoints", "duration"):  # what a change of the kind may have left behind
        if key not in reference_class.model_fields and (key == "duration" or not table.get(key)):
            table.pop(key, None)
    reference: Reference = read_settings(reference_class, table, "reference")
    return reference


def read_start(scenario: Scenario) -> Goal:
    """Where the reference begins: as the object and the fingers start."""
    placed, grasp = scenario.object, scenario.grasp
    carried = 0.0 if grasp.opening else 1.0
    pose = (*placed.position, *placed.rpy)
    return Goal(pose, grasp.internal_force, grasp.opening, carried, standoff=grasp.standoff)


def read_motion(scenario: Scenario) -> Motion:
    """The reference of a scenario on its way from the start."""
    return read_reference(scenario).start(read_start(scenario))
