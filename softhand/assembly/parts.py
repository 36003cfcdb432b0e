"""The plugins of a scenario, ready to use: laws, dampings, fingertips, reference, controller, stepper."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from softhand.contact.pads import Fingertip
from softhand.controllers.controller import Controller
from softhand.dampings.damping import Damping
from softhand.errors import ScenarioError
from softhand.laws.law import Law
from softhand.model.shapes.box import Box
from softhand.model.world import World
from softhand.plugins import find_plugin, plugin_names
from softhand.references.goal import Goal
from softhand.references.reference import Motion, Reference
from softhand.scenario.bodies import FACES
from softhand.scenario.fingertip import FingertipSection
from softhand.scenario.scenario import Scenario
from softhand.settings.settings import read_settings
from softhand.start.grasp import faces_of
from softhand.steppers.stepper import Stepper


def read_law(scenario: Scenario, tip: str = "") -> Law:
    """The law of one fingertip of a scenario with its parameters, or that of all which have none of their own."""
    section, path = _at(scenario, tip)
    law_class = find_plugin("laws", section.law, f"{path}.law")
    return read_settings(law_class, section.parameters, path)


def read_laws(scenario: Scenario) -> tuple[Law, ...]:
    """The law of each fingertip of a scenario."""
    return tuple(read_law(scenario, tip) for tip in scenario.hand.names)


def read_damping(scenario: Scenario, law: Law, tip: str = "") -> Damping:
    """The damping of one fingertip of a scenario, or of all; that of its law if it has none."""
    section, path = _at(scenario, tip)
    if section.damping is None:
        return law.damping
    damping_class = find_plugin("dampings", section.damping.name, f"{path}.damping.name")
    return read_settings(damping_class, section.damping.parameters, f"{path}.damping")


def _at(scenario: Scenario, tip: str) -> tuple[FingertipSection, str]:
    """What holds at a tip, and the path of its table."""
    section = scenario.fingertip
    own = section.tips is not None and tip in section.tips
    return (section.at(tip), f"fingertip.tips.{tip}") if own else (section, "fingertip")


def read_controller(scenario: Scenario) -> Controller:
    """The controller of a scenario with its settings."""
    section = scenario.controller
    controller: Controller = _read_plugin("controllers", section.name, section.parameters)
    return controller


def read_fingertips(scenario: Scenario, world: World, laws: Law | Sequence[Law] | None = None) -> list[Fingertip]:
    """The fingertips of a scenario, each with its face; with other laws, or one law at all, if given."""
    names = scenario.hand.names
    laws = laws or read_laws(scenario)
    laws = [laws] * len(names) if isinstance(laws, Law) else laws
    faces, face_friction = faces_of(world, scenario.grasp.contact_points), read_face_friction(scenario, world.shape)
    fingertips = []
    for name, law, face in zip(names, laws, faces, strict=True):
        tip, _ = _at(scenario, name)
        fingertips.append(
            Fingertip(
                law,
                tip.friction,
                face,
                read_damping(scenario, law, name),
                can_slip=tip.contact == "coulomb",
                static_friction=tip.static_friction,
                torsion_length=tip.torsion_length,
                limit=tip.limit,
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


def resolved(
    scenario: Scenario, law: Law | None, controller: Controller, stepper: Stepper, reference: Reference
) -> Scenario:
    """The scenario with the defaults of its plugins written out, so that the run can be repeated from it.

    Args:
        scenario: as it is.
        law: used in place of the laws of the scenario, if it was.
        controller: used.
        stepper: used.
        reference: used.
    """
    tables: dict[str, Any] = {
        "fingertip": _resolved_tip(scenario, law, ""),
        "controller": {"name": _name("controllers", scenario.controller.name, controller), **_dump(controller)},
        "stepper": {"name": scenario.stepper.name, **_dump(stepper)},
        "reference": {"kind": scenario.reference.kind, **_dump(reference)},
    }
    tips = scenario.fingertip.tips or {}
    if tips:
        tables["fingertip"]["tips"] = {tip: _resolved_tip(scenario, law, tip) for tip in tips}
    return scenario.with_values(tables)


def _resolved_tip(scenario: Scenario, law: Law | None, tip: str) -> dict[str, Any]:
    """The section `fingertip`, or the table of a tip, with the defaults of its law and its damping."""
    section, _ = _at(scenario, tip)
    used = law or read_law(scenario, tip)
    table = {**section.own(), "law": _name("laws", section.law, used), **_dump(used)}
    if section.damping is not None:
        table["damping"] = {"name": section.damping.name, **_dump(read_damping(scenario, used, tip))}
    if tip:
        del table["contact"]
    else:
        table.pop("tips", None)
    return table


def _name(kind: str, name: str, used: Any) -> str:
    """The name in the scenario, or that of the class if another one was handed over."""
    known = name in plugin_names(kind) and type(used) is find_plugin(kind, name, "")
    return name if known else type(used).__name__


def _dump(settings: Any) -> dict[str, Any]:
    return settings.model_dump(exclude_none=True)


def _read_plugin(kind: str, name: str, parameters: dict[str, Any]) -> Any:
    section = kind[:-1]
    return read_settings(find_plugin(kind, name, f"{section}.name"), parameters, section)


def read_stepper(scenario: Scenario) -> Stepper:
    """The stepper of a scenario with its settings."""
    section = scenario.stepper
    return _read_plugin("steppers", section.name, {"step": section.step, **section.parameters})


def read_reference(scenario: Scenario) -> Reference:
    """What the controller is asked for, with its settings."""
    section = scenario.reference
    reference_class = find_plugin("references", section.kind, "reference.kind")
    table = section.model_dump(exclude={"kind"}, exclude_none=True)
    for key in ("waypoints", "duration"):  # what a change of the kind may have left behind
        if key not in reference_class.model_fields and (key == "duration" or not table[key]):
            table.pop(key, None)
    return read_settings(reference_class, table, "reference")


def read_motion(scenario: Scenario) -> Motion:
    """The reference of a scenario on its way from the start."""
    return read_reference(scenario).start(read_start(scenario))


def read_start(scenario: Scenario) -> Goal:
    """Where the reference begins: as the object and the fingers start."""
    placed, grasp = scenario.object, scenario.grasp
    carried = 0.0 if grasp.opening else 1.0
    return Goal((*placed.position, *placed.rpy), grasp.internal_force, grasp.opening, carried)
