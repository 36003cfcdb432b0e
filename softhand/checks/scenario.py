"""A scenario explained and doubted at its start, without running it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from softhand.assembly.build import assemble
from softhand.assembly.collisions import collisions_at_start
from softhand.assembly.resolve import Setup, resolve
from softhand.assembly.target import doubts_of_target
from softhand.assembly.unread import unread
from softhand.checks.tip_axes import doubts_of_tip_axes
from softhand.collision.loose_parts import doubts_of_parts
from softhand.collision.record import Collisions
from softhand.collision.told import told
from softhand.contact.pads import Ball
from softhand.contact.supports import depth_in_table, table_plane
from softhand.dampings.damping import Damping
from softhand.margins.growing import growing
from softhand.model.shapes.shape import CurvedShape, Shape
from softhand.model.shapes.union import Union
from softhand.model.urdf.findings import Finding
from softhand.model.urdf.joints import UNUSED
from softhand.model.urdf.urdf import Urdf
from softhand.model.world import World, joints_of, slides_of
from softhand.numerics.record import Record
from softhand.numerics.spatial import rotation_of
from softhand.plant.plant import Plant
from softhand.plant.state import State
from softhand.plugins import find_plugin
from softhand.scenario.bodies import FACES
from softhand.scenario.scenario import Scenario
from softhand.scenario.values import list_values
from softhand.sensing.observation import Observation
from softhand.simulation.regulated import mobility_of, regulated_rows
from softhand.simulation.simulation import Simulation

_NEAR = 0.9  # of a limit
_APEX_NEAR = math.radians(80.0)
_DEEP_IN_TABLE = 5e-4  # [m]
_FAR_OFF = 1e-3  # [m]
_JOINT_NEAR = math.radians(1.0)


@dataclass(frozen=True)
class Checkup(Record):
    """What a scenario says and what is doubtful about it.

    Attributes:
        values: dotted key, value and unit of every setting, defaults written out.
        start: name and text of the figures at the start.
        warnings: a sentence each.
        frequency: fastest angular frequency of hand and object on their contacts [rad/s].
        collisions: of links at the start; None where no shapes tell them.
    """

    units: ClassVar = {"frequency": "rad/s"}

    values: list[tuple[str, str, str]]
    start: list[tuple[str, str]]
    warnings: list[str]
    frequency: float
    collisions: Collisions | None

    def tables(self, name: str) -> list[tuple[str, list[tuple[str, ...]]]]:
        """Title and rows of each table, for a scenario of that name."""
        settings = [(key, value if unit in ("", "1") else f"{value} {unit}") for key, value, unit in self.values]
        return [(name, list(settings)), ("at the start", list(self.start))]

    def raise_errors(self, name: str) -> None:
        """Nothing: a scenario with an error cannot be checked up."""


def check_scenario(scenario: Scenario) -> Checkup:
    """Build a scenario, ask its controller once and look at the start.

    Raises:
        SofthandError: whatever keeps the scenario from being run.
    """
    setup = resolve(scenario)
    simulation = assemble(setup)
    simulation.sample()
    observation = simulation.truth
    frequency = fastest_frequency(simulation.plant, simulation.state)
    world = simulation.plant.world
    stepper = find_plugin("steppers", scenario.stepper.name, "stepper.name")
    colliding = told(lambda: collisions_at_start(setup))
    warnings = [
        *_of_urdf(world.hand, warnings_of_hand(scenario, world.hand)),
        *_of_urdf(world.object, world.object.warnings),
        *(f"{world.object.file}: {doubt}" for doubt in doubts_of_parts(world.shape)),
        *_of_cut(world.shape),
        *_of_start(setup, simulation, observation, frequency),
        *doubts_of_tip_axes(world, joints_of(world, simulation.state.q)),
        *colliding.warnings,
        *doubts_of_target(setup),
        *unread(setup),
        *_of_loop(setup),
    ]
    start = [
        *_tip_rows(observation, world),
        *_material_rows(simulation),
        *_joint_rows(simulation, world),
        *_regulated_rows(observation, world),
        *_step_rows(scenario, stepper, frequency),
        *_touch_rows(simulation.plant),
        *colliding.rows,
    ]
    return Checkup(list_values(setup.scenario, slides_of(world)), start, warnings, frequency, colliding.found)


def doubts_of_start(setup: Setup) -> list[str]:
    """What `check_scenario` warns of at the start: tips, joints, step, table."""
    simulation = assemble(setup)
    simulation.sample()
    observation = simulation.truth
    stepper = find_plugin("steppers", setup.scenario.stepper.name, "stepper.name")
    any_step = math.isinf(stepper.stable_up_to)  # then kernels are spared that a run does not need
    return _of_start(
        setup, simulation, observation, 0.0 if any_step else fastest_frequency(simulation.plant, simulation.state)
    )


def _of_start(setup: Setup, simulation: Simulation, observation: Observation, frequency: float) -> list[str]:
    scenario, world = setup.scenario, simulation.plant.world
    stepper = find_plugin("steppers", scenario.stepper.name, "stepper.name")
    return [
        *_of_tips(observation, simulation.plant),
        *_of_joints(simulation, world),
        *_of_motors(scenario, simulation, world),
        *_of_step(scenario, stepper.stable_up_to, frequency),
        *_of_table(scenario, world),
    ]


def fastest_frequency(plant: Plant, state: State) -> float:
    """Largest |lambda| of lambda^2 M + lambda J^T D J + J^T K J = 0 at a state [rad/s].

    K and D are stiffness and damping of the contacts; without damping it is the square root of the largest eigenvalue
    of M^-1 J^T K J.
    """
    plant.update(state.q, state.v, state.z)
    plant.touch(state.v, state.z, with_stiffness=True)
    contacts, J = plant.contacts, plant.jacobian
    M = plant.rigid.mass_matrix(state.q)
    K = np.einsum("irk,irs,isl->kl", J, contacts["stiffness"], J)
    D = np.einsum("irk,ir,irl->kl", J, contacts["damping"], J)
    nv = len(M)
    A = np.zeros((2 * nv, 2 * nv))
    A[:nv, nv:] = np.eye(nv)
    A[nv:, :nv], A[nv:, nv:] = -np.linalg.solve(M, K), -np.linalg.solve(M, D)
    return float(np.max(np.abs(np.linalg.eigvals(A))))


def warnings_of_hand(scenario: Scenario, urdf: Urdf) -> list[Finding]:
    """Those of its URDF, but of the `<dynamics>` whose damping or friction the scenario gives or leaves out itself."""
    joints = scenario.hand.joints
    said = joints.model_fields_set if joints is not None else ()
    return [finding for finding in urdf.warnings if finding.kind not in {UNUSED.get(name) for name in said}]


def _of_urdf(urdf: Urdf, warnings: Iterable[Finding]) -> list[str]:
    return [f"{urdf.file}, {finding}" for finding in warnings]


def _of_cut(shape: Shape) -> Iterator[str]:
    off = None if not isinstance(shape, Union) or shape.off is None else max(shape.off)
    if off is not None and off > _FAR_OFF:
        yield (
            f"object.decompose: the parts are up to {1e3 * off:.2g} mm off the mesh, and it is them that the tips "
            "touch; lower object.decompose_threshold."
        )


def _of_tips(observation: Observation, plant: Plant) -> Iterator[str]:
    for i, (tip, fingertip) in enumerate(zip(plant.world.tips, plant.fingertips, strict=True)):
        law, use = fingertip.law, observation.friction_use[i]
        Phi, depth = observation.contact_angles[i, 1], observation.deformation[i, 0] / law.radius
        lowest, highest = law.Phi_range
        name = type(law).__name__
        if use > _NEAR:
            yield (
                f"{tip.name}: friction use is {use:.2f} at the start, and at 1 a real tip slips; raise "
                "grasp.internal_force or move its contact point."
            )
        if law.coordinates == "polar" and Phi > _APEX_NEAR:
            yield (
                f"{tip.name}: Phi is {math.degrees(Phi):.1f} deg at the start, and the run ends at the apex, 90 deg; "
                "turn the tip with another grasp.joint_guess, or choose a law in surface coordinates."
            )
        elif not lowest <= math.degrees(Phi) <= highest:
            yield (
                f"{tip.name}: Phi is {math.degrees(Phi):.1f} deg at the start; the law '{name}' is meant for "
                f"{lowest:g} to {highest:g} deg."
            )
        if depth > law.deepest:
            yield (
                f"{tip.name}: pressed in by {depth:.2f} of its radius at the start; the law '{name}' is meant for up "
                f"to {law.deepest:g}."
            )


def _of_joints(simulation: Simulation, world: World) -> Iterator[str]:
    lower, upper = world.position_limits
    angles, limits, slides = simulation.truth.joint_position, world.effort_limit, slides_of(world)
    for k, name in enumerate(world.joint_names):
        gap = min(angles[k] - lower[k], upper[k] - angles[k])
        if gap < min(_JOINT_NEAR, 0.01 * (upper[k] - lower[k])):
            unit = "m" if slides[k] else "rad"
            yield (
                f"{name}: starts at {angles[k]:.4g} {unit}, {gap:.2g} {unit} from a limit "
                f"({lower[k]:g} to {upper[k]:g} {unit})."
            )
        torque = abs(simulation.torque[k])
        if torque > _NEAR * limits[k]:
            unit = "N" if slides[k] else "N m"
            yield f"{name}: the controller asks for {torque:.3g} of {limits[k]:.3g} {unit} at the start."


def _of_motors(scenario: Scenario, simulation: Simulation, world: World) -> Iterator[str]:
    """A motor whose torque falls with its speed is sampled once a control period: v' = - effort / (v_0 m) v + ..."""
    speeds, effort, period = world.mechanics.velocity_limit, world.effort_limit, scenario.control_period
    if not np.any(np.isfinite(speeds)):
        return
    M = simulation.plant.rigid.mass_matrix(simulation.state.q)[: len(speeds), : len(speeds)]
    least = period * effort / (2.0 * speeds) - 1.0 / np.diag(np.linalg.inv(M))
    for k in np.flatnonzero(least > 0.0).tolist():
        yield (
            f"{world.joint_names[k]}: its motor stops the free finger within a control period, so that its speed "
            f"chatters about hand.joints.velocity_limit; add {least[k]:.2g} to its hand.joints.armature, or choose a "
            "shorter control_period."
        )


