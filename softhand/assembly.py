"""From a scenario to a simulation that is ready to run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from softhand.contact.pads import Fingertip, Support
from softhand.contact.supports import corners_on_table, pad_on_hand, table_plane, tips_on_table, tips_on_tips
from softhand.controllers.controller import Controller
from softhand.dampings.damping import Damping
from softhand.errors import ScenarioError
from softhand.grasp import Grasp, faces_of, solve_grasp
from softhand.laws.law import Law
from softhand.model.configuration import rotation_of
from softhand.model.mounting import TipPlace
from softhand.model.shapes.box import Box
from softhand.model.world import World, load_world
from softhand.open_start import solve_open_start
from softhand.plant import Plant
from softhand.plugins import find_plugin, plugin_names
from softhand.recording import Recording
from softhand.references import STRAIGHT, Reference, Waypoint, Waypoints
from softhand.scenario import FACES, FingertipSection, Scenario
from softhand.scenario_file import resolve_path
from softhand.settings import Vector3, read_settings
from softhand.simulation import Progress, Simulation
from softhand.steppers.stepper import Stepper


def build(scenario: Scenario, controller: Controller | None = None, law: Law | None = None) -> Simulation:
    """Load the model, solve the start and put everything together.

    Args:
        scenario: what to run.
        controller: used in place of the scenario's, for one that is not a plugin.
        law: used at all tips in place of the scenario's fingertip laws, likewise.

    Raises:
        ScenarioError: a name or a setting of a plugin is wrong.
        ModelError: a URDF cannot be used.
        GraspError: there is no grasp at rest.
        LawError: the fingertip law cannot be compiled.
    """
    controller = controller or read_controller(scenario)
    stepper = _read_stepper(scenario)
    world = read_world(scenario)
    fingertips, grasp = read_grasp(scenario, world, law)
    plant = Plant(world, fingertips, read_supports(scenario, world, fingertips))
    return Simulation(
        plant=plant,
        start=plant.with_supports(grasp.state),
        controller=controller,
        stepper=stepper,
        reference=read_reference(scenario),
        duration=scenario.duration,
        control_period=scenario.control_period,
        scenario=resolved(scenario, law, controller, stepper).to_toml(),
    )


def simulate(
    scenario: Scenario,
    controller: Controller | None = None,
    law: Law | None = None,
    progress: Progress | None = None,
) -> Recording:
    """Build a scenario and run it.

    Args:
        scenario: what to run, from `load_scenario`.
        controller: used in place of the scenario's, for one that is not a plugin.
        law: used at all tips in place of the scenario's fingertip laws, likewise.
        progress: called now and then with the simulated time [s].

    Raises:
        SofthandError: as `build` and `Simulation.run`.
    """
    return build(scenario, controller, law).run(progress)


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


def read_world(scenario: Scenario) -> World:
    """Hand and object of a scenario."""
    hand = scenario.hand
    tips = [tip if isinstance(tip, str) else TipPlace(tip.label, tip.frame, tip.position, tip.rpy) for tip in hand.tips]
    return load_world(
        resolve_path(hand.urdf),
        tips,
        resolve_path(scenario.object.urdf),
        scenario.object.mass,
        scenario.gravity,
        ellipsoid=scenario.object.ellipsoid,
        hull=scenario.object.hull,
        mount=(hand.position, hand.rpy),
        effort_limit=hand.effort_limit,
    )


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


def read_supports(scenario: Scenario, world: World, fingertips: Sequence[Fingertip]) -> list[Support]:
    """What may touch in a scenario beside the fingertips on the object.

    Raises:
        ModelError: a palm is on a frame that the hand does not have.
    """
    supports, table = [], scenario.table
    if table is not None:
        plane = table_plane(table.height, table.normal)
        supports += corners_on_table(world, plane, table.friction, table.stiffness, table.damping)
        supports += tips_on_table(world, fingertips, plane, table.friction)
    if scenario.fingertip.tips_touch:
        supports += tips_on_tips(world, fingertips)
    for k, palm in enumerate(scenario.palm):
        supports.append(
            pad_on_hand(
                world,
                f"palm {k + 1}",
                palm.frame,
                palm.position,
                palm.radius,
                palm.friction,
                palm.stiffness,
                palm.damping,
            )
        )
    return supports


def read_plant(scenario: Scenario, laws: Law | Sequence[Law] | None = None) -> Plant:
    """Hand, object and contacts of a scenario; with other laws, or one law at all tips, if given."""
    world = read_world(scenario)
    fingertips = read_fingertips(scenario, world, laws)
    return Plant(world, fingertips, read_supports(scenario, world, fingertips))


def read_grasp(
    scenario: Scenario, world: World, laws: Law | Sequence[Law] | None = None
) -> tuple[list[Fingertip], Grasp]:
    """The fingertips of a scenario, as `read_fingertips`, and its grasp at rest."""
    section, fingertips = scenario.grasp, read_fingertips(scenario, world, laws)
    rotation = rotation_of(scenario.object.rpy)
    if section.opening:
        grasp = solve_open_start(
            world,
            fingertips,
            section.contact_points,
            section.opening,
            scenario.object.position,
            rotation,
            read_supports(scenario, world, fingertips),
            section.joint_guess,
        )
        return fingertips, grasp
    grasp = solve_grasp(
        world,
        fingertips,
        section.contact_points,
        section.internal_force,
        scenario.object.position,
        rotation,
        section.joint_guess,
    )
    return fingertips, grasp


def resolved(scenario: Scenario, law: Law | None, controller: Controller, stepper: Stepper) -> Scenario:
    """The scenario with the defaults of its plugins written out, so that the run can be repeated from it.

    Args:
        scenario: as it is.
        law: used in place of the laws of the scenario, if it was.
        controller: used.
        stepper: used.
    """
    tables: dict[str, Any] = {
        "fingertip": _resolved_tip(scenario, law, ""),
        "controller": {"name": _name("controllers", scenario.controller.name, controller), **_dump(controller)},
        "stepper": {"name": scenario.stepper.name, **_dump(stepper)},
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


def _read_stepper(scenario: Scenario) -> Stepper:
    section = scenario.stepper
    return _read_plugin("steppers", section.name, {"step": section.step, **section.parameters})


def read_reference(scenario: Scenario) -> Reference:
    """Desired pose and internal force against time."""
    section, (start, *waypoints) = scenario.reference, read_waypoints(scenario)
    if section.kind == "waypoints":
        return Waypoints(start, waypoints)
    (target,) = waypoints
    return STRAIGHT[section.kind](
        start.coordinates, target.coordinates, start.internal_force, target.internal_force, section.duration
    )


def read_waypoints(scenario: Scenario) -> list[Waypoint]:
    """The start and all that the reference goes to, one after the other; a `step` has one target as well."""
    section, grasp = scenario.reference, scenario.grasp
    now: dict[str, Any] = {
        "object_position": scenario.object.position,
        "object_rpy": scenario.object.rpy,
        "internal_force": grasp.internal_force,
        "opening": grasp.opening,
        "carried": 0.0 if grasp.opening else 1.0,
    }
    passed = [_waypoint(**now)]
    for row in section.waypoints or (section,):
        now |= {key: value for key in now if (value := getattr(row, key, None)) is not None}
        passed.append(_waypoint(**now, duration=row.duration, phase=getattr(row, "phase", "")))
    return passed


def _waypoint(object_position: Vector3, object_rpy: Vector3, **others: Any) -> Waypoint:
    return Waypoint((*object_position, *object_rpy), **others)
