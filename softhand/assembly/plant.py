"""The model of a scenario: world, supports, plant, grasp."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from softhand.assembly.obstacles import check_clear, read_obstacles
from softhand.assembly.parts import read_fingertips
from softhand.assembly.taxels import read_taxels
from softhand.contact.obstacles import object_on_obstacle
from softhand.contact.pads import Fingertip, Support
from softhand.contact.supports import object_on_table, pad_on_hand, table_plane, tips_on_table, tips_on_tips
from softhand.laws.law import CompiledLaw, Law
from softhand.model.body import ObjectModel
from softhand.model.coupling import CouplingTable, MotorLimits
from softhand.model.hand import HandModel
from softhand.model.joint_mechanics import JointTable
from softhand.model.urdf.carrying import ArmPlace
from softhand.model.urdf.examination import HAND
from softhand.model.urdf.mounting import TipPlace
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import World, load_world
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.scenario.bodies import ArmSection, CouplingSection
from softhand.scenario.file import resolve_path
from softhand.scenario.joints import JointsSection
from softhand.scenario.scenario import Scenario
from softhand.start.grasp import Grasp, solve_grasp
from softhand.start.open import solve_open_start


def read_world(scenario: Scenario) -> World:
    """Hand and object of a scenario."""
    return load_world(read_hand(scenario), read_object(scenario), scenario.gravity)


def read_hand(scenario: Scenario) -> HandModel:
    """The hand of a scenario where it stands, with its tips."""
    hand = scenario.hand
    tips = [tip if isinstance(tip, str) else TipPlace(tip.label, tip.frame, tip.position, tip.rpy) for tip in hand.tips]
    file, mended = resolve_path(hand.urdf), (hand.repair or "", hand.density)
    coupling = read_coupling(hand.coupling)
    mechanics, arm = read_mechanics(hand.joints), read_arm(hand.arm)
    place, turned = (hand.position, hand.rpy), tuple((hand.mimic_signs or {}).items())
    return HandModel.read(file, tips, *place, hand.effort_limit, *mended, coupling, mechanics, arm, turned)


def read_mechanics(section: JointsSection | None) -> JointTable | None:
    """What the joints of a scenario have of their own, as the model takes it."""
    if section is None:
        return None
    given = ((name, getattr(section, name)) for name in JointTable._fields)
    return JointTable(*(tuple(value.items()) if isinstance(value, dict) else value for _, value in given))


def read_arm(section: ArmSection | None) -> ArmPlace | None:
    """The arm of a scenario as the model takes it."""
    if section is None:
        return None
    role = replace(HAND, repair=section.repair or "", density=section.density)
    return ArmPlace(Urdf.read(resolve_path(section.urdf), role), section.link, section.position, section.rpy)


def read_coupling(section: CouplingSection | None) -> CouplingTable | None:
    """The coupling of a scenario as the model takes it."""
    if section is None:
        return None
    motors = section.motors or {}
    limits = {name: MotorLimits(motor.effort, motor.lower, motor.upper) for name, motor in motors.items()}
    return CouplingTable(
        tuple((name, tuple(ratios.items())) for name, ratios in section.joints.items()),
        tuple((section.offsets or {}).items()),
        tuple(limits.items()),
    )


def read_object(scenario: Scenario) -> ObjectModel:
    """The object of a scenario."""
    held = scenario.object
    file, mended = resolve_path(held.urdf), (held.repair or "", held.density)
    return ObjectModel.read(file, held.mass, held.ellipsoid, held.hull, *mended, held.cut, held.inertia)


def read_supports(scenario: Scenario, world: World, fingertips: Sequence[Fingertip]) -> list[Support]:
    """What may touch in a scenario beside the fingertips on the object.

    Raises:
        ModelError: a palm is on a frame that the hand does not have, or the object cannot meet an obstacle.
        ScenarioError: an obstacle cannot be.
    """
    supports, table = [], scenario.table
    if table is not None:
        plane = table_plane(table.height, table.normal)
        supports += object_on_table(world, plane, table.friction, table.stiffness, table.damping)
        supports += tips_on_table(world, fingertips, plane, table.friction)
    if scenario.fingertip.tips_touch:
        supports += tips_on_tips(world, fingertips)
    for k, palm in enumerate(scenario.palm):
        supports.append(pad_on_hand(world, f"palm {k + 1}", **palm.model_dump()))
    for obstacle in read_obstacles(scenario.obstacle):
        supports += object_on_obstacle(world, obstacle)
    return supports


def read_plant(scenario: Scenario, laws: Law | Sequence[Law] | None = None) -> Plant:
    """Hand, object and contacts of a scenario; with other laws, or one law at all tips, if given."""
    world = read_world(scenario)
    fingertips = read_fingertips(scenario, world, laws)
    supports = read_supports(scenario, world, fingertips)
    return Plant(world, fingertips, supports, scenario.stepper.terms, read_taxels(scenario, world))


def read_grasp(
    scenario: Scenario, world: World, laws: Law | Sequence[Law] | None = None
) -> tuple[list[Fingertip], Grasp]:
    """The fingertips of a scenario, as `read_fingertips`, and its grasp at rest."""
    fingertips = read_fingertips(scenario, world, laws)
    return fingertips, solve_start(scenario, world, fingertips, read_supports(scenario, world, fingertips))


def solve_start(
    scenario: Scenario,
    world: World,
    fingertips: Sequence[Fingertip],
    supports: Sequence[Support],
    known: Mapping[Law, CompiledLaw] | None = None,
) -> Grasp:
    """The start of a scenario at rest, in the grasp or with open fingers; quickly with laws that are compiled.

    Raises:
        GraspError: there is none.
        ScenarioError: the object is in an obstacle there.
    """
    section, position, rotation = scenario.grasp, scenario.object.position, rotation_of(scenario.object.rpy)
    points, guess, reach = section.contact_points, section.joint_guess, section.reach
    if section.opening:
        grasp = solve_open_start(
            world, fingertips, points, section.opening, position, rotation, supports, guess, reach, section.standoff
        )
    else:
        grasp = solve_grasp(world, fingertips, points, section.internal_force, position, rotation, guess, known, reach)
    check_clear(scenario.obstacle, world, grasp.state.q)
    return grasp