def _of_step(scenario: Scenario, stable_up_to: float, frequency: float) -> Iterator[str]:
    step = scenario.stepper.step
    if step * frequency > stable_up_to:
        yield (
            f"stepper.step: {step:g} s is too long for {scenario.stepper.name}: at the start it needs less than "
            f"{stable_up_to / frequency:.2g} s for contacts as stiff as these; take a shorter step or midpoint."
        )


def _of_table(scenario: Scenario, world: World) -> Iterator[str]:
    if scenario.table is None:
        return
    plane = table_plane(scenario.table.height, scenario.table.normal)
    depth = depth_in_table(world, plane, scenario.object.position, rotation_of(scenario.object.rpy))
    if depth > _DEEP_IN_TABLE:
        yield (
            f"table: the object starts {1e3 * depth:.3g} mm deep in it and will be thrown off; lower table.height or "
            "raise object.position."
        )


def _of_loop(setup: Setup) -> Iterator[str]:
    found = growing(setup)
    if found is not None:
        yield found.text()


def _touch_rows(plant: Plant) -> Iterator[tuple[str, str]]:
    """What may touch what; nothing else meets."""
    slips = any(tip.can_slip for tip in plant.fingertips)
    shape = plant.world.shape
    if isinstance(shape, Union):
        how = f"of {len(shape.parts)} parts, at the nearest as it is"
        if shape.off is not None:
            inside, outside = (f"{1e3 * way:.2g} mm" for way in shape.off)
            yield "mesh of the object", f"at most {inside} inside and {outside} outside of its convex parts"
    elif isinstance(shape, CurvedShape):
        how = "as it is"
    else:
        how = "as it is, with edges" if slips else "as an endless face"
    yield "tips meet the object", f"{how}, and {'can' if slips else 'cannot'} slip"
    names = [support.name for support in plant.supports]
    tips = [tip.name for tip in plant.world.tips if f"table {tip.name}" in names]
    feet = [name for name in names if name.startswith("table ") and name.removeprefix("table ") not in tips]
    if feet:
        kind = "corners" if all(name.startswith("table corner") for name in feet) else "places"
        yield "the table meets", f"{len(feet)} {kind} of the object, {', '.join(tips)}"
    for name in names:
        if name.startswith("palm"):
            yield name, "meets the object"
    places = Counter(support.of for support in plant.supports if support.of)
    for name, count in places.items():
        yield name, f"meets the object at {count} place{'s' * (count > 1)}"
    pairs = [support.name for support in plant.supports if isinstance(support.shape, Ball)]
    if pairs:
        yield "tips meet each other", ", ".join(pairs)


def _material_rows(simulation: Simulation) -> Iterator[tuple[str, str]]:
    """Law, coefficients of friction and damping of each tip, as they hold at the start."""
    plant = simulation.plant
    for tip, fingertip, contact in zip(plant.world.tips, plant.fingertips, plant.tip_contacts, strict=True):
        mu, static = contact["friction"], contact["static_friction"]
        held = f", {static:.3g} until it slips" if static > mu else ""
        faces = ", ".join(
            f"{value:g} on {name}" for name, value in zip(FACES, fingertip.face_friction, strict=False) if value
        )
        parts = [
            f"law {type(fingertip.law).__name__}, r {1e3 * fingertip.law.radius:g} mm",
            f"mu {mu:.3g}{held}" + (f" ({faces})" if faces else ""),
            f"damping {type(fingertip.damping).__name__}" if type(fingertip.damping) is not Damping else "no damping",
        ]
        if fingertip.torsion_length is not None:
            parts.insert(2, f"torsion over {1e3 * fingertip.torsion_length:g} mm")
        yield f"{tip.name}, material", ", ".join(parts)


def _tip_rows(observation: Observation, world: World) -> Iterator[tuple[str, str]]:
    for i, tip in enumerate(world.tips):
        Phi = f"Phi {math.degrees(observation.contact_angles[i, 1]):.1f} deg"
        if observation.deformation[i, 0] <= 0.0:
            yield tip.name, f"is {-1e3 * observation.deformation[i, 0]:.3g} mm off the object, {Phi}"
            continue
        yield (
            tip.name,
            f"presses with {observation.contact_force[i, 2]:.3g} N, friction use {observation.friction_use[i]:.2f}, "
            f"dr {1e3 * observation.deformation[i, 0]:.3g} mm, {Phi}",
        )


def _joint_rows(simulation: Simulation, world: World) -> Iterator[tuple[str, str]]:
    share = np.abs(simulation.torque) / world.effort_limit
    k = int(np.argmax(share))
    name, unit = ("force", "N") if slides_of(world)[k] else ("torque", "N m")
    size = f"{abs(simulation.torque[k]):.3g} of {world.effort_limit[k]:.3g} {unit} at {world.joint_names[k]}"
    yield f"largest {name}", size


def _regulated_rows(observation: Observation, world: World) -> list[tuple[str, str]]:
    return [] if world.coupling is None else regulated_rows(mobility_of(world, observation), world.coupling)


def _step_rows(scenario: Scenario, stepper: Any, frequency: float) -> Iterator[tuple[str, str]]:
    if frequency == 0.0:
        yield "fastest vibration", "none: nothing touches at the start"
        return
    step = scenario.stepper.step
    limit = "any step is stable"
    if math.isfinite(stepper.stable_up_to):
        limit = f"stable up to {1e3 * stepper.stable_up_to / frequency:.2g} ms"
    yield "fastest vibration", f"{frequency / (2.0 * math.pi):.4g} Hz on the contacts, without the controller"
    steps = 2.0 * math.pi / (step * frequency)
    yield "step", f"{1e3 * step:g} ms, {steps:.2g} a period of it; {scenario.stepper.name}: {limit}"
